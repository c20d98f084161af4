//! The visibility database on the GPU: where a pixel finds its leaf receiver, which lights that leaf sums in which
//! way, and light maps.
//!
//! Each leaf has a list of lights for each batch, in six parts. F lights are in none of them. Near lights are those for whose
//! [rectangle](girandole_core::lights::Rectangle) some of its points may be near.
//!
//! | | in the light map | not in it | near |
//! |---|---|---|---|
//! | N: nothing blocks | 0: nothing left to do | 1: add | 2: add |
//! | P: something may block | 5: look, and subtract where it is blocked | 4: look, and add where it is not | 3: as 4 |

mod leaf;

use self::leaf::{LeafLight, Relation};
use crate::device::mirror::Mirror;
use crate::layout::BufferOffsets;
use crate::maps::places::mover_of;
use crate::records::{LeafRange, LeafRecord, ReceiverGrid};
use crate::scene::light_maps::{LightMapChanges, LightMaps, WantedMaps};
use crate::shader_constants::{BATCH, CLUSTERED, NO_PART, NONE, SIDE};
use crate::{Error, Remedy, Result};
use girandole_core::glam::Vec3;
use girandole_core::lights::{Clamp, LightSet};
use girandole_core::scene::{Geometry, Scene};
use girandole_core::visibility::{LeafId, State, TriangleReceiver, VisibilityDatabase};
use std::ops::Range;

/// A leaf's index has 24 bits.
const MAX_LEAVES: usize = 1 << 24;
/// Room that the lists of leaves on dynamic objects have, where they do not need more: 16 MiB.
const MOVING_ENTRIES: usize = 4 << 20;
const _: () = assert!(LeafRange::WORDS == NO_PART as usize + 1, "where each part begins, and the end");

/// What visibility determination says, on the GPU. Leaves of static objects come first; where only dynamic ones move, their
/// lists stay where they are.
pub(crate) struct Receivers {
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
    /// Offsets in the buffers; those that depend on the picture are missing.
    pub offsets: BufferOffsets,
    /// For each leaf, how many lights are in each part of its lists.
    pub parts: Vec<[u32; NO_PART as usize]>,
    /// For each leaf, how many lights cannot light it at all.
    pub skipped: Vec<u32>,
    /// For each leaf, the units of its light map; 0 where it has none.
    units: Vec<f32>,
    /// How many leaves have a light map.
    pub mapped: u32,
    /// For each leaf, the state of each light.
    pub states: Vec<State>,
    /// For each leaf and light, how they lie to each other.
    relations: Vec<Relation>,
    /// For each leaf and light, the part of the list that it is in, or [`NO_PART`].
    pub kinds: Vec<u8>,
    /// For each leaf, centre and radius of a sphere around it.
    pub bounds: Vec<(Vec3, f32)>,
    /// Lights.
    pub lights: u32,
    /// Leaves in the order in which their points are shaded.
    pub shading_order: Vec<u32>,
    /// Where the lists of each leaf and batch begin; those of a static leaf have room for whatever dynamic objects do.
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
    pub database: &'a VisibilityDatabase,
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
        let batches = lights.div_ceil(BATCH as usize).max(1);
        let receiver_words = receiver_words(&sources);
        let cells_at = receiver_words.len() - tree.cells.len();
        let ranges_at = room * LeafRecord::WORDS;
        // What static leaves hold at most.
        let (mut at, mut lists_at) = (ranges_at + room * batches * LeafRange::WORDS, Vec::new());
        for leaf in 0..still as u32 {
            for lights in sources.database.standing_states(leaf).chunks(BATCH as usize) {
                lists_at.push(at as u32);
                at += lights.iter().filter(|state| **state != State::Full).count();
            }
        }
        let (entries, pairs) = (moving_entries(&sources), (room - still) * lights);
        let list_room = at + entries.max(pairs.min(MOVING_ENTRIES));
        let mut result = Self {
            offsets: BufferOffsets {
                grids_at: tree.triangles.len() as u32,
                cells_at: cells_at as u32,
                leaves: room as u32,
                batches: batches as u32,
                ranges_at: ranges_at as u32,
                ..BufferOffsets::default()
            },
            receivers: Mirror::new(
                device,
                "receivers",
                receiver_words,
                cells_at + with_spare(tree.cells.len()),
            )?,
            light_lists: Mirror::new(device, "lists of lights", Vec::new(), list_room)?,
            order_words: Mirror::new(device, "shading order", Vec::new(), room)?,
            light_maps: LightMaps::new(device, 0)?,
            leaves: 0,
            room: room as u32,
            still: still as u32,
            parts: vec![[0; NO_PART as usize]; room],
            skipped: vec![0; room],
            units: Vec::new(),
            mapped: 0,
            states: Vec::new(),
            relations: Vec::new(),
            kinds: Vec::new(),
            bounds: Vec::new(),
            lights: lights as u32,
            shading_order: Vec::new(),
            lists_at,
            moving_at: at as u32,
        };
        let mut records = Vec::new();
        result.add_leaves(&sources, 0..count, &mut records);
        result.light_maps = LightMaps::new(device, result.mapped + with_spare(count - still) as u32)?;
        result.list_all(0..count, &records);
        result.flush(queue);
        Ok(result)
    }

    /// Takes what visibility determination says after dynamic objects moved, and nothing else. `false` where there is no room
    /// for it: then all is to be made anew.
    pub fn follow(&mut self, queue: &wgpu::Queue, sources: Sources) -> bool {
        let tree = sources.database.receivers();
        let (count, still) = (tree.leaves.len(), self.still as usize);
        let lights = self.lights as usize;
        let receiver_words = receiver_words(&sources);
        let is_same =
            sources.database.first_dynamic_leaf() as usize == still && sources.lights.len() == lights;
        let has_room = count <= self.room as usize
            && receiver_words.len() <= self.receivers.room()
            && self.moving_at as usize + moving_entries(&sources) <= self.light_lists.room();
        if !(is_same && has_room) {
            return false;
        }
        self.receivers.set(0, &receiver_words);
        // Leaves that stand still, where something changed.
        for leaf in 0..still {
            let row = leaf * lights..(leaf + 1) * lights;
            let states = sources.database.leaf_states(leaf as u32);
            if self.states[row.clone()] == *states {
                continue;
            }
            let is_full = |state: &State| *state == State::Full;
            if self.states[row.clone()].iter().map(is_full).ne(states.iter().map(is_full)) {
                self.light_maps.mark(leaf as u32, false);
            }
            self.states[row].copy_from_slice(states);
            self.list(leaf);
        }
        // Those that move.
        self.leaves = self.still;
        self.mapped = self.units[..still].iter().filter(|units| **units != 0.0).count() as u32;
        self.units.truncate(still);
        self.bounds.truncate(still);
        self.relations.truncate(still * lights);
        self.states.truncate(still * lights);
        self.kinds.truncate(still * lights);
        self.lists_at.truncate(still * self.offsets.batches as usize);
        self.parts[still..].fill([0; NO_PART as usize]);
        self.skipped[still..].fill(0);
        let mut records = Vec::new();
        self.add_leaves(&sources, still..count, &mut records);
        if self.mapped > self.light_maps.room {
            return false;
        }
        for leaf in still..count {
            self.light_maps.mark(leaf as u32, true);
        }
        self.list_all(still..count, &records);
        self.flush(queue);
        true
    }

    /// Appends leaves, without lists.
    fn add_leaves(&mut self, sources: &Sources, leaves: Range<usize>, records: &mut Vec<LeafRecord>) {
        let Sources { scene, geometry, lights, database } = *sources;
        for leaf in leaves {
            let light = LeafLight::new((scene, geometry), lights.samples(), database, leaf);
            let place = &database.receivers().leaves[leaf];
            let (LeafId::Patch { object, .. } | LeafId::Cluster { object, .. }) =
                database.leaf_id(leaf as u32);
            let light_map = if light.has_map { self.mapped * SIDE * SIDE } else { NONE };
            records.push(LeafRecord { mover: mover_of(scene, object as usize), ..light.record(light_map) });
            self.mapped += u32::from(light.has_map);
            self.units.push(if light.has_map { light.units } else { 0.0 });
            self.relations.extend(light.relations);
            self.states.extend_from_slice(database.leaf_states(leaf as u32));
            self.bounds.push((place.center, place.radius));
        }
        self.leaves = self.units.len() as u32;
        self.kinds.resize(self.relations.len(), NO_PART as u8);
    }

    /// Writes the records and lists of leaves, those on dynamic objects behind the others', and sorts all.
    fn list_all(&mut self, leaves: Range<usize>, records: &[LeafRecord]) {
        self.light_lists.set(leaves.start * LeafRecord::WORDS, bytemuck::cast_slice(records));
        let lights = self.lights as usize;
        let mut at = self.moving_at;
        for leaf in leaves {
            if leaf >= self.still as usize {
                for states in self.states[leaf * lights..(leaf + 1) * lights].chunks(BATCH as usize) {
                    self.lists_at.push(at);
                    at += states.iter().filter(|state| **state != State::Full).count() as u32;
                }
            }
            self.list(leaf);
        }
        // Leaves with lists of equal length lie side by side: neighbours finish together.
        let states = |leaf: u32| &self.states[leaf as usize * lights..(leaf as usize + 1) * lights];
        let mut order: Vec<u32> = (0..self.leaves).collect();
        order.sort_by_cached_key(|&leaf| states(leaf).iter().filter(|s| **s == State::Partial).count());
        self.shading_order.clone_from(&order);
        order.extend(self.leaves..self.room);
        self.order_words.set(0, &order);
    }

    /// Writes the lists of a leaf by the states of its lights.
    fn list(&mut self, leaf: usize) {
        let (lights, batches) = (self.lights as usize, self.offsets.batches as usize);
        let row = leaf * lights..(leaf + 1) * lights;
        let kinds = &mut self.kinds[row.clone()];
        for ((kind, relation), state) in
            kinds.iter_mut().zip(&self.relations[row.clone()]).zip(&self.states[row])
        {
            *kind = relation.part(*state) as u8;
        }
        let mut counts = [0; NO_PART as usize + 1];
        for (batch, kinds) in kinds.chunks(BATCH as usize).enumerate() {
            let at = self.lists_at[leaf * batches + batch];
            // The parts' first entries, in order, and the end.
            let mut bounds = [at; NO_PART as usize + 1];
            let mut entries = Vec::with_capacity(kinds.len());
            for part in 0..NO_PART as usize {
                let members = (0..).zip(kinds).filter(|(_, kind)| usize::from(**kind) == part);
                entries.extend(members.map(|(light, _)| light));
                bounds[part + 1] = at + entries.len() as u32;
                counts[part] += bounds[part + 1] - bounds[part];
            }
            let range = self.offsets.ranges_at as usize + (leaf * batches + batch) * LeafRange::WORDS;
            self.light_lists.set(range, &bounds);
            self.light_lists.set(at as usize, &entries);
        }
        self.parts[leaf].copy_from_slice(&counts[..NO_PART as usize]);
        self.skipped[leaf] = self.lights - counts.iter().sum::<u32>();
    }

    fn flush(&mut self, queue: &wgpu::Queue) {
        for words in [&mut self.receivers, &mut self.light_lists, &mut self.order_words] {
            words.flush(queue);
        }
    }

    /// What brings light maps up to date, with this bound of the geometric factor.
    pub fn light_map_changes(&self, bound: Clamp) -> LightMapChanges {
        self.light_maps.changes(&self.wanted_maps(), bound)
    }

    /// Takes note that light maps are up to date.
    pub fn advance_light_maps(&mut self, bound: Clamp) {
        let Self { light_maps, lights, kinds, units, .. } = self;
        light_maps.advance(&WantedMaps { lights: *lights as usize, kinds, units }, bound);
    }

    fn wanted_maps(&self) -> WantedMaps<'_> {
        WantedMaps { lights: self.lights as usize, kinds: &self.kinds, units: &self.units }
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

/// Lights in the lists of leaves on dynamic objects.
fn moving_entries(sources: &Sources) -> usize {
    let database = sources.database;
    let leaves = database.first_dynamic_leaf() as usize..database.receivers().leaves.len();
    let states = leaves.flat_map(|leaf| database.leaf_states(leaf as u32));
    states.filter(|state| **state != State::Full).count()
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
