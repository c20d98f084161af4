//! Determination for one root: the adaptive split of a patch, and what blocks each node.

use super::blockers::BlockerTree;
use super::boxes::Cover;
use super::pyramid::{Blocks, Facing, Place, Pyramid, Scratch, clip};
use super::receivers::{cluster_of, patch_shape};
use super::shapes::{Apex, MOST_CORNERS, Shape};
use super::surfaces::{Surfaces, area_vector};
use super::{Entry, State, VisibilitySettings};
use crate::scene::NONE;
use glam::DVec3;

/// What is known of a node: a state for each light, and what decides it, by light and blocker.
#[derive(Clone, Debug, Default)]
pub(crate) struct Row {
    pub states: Vec<State>,
    pub entries: Vec<Entry>,
}

impl Row {
    /// For how many lights the children have to be looked at.
    fn undecided(&self) -> usize {
        let mut last = NONE;
        self.entries.iter().filter(|e| !e.full() && std::mem::replace(&mut last, e.light) != e.light).count()
    }
}

/// What determination needs to know.
pub(crate) struct Context<'a> {
    pub surfaces: &'a Surfaces,
    pub lights: &'a [Apex],
    /// For each light the blocker that it lies on, or [`NONE`].
    pub own: &'a [u32],
    pub blockers: &'a BlockerTree,
    /// Whether groups of blockers may stand for their members; otherwise each blocker is found.
    pub grouped: bool,
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
    /// Blockers that may reach into the pyramid, and room to find them.
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
        let mut row = Row { states: vec![State::Unoccluded; self.lights.len()], entries: Vec::new() };
        let mut rest: &[Entry] = parent.map_or(&[], |p| &p.entries);
        for (index, light) in self.lights.iter().enumerate() {
            let count = rest.iter().take_while(|e| e.light == index as u32).count();
            let (inherited, others) = rest.split_at(count);
            rest = others;
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
            let facing = memory.pyramid.set(light, shape, &self.surfaces.tolerance);
            if facing == Facing::None {
                *state = State::Full;
                continue;
            }
            let asked = inherited.iter().filter(|e| !e.full() && !e.is_facing());
            if self.grouped {
                memory.open.clear();
                if parent.is_some() {
                    let below = |e: &Entry| (e.blocker(), e.cover.of_part(&part.corners));
                    memory.open.extend(asked.rev().map(below));
                } else {
                    memory.open.extend((!self.blockers.is_empty()).then_some((0, Cover::ANY)));
                }
                *state = self.search(index as u32, part, memory);
            } else {
                if parent.is_some() {
                    memory.near.clear();
                    memory.near.extend(asked.map(|e| e.blocker()));
                } else {
                    let Memory { scratch, pyramid, stack, near, .. } = memory;
                    self.blockers.query(pyramid, scratch, stack, near);
                }
                *state = self.each(index as u32, part.own, memory);
                if above == State::Full {
                    *state = State::Full;
                }
            }
            row.entries.extend_from_slice(&memory.found);
            if *state == State::Unoccluded && facing != Facing::All {
                row.entries.push(Entry::facing(index as u32));
            }
        }
        row
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
                if !decided && pyramid.remoteness(a.low, a.high) < pyramid.remoteness(b.low, b.high) {
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

/// A node in the making.
pub(crate) struct Draft {
    /// For a patch: first column and row, one past the last, in units of the finest split.
    pub cells: [u32; 4],
    /// For a patch: the polygon that is tested.
    pub corners: Vec<DVec3>,
    /// For a mesh: its cluster.
    pub cluster: u32,
    pub area: f64,
    pub row: Row,
    pub children: Option<[usize; 2]>,
    /// For a patch: the surface within its cells.
    outline: Vec<DVec3>,
    /// Halvings along each axis.
    depth: [u32; 2],
    credit: u32,
}

/// A rectangle around a patch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub origin: DVec3,
    /// From one side of the rectangle to the other.
    pub sides: [DVec3; 2],
}

impl Frame {
    /// Along the longest edge; the second side is chosen so that the two and the normal are right-handed.
    pub fn new(corners: &[DVec3], normal: DVec3) -> Self {
        let edge = |i: usize| corners[(i + 1) % corners.len()] - corners[i];
        let longest = (0..corners.len()).fold(0, |best, i| {
            // Equal up to rounding counts as equal, so that the first one wins wherever the scene stands.
            if edge(i).length() > edge(best).length() * (1.0 + 1e-6) { i } else { best }
        });
        let u = edge(longest).normalize();
        let v = normal.cross(u);
        let range = |axis: DVec3| {
            corners
                .iter()
                .map(|c| axis.dot(*c - corners[0]))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let ((u0, u1), (v0, v1)) = (range(u), range(v));
        Self { origin: corners[0] + u * u0 + v * v0, sides: [u * (u1 - u0), v * (v1 - v0)] }
    }

    fn corners(&self, cells: [u32; 4], finest: f64) -> [DVec3; 4] {
        let [u0, v0, u1, v1] = cells.map(|x| f64::from(x) / finest);
        let at = |u: f64, v: f64| self.origin + self.sides[0] * u + self.sides[1] * v;
        [at(u0, v0), at(u1, v0), at(u1, v1), at(u0, v1)]
    }
}

/// One side of a patch in the making.
pub(crate) struct PatchRoot<'a> {
    pub context: &'a Context<'a>,
    pub settings: &'a VisibilitySettings,
    pub simple: u32,
    pub back: bool,
    /// What is known of the group that it is part of.
    pub above: &'a Row,
    pub frame: Frame,
    /// Area × partially occluded lights above which a node may be split.
    pub threshold: f64,
}

impl PatchRoot<'_> {
    fn finest(&self) -> u32 {
        1 << self.settings.max_depth.min(8)
    }

    fn draft(
        &self,
        cells: [u32; 4],
        outline: Vec<DVec3>,
        depth: [u32; 2],
        parent: Option<&Draft>,
        memory: &mut Memory,
    ) -> Draft {
        let patch = &self.context.surfaces.patches[self.simple as usize];
        let mut corners = outline.clone();
        if corners.len() > MOST_CORNERS {
            corners = self.frame.corners(cells, f64::from(self.finest())).to_vec();
            // The frame lies in the plane up to rounding; the first side follows an edge, which settles it.
            for corner in &mut corners {
                *corner -= patch.normal * (patch.normal.dot(*corner) - patch.offset);
            }
        }
        if self.back {
            corners.reverse();
        }
        let shape = patch_shape(self.context.surfaces, self.simple, self.back, &corners);
        let area = area_vector(&outline).length();
        // It is not split if it is too small even were all partial that may be.
        let above = parent.map_or(self.above, |p| &p.row);
        let asked = above.undecided();
        let last = area * asked as f64 <= self.threshold;
        let mut part = Part { last, root: parent.is_none(), ..Part::default() };
        for (index, corner) in part.corners.iter_mut().zip(&corners) {
            let same = parent.and_then(|p| p.corners.iter().position(|c| c == corner));
            *index = same.map_or(0, |i| i as u8 + 1);
        }
        let row = self.context.row(shape, part, Some(above), memory);
        Draft { cells, corners, cluster: NONE, area, row, children: None, outline, depth, credit: LOOK_AHEAD }
    }

    /// The node's halves along one axis, unless one of them would be empty.
    fn halves(&self, node: &Draft, axis: usize) -> Option<[([u32; 4], Vec<DVec3>); 2]> {
        let cells = node.cells;
        if cells[axis + 2] - cells[axis] < 2 {
            return None;
        }
        let middle = (cells[axis] + cells[axis + 2]) / 2;
        let side = self.frame.sides[axis];
        let normal = side.try_normalize()?;
        let at = normal.dot(self.frame.origin + side * (f64::from(middle) / f64::from(self.finest())));
        let half = |sign: f64, end: usize| {
            let mut outline = Vec::with_capacity(node.outline.len() + 1);
            clip(&node.outline, &mut outline, normal * sign, at * sign);
            let mut cells = cells;
            cells[axis + end] = middle;
            (area_vector(&outline).length() > 1e-4 * node.area).then_some((cells, outline))
        };
        Some([half(-1.0, 2)?, half(1.0, 0)?])
    }

    /// Splits while it pays.
    pub fn build(&self, memory: &mut Memory) -> Vec<Draft> {
        let patch = &self.context.surfaces.patches[self.simple as usize];
        let finest = self.finest();
        let root = self.draft([0, 0, finest, finest], patch.corners.clone(), [0; 2], None, memory);
        let mut nodes = vec![root];
        let mut next = 0;
        while next < nodes.len() {
            let index = next;
            next += 1;
            let node = &nodes[index];
            if node.credit == 0 || cost(node) <= self.threshold {
                continue;
            }
            let length = |axis: usize| self.frame.sides[axis].length() / f64::from(1 << node.depth[axis]);
            let longer = usize::from(length(1) > length(0) * (1.0 + 1e-6));
            let Some((axis, halves)) =
                [longer, 1 - longer].into_iter().find_map(|axis| Some((axis, self.halves(node, axis)?)))
            else {
                continue;
            };
            let mut depth = node.depth;
            depth[axis] += 1;
            let mut children =
                halves.map(|(cells, outline)| self.draft(cells, outline, depth, Some(node), memory));
            let after: f64 = children.iter().map(cost).sum();
            let pays = after <= cost(node) * (1.0 - f64::from(self.settings.least_gain));
            for child in &mut children {
                child.credit = if pays { LOOK_AHEAD } else { node.credit - 1 };
            }
            nodes[index].children = Some([nodes.len(), nodes.len() + 1]);
            nodes.extend(children);
        }
        self.collapse(&mut nodes);
        nodes
    }

    /// Undoes splits that gained too little.
    fn collapse(&self, nodes: &mut [Draft]) {
        let mut below = vec![0.0; nodes.len()];
        for index in (0..nodes.len()).rev() {
            let own = cost(&nodes[index]);
            below[index] = own;
            if let Some([a, b]) = nodes[index].children {
                let after = below[a] + below[b];
                if after <= own * (1.0 - f64::from(self.settings.least_gain)) {
                    below[index] = after;
                } else {
                    nodes[index].children = None;
                }
            }
        }
    }
}

/// How many levels a split may take to pay. In a furnished room something blocks a little of every light for a half
/// and for a quarter of the floor: gains begin where pieces are smaller than what stands between.
const LOOK_AHEAD: u32 = 7;

/// Area × partially occluded lights.
fn cost(node: &Draft) -> f64 {
    node.area * node.row.states.iter().filter(|&&s| s == State::Partial).count() as f64
}

/// A mesh's clusters down to those of at most so many triangles.
pub(crate) fn mesh_nodes(context: &Context, mesh: u32, triangles: u32, memory: &mut Memory) -> Vec<Draft> {
    let mut nodes: Vec<Draft> = Vec::new();
    let mut open = vec![(0, None)];
    let mut next = 0;
    while next < open.len() {
        let (index, parent): (u32, Option<usize>) = open[next];
        let cluster = cluster_of(context.surfaces, mesh, index);
        let last = cluster.range.len() <= triangles as usize || cluster.children[0] == NONE;
        let part = Part { own: Some(mesh), last, ..Part::default() };
        let row = context.row(Shape::Cluster(cluster), part, parent.map(|p| &nodes[p].row), memory);
        let mut children = None;
        if !last {
            children = Some([open.len(), open.len() + 1]);
            open.extend(cluster.children.map(|c| (c, Some(next))));
        }
        nodes.push(Draft {
            cells: [0; 4],
            corners: Vec::new(),
            cluster: index,
            area: cluster.area,
            row,
            children,
            outline: Vec::new(),
            depth: [0; 2],
            credit: 0,
        });
        next += 1;
    }
    nodes
}
