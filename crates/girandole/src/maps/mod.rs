//! Shadow maps: where each one lies, what is drawn into it, which are stale, and the textures.

pub(crate) mod atlas;
pub(crate) mod culling;
pub(crate) mod footprint;
pub(crate) mod hidden;
pub(crate) mod layout;
pub(crate) mod moved;
pub(crate) mod non_blockers;
pub(crate) mod occluders;
mod pieces;
pub(crate) mod places;
pub(crate) mod solids;
pub(crate) mod stale;
pub(crate) mod states;
pub(crate) mod still;
pub(crate) mod texels;
