//! What tells leaves apart, from one hierarchy of receivers to the next.

use super::receivers::{LeafKind, Receivers, Source};
use super::surfaces::Surfaces;
use crate::scene::{Geometry, NONE};

/// Cells that a patch's rectangle is divided into along each axis for its leaves' ids: the finest split there is.
const FINEST: u32 = 256;

/// A leaf's identity: which piece of which object's surface it is. It depends neither on other objects nor on the
/// lights, except that they decide which leaves there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LeafId {
    /// One side of a part of a planar patch.
    Patch {
        /// Index into the scene's objects.
        object: u32,
        /// Which of the object's patches in [`Geometry::patches`]; or, for a large triangle that is part of none, its
        /// number among the object's triangles, counted down from [`NONE`].
        patch: u32,
        /// Whether it is the side against the patch's normal.
        back: bool,
        /// First column and row, and one past the last, in 1/256 of the patch's rectangle.
        cells: [u16; 4],
    },
    /// Some triangles of a mesh.
    Cluster {
        /// Index into the scene's objects.
        object: u32,
        /// Which node of the tree over the object's triangles, the root being 0, parents before children.
        cluster: u32,
    },
    /// All surfaces for which visibility was not determined.
    Undetermined,
}

/// An id for each leaf from `first` on.
pub(super) fn identify(
    geometry: &Geometry,
    surfaces: &Surfaces,
    receivers: &Receivers,
    first: usize,
) -> Vec<LeafId> {
    let cluster_of = |node: u32| match receivers.nodes.get(node as usize).map(|node| &node.source) {
        Some(Source::Cluster { cluster, .. }) => *cluster,
        _ => NONE,
    };
    let identify = |leaf: &super::Leaf| match leaf.kind {
        LeafKind::Patch { grid, back, cells } => {
            let of = &receivers.grids[grid as usize];
            let range = &geometry.objects[of.object as usize];
            let patch = match of.patch {
                NONE => NONE - 1 - (surfaces.patches[grid as usize].triangles.start - range.triangles.start),
                patch => patch - range.patches.start,
            };
            let size = [of.columns, of.rows, of.columns, of.rows];
            let cells = std::array::from_fn(|i| (cells[i] * (FINEST / size[i])) as u16);
            LeafId::Patch { object: of.object, patch, back, cells }
        }
        LeafKind::Cluster { object } => LeafId::Cluster { object, cluster: cluster_of(leaf.node) },
        LeafKind::Undetermined => LeafId::Undetermined,
    };
    receivers.leaves[first..].iter().map(identify).collect()
}
