//! Puts a hierarchy of receivers together: first those that stand still, then those that may move, so that the first part
//! stays what it is when they do.

use super::groups::{PatchSide, ReceiverGroups};
use super::hierarchy::{Frame, NodeBuilder, PatchRoot, mesh_nodes};
use super::node_visibility::{NodeContext, NodeVisibility, SceneContext, Workspace};
use super::pyramid::Tests;
use super::receivers::{Leaf, LeafKind, Node, PatchGrid, Receivers, Source, TriangleReceiver};
use super::shapes::Shape;
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
    pub visibility: Vec<NodeVisibility>,
    pub tests: Tests,
}

/// Where the part of an [`Assembly`] ends that belongs to objects that stand still.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct End {
    pub nodes: usize,
    pub leaves: usize,
    cells: usize,
    corners: usize,
    pub tests: Tests,
}

/// Surfaces of a scene that become receivers together: sides of simple patches, and meshes.
pub(super) struct Sources {
    sides: Vec<PatchSide>,
    meshes: Vec<u32>,
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
        Self { sides: sides.collect(), meshes: meshes.collect() }
    }

    /// Area of the patches, both sides of those that have two, m².
    pub fn area(&self, surfaces: &Surfaces) -> f64 {
        self.sides.iter().map(|(simple, _)| surfaces.patches[*simple as usize].area).sum()
    }
}

impl Assembly {
    /// Without receivers.
    pub fn new(surfaces: &Surfaces, geometry: &Geometry) -> Self {
        let mut result = Self::default();
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
            tests: self.tests,
        }
    }

    /// Takes all away that was appended since, and what is on other objects than those that stand still.
    pub fn truncate(&mut self, end: End, surfaces: &Surfaces, stands: impl Fn(u32) -> bool) {
        let Self { receivers, visibility, tests } = self;
        receivers.nodes.truncate(end.nodes);
        receivers.leaves.truncate(end.leaves);
        receivers.ids.truncate(end.leaves);
        receivers.cells.truncate(end.cells);
        receivers.corners.truncate(end.corners);
        visibility.truncate(end.nodes);
        *tests = end.tests;
        for simple in 0..surfaces.patches.len() {
            if !stands(surfaces.patches[simple].object) {
                receivers.grids[simple] = empty_grid(surfaces, simple);
            }
        }
    }

    /// Appends receivers: patches are split while their area times their partially occluded lights exceeds `threshold`.
    pub fn append(
        &mut self,
        context: &SceneContext,
        geometry: &Geometry,
        settings: &VisibilitySettings,
        Sources { sides, meshes }: &Sources,
        threshold: f64,
    ) {
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
            let nodes = root.build(&mut workspace);
            Built { index, nodes, tests: workspace.scratch.tests }
        };
        let mut parts = Vec::new();
        if !sides.is_empty() {
            parts = descend(context, &ReceiverGroups::new(surfaces, sides), 0, None, &build);
        }
        parts.sort_unstable_by_key(|part| part.index);
        parts.extend(map(meshes, |&index| {
            let mut workspace = Workspace::new();
            let nodes = mesh_nodes(context, index, settings.cluster_triangles.max(1), &mut workspace);
            Built { index, nodes, tests: workspace.scratch.tests }
        }));
        let roots = sides.iter().map(|&(simple, back)| Root::Patch { simple, back });
        let roots = roots.chain(meshes.iter().map(|&mesh| Root::Mesh(mesh)));
        let first = self.receivers.leaves.len();
        for &(simple, _) in sides {
            for triangle in surfaces.patches[simple as usize].triangles.clone() {
                self.receivers.triangles[triangle as usize] = TriangleReceiver::Grid(simple);
            }
        }
        for (root, part) in roots.zip(parts) {
            self.tests += part.tests;
            flatten(surfaces, &root, part.nodes, &mut self.receivers, &mut self.visibility);
        }
        make_grids(settings, first, frame, &mut self.receivers);
        let ids = ids::identify(geometry, surfaces, &self.receivers, first);
        self.receivers.ids.extend(ids);
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

/// One result for each item, in order, on all cores.
pub(super) fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        items.par_iter().with_max_len(1).map(f).collect()
    }
    #[cfg(not(feature = "parallel"))]
    items.iter().map(f).collect()
}
