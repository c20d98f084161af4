//! Puts a hierarchy of receivers together: first those that stand still, then those that may move, so that the first part
//! stays what it is when they do.

use super::groups::{PatchSide, ReceiverGroups};
use super::hierarchy::{Frame, NodeBuilder, PatchRoot, mesh_nodes};
use super::node_visibility::{NodeVisibility, SceneContext, Workspace};
use super::parallel::map;
use super::pyramid::Tests;
use super::receivers::{Leaf, LeafKind, Node, PatchGrid, Receivers, Source, TriangleReceiver};
use super::state_matrix::StateMatrix;
use super::surfaces::Surfaces;
use super::{VisibilitySettings, ids};
use crate::scene::{Geometry, NONE};
use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

/// A root under construction.
enum Root {
    Patch { simple: u32, back: bool },
    Mesh(u32),
}

/// A hierarchy of receivers in the making, with the visibility of its nodes that static blockers leave.
#[derive(Clone, Debug, Default)]
pub(super) struct Assembly {
    pub receivers: Receivers,
    pub visibility: StateMatrix,
}

/// Where the part of an [`Assembly`] ends that belongs to objects that stand still.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct End {
    pub nodes: usize,
    pub leaves: usize,
    cells: usize,
    corners: usize,
}

/// Surfaces of a scene that become receivers together: sides of simple patches, and meshes.
#[derive(Clone, Debug, Default)]
pub(super) struct Sources {
    sides: Vec<PatchSide>,
    meshes: Vec<u32>,
    /// Of the sides, if there are any.
    groups: Option<ReceiverGroups>,
}

impl Sources {
    /// Those of the objects that are accepted.
    pub fn of(surfaces: &Surfaces, accept: impl Fn(u32) -> bool) -> Self {
        let patches = (0..).zip(&surfaces.patches).filter(|(_, patch)| accept(patch.object));
        let sides = patches.flat_map(|(simple, patch)| {
            [false, true]
                .into_iter()
                .take(1 + usize::from(patch.double_sided))
                .map(move |back| (simple, back))
        });
        let meshes = (0..).zip(&surfaces.meshes).filter(|(_, mesh)| accept(mesh.object)).map(|(i, _)| i);
        let sides: Vec<PatchSide> = sides.collect();
        let groups = (!sides.is_empty()).then(|| ReceiverGroups::new(surfaces, &sides));
        Self { sides, meshes: meshes.collect(), groups }
    }

    /// How many of the roots are sides of patches; they come before the meshes.
    pub fn sides(&self) -> usize {
        self.sides.len()
    }

    /// How many roots there are.
    pub fn roots(&self) -> usize {
        self.sides.len() + self.meshes.len()
    }

    /// What `build` makes of each side of a patch, given the visibility of its group; and the groups' tests.
    pub fn descend<T: Send>(
        &self,
        context: &SceneContext,
        build: &(impl Fn(u32, &NodeVisibility) -> T + Sync + Send),
    ) -> (Vec<T>, Tests) {
        let found = self.groups.as_ref().map(|groups| groups.descend(context, build));
        let (mut parts, tests) = found.unwrap_or_default();
        parts.sort_unstable_by_key(|(side, _)| *side);
        (parts.into_iter().map(|(_, part)| part).collect(), tests)
    }

    /// Area of the patches, both sides of those that have two, m².
    pub fn area(&self, surfaces: &Surfaces) -> f64 {
        self.sides.iter().map(|(simple, _)| surfaces.patches[*simple as usize].area).sum()
    }
}

impl Assembly {
    /// Without receivers.
    pub fn new(surfaces: &Surfaces, geometry: &Geometry, lights: usize) -> Self {
        let mut result = Self { visibility: StateMatrix::new(lights), ..Self::default() };
        result.receivers.triangles = vec![TriangleReceiver::Leaf(NONE); geometry.triangles.len()];
        for simple in 0..surfaces.patches.len() {
            result.receivers.grids.push(empty_grid(surfaces, simple));
        }
        result
    }

    pub fn end(&self) -> End {
        End {
            nodes: self.receivers.nodes.len(),
            leaves: self.receivers.leaves.len(),
            cells: self.receivers.cells.len(),
            corners: self.receivers.corners.len(),
        }
    }

    /// Takes all away that was appended since, and what is on other objects than those that stand still.
    pub fn truncate(&mut self, end: End, surfaces: &Surfaces, stands: impl Fn(u32) -> bool) {
        let Self { receivers, visibility } = self;
        receivers.nodes.truncate(end.nodes);
        receivers.leaves.truncate(end.leaves);
        receivers.ids.truncate(end.leaves);
        receivers.cells.truncate(end.cells);
        receivers.corners.truncate(end.corners);
        visibility.truncate(end.nodes);
        for simple in 0..surfaces.patches.len() {
            if !stands(surfaces.patches[simple].object) {
                receivers.grids[simple] = empty_grid(surfaces, simple);
            }
        }
    }

    /// Appends receivers: patches are split while their area times their partially occluded lights exceeds `threshold`. Returns
    /// the tests made.
    pub fn append(
        &mut self,
        context: &SceneContext,
        geometry: &Geometry,
        settings: &VisibilitySettings,
        sources: &Sources,
        threshold: f64,
    ) -> Tests {
        let Sources { sides, meshes, .. } = sources;
        let surfaces = context.surfaces;
        let frame = |simple: u32| {
            let patch = &surfaces.patches[simple as usize];
            Frame::new(&patch.corners, patch.normal)
        };
        let build = |index: u32, group_visibility: &NodeVisibility| {
            let mut workspace = Workspace::new();
            let (simple, back) = sides[index as usize];
            let root = PatchRoot {
                context,
                settings,
                simple,
                back,
                group_visibility,
                frame: frame(simple),
                threshold,
            };
            (root.build(&mut workspace), workspace.scratch.tests)
        };
        let (mut parts, mut tests) = sources.descend(context, &build);
        parts.extend(map(meshes, |&index| {
            let mut workspace = Workspace::new();
            let nodes = mesh_nodes(context, index, settings.cluster_triangles.max(1), &mut workspace);
            (nodes, workspace.scratch.tests)
        }));
        let roots = sides.iter().map(|&(simple, back)| Root::Patch { simple, back });
        let roots = roots.chain(meshes.iter().map(|&mesh| Root::Mesh(mesh)));
        let first = self.receivers.leaves.len();
        for &(simple, _) in sides {
            for triangle in surfaces.patches[simple as usize].triangles.clone() {
                self.receivers.triangles[triangle as usize] = TriangleReceiver::Grid(simple);
            }
        }
        for (root, (nodes, of_root)) in roots.zip(parts) {
            tests += of_root;
            flatten(surfaces, &root, nodes, &mut self.receivers, &mut self.visibility);
        }
        make_grids(settings, first, frame, &mut self.receivers);
        let ids = ids::identify(geometry, surfaces, &self.receivers, first);
        self.receivers.ids.extend(ids);
        tests
    }
}

/// The grid of a simple patch that has no leaves yet.
fn empty_grid(surfaces: &Surfaces, simple: usize) -> PatchGrid {
    let patch = &surfaces.patches[simple];
    PatchGrid {
        patch: patch.patch,
        object: patch.object,
        origin: Frame::new(&patch.corners, patch.normal).origin.as_vec3(),
        axis_u: Vec3::ZERO,
        axis_v: Vec3::ZERO,
        columns: 1,
        rows: 1,
        front: NONE,
        back: NONE,
    }
}

/// Appends the nodes of a root that were not collapsed.
fn flatten(
    surfaces: &Surfaces,
    root: &Root,
    mut builders: Vec<NodeBuilder>,
    result: &mut Receivers,
    visibility: &mut StateMatrix,
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
        visibility.push(&std::mem::take(&mut builder.visibility));
    }
}

/// Chooses the resolution of the grids of all leaves from `first` on, converts these leaves' cells to it and fills the
/// grids.
fn make_grids(
    settings: &VisibilitySettings,
    first: usize,
    frame: impl Fn(u32) -> Frame,
    result: &mut Receivers,
) {
    let finest = 1_u32 << settings.max_depth.min(8);
    // The cells' size, in units of the finest possible split.
    let mut units: FxHashMap<u32, [u32; 2]> = FxHashMap::default();
    for leaf in &result.leaves[first..] {
        if let LeafKind::Patch { grid, cells, .. } = leaf.kind {
            let units = units.entry(grid).or_insert([finest; 2]);
            for (axis, unit) in units.iter_mut().enumerate() {
                *unit = (*unit).min(cells[axis + 2] - cells[axis]);
            }
        }
    }
    for (&index, unit) in &units {
        let (grid, frame) = (&mut result.grids[index as usize], frame(index));
        let [columns, rows] = unit.map(|u| finest / u);
        let scaled = |side: DVec3, count: u32| {
            let squared = side.length_squared();
            if squared > 0.0 { (side * (f64::from(count) / squared)).as_vec3() } else { side.as_vec3() }
        };
        (grid.columns, grid.rows) = (columns, rows);
        grid.axis_u = scaled(frame.sides[0], columns);
        grid.axis_v = scaled(frame.sides[1], rows);
    }
    for (index, leaf) in result.leaves.iter_mut().enumerate().skip(first) {
        let LeafKind::Patch { grid, back, cells } = &mut leaf.kind else { continue };
        let unit = units[grid];
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
