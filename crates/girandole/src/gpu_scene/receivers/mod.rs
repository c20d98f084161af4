//! The visibility database on the GPU: where a pixel finds its leaf receiver, which lights that leaf sums in which
//! way, and light maps.
//!
//! Each leaf has a list of lights for each batch, in seven parts. F lights and dark ones are in none of them. Near lights are those for whose
//! [rectangle](girandole_core::lights::Rectangle) some of its points may be near.
//!
//! | | in the light map | not in it | near | behind a joint |
//! |---|---|---|---|---|
//! | N: nothing blocks | 0: nothing left to do | 1: add | 2: add | |
//! | P: something may block | 6: look, and subtract where it is blocked | 5: look, and add where it is not | 3: as 5 | 4: as 5, more closely |

mod exact_sum;
mod follow;
mod leaf;
#[cfg(test)]
mod leaf_tests;
mod lists;
mod look_ups;

use self::leaf::{LeafLight, LeafPlace, Relation, is_dark};
use crate::device::mirror::Mirror;
use crate::gpu_scene::geometry::gpu_lights;
use crate::gpu_scene::light_maps::{LightMapChanges, LightMaps, WantedMaps, is_mapped};
use crate::layout::{BufferOffsets, Light};
use crate::records::{LeafRange, LeafRecord, ReceiverGrid};
use crate::shader_constants::{BATCH, CLUSTERED, NO_PART, NONE};
use crate::{Error, Remedy, Result};
use girandole_core::glam::Vec3;
use girandole_core::lights::{Clamp, LightSample, LightSet};
use girandole_core::scene::{Geometry, Scene};
use girandole_core::visibility::{State, TriangleReceiver, VisibilityDatabase};
use std::ops::Range;
use std::sync::Arc;

/// A leaf's index has 24 bits.
const MAX_LEAVES: usize = 1 << 24;
const _: () = assert!(LeafRange::WORDS == NO_PART as usize + 1, "where each part begins, and the end");

/// What visibility determination says, on the GPU. Leaves of static objects come first; while they are the same, only what
/// changes of their lists and light maps is written, whatever moves.
pub(crate) struct Receivers {
    /// What says it; nothing while that is being changed.
    database: Option<Arc<VisibilityDatabase>>,
    receivers: Mirror,
    light_lists: Mirror,
    order_words: Mirror,
    pub light_maps: LightMaps,
    /// How many there are.
    pub leaves: u32,
    /// How many there is room for: the others have no points.
    pub room: u32,
    /// How many of them are on static objects.
    still: u32,
    /// How many light maps static leaves have; all others have room for one.
    static_maps: u32,
    /// Offsets in the buffers; those that depend on the picture are missing.
    pub offsets: BufferOffsets,
    /// For each leaf, how many lights are in each part of its lists.
    pub parts: Vec<[u32; NO_PART as usize]>,
    /// For each leaf, how many lights cannot light it at all.
    pub skipped: Vec<u32>,
    places: Vec<LeafPlace>,
    /// For each leaf, what decides about its light map.
    leaf_lights: Vec<LeafLight>,
    /// For each leaf, the units of its light map; 0 where it has none.
    units: Vec<f32>,
    /// How many leaves have a light map.
    pub mapped: u32,
    /// For each leaf, the state of each light.
    pub states: Vec<State>,
    /// The same, whatever dynamic objects do.
    standing: Vec<State>,
    /// For each leaf and light, how they lie to each other.
    relations: Vec<Relation>,
    /// For each leaf and light, the part of the list that it is in, or [`NO_PART`].
    pub kinds: Vec<u8>,
    /// For each leaf, centre and radius of a sphere around it.
    bounds: Vec<(Vec3, f32)>,
    /// Lights.
    pub lights: u32,
    samples: Vec<LightSample>,
    /// The same, without places in the atlas.
    gpu_lights: Vec<Light>,
    /// Leaves in the order in which their points are shaded.
    pub shading_order: Vec<u32>,
    /// Where the lists of each leaf and batch begin; those of static leaves have room for whatever dynamic objects do, and for
    /// some lights more.
    lists_at: Vec<u32>,
    /// Where those of leaves on dynamic objects begin.
    moving_at: u32,
}

/// Receivers whose light maps, if the frame has any, hold this frame's lights.
#[derive(Clone, Copy)]
pub(crate) struct LightMapsView<'a> {
    pub receivers: &'a Receivers,
    /// Whether they are used.
    pub used: bool,
}

/// What receivers are made of.
#[derive(Clone, Copy)]
pub(crate) struct Sources<'a> {
    pub scene: &'a Scene,
    pub geometry: &'a Geometry,
    pub lights: &'a LightSet,
    pub database: &'a Arc<VisibilityDatabase>,
}

impl Receivers {
    pub fn new((device, queue): (&wgpu::Device, &wgpu::Queue), sources: Sources) -> Result<Self> {
        let tree = sources.database.receivers();
        let (count, still) = (tree.leaves.len(), sources.database.first_dynamic_leaf() as usize);
        if count >= MAX_LEAVES {
            return Err(Error::too_large(format!("{count} receivers are too many"), Remedy::Naive));
        }
        let lights = sources.lights.len();
        // Those of dynamic objects may become more.
        let with_spare = |n: usize| if count > still { 2 * n + 64 } else { n };
        let room = still + with_spare(count - still);
        let receiver_words = receiver_words(&sources);
        let cells_at = receiver_words.len() - tree.cells.len();
        let mut result = Self {
            database: Some(sources.database.clone()),
            offsets: BufferOffsets {
                grids_at: tree.triangles.len() as u32,
                cells_at: cells_at as u32,
                leaves: room as u32,
                batches: lights.div_ceil(BATCH as usize).max(1) as u32,
                ranges_at: (room * LeafRecord::WORDS) as u32,
                ..BufferOffsets::default()
            },
            receivers: Mirror::new(
                device,
                "receivers",
                receiver_words,
                cells_at + with_spare(tree.cells.len()),
            )?,
            light_lists: Mirror::new(device, "lists of lights", Vec::new(), 0)?,
            order_words: Mirror::new(device, "shading order", Vec::new(), room)?,
            light_maps: LightMaps::new(device, 0)?,
            leaves: 0,
            room: room as u32,
            still: still as u32,
            static_maps: 0,
            parts: vec![[0; NO_PART as usize]; room],
            skipped: vec![0; room],
            places: Vec::new(),
            leaf_lights: Vec::new(),
            units: Vec::new(),
            mapped: 0,
            states: Vec::new(),
            standing: Vec::new(),
            relations: Vec::new(),
            kinds: Vec::new(),
            bounds: Vec::new(),
            lights: lights as u32,
            samples: sources.lights.samples().to_vec(),
            gpu_lights: gpu_lights(sources.lights, sources.geometry.radius()),
            shading_order: Vec::new(),
            lists_at: Vec::new(),
            moving_at: 0,
        };
        result.resize(count);
        (0..count).for_each(|leaf| result.place(&sources, leaf));
        result.static_maps = result.places[..still].iter().filter(|place| place.has_map).count() as u32;
        result.light_maps = LightMaps::new(device, result.static_maps + (room - still) as u32)?;
        result.lay_out(device)?;
        result.order();
        result.flush(queue);
        Ok(result)
    }

    /// Makes room for so many leaves, and forgets others.
    fn resize(&mut self, count: usize) {
        let pairs = count * self.lights as usize;
        self.leaves = count as u32;
        self.places.truncate(count);
        self.leaf_lights.resize_with(count, LeafLight::default);
        self.units.resize(count, 0.0);
        self.bounds.resize(count, (Vec3::ZERO, 0.0));
        self.states.resize(pairs, State::Full);
        self.standing.resize(pairs, State::Full);
        self.relations.resize(pairs, Relation::default());
        self.kinds.resize(pairs, NO_PART as u8);
    }

    /// Takes a leaf that was not there, or was another one.
    fn place(&mut self, sources: &Sources, leaf: usize) {
        let Sources { scene, geometry, database, .. } = *sources;
        let place = LeafPlace::of((scene, geometry), database, leaf);
        let row = self.row(leaf);
        self.states[row.clone()].copy_from_slice(database.leaf_states(leaf as u32));
        self.standing[row.clone()].copy_from_slice(database.standing_states(leaf as u32));
        let relations = &mut self.relations[row.clone()];
        let light = LeafLight::new(&place, &self.samples, &self.standing[row], relations);
        self.units[leaf] = if place.has_map { light.units() } else { 0.0 };
        self.bounds[leaf] = place.bounds();
        self.leaf_lights[leaf] = light;
        match self.places.get_mut(leaf) {
            Some(before) => *before = place,
            None => self.places.push(place),
        }
        self.choose_parts(leaf, 0..self.lights as usize);
    }

    /// Decides in which parts of a leaf's list these lights are. Whether any of them is in another one than before.
    fn choose_parts(&mut self, leaf: usize, lights: impl IntoIterator<Item = usize>) -> bool {
        let first = leaf * self.lights as usize;
        let mut differ = false;
        for light in lights {
            let pair = first + light;
            // What is dark is in none.
            let part = match is_dark(&self.samples[light]) {
                true => NO_PART,
                false => self.relations[pair].part(self.states[pair]),
            };
            let before = std::mem::replace(&mut self.kinds[pair], part as u8);
            differ |= before != part as u8;
            if is_mapped(before) != is_mapped(part as u8) {
                self.light_maps.mark(leaf, false);
            }
        }
        differ
    }

    /// The pairs of a leaf.
    fn row(&self, leaf: usize) -> Range<usize> {
        leaf * self.lights as usize..(leaf + 1) * self.lights as usize
    }

    fn flush(&mut self, queue: &wgpu::Queue) {
        for words in [&mut self.receivers, &mut self.light_lists, &mut self.order_words] {
            words.flush(queue);
        }
    }

    /// Holds what says the same, or lets go of it.
    pub fn hold(&mut self, database: Option<&Arc<VisibilityDatabase>>) {
        self.database = database.cloned();
    }

    /// What brings light maps up to date, with this bound of the geometric factor.
    pub fn light_map_changes(&self, bound: Clamp) -> LightMapChanges {
        self.light_maps.changes(&self.wanted_maps(), bound)
    }

    /// Takes note that light maps are up to date.
    pub fn advance_light_maps(&mut self, bound: Clamp) {
        let Self { light_maps, gpu_lights, kinds, units, .. } = self;
        light_maps.advance(&WantedMaps { lights: gpu_lights, kinds, units }, bound);
    }

    fn wanted_maps(&self) -> WantedMaps<'_> {
        WantedMaps { lights: &self.gpu_lights, kinds: &self.kinds, units: &self.units }
    }

    /// Where pixels find their leaf.
    pub fn receivers(&self) -> &wgpu::Buffer {
        &self.receivers.buffer
    }

    /// Leaf records, and lists of lights.
    pub fn light_lists(&self) -> &wgpu::Buffer {
        &self.light_lists.buffer
    }

    /// Leaves in their shading order.
    pub fn shading_order(&self) -> &wgpu::Buffer {
        &self.order_words.buffer
    }
}

/// Where pixels find their leaf: triangles, grids, cells.
fn receiver_words(sources: &Sources) -> Vec<u32> {
    let tree = sources.database.receivers();
    let mut words: Vec<u32> = Vec::new();
    for receiver in &tree.triangles {
        words.push(match *receiver {
            TriangleReceiver::Grid(grid) => grid,
            TriangleReceiver::Leaf(leaf) => leaf | CLUSTERED,
        });
    }
    for grid in &tree.grids {
        words.extend_from_slice(bytemuck::cast_slice(&[ReceiverGrid {
            origin: grid.origin.to_array(),
            columns: grid.columns,
            axis_u: grid.axis_u.to_array(),
            rows: grid.rows,
            axis_v: grid.axis_v.to_array(),
            front: grid.front,
            // The back of a single-sided patch is never seen.
            back: if grid.back == NONE { grid.front } else { grid.back },
        }]));
    }
    words.extend(&tree.cells);
    words
}
