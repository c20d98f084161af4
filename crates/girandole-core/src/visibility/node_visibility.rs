//! Occlusion of one node of the receiver hierarchy from each light.

use super::State;
use super::blockers::{BlockerNode, BlockerTree};
use super::boxes::FullCoverHint;
use super::light_points::LightPoint;
use super::pyramid::{Containment, Facing, Occlusion, Pyramid, Scratch};
use super::shapes::{MAX_CORNERS, Shape};
use super::surfaces::Surfaces;
use crate::parallel::map;
use crate::scene::NONE;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// Lights that are worth a piece of work of their own.
const LEAST_LIGHTS: usize = 128;
/// Pieces into which those of a node are cut.
const MOST_CHUNKS: usize = 64;

/// A full or partial blocker of a pair: `light`, and an index into the blockers with the lowest bit set if full.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub light: u32,
    code: u32,
    hint: FullCoverHint,
}

impl Entry {
    pub fn new(light: u32, blocker: u32, full: bool) -> Self {
        Self { light, code: blocker << 1 | u32::from(full), hint: FullCoverHint::UNKNOWN }
    }

    /// Marks a light that only parts of the receiver face.
    pub fn partly_facing(light: u32) -> Self {
        Self { light, code: u32::MAX << 1, hint: FullCoverHint::UNKNOWN }
    }

    pub fn is_partly_facing(self) -> bool {
        self.code == u32::MAX << 1
    }

    pub fn blocker(self) -> u32 {
        self.code >> 1
    }

    pub fn full(self) -> bool {
        self.code & 1 == 1
    }

    /// What a child of the receiver has to test, and which parts of it may be covered.
    pub fn for_child(&self, child: &NodeContext) -> (u32, FullCoverHint) {
        (self.blocker(), self.hint.for_child(&child.parent_corners))
    }
}

/// A node's state for each light, and, until its children are tested, the blockers that these start from, sorted by light.
#[derive(Clone, Debug, Default)]
pub(crate) struct NodeVisibility {
    pub states: Vec<State>,
    pub entries: Vec<Entry>,
}

impl NodeVisibility {
    /// The number of lights for which the children have to be tested.
    pub fn undecided(&self) -> usize {
        let mut last = NONE;
        self.entries.iter().filter(|e| !e.full() && std::mem::replace(&mut last, e.light) != e.light).count()
    }
}

/// The inputs that all nodes share.
pub(crate) struct SceneContext<'a> {
    pub surfaces: &'a Surfaces,
    pub lights: &'a [LightPoint],
    pub blockers: &'a BlockerTree,
}

/// A node's position in the hierarchy.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NodeContext {
    /// The mesh that it is part of.
    pub own_mesh: Option<u32>,
    /// Whether it is certain to have no children.
    pub is_leaf: bool,
    /// Whether what is above it is known of just as much: then it needs no tests unless it is partial, or may face away.
    pub is_known: bool,
    /// See [`parent_corners`].
    pub parent_corners: [u8; MAX_CORNERS],
}

/// For each corner of a node the parent's corner at the same position, counted from 1; 0 for new ones.
pub(crate) fn parent_corners(corners: &[DVec3], parent: Option<&[DVec3]>) -> [u8; MAX_CORNERS] {
    let mut result = [0; MAX_CORNERS];
    for (index, corner) in result.iter_mut().zip(corners) {
        let same = parent.and_then(|parent| parent.iter().position(|c| c == corner));
        *index = same.map_or(0, |i| i as u8 + 1);
    }
    result
}

/// Buffers that one thread uses for one node after another.
pub(crate) struct Workspace {
    pub scratch: Scratch,
    pub pyramid: Pyramid,
    /// Nodes of the blocker hierarchy still to be tested, and which parts of the receiver they may cover.
    pub open: Vec<(u32, FullCoverHint)>,
    /// The stack of a search for what is near.
    pub stack: Vec<u32>,
    pub found: Vec<Entry>,
    /// Lights to be tested.
    pub lights: Vec<u32>,
}

impl Workspace {
    pub fn new() -> Self {
        Self {
            scratch: Scratch::default(),
            pyramid: Pyramid::new(),
            open: Vec::new(),
            stack: Vec::new(),
            found: Vec::new(),
            lights: Vec::new(),
        }
    }
}

impl SceneContext<'_> {
    /// Tests a node against the hierarchy of blockers, starting from those that its parent left undecided: many lights on all cores, as a
    /// large surface has most of the nodes, one after the other.
    pub fn visibility_by_groups(
        &self,
        shape: Shape,
        node: NodeContext,
        parent: Option<&NodeVisibility>,
        workspace: &mut Workspace,
    ) -> NodeVisibility {
        let count = self.lights.len();
        let each = (count / MOST_CHUNKS).max(LEAST_LIGHTS);
        if count < 2 * each {
            return self.visibility_of_lights(0..count, (shape, node), parent, workspace);
        }
        let chunks: Vec<Range<usize>> =
            (0..count).step_by(each).map(|first| first..count.min(first + each)).collect();
        let mut result = NodeVisibility { states: Vec::with_capacity(count), entries: Vec::new() };
        for (part, tests) in map(&chunks, |chunk| {
            let mut workspace = Workspace::new();
            let part = self.visibility_of_lights(chunk.clone(), (shape, node), parent, &mut workspace);
            (part, workspace.scratch.tests)
        }) {
            result.states.extend(part.states);
            result.entries.extend(part.entries);
            workspace.scratch.tests += tests;
        }
        result
    }

    /// The same for some lights.
    pub(super) fn visibility_of_lights(
        &self,
        lights: Range<usize>,
        (shape, node): (Shape, NodeContext),
        parent: Option<&NodeVisibility>,
        workspace: &mut Workspace,
    ) -> NodeVisibility {
        let faces_all_ways = matches!(shape, Shape::Cluster(cluster) if cluster.angle >= FRAC_PI_2);
        let is_known = node.is_known && faces_all_ways;
        let mut rest: &[Entry] = parent.map_or(&[], |p| {
            let [first, end] = [lights.start, lights.end]
                .map(|light| p.entries.partition_point(|e| (e.light as usize) < light));
            &p.entries[first..end]
        });
        let tolerance = shape.tolerance(&self.surfaces.tolerance);
        let mut result = NodeVisibility {
            states: vec![State::Unoccluded; lights.len()],
            entries: Vec::with_capacity(rest.len()),
        };
        for (state, index) in result.states.iter_mut().zip(lights) {
            let light = &self.lights[index];
            let inherited = split_off_light(&mut rest, index as u32);
            let parent_state = parent.map_or(State::Unoccluded, |p| p.states[index]);
            // Decided for the whole subtree, or for just this.
            let is_decided = inherited.iter().all(|e| e.full()) || is_known && parent_state != State::Partial;
            if parent.is_some() && is_decided {
                *state = parent_state;
                continue;
            }
            workspace.open.clear();
            if parent.is_some() {
                let partial = inherited.iter().filter(|e| !e.full() && !e.is_partly_facing());
                workspace.open.extend(partial.rev().map(|e| e.for_child(&node)));
            } else {
                workspace.open.extend((!self.blockers.is_empty()).then_some((0, FullCoverHint::UNKNOWN)));
            }
            workspace.scratch.tests.boxes += 1;
            let facing = match workspace.open.is_empty() {
                true => workspace.pyramid.facing(&light.apex, shape, &tolerance),
                false => workspace.pyramid.set(&light.apex, shape, &tolerance),
            };
            if facing == Facing::None {
                *state = State::Full;
                continue;
            }
            *state = self.search(index as u32, node, State::Unoccluded, workspace);
            result.entries.extend_from_slice(&workspace.found);
            if *state == State::Unoccluded && facing != Facing::All {
                result.entries.push(Entry::partly_facing(index as u32));
            }
        }
        result
    }

    /// Traverses the hierarchy of blockers only as far as the state depends on it: until one blocker is partial, unless
    /// `state` says that another one is, and from there on where one may be full. What the children have to test is left in
    /// `found`.
    pub fn search(
        &self,
        index: u32,
        context: NodeContext,
        mut state: State,
        workspace: &mut Workspace,
    ) -> State {
        let Workspace { scratch, pyramid, open, found, .. } = workspace;
        let NodeContext { own_mesh, is_leaf, .. } = context;
        let light = &self.lights[index as usize];
        found.clear();
        while let Some((group, mut hint)) = open.pop() {
            let node = &self.blockers.nodes[group as usize];
            let bounds = (node.low, node.high, node.extents[usize::from(light.is_outside)]);
            // A cluster of the receiver's own mesh.
            if node.mesh != NONE && own_mesh == Some(node.mesh) {
                scratch.tests.blockers += 1;
                if !self.surfaces.meshes[node.mesh as usize].convex {
                    found.push(Entry::new(index, group, false));
                    state = State::Partial;
                }
                continue;
            }
            let is_partial = state == State::Partial;
            if is_partial && !pyramid.may_be_fully_covered(bounds, &mut hint, scratch) {
                if is_leaf {
                    continue;
                }
                // The hint saves a patch's children the same test; other receivers have none and cull the box here.
                if pyramid.has_sphere() {
                    scratch.tests.boxes += 1;
                    if pyramid.classify_box(node.low, node.high) == Containment::Outside {
                        continue;
                    }
                }
                found.push(Entry { hint, ..Entry::new(index, group, false) });
                continue;
            }
            if node.count == 0 {
                if !is_partial {
                    scratch.tests.boxes += 1;
                    let containment = match self.surfaces.meshes.get(node.mesh as usize) {
                        Some(part) => pyramid.classify_cluster(&part.tree.nodes[node.cluster as usize]),
                        None => pyramid.classify_box(node.low, node.high),
                    };
                    if containment == Containment::Outside {
                        continue;
                    }
                    // Whatever is in a box inside the pyramid blocks a part.
                    if containment == Containment::Inside
                        && !pyramid.may_be_fully_covered(bounds, &mut hint, scratch)
                    {
                        found.push(Entry { hint, ..Entry::new(index, group, false) });
                        state = State::Partial;
                        continue;
                    }
                }
                let mut order = [node.first + 1, node.first];
                let [a, b] = order.map(|c| &self.blockers.nodes[c as usize]);
                if !is_partial && pyramid.is_nearer([(a.low, a.high), (b.low, b.high)]) {
                    order.swap(0, 1);
                }
                open.extend(order.map(|child| (child, hint)));
                continue;
            }
            match self.test_leaf(node, light, own_mesh, pyramid, scratch) {
                Occlusion::None => {}
                Occlusion::Partial => {
                    found.push(Entry::new(index, group, false));
                    state = State::Partial;
                }
                Occlusion::Full => {
                    found.clear();
                    found.push(Entry::new(index, group, true));
                    return State::Full;
                }
            }
        }
        state
    }

    /// How much of the pyramid the blockers of a leaf of their hierarchy occlude, each by itself.
    #[inline]
    fn test_leaf(
        &self,
        leaf: &BlockerNode,
        light: &LightPoint,
        own_mesh: Option<u32>,
        pyramid: &mut Pyramid,
        scratch: &mut Scratch,
    ) -> Occlusion {
        if let Some(part) = self.surfaces.meshes.get(leaf.mesh as usize) {
            let is_touched = pyramid.intersects_cluster(&part.tree, leaf.cluster, scratch);
            return if is_touched { Occlusion::Partial } else { Occlusion::None };
        }
        let mut occlusion = Occlusion::None;
        for &blocker in &self.blockers.items[leaf.first as usize..(leaf.first + leaf.count) as usize] {
            match self.surfaces.test(blocker, pyramid, own_mesh, scratch) {
                Occlusion::None => {}
                // The triangle that a light lies on does not block it.
                Occlusion::Full if light.own != blocker => return Occlusion::Full,
                Occlusion::Full | Occlusion::Partial => occlusion = Occlusion::Partial,
            }
        }
        occlusion
    }
}

/// Splits the entries of a light off the front of the rest.
pub(crate) fn split_off_light<'a>(rest: &mut &'a [Entry], light: u32) -> &'a [Entry] {
    let count = rest.iter().take_while(|e| e.light == light).count();
    let (of_light, others) = rest.split_at(count);
    *rest = others;
    of_light
}
