//! Visibility determination: which lights need no shadow map where (Barczak §4.3.1).
//!
//! For each pair of a receiver (a piece of surface) and a light sample, the [`VisibilityDatabase`] stores one of three
//! [`State`]s. It is conservative: a pair that the tests do not decide is [`State::Partial`]. With visibility traced as
//! the reference does it (ray origins offset by [`ray_offset_distance`](crate::trace::ray_offset_distance)), a ray between
//! an unoccluded pair is never blocked, and one between a fully occluded pair always is, or the two do not face each
//! other. Left out is the seam of two surfaces, within 5e-7 of the scene's diagonal, where rounding decides which side a
//! point is on.
//!
//! Receivers form a hierarchy: planar patches are split while that reduces the number of partial pairs, meshes are trees
//! of clusters. A light and a receiver span an occlusion pyramid; blockers outside of it are culled. That a blocker blocks
//! nothing, or everything, holds for the whole subtree of the receiver; if it blocks a part, the children are tested
//! against it.
//!
//! Blockers form a bounding volume hierarchy, down to clusters of meshes. Traversal stops at an inner node, a *group*, if
//! its members cannot change the state: once anything blocks a part, only nodes that may hold a full blocker are
//! traversed, and the others are left to the receiver's children. A node may hold a full blocker only if all rays from
//! the receiver's corners to the light pass through its box, and only if its largest polygon is as wide as the pyramid is
//! there. A failed test leaves a hint for the children: those that have a corner whose ray misses the box, or that are
//! still too wide, skip the test.
//!
//! Dynamic blockers are tested after the static ones, and only where they can change the state. Opaque polygons, which might cover
//! a receiver, are traversed as static ones are, in a hierarchy of their own, but for receivers that those cover. All others can only
//! make an unoccluded pair partial. To find which, the shadow of a bounding sphere of each, as a light sees it, is looked up in the
//! hierarchy of receivers, four boxes at a time, unless one static polygon hides it from the light as a whole. Where it reaches a
//! leaf, that is tested: against the sphere alone where both it and the shadow are small; else by the cone about all rays between
//! the light and the leaf, and by the pyramid where the cone does not decide. An inner node is partial if one of its leaves is.
//!
//! Receivers on small dynamic objects start from what static blockers leave of a light to a ball about the object.
//!
//! Patches that face the same way and are near each other form groups too, above the hierarchy of receivers: a light
//! behind all of a group is behind each member, and a blocker outside the group's pyramid is outside of the members'.
//!
//! Each light is determined by itself, whichever others there are. Where lights move, the hierarchy of receivers is held and
//! their states alone are determined anew (`Illumination::update`). Where dynamic objects move, the receivers on those that did
//! are made anew, and what dynamic objects block is determined again. Where static objects or the number of lights change,
//! everything is.
//!
//! ```
//! use girandole_core::lights::{LightSet, LightSettings};
//! use girandole_core::scene::{Geometry, builtin};
//! use girandole_core::visibility::{State, VisibilityDatabase, VisibilitySettings};
//!
//! let scene = builtin::build("table", builtin::MovingObject::None)?;
//! let geometry = Geometry::new(&scene);
//! let lights = LightSet::sample(&scene, &geometry, &LightSettings { count: 20, ..LightSettings::default() })?;
//! let database = VisibilityDatabase::build(&scene, &geometry, &lights, &VisibilitySettings::default())?;
//! // Which lights need a shadow map at the first corner of the first triangle?
//! let leaf = database.receivers().leaf_at(0, geometry.corners(0)[0], true).unwrap();
//! let needed = database.leaf_states(leaf).iter().filter(|&&s| s == State::Partial).count();
//! assert!(needed < 20);
//! # Ok::<(), girandole_core::Error>(())
//! ```

mod assembly;
mod balls;
mod blockers;
mod boxes;
mod build;
mod clusters;
mod cones;
mod cover;
mod database;
mod dynamic;
mod follow;
mod groups;
mod growth;
mod held;
mod hierarchy;
mod ids;
mod joints;
mod light_points;
mod movers;
mod needed;
mod node_visibility;
mod primitives;
mod pyramid;
mod receiver_tree;
mod receivers;
mod seen;
mod shades;
mod shadows;
mod shapes;
mod sources;
mod state_matrix;
mod surfaces;

pub use build::VisibilityBuild;
pub use database::{Counts, MOST_LIGHTS, VisibilityDatabase};
pub use ids::LeafId;
pub use joints::Joint;
pub use pyramid::Tests;
pub use receivers::{Leaf, LeafKind, Node, PatchGrid, Receivers, TriangleReceiver};

/// How the rays between a receiver and a light are occluded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum State {
    /// N: nothing blocks any of them.
    #[default]
    Unoccluded = 0,
    /// P: something may block some of them.
    Partial = 1,
    /// F: all are blocked, or the two do not face each other.
    Full = 2,
}

/// How the hierarchy of receivers is built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisibilitySettings {
    /// A patch is split further while its area times its number of partially occluded lights exceeds the area of all
    /// patches times the number of lights divided by this. Higher: more and smaller leaves, fewer pairs that need a
    /// shadow map, more time.
    pub split: f32,
    /// How often a patch may be halved along each of its two axes, at most 8. Higher: finer leaves.
    pub max_depth: u32,
    /// The share of partially occluded pairs (weighted by area) that a split has to take away, itself or together
    /// with those of the next two levels, 0 to 1. Higher: fewer leaves.
    pub least_gain: f32,
    /// Triangles of a mesh's leaf, at most. Lower: more leaves, more of which face away from a light.
    pub cluster_triangles: u32,
    /// Patches whose largest extent is at least this share of [`Geometry::surface_extent`](crate::scene::Geometry::surface_extent)
    /// are receivers and blockers of their own; all else counts as mesh. Lower: more receivers.
    pub least_extent: f32,
    /// How many patches are receivers of their own, at most: the largest by area.
    pub most_patches: u32,
}

impl Default for VisibilitySettings {
    fn default() -> Self {
        Self {
            split: 3000.0,
            max_depth: 6,
            least_gain: 0.12,
            cluster_triangles: 128,
            least_extent: 0.03,
            most_patches: 4096,
        }
    }
}

impl VisibilitySettings {
    /// No hierarchy: each patch is one receiver.
    pub fn flat() -> Self {
        Self { max_depth: 0, ..Self::default() }
    }
}

#[cfg(test)]
mod tests;
