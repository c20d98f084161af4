//! What lies on the GPU of a scene: geometry, lights, receivers with their light maps, and all of it together.

pub(crate) mod geometry;
pub(crate) mod lights;
pub(crate) mod receivers;
pub(crate) mod resident;
pub(crate) mod surface_ids;
