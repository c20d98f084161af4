//! Shadow maps: where each one lies, what is drawn into it, which are stale, and the textures.

pub(crate) mod atlas;
pub(crate) mod bounds;
pub(crate) mod cache;
#[cfg(test)]
mod cache_tests;
pub(crate) mod layout;
pub(crate) mod map_view;
pub(crate) mod moved;
pub(crate) mod non_blockers;
pub(crate) mod occluders;
pub(crate) mod occlusion_culling;
pub(crate) mod snapshot;
