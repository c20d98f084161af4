//! The hierarchy of receivers, and which leaf a point of a surface belongs to.

use super::State;
use super::clusters::Cluster;
use super::ids::LeafId;
use super::pyramid::{Facing, Pyramid};
use super::shapes::{Apex, Shape};
use super::surfaces::Surfaces;
use crate::scene::NONE;
use glam::{DVec3, Vec3};
use std::ops::Range;

/// A piece of surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// Index of the parent, [`NONE`] for a root.
    pub parent: u32,
    /// Indices of the children, [`NONE`] for a leaf. Children come after their parent.
    pub children: [u32; 2],
    /// Index into [`Receivers::leaves`], [`NONE`] for an inner node.
    pub leaf: u32,
    /// Area, m².
    pub area: f32,
    pub(crate) source: Source,
}

/// Where a node's shape is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Source {
    /// A simple patch, its side, and corners in [`Receivers::corners`].
    Patch { simple: u32, back: bool, corners: Range<u32> },
    /// A mesh and a cluster of its tree.
    Cluster { mesh: u32, cluster: u32 },
}

/// What kind of surface a leaf is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeafKind {
    /// One side of a rectangle of a patch's grid.
    Patch {
        /// Index into [`Receivers::grids`].
        grid: u32,
        /// Whether it is the side against the patch's normal.
        back: bool,
        /// First column and row, and one past the last column and row.
        cells: [u32; 4],
    },
    /// Some triangles of a mesh, from both sides.
    Cluster {
        /// Index into the scene's objects.
        object: u32,
    },
    /// All static surfaces for which visibility was not determined, since no view needs it: each light may be hidden from any of
    /// their points.
    Undetermined,
}

/// A node without children.
#[derive(Clone, Debug, PartialEq)]
pub struct Leaf {
    /// Index into [`Receivers::nodes`]; [`NONE`] for [`LeafKind::Undetermined`].
    pub node: u32,
    /// Patch or mesh.
    pub kind: LeafKind,
    /// Centre of a sphere that holds it.
    pub center: Vec3,
    /// Radius of that sphere, metres.
    pub radius: f32,
    /// Area, m².
    pub area: f32,
}

/// A grid over a patch's bounding rectangle; each cell belongs to one leaf a side.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchGrid {
    /// Index into [`Geometry::patches`](crate::scene::Geometry::patches); [`NONE`] for a large triangle that is part
    /// of none.
    pub patch: u32,
    /// Index into the scene's objects.
    pub object: u32,
    /// Where column and row are 0.
    pub origin: Vec3,
    /// `axis_u · (p − origin)` is the column of a point, 0 to `columns`.
    pub axis_u: Vec3,
    /// `axis_v · (p − origin)` is the row of a point, 0 to `rows`.
    pub axis_v: Vec3,
    /// How many columns, at least 1.
    pub columns: u32,
    /// How many rows, at least 1.
    pub rows: u32,
    /// Where the cells of its front begin in [`Receivers::cells`], row by row.
    pub front: u32,
    /// The same for its back; [`NONE`] if it is single-sided.
    pub back: u32,
}

/// How to find the leaf of a point on a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TriangleReceiver {
    /// By the cell of a grid.
    Grid(u32),
    /// All of the triangle is in this leaf.
    Leaf(u32),
}

/// All receivers of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Receivers {
    /// The hierarchy, parents before children.
    pub nodes: Vec<Node>,
    /// The nodes without children.
    pub leaves: Vec<Leaf>,
    /// One grid for each patch or large triangle that is a receiver of its own.
    pub grids: Vec<PatchGrid>,
    /// Leaves by cell, see [`PatchGrid::front`].
    pub cells: Vec<u32>,
    /// One for each triangle of the geometry.
    pub triangles: Vec<TriangleReceiver>,
    pub(crate) corners: Vec<DVec3>,
    pub(crate) ids: Vec<LeafId>,
}

impl PatchGrid {
    /// The cell (column, row) of a point, the nearest one if it lies outside.
    pub fn cell(&self, position: Vec3) -> [u32; 2] {
        let from = position - self.origin;
        let clamp = |x: f32, count: u32| (x as u32).min(count - 1);
        [clamp(self.axis_u.dot(from), self.columns), clamp(self.axis_v.dot(from), self.rows)]
    }
}

impl Receivers {
    /// The leaf that a point of a triangle is in, seen from the front or the back; `None` for the back of a
    /// single-sided patch, and where there is no such triangle.
    pub fn leaf_at(&self, triangle: u32, position: Vec3, front: bool) -> Option<u32> {
        match *self.triangles.get(triangle as usize)? {
            TriangleReceiver::Leaf(leaf) => Some(leaf),
            TriangleReceiver::Grid(index) => {
                let grid = &self.grids[index as usize];
                let first = if front { grid.front } else { grid.back };
                let [column, row] = grid.cell(position);
                (first != NONE).then(|| self.cells[(first + row * grid.columns + column) as usize])
            }
        }
    }

    /// The leaves' identities, in the order of [`Receivers::leaves`]; no two are equal.
    pub fn ids(&self) -> &[LeafId] {
        &self.ids
    }

    /// Corners of a patch node's polygon, which may be somewhat larger than the surface; empty for meshes.
    pub fn polygon(&self, node: u32) -> Vec<Vec3> {
        self.node_corners(node).iter().map(|c| c.as_vec3()).collect()
    }

    /// The nodes of each root, from a node on.
    pub(crate) fn roots(&self, first: usize) -> Vec<Range<usize>> {
        let mut starts: Vec<usize> =
            (first..self.nodes.len()).filter(|&i| self.nodes[i].parent == NONE).collect();
        starts.push(self.nodes.len());
        starts.windows(2).map(|pair| pair[0]..pair[1]).collect()
    }

    /// The corners of a patch's node; none of a mesh's.
    pub(crate) fn node_corners(&self, node: u32) -> &[DVec3] {
        match &self.nodes[node as usize].source {
            Source::Patch { corners, .. } => self.corners(corners),
            Source::Cluster { .. } => &[],
        }
    }

    fn corners(&self, range: &Range<u32>) -> &[DVec3] {
        &self.corners[range.start as usize..range.end as usize]
    }

    pub(crate) fn shape<'a>(&'a self, surfaces: &'a Surfaces, node: u32) -> Shape<'a> {
        match &self.nodes[node as usize].source {
            Source::Patch { simple, back, corners } => {
                patch_shape(surfaces, *simple, *back, self.corners(corners))
            }
            Source::Cluster { mesh, cluster } => Shape::Cluster(cluster_of(surfaces, *mesh, *cluster)),
        }
    }

    /// Whether one static polygon hides a mesh as a whole from a light, given the state that static blockers leave to its root. Where
    /// that does not face the light, it is full without a blocker.
    pub(crate) fn is_hidden(
        &self,
        surfaces: &Surfaces,
        (root, state): (u32, State),
        apex: &Apex,
        pyramid: &mut Pyramid,
    ) -> bool {
        let shape = self.shape(surfaces, root);
        state == State::Full
            && pyramid.facing(apex, shape, &shape.tolerance(&surfaces.tolerance)) != Facing::None
    }

    /// The object that a node is on.
    pub(crate) fn object(&self, surfaces: &Surfaces, node: u32) -> u32 {
        match self.nodes[node as usize].source {
            Source::Patch { simple, .. } => surfaces.patches[simple as usize].object,
            Source::Cluster { mesh, .. } => surfaces.meshes[mesh as usize].object,
        }
    }

    /// The mesh that a node is part of.
    pub(crate) fn mesh(&self, node: u32) -> Option<u32> {
        match self.nodes[node as usize].source {
            Source::Cluster { mesh, .. } => Some(mesh),
            Source::Patch { .. } => None,
        }
    }
}

/// One side of a patch, or a part of it.
pub(crate) fn patch_shape<'a>(
    surfaces: &Surfaces,
    simple: u32,
    back: bool,
    corners: &'a [DVec3],
) -> Shape<'a> {
    let sign = if back { -1.0 } else { 1.0 };
    Shape::Patch { corners, plane: surfaces.patches[simple as usize].plane.turned(sign) }
}

pub(crate) fn cluster_of(surfaces: &Surfaces, mesh: u32, cluster: u32) -> &Cluster {
    &surfaces.meshes[mesh as usize].tree.nodes[cluster as usize]
}
