//! What blocks a node from each light.

use super::blockers::BlockerTree;
use super::boxes::{Cover, Reach};
use super::pyramid::{Blocks, Facing, Place, Pyramid, Scratch};
use super::shapes::{Apex, MOST_CORNERS, Shape};
use super::surfaces::Surfaces;
use super::{Entry, State};
use crate::scene::NONE;

/// What is known of a node: a state for each light, and what decides it, by light and blocker.
#[derive(Clone, Debug, Default)]
pub(crate) struct Row {
    pub states: Vec<State>,
    pub entries: Vec<Entry>,
}

impl Row {
    /// For how many lights the children have to be looked at.
    pub fn undecided(&self) -> usize {
        let mut last = NONE;
        self.entries.iter().filter(|e| !e.full() && std::mem::replace(&mut last, e.light) != e.light).count()
    }

    /// Forgets what only children ask for: what static ones block stays as it is, and what decided it is enough.
    pub fn settle(&mut self) {
        self.entries.retain(|e| !e.is_facing());
        self.entries.dedup_by_key(|e| e.light);
        self.entries.shrink_to_fit();
    }
}

/// What determination needs to know.
pub(crate) struct Context<'a> {
    pub surfaces: &'a Surfaces,
    pub lights: &'a [Apex],
    /// For each light the blocker that it lies on, or [`NONE`].
    pub own: &'a [u32],
    pub blockers: &'a BlockerTree,
}

/// What a node is part of.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Part {
    /// The mesh.
    pub own: Option<u32>,
    /// Whether it is certain to have no children.
    pub last: bool,
    /// Whether only groups are above it: the blocker that covers one of those is named again.
    pub root: bool,
    /// Which of the parent's corners its own are: counted from 1, 0 for new ones.
    pub corners: [u8; MOST_CORNERS],
}

/// Working memory.
pub(crate) struct Memory {
    pub scratch: Scratch,
    pyramid: Pyramid,
    /// Groups to look at, and what they may cover.
    open: Vec<(u32, Cover)>,
    /// Blockers near the pyramid, and room to find them.
    near: Vec<u32>,
    stack: Vec<u32>,
    found: Vec<Entry>,
}

impl Memory {
    pub fn new() -> Self {
        Self {
            scratch: Scratch::default(),
            pyramid: Pyramid::new(),
            open: Vec::new(),
            near: Vec::new(),
            stack: Vec::new(),
            found: Vec::new(),
        }
    }
}

impl Context<'_> {
    /// The row of a node, given its parent's.
    pub fn row(&self, shape: Shape, part: Part, parent: Option<&Row>, memory: &mut Memory) -> Row {
        let mut rest: &[Entry] = parent.map_or(&[], |p| &p.entries);
        let tolerance = shape.tolerance(&self.surfaces.tolerance);
        let mut row = Row {
            states: vec![State::Unoccluded; self.lights.len()],
            entries: Vec::with_capacity(rest.len()),
        };
        for (index, light) in self.lights.iter().enumerate() {
            let inherited = take_light(&mut rest, index as u32);
            let above = parent.map_or(State::Unoccluded, |p| p.states[index]);
            let state = &mut row.states[index];
            // What has been decided for all below.
            if parent.is_some() && inherited.iter().all(|e| e.full()) {
                *state = above;
                if part.root {
                    row.entries.extend_from_slice(inherited);
                }
                continue;
            }
            memory.scratch.tests.boxes += 1;
            let facing = memory.pyramid.set(light, shape, &tolerance);
            if facing == Facing::None {
                *state = State::Full;
                continue;
            }
            memory.open.clear();
            if parent.is_some() {
                let asked = inherited.iter().filter(|e| !e.full() && !e.is_facing());
                let below = |e: &Entry| (e.blocker(), e.cover.of_part(&part.corners));
                memory.open.extend(asked.rev().map(below));
            } else {
                memory.open.extend((!self.blockers.is_empty()).then_some((0, Cover::ANY)));
            }
            *state = self.search(index as u32, part, memory);
            row.entries.extend_from_slice(&memory.found);
            if *state == State::Unoccluded && facing != Facing::All {
                row.entries.push(Entry::facing(index as u32));
            }
        }
        row
    }

    /// The row of a node, given its parent's, with each blocker for itself. `fixed` has what others do to it: where they
    /// make it F nothing is looked for, and where P, meshes cannot change it and are in doubt as soon as they are near.
    pub fn row_of_each(
        &self,
        shape: Shape,
        own: Option<u32>,
        (parent, fixed): (Option<&Row>, &Row),
        memory: &mut Memory,
    ) -> Row {
        let mut rest: &[Entry] = parent.map_or(&[], |p| &p.entries);
        let mut row = Row { states: fixed.states.clone(), entries: Vec::new() };
        let tolerance = shape.tolerance(&self.surfaces.tolerance);
        let bounds = shape.sphere(&tolerance);
        for (index, (light, state)) in self.lights.iter().zip(&mut row.states).enumerate() {
            let inherited = take_light(&mut rest, index as u32);
            let covered = parent.is_some_and(|p| p.states[index] == State::Full);
            let is_settled = parent.is_some() && inherited.iter().all(|e| e.full());
            if *state != State::Full && !is_settled {
                self.find_near(&Reach::new(light, bounds), parent.map(|_| inherited), memory);
                let Memory { scratch, pyramid, near, .. } = &mut *memory;
                let is_own = |b: &u32| self.surfaces.mesh_of(*b) == own;
                let shades_itself = own.is_some_and(|mesh| !self.surfaces.meshes[mesh as usize].convex);
                if shades_itself && near.iter().any(is_own) {
                    *state = State::Partial;
                }
                if *state == State::Partial && near.iter().all(|b| self.surfaces.mesh_of(*b).is_some()) {
                    row.entries.extend(near.iter().map(|b| Entry::new(index as u32, *b, false)));
                } else if !near.is_empty() {
                    scratch.tests.boxes += 1;
                    if pyramid.set(light, shape, &tolerance) == Facing::None {
                        *state = State::Full;
                    } else {
                        *state = (*state).max(self.each(index as u32, own, memory));
                        row.entries.extend_from_slice(&memory.found);
                    }
                }
            }
            if covered {
                *state = State::Full;
            }
        }
        row
    }

    /// Leaves in `near` the blockers that are near: of those that are inherited, if any are, else of all.
    fn find_near(&self, reach: &Reach, inherited: Option<&[Entry]>, memory: &mut Memory) {
        let Memory { scratch, stack, near, .. } = memory;
        let Some(inherited) = inherited else {
            return self.blockers.query(reach, scratch, stack, near);
        };
        scratch.tests.boxes += inherited.len() as u64;
        near.clear();
        near.extend(inherited.iter().filter(|e| !e.full()).map(|e| e.blocker()).filter(|b| {
            let (low, high) = self.surfaces.blocker_box(*b);
            reach.meets(low, high)
        }));
    }

    /// Each blocker for itself.
    fn each(&self, index: u32, own: Option<u32>, memory: &mut Memory) -> State {
        let mut state = State::Unoccluded;
        let Memory { scratch, pyramid, near, found, .. } = memory;
        found.clear();
        for &blocker in near.iter() {
            let blocks = self.surfaces.test(blocker, pyramid, own, scratch);
            if blocks == Blocks::None {
                continue;
            }
            // The triangle that a light lies on does not block it.
            let full = blocks == Blocks::Full && self.own[index as usize] != blocker;
            found.push(Entry::new(index, blocker, full));
            state = state.max(if full { State::Full } else { State::Partial });
        }
        state
    }

    /// Goes through groups only as far as the state calls for: until one blocker is partial, and from there on where
    /// one may be full. Leaves the codes of what the children have to look at.
    fn search(&self, index: u32, part: Part, memory: &mut Memory) -> State {
        let Memory { scratch, pyramid, open, found, .. } = memory;
        let Part { own, last, .. } = part;
        found.clear();
        let mut state = State::Unoccluded;
        while let Some((group, mut cover)) = open.pop() {
            let node = &self.blockers.nodes[group as usize];
            let bounds = (node.low, node.high, node.extent);
            // Part of the receiver's own mesh.
            if node.mesh != NONE && own == Some(node.mesh) {
                scratch.tests.blockers += 1;
                if !self.surfaces.meshes[node.mesh as usize].convex {
                    found.push(Entry::new(index, group, false));
                    state = State::Partial;
                }
                continue;
            }
            let decided = state == State::Partial;
            if decided && !pyramid.may_be_covered(bounds, &mut cover, scratch) {
                if last {
                    continue;
                }
                // A patch's parts know by `cover` what not to ask again; to those of others it is left out.
                if pyramid.is_round() {
                    scratch.tests.boxes += 1;
                    if pyramid.place(node.low, node.high) == Place::Outside {
                        continue;
                    }
                }
                found.push(Entry { cover, ..Entry::new(index, group, false) });
                continue;
            }
            if node.count == 0 {
                if !decided {
                    scratch.tests.boxes += 1;
                    let place = match self.surfaces.meshes.get(node.mesh as usize) {
                        Some(part) => pyramid.place_cluster(&part.tree.nodes[node.cluster as usize]),
                        None => pyramid.place(node.low, node.high),
                    };
                    match place {
                        Place::Outside => continue,
                        Place::Crossing => {}
                        // Whatever it is, it blocks something.
                        Place::Inside => {
                            if !pyramid.may_be_covered(bounds, &mut cover, scratch) {
                                found.push(Entry { cover, ..Entry::new(index, group, false) });
                                state = State::Partial;
                                continue;
                            }
                        }
                    }
                }
                let mut order = [node.first + 1, node.first];
                let [a, b] = order.map(|c| &self.blockers.nodes[c as usize]);
                if !decided && pyramid.is_nearer([(a.low, a.high), (b.low, b.high)]) {
                    order.swap(0, 1);
                }
                open.extend(order.map(|child| (child, cover)));
                continue;
            }
            if node.mesh != NONE {
                let tree = &self.surfaces.meshes[node.mesh as usize].tree;
                if pyramid.meets_cluster(tree, node.cluster, scratch) {
                    found.push(Entry::new(index, group, false));
                    state = State::Partial;
                }
                continue;
            }
            let mut partial = false;
            for &blocker in &self.blockers.items[node.first as usize..(node.first + node.count) as usize] {
                match self.surfaces.test(blocker, pyramid, own, scratch) {
                    Blocks::None => {}
                    // The triangle that a light lies on does not block it.
                    Blocks::Full if self.own[index as usize] != blocker => {
                        found.clear();
                        found.push(Entry::new(index, group, true));
                        return State::Full;
                    }
                    Blocks::Full | Blocks::Partial => partial = true,
                }
            }
            if partial {
                found.push(Entry::new(index, group, false));
                state = State::Partial;
            }
        }
        state
    }
}

/// Takes a light's entries from the front of those that are left.
fn take_light<'a>(rest: &mut &'a [Entry], light: u32) -> &'a [Entry] {
    let count = rest.iter().take_while(|e| e.light == light).count();
    let (taken, others) = rest.split_at(count);
    *rest = others;
    taken
}
