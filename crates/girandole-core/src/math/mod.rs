//! Small pure functions, the ones marked so mirrored in the renderer's `shaders/lib/`.

pub mod octahedral;
pub mod sequence;
pub mod sh;
pub mod warp;
