//! Where to shade: textures and buffers of the picture's size, lists of points, elements of multipass shading.

pub(crate) mod average;
pub(crate) mod lists;
pub(crate) mod multipass_plan;
pub(crate) mod targets;
