//! Where dynamic objects were when each light's map was drawn.
//!
//! A stale map shows an object where it was. What the object's own surface receives is therefore looked up there, too: a
//! point that the map shows, and not one that the object's former self hides. Shadows on what moves lag behind as those of what
//! moves do. Objects that bend are looked up where they are.

use crate::device::buffers::uniform;
use crate::layout::{Light, PreviousTransform};
use crate::maps::cache::{MapCache, MapUpdate};
use crate::maps::snapshot::Snapshot;
use crate::shader_constants::{BATCH, MAX_PREVIOUS_TRANSFORMS, NONE};
use girandole_core::glam::DAffine3;
use girandole_core::scene::Scene;
use std::collections::BTreeMap;

/// Which of the dynamic objects each object is, or [`NONE`].
pub(crate) fn mover_of(scene: &Scene, object: usize) -> u32 {
    if !scene.objects[object].dynamic {
        return NONE;
    }
    scene.objects[..object].iter().filter(|o| o.dynamic).count() as u32
}

/// Where points of an object were.
fn previous_transform(then: &DAffine3, now: &DAffine3) -> PreviousTransform {
    let flat = now.matrix3.determinant() == 0.0;
    let then_from_now = if flat { DAffine3::IDENTITY } else { *then * now.inverse() };
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let row = then_from_now.matrix3.row(axis).extend(then_from_now.translation[axis]);
        row.as_vec4()
    });
    PreviousTransform { x, y, z }
}

/// Where dynamic objects were when stale maps were drawn.
pub(crate) struct PreviousTransforms {
    /// For each light, the first of its places, one for each dynamic object; [`NONE`] where its map is up to date.
    pub rows: Vec<u32>,
    places: Vec<PreviousTransform>,
}

/// The same on the GPU, for a frame.
#[derive(Clone)]
pub(crate) struct GpuPreviousTransforms {
    places: wgpu::Buffer,
    rows: wgpu::Buffer,
}

/// What shaders bind for a batch of lights.
pub(crate) struct PreviousTransformsBinding<'a> {
    pub places: &'a wgpu::Buffer,
    pub rows: wgpu::BufferBinding<'a>,
}

impl GpuPreviousTransforms {
    pub fn new(device: &wgpu::Device, old: &PreviousTransforms) -> Self {
        let mut rows = old.rows.clone();
        rows.resize(rows.len().max(1).next_multiple_of(BATCH as usize), NONE);
        Self {
            places: old.transforms_buffer(device),
            rows: uniform(device, "old rows", bytemuck::cast_slice(&rows)),
        }
    }

    /// For the batch that begins with a light.
    pub fn batch(&self, first: u32) -> PreviousTransformsBinding<'_> {
        let size = size_of::<u32>() as u64;
        let rows = wgpu::BufferBinding {
            buffer: &self.rows,
            offset: u64::from(first) * size,
            size: wgpu::BufferSize::new(u64::from(BATCH) * size),
        };
        PreviousTransformsBinding { places: &self.places, rows }
    }
}

impl PreviousTransforms {
    /// Those of the maps that are stale once these are drawn, with objects where they are `now`; nothing where none is.
    pub fn new(now: &Snapshot, (cache, lights): (&MapCache, &[Light]), drawn: &[MapUpdate]) -> Option<Self> {
        let mut is_stale: Vec<bool> = cache.stale_parts(lights).map(|part| !part.is_empty()).collect();
        drawn.iter().for_each(|update| is_stale[update.light as usize] = false);
        let (mut rows, mut known, mut places) = (vec![NONE; cache.len()], BTreeMap::new(), Vec::new());
        for ((row, then), _) in
            rows.iter_mut().zip(cache.transforms()).zip(is_stale).filter(|(_, stale)| *stale)
        {
            let movers = now.places.len();
            let differs = |then: &&Snapshot| then.moment != now.moment && then.places.len() == movers;
            let Some(then) = then.filter(differs) else { continue };
            let has_room = places.len() + movers <= MAX_PREVIOUS_TRANSFORMS as usize;
            if !known.contains_key(&then.moment) && has_room {
                known.insert(then.moment, places.len() as u32);
                let pairs = then.places.iter().zip(&*now.places);
                places.extend(pairs.map(|(then, now)| previous_transform(then, now)));
            }
            *row = known.get(&then.moment).copied().unwrap_or(NONE);
        }
        (!places.is_empty()).then_some(Self { rows, places })
    }

    /// Of as many lights whose maps are up to date.
    pub fn none(lights: usize) -> Self {
        Self { rows: vec![NONE; lights], places: Vec::new() }
    }

    /// `previous_transforms` for shaders.
    pub fn transforms_buffer(&self, device: &wgpu::Device) -> wgpu::Buffer {
        let mut places = self.places.clone();
        places.resize(MAX_PREVIOUS_TRANSFORMS as usize, PreviousTransform::default());
        uniform(device, "old places", bytemuck::cast_slice(&places))
    }
}
