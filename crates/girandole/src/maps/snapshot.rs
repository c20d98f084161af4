//! Where dynamic objects are.

use girandole_core::glam::DAffine3;
use girandole_core::scene::{Geometry, Object, Scene};
use std::sync::Arc;

/// The places of all dynamic objects at a moment.
#[derive(Clone, Debug, Default)]
pub(crate) struct Snapshot {
    /// How many updates came before it.
    pub moment: u64,
    /// World from object, relative to the geometry's origin.
    pub places: Arc<[DAffine3]>,
}

impl Snapshot {
    /// Of a scene as it stands, after so many updates.
    pub fn new(moment: u64, scene: &Scene, geometry: &Geometry) -> Self {
        let world_from_nodes = scene.world_from_nodes();
        let place = |object: &Object| {
            if object.removed || scene.is_deformed(object) {
                return DAffine3::IDENTITY;
            }
            let world_from_object = world_from_nodes[object.node.index()];
            DAffine3 { translation: world_from_object.translation - geometry.origin, ..world_from_object }
        };
        Self { moment, places: scene.objects.iter().filter(|o| o.dynamic).map(place).collect() }
    }
}
