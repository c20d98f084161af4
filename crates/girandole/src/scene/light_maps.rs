//! What light maps hold, and what has to be added to them and taken away. Their sums are integers, so that what is added and
//! taken away again leaves nothing behind: after any changes a map is, to the bit, that of a fresh sum.

use crate::layout::LightMapUpdate;
use crate::shader_constants::{BATCH, MAPPED_SHADOWED, MAPPED_UNSHADOWED, SIDE, TAKEN_AWAY};
use crate::{Error, Remedy, Result};
use girandole_core::lights::Clamp;
use std::collections::BTreeMap;

/// Light maps on the GPU, and what is in them.
pub(crate) struct LightMaps {
    /// Irradiance, four floats a texel.
    pub maps: wgpu::Buffer,
    /// The same as integers, in the units of each map.
    pub sums: wgpu::Buffer,
    /// How many there is room for.
    pub room: u32,
    /// The bound of the geometric factor that they were summed with; nothing before the first frame.
    bound: Option<Clamp>,
    /// For each leaf and light, whether it is in the leaf's map.
    held: Vec<bool>,
    /// Leaves whose maps are not what they should be, and whether nothing in them counts.
    stale: BTreeMap<u32, bool>,
}

/// How leaves' maps should be.
pub(crate) struct WantedMaps<'a> {
    /// How many lights there are.
    pub lights: usize,
    /// For each leaf and light, the part of the list that it is in.
    pub kinds: &'a [u8],
    /// For each leaf, the units of its sums in 1 W/m²; 0 where it has no map.
    pub units: &'a [f32],
}

/// What brings light maps up to date.
#[derive(Default)]
pub(crate) struct LightMapChanges {
    /// For each batch of lights, leaves and what changes in their maps.
    pub updates: Vec<Vec<LightMapUpdate>>,
    /// Indices of lights in their batches, with [`TAKEN_AWAY`].
    pub lights: Vec<u32>,
}

impl LightMaps {
    /// So many, all of them empty.
    ///
    /// # Errors
    /// [`Error::TooLarge`] beyond the device's limits.
    pub fn new(device: &wgpu::Device, room: u32) -> Result<Self> {
        let size = u64::from((room * SIDE * SIDE).max(16)) * 16;
        if size > device.limits().max_storage_buffer_binding_size {
            return Err(Error::too_large(format!("{room} light maps are too many"), Remedy::Naive));
        }
        let buffer = |label| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        };
        let (maps, sums) = (buffer("light maps"), buffer("sums of light maps"));
        Ok(Self { maps, sums, room, bound: None, held: Vec::new(), stale: BTreeMap::new() })
    }

    /// A leaf's map has to be looked at again; `is_void`, where nothing in it counts.
    pub fn mark(&mut self, leaf: u32, is_void: bool) {
        *self.stale.entry(leaf).or_default() |= is_void;
    }

    /// What brings all maps to how they should be, with this bound of the geometric factor.
    pub fn changes(&self, wanted: &WantedMaps, bound: Clamp) -> LightMapChanges {
        let mut changes = LightMapChanges::default();
        changes.updates.resize_with(wanted.lights.div_ceil(BATCH as usize).max(1), Vec::new);
        if self.bound == Some(bound) {
            self.stale.iter().for_each(|(&leaf, &is_void)| self.add(wanted, (leaf, is_void), &mut changes));
        } else {
            let all = 0..wanted.units.len() as u32;
            all.for_each(|leaf| self.add(wanted, (leaf, true), &mut changes));
        }
        changes
    }

    fn add(&self, wanted: &WantedMaps, (leaf, all_void): (u32, bool), changes: &mut LightMapChanges) {
        // A leaf may be gone by now.
        let units = wanted.units.get(leaf as usize).copied().unwrap_or(0.0);
        if units == 0.0 {
            return;
        }
        let row = leaf as usize * wanted.lights..(leaf as usize + 1) * wanted.lights;
        for (batch, updates) in changes.updates.iter_mut().enumerate() {
            let first = changes.lights.len() as u32;
            let start = batch * BATCH as usize;
            let kinds = wanted.kinds[row.clone()].iter().skip(start).take(BATCH as usize);
            for (light, &kind) in kinds.enumerate() {
                let held = !all_void && self.held[row.start + start + light];
                if is_mapped(kind) != held {
                    changes.lights.push(light as u32 | if held { TAKEN_AWAY } else { 0 });
                }
            }
            let end = changes.lights.len() as u32;
            let is_void = all_void && batch == 0;
            if is_void || first < end {
                updates.push(LightMapUpdate { leaf, first, end, is_void: u32::from(is_void), units });
            }
        }
    }

    /// Takes note that [`Self::changes`] were made.
    pub fn advance(&mut self, wanted: &WantedMaps, bound: Clamp) {
        let all_new = self.bound != Some(bound);
        self.held.resize(wanted.kinds.len(), false);
        let stale = std::mem::take(&mut self.stale);
        let every = 0..if all_new { wanted.units.len() } else { 0 };
        for leaf in every.chain(stale.into_keys().map(|leaf| leaf as usize)) {
            let row = leaf * wanted.lights..(leaf + 1) * wanted.lights;
            if let Some(kinds) = wanted.kinds.get(row.clone()) {
                self.held[row].iter_mut().zip(kinds).for_each(|(held, &kind)| *held = is_mapped(kind));
            }
        }
        self.bound = Some(bound);
    }
}

impl LightMapChanges {
    pub fn is_empty(&self) -> bool {
        self.updates.iter().all(Vec::is_empty)
    }
}

fn is_mapped(kind: u8) -> bool {
    matches!(u32::from(kind), MAPPED_UNSHADOWED | MAPPED_SHADOWED)
}
