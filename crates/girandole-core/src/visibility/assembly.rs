//! Puts a hierarchy of receivers together: first those that stand still, then those that may move, so that the first part
//! stays what it is when they do.

use super::growth::{Grown, breadth_first};
use super::hierarchy::{Frame, NodeBuilder};
use super::receivers::{Leaf, LeafKind, Node, PatchGrid, Receivers, Source, TriangleReceiver};
use super::sources::{Root, Sources};
use super::state_matrix::StateMatrix;
use super::surfaces::Surfaces;
use super::{LeafId, VisibilitySettings, ids};
use crate::scene::{Geometry, NONE};
use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// A hierarchy of receivers in the making, with the visibility of its nodes that static blockers leave.
#[derive(Clone, Debug, Default)]
pub(super) struct Assembly {
    pub receivers: Receivers,
    pub visibility: StateMatrix,
}

/// Where the part of an [`Assembly`] ends that belongs to some objects.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct End {
    pub nodes: usize,
    pub leaves: usize,
    cells: usize,
    corners: usize,
}

impl Assembly {
    /// Without receivers; or with the one leaf of all that is not determined.
    pub fn new(surfaces: &Surfaces, geometry: &Geometry, lights: usize, has_undetermined: bool) -> Self {
        let mut result = Self { visibility: StateMatrix::new(lights), ..Self::default() };
        let leaf = if has_undetermined { 0 } else { NONE };
        result.receivers.triangles = vec![TriangleReceiver::Leaf(leaf); geometry.triangles.len()];
        if has_undetermined {
            result.receivers.leaves.push(undetermined(surfaces));
            result.receivers.ids.push(LeafId::Undetermined);
        }
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

    /// Drops what comes after `end`.
    pub fn truncate(&mut self, end: End) {
        let Receivers { nodes, leaves, cells, corners, ids, .. } = &mut self.receivers;
        nodes.truncate(end.nodes);
        leaves.truncate(end.leaves);
        ids.truncate(end.leaves);
        cells.truncate(end.cells);
        corners.truncate(end.corners);
        self.visibility.truncate(end.nodes);
    }

    /// Takes off what comes after `end`.
    pub fn split_off(&mut self, end: End) -> Self {
        let from = &mut self.receivers;
        let receivers = Receivers {
            nodes: from.nodes.split_off(end.nodes),
            leaves: from.leaves.split_off(end.leaves),
            ids: from.ids.split_off(end.leaves),
            cells: from.cells.split_off(end.cells),
            corners: from.corners.split_off(end.corners),
            ..Receivers::default()
        };
        Self { receivers, visibility: self.visibility.split_off(end.nodes) }
    }

    /// Appends receivers that were taken off, of surfaces that are where they were: those between two ends, in what was taken
    /// off from the first of the three on.
    pub fn append_held(
        &mut self,
        surfaces: &Surfaces,
        sources: &Sources,
        taken: &Self,
        [first, from, to]: [End; 3],
    ) {
        let at = self.end();
        let Receivers { nodes, leaves, grids, cells, triangles, corners, ids } = &mut self.receivers;
        let of = &taken.receivers;
        let shifted = |index: u32, from: usize, at: usize| match index {
            NONE => NONE,
            index => (index as usize - from + at) as u32,
        };
        let leaf = |index: u32| shifted(index, from.leaves, at.leaves);
        let node = |index: u32| shifted(index, from.nodes, at.nodes);
        for held in &of.nodes[from.nodes - first.nodes..to.nodes - first.nodes] {
            let source = match held.source.clone() {
                Source::Patch { simple, back, corners: Range { start, end } } => {
                    let corner = |index: u32| shifted(index, from.corners, at.corners);
                    Source::Patch { simple, back, corners: corner(start)..corner(end) }
                }
                Source::Cluster { mesh, cluster } => {
                    if held.leaf != NONE {
                        note_leaf(surfaces, (mesh, cluster), leaf(held.leaf), triangles);
                    }
                    Source::Cluster { mesh, cluster }
                }
            };
            nodes.push(Node {
                parent: node(held.parent),
                children: held.children.map(node),
                leaf: leaf(held.leaf),
                area: held.area,
                source,
            });
        }
        let range = from.leaves - first.leaves..to.leaves - first.leaves;
        ids.extend_from_slice(&of.ids[range.clone()]);
        leaves.extend(of.leaves[range].iter().map(|l| Leaf { node: node(l.node), ..l.clone() }));
        corners.extend_from_slice(&of.corners[from.corners - first.corners..to.corners - first.corners]);
        cells.extend(of.cells[from.cells - first.cells..to.cells - first.cells].iter().map(|c| leaf(*c)));
        for simple in sources.patches() {
            let grid = &mut grids[simple as usize];
            (grid.front, grid.back) =
                (shifted(grid.front, from.cells, at.cells), shifted(grid.back, from.cells, at.cells));
        }
        self.visibility.append_rows(&taken.visibility, from.nodes - first.nodes..to.nodes - first.nodes);
    }

    /// Appends receivers that were grown from these sources; the nodes of each root, with its position among theirs.
    pub fn append(
        &mut self,
        geometry: &Geometry,
        surfaces: &Surfaces,
        settings: &VisibilitySettings,
        sources: &Sources,
        grown: Grown,
    ) -> Vec<(usize, Range<usize>)> {
        let first = self.receivers.leaves.len();
        let mut ranges = Vec::with_capacity(grown.roots.len());
        for (index, nodes) in grown.roots {
            let root = sources.root(index);
            if let Root::Patch { simple, back: false } = root {
                self.receivers.grids[simple as usize] = empty_grid(surfaces, simple as usize);
                for triangle in surfaces.patches[simple as usize].triangles.clone() {
                    self.receivers.triangles[triangle as usize] = TriangleReceiver::Grid(simple);
                }
            }
            let start = self.receivers.nodes.len();
            flatten(surfaces, &root, nodes, &mut self.receivers);
            ranges.push((index, start..self.receivers.nodes.len()));
        }
        self.visibility.append(grown.visibility);
        let frame = |simple: u32| Frame::of(&surfaces.patches[simple as usize]);
        make_grids(settings, first, frame, &mut self.receivers);
        let ids = ids::identify(geometry, surfaces, &self.receivers, first);
        self.receivers.ids.extend(ids);
        ranges
    }
}

/// The leaf of all that is not determined.
fn undetermined(surfaces: &Surfaces) -> Leaf {
    let bounds = (0..surfaces.blocker_count()).map(|surface| surfaces.blocker_box(surface));
    let (low, high) =
        bounds.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (l, h)| (low.min(l), high.max(h)));
    let radius = ((high - low).length() * 0.5 * (1.0 + 1e-6)) as f32;
    Leaf {
        node: NONE,
        kind: LeafKind::Undetermined,
        center: ((low + high) * 0.5).as_vec3(),
        radius,
        area: 0.0,
    }
}

/// The grid of a simple patch that has no leaves yet.
fn empty_grid(surfaces: &Surfaces, simple: usize) -> PatchGrid {
    let patch = &surfaces.patches[simple];
    PatchGrid {
        patch: patch.patch,
        object: patch.object,
        origin: Frame::of(patch).origin.as_vec3(),
        axis_u: Vec3::ZERO,
        axis_v: Vec3::ZERO,
        columns: 1,
        rows: 1,
        front: NONE,
        back: NONE,
    }
}

/// Appends the nodes of a root that were not collapsed.
fn flatten(surfaces: &Surfaces, root: &Root, mut builders: Vec<NodeBuilder>, result: &mut Receivers) {
    let first = result.nodes.len();
    for (builder, parent) in breadth_first(&builders) {
        let parent = parent.map_or(NONE, |parent| (first + parent) as u32);
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
        if builder.children.is_none() {
            leaf = result.leaves.len() as u32;
            result.leaves.push(Leaf {
                node: index,
                kind,
                center: center.as_vec3(),
                radius: (radius * (1.0 + 1e-6)) as f32,
                area: builder.area as f32,
            });
            if let Source::Cluster { mesh, cluster } = source {
                note_leaf(surfaces, (mesh, cluster), leaf, &mut result.triangles);
            }
        }
        let area = builder.area as f32;
        result.nodes.push(Node { parent, children: [NONE; 2], leaf, area, source });
    }
}

/// Notes which leaf the triangles of a mesh's cluster are in.
fn note_leaf(
    surfaces: &Surfaces,
    (mesh, cluster): (u32, u32),
    leaf: u32,
    triangles: &mut [TriangleReceiver],
) {
    let tree = &surfaces.meshes[mesh as usize].tree;
    let range = tree.nodes[cluster as usize].range.clone();
    for &triangle in &tree.order[range.start as usize..range.end as usize] {
        triangles[triangle as usize] = TriangleReceiver::Leaf(leaf);
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
