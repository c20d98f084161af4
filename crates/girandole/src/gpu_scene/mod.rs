//! What lies on the GPU of a scene: geometry, lights, and receivers with their light maps.

pub(crate) mod environment;
pub(crate) mod geometry;
pub(crate) mod light_maps;
pub(crate) mod light_source;
pub(crate) mod lights;
pub(crate) mod pairs;
pub(crate) mod previous_transforms;
pub(crate) mod receivers;
pub(crate) mod surface_ids;
pub(crate) mod transfer;
pub(crate) mod transparent;
