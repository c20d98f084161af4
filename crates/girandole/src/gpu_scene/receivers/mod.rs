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

use self::leaf::{LeafLight, LeafPlace, is_dark};
use crate::device::mirror::Mirror;
use crate::gpu_scene::geometry::gpu_lights;
use crate::gpu_scene::light_maps::{LightMapChanges, LightMaps, WantedMaps};
use crate::gpu_scene::pairs::{Pair, Pairs, set_states};
use crate::layout::{BufferOffsets, Light};
use crate::parallel::in_order;
use crate::records::{LeafRange, LeafRecord, ReceiverGrid};
use crate::shader_constants::{BATCH, CLUSTERED, NO_PART, NONE};
use crate::{Error, Remedy, Result};
use girandole_core::lights::{Clamp, LightSample, LightSet};
use girandole_core::scene::{Geometry, Scene};
use girandole_core::visibility::{TriangleReceiver, VisibilityDatabase};
use std::sync::Arc;

/// A leaf's index has 24 bits.
const MAX_LEAVES: usize = 1 << 24;
/// Leaves that wait to be put in their places.
const LEAVES_AT_ONCE: usize = 64;
const _: () = assert!(LeafRange::WORDS == NO_PART as usize + 1, "where each part begins, and the end");

/// What visibility determination says, on the GPU. Leaves of static objects come first; while they are the same, only what
/// changes of their lists and light maps is written, whatever moves.
pub(crate) struct Receivers {
    /// What says it; nothing while that is being changed.
    database: Option<Arc<VisibilityDatabase>>,
    receivers: Mirror,
    light_lists: Mirror,
    pub light_maps: LightMaps,
    /// Offsets in the buffers; those that depend on the picture are missing. There is room for so many leaves: beyond those
    /// that there are, they have no points.
    pub offsets: BufferOffsets,
    /// How many leaves are on static objects.
    still: u32,
    leaves: Vec<LeafReceiver>,
    /// For each leaf, the units of its light map; 0 where it has none.
    units: Vec<f32>,
    lights: Lights,
    pub pairs: Pairs,
    pub lists: Lists,
    pub order: ShadingOrder,
}

struct LeafReceiver {
    place: LeafPlace,
    /// What decides about its light map.
    light: LeafLight,
}

struct Lights {
    samples: Vec<LightSample>,
    /// The same, without places in the atlas.
    on_gpu: Vec<Light>,
}

/// Where the lists of leaves and batches lie, and how long they are.
pub(crate) struct Lists {
    /// Where each begins, in entries; those of static leaves have room for whatever dynamic objects do, and for some lights more.
    at: Vec<u32>,
    /// Where those of leaves on dynamic objects begin.
    moving_at: u32,
    /// For each leaf, how many lights are in each part.
    pub parts: Vec<[u32; NO_PART as usize]>,
    /// For each leaf, how many lights cannot light it at all.
    pub skipped: Vec<u32>,
}

/// The order in which leaves' points are shaded.
pub(crate) struct ShadingOrder {
    words: Mirror,
    pub leaves: Vec<u32>,
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
            light_maps: LightMaps::new(device, 0)?,
            still: still as u32,
            leaves: Vec::new(),
            units: Vec::new(),
            lights: Lights {
                samples: sources.lights.samples().to_vec(),
                on_gpu: gpu_lights(sources.lights, sources.geometry.radius()),
            },
            pairs: Pairs::new(lights),
            lists: Lists {
                at: Vec::new(),
                moving_at: 0,
                parts: vec![[0; NO_PART as usize]; room],
                skipped: vec![0; room],
            },
            order: ShadingOrder {
                words: Mirror::new(device, "shading order", Vec::new(), room)?,
                leaves: Vec::new(),
            },
        };
        result.resize(count);
        let leaves: Vec<usize> = (0..count).collect();
        for leaves in leaves.chunks(LEAVES_AT_ONCE) {
            let placed = in_order(leaves, |&leaf| result.placed(&sources, leaf));
            leaves.iter().zip(placed).for_each(|(&leaf, placed)| result.put(leaf, placed));
        }
        result.light_maps = LightMaps::new(device, result.static_maps() + (room - still) as u32)?;
        result.lay_out(device)?;
        result.sort();
        result.flush(queue);
        Ok(result)
    }

    /// Makes room for so many leaves, and forgets others.
    fn resize(&mut self, count: usize) {
        self.leaves.truncate(count);
        self.units.resize(count, 0.0);
        self.pairs.resize(count);
    }

    /// Takes a leaf that was not there, or was another one.
    fn place(&mut self, sources: &Sources, leaf: usize) {
        let placed = self.placed(sources, leaf);
        self.put(leaf, placed);
    }

    /// What such a leaf is, and how lights lie to it.
    fn placed(&self, sources: &Sources, leaf: usize) -> (LeafReceiver, Vec<Pair>) {
        let Sources { scene, geometry, database, .. } = *sources;
        let place = LeafPlace::of((scene, geometry), database, leaf);
        let mut pairs = vec![Pair::default(); self.pairs.lights];
        set_states(&mut pairs, database.leaf_states(leaf as u32), database.standing_states(leaf as u32));
        let light = LeafLight::new(&place, &self.lights.samples, &mut pairs);
        (LeafReceiver { place, light }, pairs)
    }

    fn put(&mut self, leaf: usize, (placed, pairs): (LeafReceiver, Vec<Pair>)) {
        self.pairs.row_mut(leaf).copy_from_slice(&pairs);
        self.units[leaf] = if placed.place.has_map { placed.light.units() } else { 0.0 };
        match self.leaves.get_mut(leaf) {
            Some(before) => *before = placed,
            None => self.leaves.push(placed),
        }
        self.choose_parts(leaf, 0..self.pairs.lights);
    }

    /// Decides in which parts of a leaf's list these lights are. Whether any of them is in another one than before.
    fn choose_parts(&mut self, leaf: usize, chosen: impl IntoIterator<Item = usize>) -> bool {
        let Self { lights, pairs, light_maps, .. } = self;
        let pairs = pairs.row_mut(leaf);
        let (mut differ, mut map_differs) = (false, false);
        for light in chosen {
            let pair = &mut pairs[light];
            let before = *pair;
            // What is dark is in none.
            pair.set_part(match is_dark(&lights.samples[light]) {
                true => NO_PART,
                false => pair.relation().part(pair.state()),
            });
            differ |= before != *pair;
            map_differs |= before.is_mapped() != pair.is_mapped();
        }
        if map_differs {
            light_maps.mark(leaf, false);
        }
        differ
    }

    /// How many leaves there are.
    pub fn leaf_count(&self) -> u32 {
        self.leaves.len() as u32
    }

    /// How many lights there are.
    pub fn light_count(&self) -> u32 {
        self.pairs.lights as u32
    }

    /// How many leaves have a light map.
    pub fn mapped(&self) -> u32 {
        maps_of(&self.leaves)
    }

    /// How many static ones do; all others have room for one.
    fn static_maps(&self) -> u32 {
        maps_of(&self.leaves[..self.still as usize])
    }

    fn flush(&mut self, queue: &wgpu::Queue) {
        for words in [&mut self.receivers, &mut self.light_lists, &mut self.order.words] {
            words.flush(queue);
        }
    }

    /// Holds what says the same, or lets go of it.
    pub fn hold(&mut self, database: Option<&Arc<VisibilityDatabase>>) {
        self.database = database.cloned();
    }

    /// What brings light maps up to date, with this bound of the geometric factor.
    pub fn light_map_changes(&self, bound: Clamp) -> LightMapChanges {
        let wanted = WantedMaps { lights: &self.lights.on_gpu, pairs: &self.pairs, units: &self.units };
        self.light_maps.changes(&wanted, bound)
    }

    /// Takes note that light maps are up to date.
    pub fn advance_light_maps(&mut self, bound: Clamp) {
        let Self { light_maps, lights, pairs, units, .. } = self;
        light_maps.advance(&lights.on_gpu, pairs, units.len(), bound);
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
        &self.order.words.buffer
    }
}

fn maps_of(leaves: &[LeafReceiver]) -> u32 {
    leaves.iter().filter(|leaf| leaf.place.has_map).count() as u32
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
