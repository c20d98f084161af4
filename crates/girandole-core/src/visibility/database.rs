//! The visibility database: for each node and light the state, and the blockers that decide it.

use super::blockers::{Blocker, BlockerTree};
use super::groups::{Groups, Side};
use super::hierarchy::{Draft, Frame, PatchRoot, mesh_nodes};
use super::pyramid::Tests;
use super::receivers::{Leaf, LeafKind, Node, PatchGrid, Receivers, Source, TriangleReceiver};
use super::rows::{Context, Memory, Part, Row};
use super::shapes::{Apex, Shape};
use super::surfaces::Surfaces;
use super::{Entry, LeafId, State, VisibilitySettings, ids};
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
    /// By node: what static objects block, and what dynamic ones do.
    fixed: Vec<Row>,
    pub(super) moving: Vec<Row>,
    tests: Tests,
    of_geometry: Generation,
    of_lights: Generation,
}

/// What a database consists of.
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
    /// Full and partial blockers that are remembered, over all nodes.
    pub blockers: usize,
    /// Tests that it took.
    pub tests: Tests,
}

/// A root in the making.
enum Root {
    Patch { simple: u32, back: bool },
    Mesh(u32),
}

impl VisibilityDatabase {
    /// Determines everything from scratch: the hierarchy from static geometry and the lights, then what dynamic
    /// objects block.
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
        // The hierarchy, with what static objects block.
        let groups = BlockerTree::detailed(&surfaces, &apexes, |object| !dynamic(object));
        let context = Context { surfaces: &surfaces, lights: &apexes, own: &own, blockers: &groups };
        let (receivers, fixed, mut tests) = receivers(&context, geometry, settings);
        // What dynamic ones block besides.
        let blockers = BlockerTree::new(&surfaces, dynamic);
        let mut moving = Vec::new();
        if !blockers.is_empty() {
            let context = Context { blockers: &blockers, ..context };
            let (rows, more) = determine(&context, &receivers, |node, shape, part, parent, memory| {
                context.row_of_each(shape, part.own, (parent, &fixed[node]), memory)
            });
            moving = rows;
            tests += more;
        }
        let mut states = Vec::with_capacity(fixed.len() * apexes.len());
        for (node, row) in fixed.iter().enumerate() {
            match moving.get(node) {
                Some(with_moving) => states.extend(&with_moving.states),
                None => states.extend(&row.states),
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

    /// What was found to block a node from a light fully (`true`) or partially. Of static objects this is the one
    /// blocker or [`Blocker::Group`] that decides their state, as it stays the same for as long as they stand. Of
    /// dynamic ones it is each patch or mesh where static ones leave the pair unoccluded; where those block a part of
    /// it, dynamic patches, and each mesh that is near, looked at or not; where those block all, none. Below a full one
    /// nothing is looked at again. Where a node has none, its parent's decide, or the light and it do not face each
    /// other.
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

    /// How much there is of everything.
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

/// What blocks a node from a light.
pub(super) fn entries_of(rows: &[Row], node: u32, light: u32) -> impl Iterator<Item = &Entry> {
    rows.get(node as usize).map_or(&[][..], |row| of_light(&row.entries, light)).iter()
}

pub(super) fn of_light(entries: &[Entry], light: u32) -> &[Entry] {
    let first = entries.partition_point(|e| e.light < light);
    let count = entries[first..].partition_point(|e| e.light == light);
    &entries[first..first + count]
}

/// Rows of all nodes of a given hierarchy, each as `row` makes it of the node, its parent's row and memory to work in;
/// and the number of tests.
pub(super) fn determine(
    context: &Context,
    receivers: &Receivers,
    row: impl Fn(usize, Shape, Part, Option<&Row>, &mut Memory) -> Row + Sync + Send,
) -> (Vec<Row>, Tests) {
    let roots: Vec<usize> =
        (0..receivers.nodes.len()).filter(|&i| receivers.nodes[i].parent == NONE).collect();
    let ranges: Vec<_> = roots
        .iter()
        .enumerate()
        .map(|(i, &first)| first..roots.get(i + 1).copied().unwrap_or(receivers.nodes.len()))
        .collect();
    let parts = map(&ranges, |range| {
        let mut memory = Memory::new();
        let mut rows: Vec<Row> = Vec::with_capacity(range.len());
        for index in range.clone() {
            let node = &receivers.nodes[index];
            let parent = rows.get((node.parent as usize).wrapping_sub(range.start));
            let shape = receivers.shape(context.surfaces, index as u32);
            let part = Part { own: receivers.mesh(index as u32), last: node.leaf != NONE, ..Part::default() };
            rows.push(row(index, shape, part, parent, &mut memory));
        }
        (rows, memory.scratch.tests)
    });
    let mut tests = Tests::default();
    for part in &parts {
        tests += part.1;
    }
    (parts.into_iter().flat_map(|p| p.0).collect(), tests)
}

/// Makes the hierarchy; what blocks its nodes comes with it, and the number of tests.
fn receivers(
    context: &Context,
    geometry: &Geometry,
    settings: &VisibilitySettings,
) -> (Receivers, Vec<Row>, Tests) {
    let surfaces = context.surfaces;
    let sides = |simple: usize| 1 + usize::from(surfaces.patches[simple].double_sided);
    let total: f64 = (0..surfaces.patches.len()).map(|i| surfaces.patches[i].area * sides(i) as f64).sum();
    let threshold = total * context.lights.len() as f64 / f64::from(settings.split).max(1e-30);
    let of_patch = |i: usize| [false, true].into_iter().take(sides(i)).map(move |back| (i as u32, back));
    let patches: Vec<Side> = (0..surfaces.patches.len()).flat_map(of_patch).collect();
    let frames: Vec<Frame> = surfaces.patches.iter().map(|p| Frame::new(&p.corners, p.normal)).collect();
    let build = |index: u32, above: &Row| {
        let mut memory = Memory::new();
        let (simple, back) = patches[index as usize];
        let frame = frames[simple as usize];
        let nodes = PatchRoot { context, settings, simple, back, above, frame, threshold }.build(&mut memory);
        Built { index, nodes, tests: memory.scratch.tests }
    };
    let mut parts = Vec::new();
    if !patches.is_empty() {
        parts = descend(context, &Groups::new(surfaces, &patches), 0, None, &build);
    }
    parts.sort_unstable_by_key(|part| part.index);
    let meshes: Vec<u32> = (0..surfaces.meshes.len() as u32).collect();
    parts.extend(map(&meshes, |&index| {
        let mut memory = Memory::new();
        let nodes = mesh_nodes(context, index, settings.cluster_triangles.max(1), &mut memory);
        Built { index, nodes, tests: memory.scratch.tests }
    }));
    let roots = patches.iter().map(|&(simple, back)| Root::Patch { simple, back });
    let roots = roots.chain(meshes.iter().map(|&mesh| Root::Mesh(mesh)));
    let mut result = Receivers {
        triangles: vec![TriangleReceiver::Leaf(NONE); geometry.triangles.len()],
        ..Receivers::default()
    };
    let mut rows = Vec::new();
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
        flatten(surfaces, &root, part.nodes, &mut result, &mut rows);
    }
    make_grids(settings, &frames, &mut result);
    result.ids = ids::identify(geometry, surfaces, &result);
    (result, rows, tests)
}

/// What is below one root.
struct Built {
    index: u32,
    nodes: Vec<Draft>,
    tests: Tests,
}

/// What is below each member of a group, in any order; `build` makes it, given what is known of the group.
fn descend(
    context: &Context,
    groups: &Groups,
    index: u32,
    above: Option<&Row>,
    build: &(impl Fn(u32, &Row) -> Built + Sync + Send),
) -> Vec<Built> {
    let group = &groups.nodes[index as usize];
    let mut memory = Memory::new();
    let part = Part { root: true, ..Part::default() };
    let row = context.row(Shape::Group(group), part, above, &mut memory);
    let mut built = if group.bounds.children[0] == NONE {
        let members = group.bounds.range.start as usize..group.bounds.range.end as usize;
        map(&groups.order[members], |&member| build(member, &row))
    } else {
        let below = |&child: &u32| descend(context, groups, child, Some(&row), build);
        map(&group.bounds.children, below).into_iter().flatten().collect()
    };
    if let Some(first) = built.first_mut() {
        first.tests += memory.scratch.tests;
    }
    built
}

/// Appends the nodes of a root that are still in its hierarchy.
fn flatten(
    surfaces: &Surfaces,
    root: &Root,
    mut drafts: Vec<Draft>,
    result: &mut Receivers,
    rows: &mut Vec<Row>,
) {
    let mut open = std::collections::VecDeque::from([(0_usize, NONE)]);
    while let Some((draft, parent)) = open.pop_front() {
        let draft = &mut drafts[draft];
        let index = result.nodes.len() as u32;
        if parent != NONE {
            let children = &mut result.nodes[parent as usize].children;
            let slot = usize::from(children[0] != NONE);
            children[slot] = index;
        }
        let (source, kind, center, radius) = match *root {
            Root::Mesh(mesh) => {
                let cluster = &surfaces.meshes[mesh as usize].tree.nodes[draft.cluster as usize];
                let kind = LeafKind::Cluster { object: surfaces.meshes[mesh as usize].object };
                (Source::Cluster { mesh, cluster: draft.cluster }, kind, cluster.center, cluster.radius)
            }
            Root::Patch { simple, back } => {
                let low = draft.corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
                let high = draft.corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
                let center = (low + high) * 0.5;
                let radius = draft.corners.iter().map(|c| c.distance(center)).fold(0.0, f64::max);
                let first = result.corners.len() as u32;
                result.corners.append(&mut draft.corners);
                let corners = first..result.corners.len() as u32;
                let kind = LeafKind::Patch { grid: simple, back, cells: draft.cells };
                (Source::Patch { simple, back, corners }, kind, center, radius)
            }
        };
        let mut leaf = NONE;
        match draft.children {
            Some(children) => open.extend(children.map(|c| (c, index))),
            None => {
                leaf = result.leaves.len() as u32;
                result.leaves.push(Leaf {
                    node: index,
                    kind,
                    center: center.as_vec3(),
                    radius: (radius * (1.0 + 1e-6)) as f32,
                    area: draft.area as f32,
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
        let area = draft.area as f32;
        result.nodes.push(Node { parent, children: [NONE; 2], leaf, area, source });
        rows.push(std::mem::take(&mut draft.row));
    }
}

/// Chooses each grid's finest split, brings its leaves' cells to it and enters them.
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
