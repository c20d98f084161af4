//! Surfaces that cannot block light: everything in the scene and all lights lie on one side of their plane (Barczak §4.2.2), as
//! with the outer walls of a room.

use crate::layout::Light;
use girandole_core::glam::Vec3;
use girandole_core::scene::{Geometry, Scene, WorldPatch};
use std::ops::Range;

/// Patches that stay out of shadow maps.
#[derive(Clone, Debug, Default)]
pub(crate) struct NonBlockers {
    /// Indices of patches, ascending.
    patches: Vec<u32>,
    /// For each patch, whether it stands still with all static vertices in front of it.
    still: Vec<bool>,
    is_wanted: bool,
}

impl NonBlockers {
    /// Those of a scene; none, unless they are `wanted`.
    pub fn new(scene: &Scene, geometry: &Geometry, lights: &[Light], wanted: bool) -> Self {
        let mut result = Self { is_wanted: wanted, ..Self::default() };
        if wanted {
            let still = vertices(scene, geometry, false);
            let stand_in_front = |patch: &WorldPatch| {
                !scene.objects[patch.object as usize].dynamic && are_in_front(geometry, patch, &still)
            };
            result.still = geometry.patches.iter().map(stand_in_front).collect();
            result.patches = result.find(scene, geometry, lights);
        }
        result
    }

    /// Indices of patches, ascending.
    pub fn patches(&self) -> &[u32] {
        &self.patches
    }

    /// Whether they are the same after lights and dynamic objects moved.
    pub fn stay(&self, scene: &Scene, geometry: &Geometry, lights: &[Light]) -> bool {
        !self.is_wanted || self.find(scene, geometry, lights) == self.patches
    }

    fn find(&self, scene: &Scene, geometry: &Geometry, lights: &[Light]) -> Vec<u32> {
        // A directional light comes from outside of the scene: whatever it passes on its way in can block.
        if lights.iter().any(Light::is_parallel) {
            return Vec::new();
        }
        let [still, moving] = [false, true].map(|dynamic| vertices(scene, geometry, dynamic));
        let is_one = |(index, patch): &(usize, &WorldPatch)| {
            let stands = !scene.objects[patch.object as usize].dynamic;
            let before_still =
                if stands { self.still[*index] } else { are_in_front(geometry, patch, &still) };
            before_still
                && lights.iter().all(|l| height(patch, l.position) >= 0.0)
                && are_in_front(geometry, patch, &moving)
        };
        geometry.patches.iter().enumerate().filter(is_one).map(|(index, _)| index as u32).collect()
    }
}

/// The vertices of static objects or of dynamic ones, as ranges.
fn vertices(scene: &Scene, geometry: &Geometry, dynamic: bool) -> Vec<Range<u32>> {
    let objects = scene.objects.iter().zip(&geometry.objects);
    objects.filter(|(object, _)| object.dynamic == dynamic).map(|(_, range)| range.vertices.clone()).collect()
}

fn are_in_front(geometry: &Geometry, patch: &WorldPatch, vertices: &[Range<u32>]) -> bool {
    let tolerance = geometry.detail() * 1e-6;
    let positions = |range: &Range<u32>| &geometry.positions[range.start as usize..range.end as usize];
    vertices.iter().all(|range| positions(range).iter().all(|&p| height(patch, p) >= -tolerance))
}

fn height(patch: &WorldPatch, point: Vec3) -> f32 {
    patch.normal.dot(point - patch.outline[0])
}
