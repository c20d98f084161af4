//! Shadow maps: where each one lies, what is drawn into it, and the textures.

pub(crate) mod atlas;
pub(crate) mod layout;
pub(crate) mod occluders;
