//! Visibility determination: which lights need no shadow map where (Barczak §4.3.1).
//!
//! For each pair of a receiver (a piece of surface) and a light sample, the [`VisibilityDatabase`] knows one of three
//! [`State`]s. It is conservative: whatever is in doubt is [`State::Partial`]. With visibility traced as the reference
//! does it (points lifted by [`lift_distance`](crate::trace::lift_distance)), a ray between an unoccluded pair is never
//! blocked, and one between a fully occluded pair always is, or the two do not face each other. Left out is the very
//! seam of two surfaces, within 5e-7 of the scene's diagonal, where rounding decides which side a point is on.
//!
//! Receivers form a hierarchy: planar patches are split while that pays, meshes are trees of clusters. A light and a
//! receiver span an occlusion pyramid; what lies outside of it blocks nothing. Where a blocker is found to block
//! nothing, or everything, that holds for all nodes below; where it blocks a part, the children are tested against it.
//!
//! Blockers form a hierarchy as well, down to clusters of meshes. Static ones never leave, so that no list of them is
//! needed, and a *group* stands for its members wherever those cannot change the state: once anything blocks a part,
//! only what may cover the whole receiver is looked at, and the rest is left, closed, to the receiver's children. A
//! group may cover a receiver only if all rays from its corners to the light pass through the group's box, and only
//! if its largest polygon is as wide as the pyramid is there. What that shows is kept: a part of the receiver that has
//! a corner whose ray misses the group, or is still too wide, need not ask again. Dynamic blockers are found each for
//! itself, as far as they can change what static ones leave: not where those cover a receiver, and where they block a
//! part of it, only patches, which might cover it.
//!
//! Patches that face the same way and are near each other form groups too, above the hierarchy of receivers: a light
//! behind all of a group is behind each member, and what does not reach into the group's pyramid reaches into none of
//! theirs.
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

mod blockers;
mod boxes;
mod clusters;
mod database;
mod groups;
mod hierarchy;
mod ids;
mod pyramid;
mod receivers;
mod rows;
mod shapes;
mod surfaces;

pub use blockers::Blocker;
pub use database::{Counts, MOST_LIGHTS, VisibilityDatabase};
pub use ids::LeafId;
pub use pyramid::Tests;
pub use receivers::{Leaf, LeafKind, Node, PatchGrid, Receivers, TriangleReceiver};

/// What is known about the rays between a receiver and a light.
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

/// How receivers are made.
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
    /// Patches whose largest extent is at least this share of the scene's diagonal are receivers and blockers of
    /// their own; all else counts as mesh. Lower: more receivers.
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
            least_extent: 0.02,
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

/// A full or partial blocker of a pair: `light`, and an index into the blockers with the lowest bit set if full.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    light: u32,
    code: u32,
    cover: boxes::Cover,
}

impl Entry {
    fn new(light: u32, blocker: u32, full: bool) -> Self {
        Self { light, code: blocker << 1 | u32::from(full), cover: boxes::Cover::ANY }
    }

    /// That only parts of the receiver face the light.
    fn facing(light: u32) -> Self {
        Self { light, code: u32::MAX << 1, cover: boxes::Cover::ANY }
    }

    fn is_facing(self) -> bool {
        self.code == u32::MAX << 1
    }

    fn blocker(self) -> u32 {
        self.code >> 1
    }

    fn full(self) -> bool {
        self.code & 1 == 1
    }
}

#[cfg(test)]
mod tests;
