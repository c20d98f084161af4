//! The visibility database: for each node and light the state, and the blockers that decide it.

use super::blockers::{Blocker, BlockerTree};
use super::groups::{PatchSide, ReceiverGroups};
use super::hierarchy::{Frame, NodeBuilder, PatchRoot, mesh_nodes};
use super::node_visibility::{Entry, NodeContext, NodeVisibility, SceneContext, Workspace};
use super::pyramid::Tests;
use super::receivers::{Leaf, LeafKind, Node, PatchGrid, Receivers, Source, TriangleReceiver};
use super::shapes::{Apex, Shape};
use super::surfaces::Surfaces;
use super::{LeafId, State, VisibilitySettings, ids};
use crate::generation::Generation;
use crate::lights::LightSet;
use crate::scene::{Geometry, NONE, Scene};
use crate::{Error, Result};
use glam::DVec3;

/// With more lights visibility is not determined: a database holds three bytes for each node and light.
pub const MOST_LIGHTS: usize = 16384;

/// For each node and light the state, and the blockers that decide it.
#[derive(Clone, Debug)]
pub struct VisibilityDatabase {
    receivers: Receivers,
    surfaces: Surfaces,
    /// Over static blockers.
    groups: BlockerTree,
    lights: usize,
    /// By node and light, of all blockers.
    states: Vec<State>,
    /// By node: with static blockers only, and with dynamic ones.
    fixed: Vec<NodeVisibility>,
    pub(super) moving: Vec<NodeVisibility>,
    tests: Tests,
    of_geometry: Generation,
    of_lights: Generation,
}

/// The size of a database.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Nodes of the hierarchy.
    pub nodes: usize,
    /// Its leaves.
    pub leaves: usize,
    /// Pairs of a leaf and a light.
    pub pairs: usize,
    /// How many of them are unoccluded, partially and fully occluded.
    pub by_state: [usize; 3],
    /// The same as shares, weighted by the leaves' areas.
    pub area_shares: [f64; 3],
    /// Full and partial blockers that are stored, over all nodes.
    pub blockers: usize,
    /// Tests made to build it.
    pub tests: Tests,
}

/// A root under construction.
enum Root {
    Patch { simple: u32, back: bool },
    Mesh(u32),
}

impl VisibilityDatabase {
    /// Builds everything from scratch: the hierarchy from the lights and static blockers, then the visibility with dynamic
    /// blockers.
    ///
    /// # Errors
    /// [`Error::Invalid`] where there are more than [`MOST_LIGHTS`] lights, or geometry or lights are not this scene's.
    pub fn build(
        scene: &Scene,
        geometry: &Geometry,
        lights: &LightSet,
        settings: &VisibilitySettings,
    ) -> Result<Self> {
        geometry.belongs_to(scene)?;
        lights.belongs_to(geometry)?;
        if lights.len() > MOST_LIGHTS {
            return Err(Error::Invalid(format!(
                "visibility is determined for {MOST_LIGHTS} light samples at most; there are {}",
                lights.len()
            )));
        }
        let surfaces = Surfaces::new(scene, geometry, settings);
        let apexes: Vec<Apex> = lights.samples().iter().map(Apex::new).collect();
        let own: Vec<u32> = lights.samples().iter().map(|l| surfaces.blocker_of(l.triangle())).collect();
        let dynamic = |object: u32| scene.objects.get(object as usize).is_some_and(|o| o.dynamic);
        // The hierarchy, with the visibility that static blockers leave.
        let groups = BlockerTree::with_clusters(&surfaces, &apexes, |object| !dynamic(object));
        let context = SceneContext { surfaces: &surfaces, lights: &apexes, own: &own, blockers: &groups };
        let (receivers, fixed, mut tests) = receivers(&context, geometry, settings);
        // The visibility with dynamic blockers too.
        let blockers = BlockerTree::new(&surfaces, dynamic);
        let mut moving = Vec::new();
        if !blockers.is_empty() {
            let context = SceneContext { blockers: &blockers, ..context };
            let (with_dynamic, more) =
                determine(&context, &receivers, |node, shape, at, parent, workspace| {
                    context.visibility_by_blockers(shape, at.own_mesh, (parent, &fixed[node]), workspace)
                });
            moving = with_dynamic;
            tests += more;
        }
        let mut states = Vec::with_capacity(fixed.len() * apexes.len());
        for (node, visibility) in fixed.iter().enumerate() {
            match moving.get(node) {
                Some(with_moving) => states.extend(&with_moving.states),
                None => states.extend(&visibility.states),
            }
        }
        Ok(Self {
            receivers,
            surfaces,
            groups,
            lights: apexes.len(),
            states,
            fixed,
            moving,
            tests,
            of_geometry: geometry.generation(),
            of_lights: lights.generation(),
        })
    }

    /// Whether it was built for this geometry and these lights.
    ///
    /// # Errors
    /// [`Error::Invalid`] where it was built for others.
    pub fn belongs_to(&self, geometry: &Geometry, lights: &LightSet) -> Result<()> {
        let sentence = "this visibility database belongs to another scene, an earlier version of it or other lights; \
                        build it anew";
        self.of_geometry.expect(geometry.generation(), sentence)?;
        self.of_lights.expect(lights.generation(), sentence)
    }

    /// The identity of a leaf.
    pub fn leaf_id(&self, leaf: u32) -> LeafId {
        self.receivers.ids[leaf as usize]
    }

    /// The hierarchy of receivers.
    pub fn receivers(&self) -> &Receivers {
        &self.receivers
    }

    /// How many lights there are.
    pub fn lights(&self) -> usize {
        self.lights
    }

    /// The state of any node for a light: fully occluded if one blocker covers it all, or the two do not face each
    /// other.
    pub fn state(&self, node: u32, light: u32) -> State {
        self.states[node as usize * self.lights + light as usize]
    }

    /// The states of a leaf, one for each light.
    pub fn leaf_states(&self, leaf: u32) -> &[State] {
        let first = self.receivers.leaves[leaf as usize].node as usize * self.lights;
        &self.states[first..first + self.lights]
    }

    /// The blockers of a node and a light, full (`true`) or partial. Of static objects this is the one blocker or
    /// [`Blocker::Group`] that decides their state. Of dynamic ones it is each patch or mesh if static ones leave the pair
    /// unoccluded; if those block a part of it, patches, and each mesh that is near, tested or not; if those block all,
    /// none. Below a full blocker nothing is tested again. If a node has none, its parent's decide, or the light and it do
    /// not face each other.
    pub fn blockers(&self, node: u32, light: u32) -> impl Iterator<Item = (Blocker, bool)> + '_ {
        let fixed = entries_of(&self.fixed, node, light)
            .map(|e| (self.groups.blocker(&self.surfaces, e.blocker()), e.full()));
        let moving =
            entries_of(&self.moving, node, light).map(|e| (self.surfaces.blocker(e.blocker()), e.full()));
        fixed.chain(moving)
    }

    /// The blockers of a [`Blocker::Group`].
    pub fn members(&self, group: u32) -> impl Iterator<Item = Blocker> + '_ {
        self.groups.members(group).into_iter().map(|b| self.surfaces.blocker(b))
    }

    /// The numbers of nodes, leaves, pairs by state, blockers and tests.
    pub fn counts(&self) -> Counts {
        let mut counts = Counts {
            nodes: self.receivers.nodes.len(),
            leaves: self.receivers.leaves.len(),
            pairs: self.receivers.leaves.len() * self.lights,
            blockers: self.fixed.iter().chain(&self.moving).map(|r| r.entries.len()).sum(),
            tests: self.tests,
            ..Counts::default()
        };
        for (index, leaf) in self.receivers.leaves.iter().enumerate() {
            for &state in self.leaf_states(index as u32) {
                counts.by_state[state as usize] += 1;
                counts.area_shares[state as usize] += f64::from(leaf.area);
            }
        }
        let total: f64 = counts.area_shares.iter().sum();
        if total > 0.0 {
            counts.area_shares = counts.area_shares.map(|a| a / total);
        }
        counts
    }
}

/// The blockers of a node and a light.
pub(super) fn entries_of(nodes: &[NodeVisibility], node: u32, light: u32) -> impl Iterator<Item = &Entry> {
    nodes.get(node as usize).map_or(&[][..], |n| of_light(&n.entries, light)).iter()
}

pub(super) fn of_light(entries: &[Entry], light: u32) -> &[Entry] {
    let first = entries.partition_point(|e| e.light < light);
    let count = entries[first..].partition_point(|e| e.light == light);
    &entries[first..first + count]
}

/// The visibility of all nodes of a given hierarchy, each computed by `test` from its parent's, and the number of tests.
pub(super) fn determine(
    context: &SceneContext,
    receivers: &Receivers,
    test: impl Fn(usize, Shape, NodeContext, Option<&NodeVisibility>, &mut Workspace) -> NodeVisibility
    + Sync
    + Send,
) -> (Vec<NodeVisibility>, Tests) {
    let roots: Vec<usize> =
        (0..receivers.nodes.len()).filter(|&i| receivers.nodes[i].parent == NONE).collect();
    let ranges: Vec<_> = roots
        .iter()
        .enumerate()
        .map(|(i, &first)| first..roots.get(i + 1).copied().unwrap_or(receivers.nodes.len()))
        .collect();
    let parts = map(&ranges, |range| {
        let mut workspace = Workspace::new();
        let mut nodes: Vec<NodeVisibility> = Vec::with_capacity(range.len());
        for index in range.clone() {
            let node = &receivers.nodes[index];
            let parent = nodes.get((node.parent as usize).wrapping_sub(range.start));
            let shape = receivers.shape(context.surfaces, index as u32);
            let own_mesh = receivers.mesh(index as u32);
            let at = NodeContext { own_mesh, is_leaf: node.leaf != NONE, ..NodeContext::default() };
            nodes.push(test(index, shape, at, parent, &mut workspace));
        }
        (nodes, workspace.scratch.tests)
    });
    let mut tests = Tests::default();
    for part in &parts {
        tests += part.1;
    }
    (parts.into_iter().flat_map(|p| p.0).collect(), tests)
}

/// Builds the hierarchy, with the visibility of its nodes and the number of tests.
fn receivers(
    context: &SceneContext,
    geometry: &Geometry,
    settings: &VisibilitySettings,
) -> (Receivers, Vec<NodeVisibility>, Tests) {
    let surfaces = context.surfaces;
    let sides = |simple: usize| 1 + usize::from(surfaces.patches[simple].double_sided);
    let total: f64 = (0..surfaces.patches.len()).map(|i| surfaces.patches[i].area * sides(i) as f64).sum();
    let threshold = total * context.lights.len() as f64 / f64::from(settings.split).max(1e-30);
    let of_patch = |i: usize| [false, true].into_iter().take(sides(i)).map(move |back| (i as u32, back));
    let patches: Vec<PatchSide> = (0..surfaces.patches.len()).flat_map(of_patch).collect();
    let frames: Vec<Frame> = surfaces.patches.iter().map(|p| Frame::new(&p.corners, p.normal)).collect();
    let build = |index: u32, group_visibility: &NodeVisibility| {
        let mut workspace = Workspace::new();
        let (simple, back) = patches[index as usize];
        let frame = frames[simple as usize];
        let nodes = PatchRoot { context, settings, simple, back, group_visibility, frame, threshold }
            .build(&mut workspace);
        Built { index, nodes, tests: workspace.scratch.tests }
    };
    let mut parts = Vec::new();
    if !patches.is_empty() {
        parts = descend(context, &ReceiverGroups::new(surfaces, &patches), 0, None, &build);
    }
    parts.sort_unstable_by_key(|part| part.index);
    let meshes: Vec<u32> = (0..surfaces.meshes.len() as u32).collect();
    parts.extend(map(&meshes, |&index| {
        let mut workspace = Workspace::new();
        let nodes = mesh_nodes(context, index, settings.cluster_triangles.max(1), &mut workspace);
        Built { index, nodes, tests: workspace.scratch.tests }
    }));
    let roots = patches.iter().map(|&(simple, back)| Root::Patch { simple, back });
    let roots = roots.chain(meshes.iter().map(|&mesh| Root::Mesh(mesh)));
    let mut result = Receivers {
        triangles: vec![TriangleReceiver::Leaf(NONE); geometry.triangles.len()],
        ..Receivers::default()
    };
    let mut visibility = Vec::new();
    let mut tests = Tests::default();
    for (simple, frame) in frames.iter().enumerate() {
        let patch = &surfaces.patches[simple];
        for triangle in patch.triangles.clone() {
            result.triangles[triangle as usize] = TriangleReceiver::Grid(simple as u32);
        }
        result.grids.push(PatchGrid {
            patch: patch.patch,
            object: patch.object,
            origin: frame.origin.as_vec3(),
            axis_u: DVec3::ZERO.as_vec3(),
            axis_v: DVec3::ZERO.as_vec3(),
            columns: 1,
            rows: 1,
            front: NONE,
            back: NONE,
        });
    }
    for (root, part) in roots.zip(parts) {
        tests += part.tests;
        flatten(surfaces, &root, part.nodes, &mut result, &mut visibility);
    }
    make_grids(settings, &frames, &mut result);
    result.ids = ids::identify(geometry, surfaces, &result);
    (result, visibility, tests)
}

/// The subtree of one root.
struct Built {
    index: u32,
    nodes: Vec<NodeBuilder>,
    tests: Tests,
}

/// The subtrees of a group's members, in any order; `build` makes each, given the group's visibility.
fn descend(
    context: &SceneContext,
    groups: &ReceiverGroups,
    index: u32,
    above: Option<&NodeVisibility>,
    build: &(impl Fn(u32, &NodeVisibility) -> Built + Sync + Send),
) -> Vec<Built> {
    let group = &groups.nodes[index as usize];
    let mut workspace = Workspace::new();
    let node = NodeContext { is_root: true, ..NodeContext::default() };
    let visibility = context.visibility_by_groups(Shape::Group(group), node, above, &mut workspace);
    let mut built = if group.bounds.children[0] == NONE {
        let members = group.bounds.range.start as usize..group.bounds.range.end as usize;
        map(&groups.order[members], |&member| build(member, &visibility))
    } else {
        let below = |&child: &u32| descend(context, groups, child, Some(&visibility), build);
        map(&group.bounds.children, below).into_iter().flatten().collect()
    };
    if let Some(first) = built.first_mut() {
        first.tests += workspace.scratch.tests;
    }
    built
}

/// Appends the nodes of a root that were not collapsed.
fn flatten(
    surfaces: &Surfaces,
    root: &Root,
    mut builders: Vec<NodeBuilder>,
    result: &mut Receivers,
    visibility: &mut Vec<NodeVisibility>,
) {
    let mut open = std::collections::VecDeque::from([(0_usize, NONE)]);
    while let Some((builder, parent)) = open.pop_front() {
        let builder = &mut builders[builder];
        let index = result.nodes.len() as u32;
        if parent != NONE {
            let children = &mut result.nodes[parent as usize].children;
            let slot = usize::from(children[0] != NONE);
            children[slot] = index;
        }
        let (source, kind, center, radius) = match *root {
            Root::Mesh(mesh) => {
                let cluster = &surfaces.meshes[mesh as usize].tree.nodes[builder.cluster as usize];
                let kind = LeafKind::Cluster { object: surfaces.meshes[mesh as usize].object };
                (Source::Cluster { mesh, cluster: builder.cluster }, kind, cluster.center, cluster.radius)
            }
            Root::Patch { simple, back } => {
                let low = builder.corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
                let high = builder.corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
                let center = (low + high) * 0.5;
                let radius = builder.corners.iter().map(|c| c.distance(center)).fold(0.0, f64::max);
                let first = result.corners.len() as u32;
                result.corners.append(&mut builder.corners);
                let corners = first..result.corners.len() as u32;
                let kind = LeafKind::Patch { grid: simple, back, cells: builder.cells };
                (Source::Patch { simple, back, corners }, kind, center, radius)
            }
        };
        let mut leaf = NONE;
        match builder.children {
            Some(children) => open.extend(children.map(|c| (c, index))),
            None => {
                leaf = result.leaves.len() as u32;
                result.leaves.push(Leaf {
                    node: index,
                    kind,
                    center: center.as_vec3(),
                    radius: (radius * (1.0 + 1e-6)) as f32,
                    area: builder.area as f32,
                });
                if let Source::Cluster { mesh, cluster } = source {
                    let tree = &surfaces.meshes[mesh as usize].tree;
                    let range = tree.nodes[cluster as usize].range.clone();
                    for &triangle in &tree.order[range.start as usize..range.end as usize] {
                        result.triangles[triangle as usize] = TriangleReceiver::Leaf(leaf);
                    }
                }
            }
        }
        let area = builder.area as f32;
        result.nodes.push(Node { parent, children: [NONE; 2], leaf, area, source });
        visibility.push(std::mem::take(&mut builder.visibility));
    }
}

/// Chooses each grid's resolution, converts its leaves' cells to it and fills the grid.
fn make_grids(settings: &VisibilitySettings, frames: &[Frame], result: &mut Receivers) {
    let finest = 1_u32 << settings.max_depth.min(8);
    // The cells' size, in units of the finest possible split.
    let mut units = vec![[finest; 2]; frames.len()];
    for leaf in &result.leaves {
        if let LeafKind::Patch { grid, cells, .. } = leaf.kind {
            for (axis, unit) in units[grid as usize].iter_mut().enumerate() {
                *unit = (*unit).min(cells[axis + 2] - cells[axis]);
            }
        }
    }
    for (grid, (frame, unit)) in result.grids.iter_mut().zip(frames.iter().zip(&units)) {
        let [columns, rows] = unit.map(|u| finest / u);
        let scaled = |side: DVec3, count: u32| {
            let squared = side.length_squared();
            if squared > 0.0 { (side * (f64::from(count) / squared)).as_vec3() } else { side.as_vec3() }
        };
        (grid.columns, grid.rows) = (columns, rows);
        grid.axis_u = scaled(frame.sides[0], columns);
        grid.axis_v = scaled(frame.sides[1], rows);
    }
    for (index, leaf) in result.leaves.iter_mut().enumerate() {
        let LeafKind::Patch { grid, back, cells } = &mut leaf.kind else { continue };
        let unit = units[*grid as usize];
        *cells = [cells[0] / unit[0], cells[1] / unit[1], cells[2] / unit[0], cells[3] / unit[1]];
        let grid = &mut result.grids[*grid as usize];
        let first = if *back { &mut grid.back } else { &mut grid.front };
        if *first == NONE {
            *first = result.cells.len() as u32;
            result.cells.resize(result.cells.len() + (grid.columns * grid.rows) as usize, NONE);
        }
        for row in cells[1]..cells[3] {
            for column in cells[0]..cells[2] {
                result.cells[(*first + row * grid.columns + column) as usize] = index as u32;
            }
        }
    }
}

/// One result for each item, in order, on all cores.
fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        items.par_iter().with_max_len(1).map(f).collect()
    }
    #[cfg(not(feature = "parallel"))]
    items.iter().map(f).collect()
}
