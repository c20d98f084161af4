//! What light maps hold, and what has to be added to them and taken away. Their sums are integers, so that what is added and
//! taken away again leaves nothing behind: after any changes a map is, to the bit, that of a fresh sum.

use crate::gpu_scene::pairs::{Pair, Pairs};
use crate::layout::{Light, LightMapUpdate};
use crate::shader_constants::{ADDS, BATCH, REPLACES, SIDE, TAKES_AWAY};
use crate::{Error, Remedy, Result};
use girandole_core::lights::Clamp;
use std::collections::{BTreeMap, BTreeSet};

const _: () = assert!(BATCH <= 1 << 16, "an index in a batch has 16 bits");
/// Words of a texel's sums: three channels of 64 bits.
const SUM_WORDS: u32 = 6;

/// Light maps on the GPU, and what is in them.
pub(crate) struct LightMaps {
    /// Irradiance, four floats a texel.
    pub maps: wgpu::Buffer,
    /// The same as integers, in the units of each map.
    pub sums: wgpu::Buffer,
    /// The bound of the geometric factor that they were summed with; nothing before the first frame.
    bound: Option<Clamp>,
    /// Lights as they were summed.
    lights: Vec<Light>,
    /// Those that are others by now.
    changed: BTreeSet<usize>,
    /// Leaves whose maps hold others than they should, and whether nothing in them counts.
    stale: BTreeMap<u32, bool>,
}

/// How leaves' maps should be.
pub(crate) struct WantedMaps<'a> {
    /// Their places in the atlas do not matter.
    pub lights: &'a [Light],
    /// Which lights they hold, and are to hold.
    pub pairs: &'a Pairs,
    /// For each leaf, the units of its sums in 1 W/m²; 0 where it has no map.
    pub units: &'a [f32],
}

/// What brings light maps up to date.
#[derive(Default)]
pub(crate) struct LightMapChanges {
    /// For each batch of lights, leaves whose maps lose some; and those whose maps gain some, or are emptied.
    pub updates: Vec<[Vec<LightMapUpdate>; 2]>,
    /// Indices of lights in their batches.
    pub lights: Vec<u16>,
    /// Lights as they were added, if any are taken away.
    pub former: Option<Vec<Light>>,
}

impl LightMaps {
    /// So many, all of them empty.
    ///
    /// # Errors
    /// [`Error::TooLarge`] beyond the device's limits.
    pub fn new(device: &wgpu::Device, room: u32) -> Result<Self> {
        let texels = u64::from((room * SIDE * SIDE).max(16));
        let buffer = |label, words: u32| {
            let size = texels * u64::from(words) * 4;
            if size > device.limits().max_storage_buffer_binding_size {
                return Err(Error::too_large(format!("{room} light maps are too many"), Remedy::Naive));
            }
            Ok(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            }))
        };
        Ok(Self {
            maps: buffer("light maps", 4)?,
            sums: buffer("sums of light maps", SUM_WORDS)?,
            bound: None,
            lights: Vec::new(),
            changed: BTreeSet::new(),
            stale: BTreeMap::new(),
        })
    }

    /// A leaf's map is to hold other lights than it did; `is_void`, where nothing in it counts.
    pub fn mark(&mut self, leaf: usize, is_void: bool) {
        *self.stale.entry(leaf as u32).or_default() |= is_void;
    }

    /// These lights are others than they were.
    pub fn mark_lights(&mut self, lights: &[usize]) {
        self.changed.extend(lights);
    }

    /// What brings all maps to how they should be, with this bound of the geometric factor.
    pub fn changes(&self, wanted: &WantedMaps, bound: Clamp) -> LightMapChanges {
        let mut changes = LightMapChanges::default();
        changes.updates.resize_with(wanted.lights.len().div_ceil(BATCH as usize).max(1), Default::default);
        let every_light: Vec<usize> = (0..wanted.lights.len()).collect();
        let leaves = 0..wanted.units.len() as u32;
        if self.bound != Some(bound) {
            leaves.for_each(|leaf| self.add(wanted, (leaf, true), &every_light, &mut changes));
            return changes;
        }
        // Where the same lights are held as before, those that changed.
        let changed: Vec<usize> = self.changed.iter().copied().collect();
        if !changed.is_empty() {
            let same = leaves.filter(|leaf| !self.stale.contains_key(leaf));
            same.for_each(|leaf| self.add(wanted, (leaf, false), &changed, &mut changes));
        }
        for (&leaf, &is_void) in &self.stale {
            self.add(wanted, (leaf, is_void), &every_light, &mut changes);
        }
        let takes_away = changes.updates.iter().any(|[taken_away, _]| !taken_away.is_empty());
        changes.former = takes_away.then(|| self.lights.clone());
        changes
    }

    /// Adds what changes of these lights, ascending, in a leaf's map.
    fn add(
        &self,
        wanted: &WantedMaps,
        (leaf, all_void): (u32, bool),
        lights: &[usize],
        changes: &mut LightMapChanges,
    ) {
        // A leaf may be gone by now.
        let units = wanted.units.get(leaf as usize).copied().unwrap_or(0.0);
        if units == 0.0 {
            return;
        }
        let pairs = wanted.pairs.row(leaf as usize);
        let LightMapChanges { updates, lights: indices, .. } = changes;
        for (batch, [taken_away, added]) in updates.iter_mut().enumerate() {
            let start = batch * BATCH as usize;
            let [from, to] = [start, start + BATCH as usize].map(|end| lights.partition_point(|&l| l < end));
            let is_held = |light: usize| !all_void && pairs[light].is_held();
            let is_wanted = |light: usize| pairs[light].is_mapped();
            let differs = |light: usize| is_wanted(light) != is_held(light) || self.changed.contains(&light);
            let first = indices.len() as u32;
            let taken = lights[from..to].iter().filter(|light| is_held(**light) && differs(**light));
            indices.extend(taken.map(|light| (light - start) as u16));
            let middle = indices.len() as u32;
            let gained = lights[from..to].iter().filter(|light| is_wanted(**light) && differs(**light));
            indices.extend(gained.map(|light| (light - start) as u16));
            let end = indices.len() as u32;
            if first < middle {
                taken_away.push(LightMapUpdate { leaf, first, end: middle, kind: TAKES_AWAY, units });
            }
            let is_void = all_void && batch == 0;
            if is_void || middle < end {
                let kind = if is_void { REPLACES } else { ADDS };
                added.push(LightMapUpdate { leaf, first: middle, end, kind, units });
            }
        }
    }

    /// Takes note that [`Self::changes`] were made, to the maps of so many leaves.
    pub fn advance(&mut self, lights: &[Light], pairs: &mut Pairs, leaves: usize, bound: Clamp) {
        let all_new = self.bound != Some(bound);
        let stale = std::mem::take(&mut self.stale).into_keys().map(|leaf| leaf as usize);
        let every = 0..if all_new { leaves } else { 0 };
        // A leaf may be gone by now.
        for leaf in every.chain(stale.filter(|leaf| *leaf < leaves)) {
            pairs.row_mut(leaf).iter_mut().for_each(Pair::hold);
        }
        lights.clone_into(&mut self.lights);
        self.changed.clear();
        self.bound = Some(bound);
    }
}

impl LightMapChanges {
    pub fn is_empty(&self) -> bool {
        self.updates.iter().flatten().all(Vec::is_empty)
    }
}
