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

use crate::device::buffers::storage;
use crate::layout::BufferOffsets;
use crate::records::{LeafRange, LeafRecord, ReceiverGrid};
use crate::scene::surface_ids::is_flat;
use crate::shader_constants::{
    BATCH, CLUSTERED, MAPPED_SHADOWED, MAPPED_UNSHADOWED, NEAR_SHADOWED, NEAR_UNSHADOWED, NO_PART, NONE,
    SHADOWED, SIDE, UNSHADOWED,
};
use crate::{Error, Remedy, Result};
use girandole_core::glam::Vec3;
use girandole_core::image::luminance;
use girandole_core::lights::{Clamp, LightSample, LightSet, Profile};
use girandole_core::scene::{Geometry, Scene};
use girandole_core::visibility::{Leaf, LeafKind, State, TriangleReceiver, VisibilityDatabase};
use wgpu::util::DeviceExt;

/// A leaf's index has 24 bits.
const MAX_LEAVES: usize = 1 << 24;
const _: () = assert!(LeafRange::WORDS == NO_PART as usize + 1, "where each part begins, and the end");
/// Largest error of interpolating a light's contribution in a light map, as a share of what the leaf receives.
const INTERPOLATION_ERROR: f32 = 5e-4;

/// What visibility determination says, on the GPU.
pub(crate) struct Receivers {
    pub receivers: wgpu::Buffer,
    pub light_lists: wgpu::Buffer,
    pub light_maps: wgpu::Buffer,
    pub leaves: u32,
    /// Offsets in the buffers; those that depend on the picture are missing.
    pub offsets: BufferOffsets,
    /// For each leaf, how many lights are in each part of its lists.
    pub parts: Vec<[u32; NO_PART as usize]>,
    /// For each leaf, how many lights cannot light it at all.
    pub skipped: Vec<u32>,
    /// How many leaves have a light map.
    pub mapped: u32,
    /// For each leaf, the state of each light.
    pub states: Vec<State>,
    /// For each leaf and light, the part of the list that it is in, or [`NO_PART`].
    pub kinds: Vec<u8>,
    /// For each leaf, centre and radius of a sphere around it.
    pub bounds: Vec<(Vec3, f32)>,
    /// Lights.
    pub lights: u32,
    /// Leaves in the order in which their points are shaded.
    pub shading_order: Vec<u32>,
    pub shading_order_buffer: wgpu::Buffer,
}

/// Receivers whose light maps, if the frame has any, hold this frame's lights.
#[derive(Clone, Copy)]
pub(crate) struct LightMapsView<'a> {
    pub receivers: &'a Receivers,
    /// Whether they are used.
    pub used: bool,
}

/// A leaf patch in world space.
struct LeafRectangle {
    corner: Vec3,
    across: Vec3,
    up: Vec3,
    normal: Vec3,
}

impl Receivers {
    pub fn new(
        device: &wgpu::Device,
        scene: &Scene,
        geometry: &Geometry,
        lights: &LightSet,
        database: &VisibilityDatabase,
    ) -> Result<Self> {
        let tree = database.receivers();
        let count = tree.leaves.len();
        if count >= MAX_LEAVES {
            return Err(Error::too_large(format!("{count} receivers are too many"), Remedy::Naive));
        }
        // Points are shaded in an order in which leaves with lists of equal length lie side by side: neighbours in it
        // finish together.
        let mut shading_order: Vec<u32> = (0..count as u32).collect();
        shading_order
            .sort_by_key(|&leaf| database.leaf_states(leaf).iter().filter(|s| **s == State::Partial).count());
        // Where pixels find their leaf.
        let mut words: Vec<u32> = Vec::new();
        for receiver in &tree.triangles {
            words.push(match *receiver {
                TriangleReceiver::Grid(grid) => grid,
                TriangleReceiver::Leaf(leaf) => leaf | CLUSTERED,
            });
        }
        let grids_at = words.len() as u32;
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
        let cells_at = words.len() as u32;
        words.extend(&tree.cells);

        // Leaf records, then ranges, then lists.
        let batches = (lights.samples().len() as u32).div_ceil(BATCH).max(1);
        let ranges_at = count * LeafRecord::WORDS;
        let mut lists = vec![0u32; ranges_at + count * batches as usize * LeafRange::WORDS];
        let mut parts = vec![[0; NO_PART as usize]; count];
        let mut skipped = vec![0; count];
        let mut kinds = vec![NO_PART as u8; count * lights.samples().len()];
        let mut all_states = Vec::with_capacity(kinds.len());
        let mut mapped = 0;
        for leaf in 0..count {
            let rectangle = rectangle(geometry, database, leaf);
            let has_map = rectangle.is_some() && is_plain(scene, geometry, database, leaf);
            let light_map = if has_map { mapped * SIDE * SIDE } else { NONE };
            mapped += u32::from(has_map);
            lists[leaf * LeafRecord::WORDS..][..LeafRecord::WORDS]
                .copy_from_slice(bytemuck::cast_slice(&[leaf_record(light_map, rectangle.as_ref())]));
            let states = database.leaf_states(leaf as u32);
            let in_map = in_map(lights.samples(), states, rectangle.as_ref().filter(|_| has_map));
            let kinds = &mut kinds[leaf * lights.len()..][..lights.len()];
            for (index, light) in lights.samples().iter().enumerate() {
                let near = is_near(light, rectangle.as_ref(), &tree.leaves[leaf]);
                kinds[index] = part(states[index], in_map[index], near) as u8;
            }
            for batch in 0..batches {
                let range = ranges_at + (leaf * batches as usize + batch as usize) * LeafRange::WORDS;
                let first = (batch * BATCH) as usize;
                let end = (first + BATCH as usize).min(lights.samples().len());
                let mut bounds = [lists.len() as u32; NO_PART as usize + 1];
                for part in 0..NO_PART {
                    let before = lists.len();
                    let members = (first..end).filter(|light| u32::from(kinds[*light]) == part);
                    lists.extend(members.map(|light| (light - first) as u32));
                    parts[leaf][part as usize] += (lists.len() - before) as u32;
                    bounds[part as usize + 1] = lists.len() as u32;
                }
                // A record of the parts' first entries, in order, and the end.
                lists[range..][..LeafRange::WORDS].copy_from_slice(&bounds);
            }
            all_states.extend_from_slice(states);
            skipped[leaf] = states.iter().filter(|s| **s == State::Full).count() as u32;
        }
        let map_size = u64::from((mapped * SIDE * SIDE).max(16)) * 16;
        if map_size > device.limits().max_storage_buffer_binding_size {
            return Err(Error::too_large(format!("{mapped} light maps are too many"), Remedy::Naive));
        }
        Ok(Self {
            receivers: storage(device, "receivers", &words)?,
            light_lists: storage(device, "lists of lights", &lists)?,
            light_maps: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("light maps"),
                size: map_size,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            }),
            leaves: count as u32,
            offsets: BufferOffsets {
                grids_at,
                cells_at,
                leaves: count as u32,
                batches,
                ranges_at: ranges_at as u32,
                ..BufferOffsets::default()
            },
            parts,
            skipped,
            mapped,
            states: all_states,
            bounds: tree.leaves.iter().map(|leaf| (leaf.center, leaf.radius)).collect(),
            shading_order_buffer: storage(device, "shading order", &shading_order)?,
            shading_order,
            kinds,
            lights: lights.samples().len() as u32,
        })
    }

    /// The offsets that depend on no picture, for baking light maps.
    pub fn offsets_buffer(&self, device: &wgpu::Device) -> wgpu::Buffer {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("buffer offsets"),
            contents: bytemuck::bytes_of(&self.offsets),
            usage: wgpu::BufferUsages::UNIFORM,
        })
    }
}

impl LeafRectangle {
    /// Its point that is nearest to another one.
    fn nearest(&self, point: Vec3) -> Vec3 {
        let along =
            |axis: Vec3| axis * ((point - self.corner).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
        self.corner + along(self.across) + along(self.up)
    }
}

/// The part of its patch's plane that a leaf covers; `None` for clusters.
fn rectangle(geometry: &Geometry, database: &VisibilityDatabase, leaf: usize) -> Option<LeafRectangle> {
    let tree = database.receivers();
    let LeafKind::Patch { grid: grid_index, back, cells: [column, row, end_column, end_row] } =
        tree.leaves[leaf].kind
    else {
        return None;
    };
    let grid = &tree.grids[grid_index as usize];
    let cell = [grid.axis_u, grid.axis_v].map(|axis| axis / axis.length_squared());
    // A lone triangle has no patch and gets no map.
    let normal = geometry.patches.get(grid.patch as usize)?.normal;
    Some(LeafRectangle {
        corner: grid.origin + cell[0] * column as f32 + cell[1] * row as f32,
        across: cell[0] * (end_column - column) as f32,
        up: cell[1] * (end_row - row) as f32,
        normal: if back { -normal } else { normal },
    })
}

fn leaf_record(light_map: u32, rectangle: Option<&LeafRectangle>) -> LeafRecord {
    let Some(r) = rectangle else { return LeafRecord { light_map, ..LeafRecord::default() } };
    let texel = |axis: Vec3| {
        let scaled = axis / axis.length_squared() * (SIDE - 1) as f32;
        scaled.extend(-scaled.dot(r.corner)).to_array()
    };
    LeafRecord {
        light_map,
        texel_u: texel(r.across),
        texel_v: texel(r.up),
        corner: r.corner.to_array(),
        across: r.across.to_array(),
        up: r.up.to_array(),
        normal: r.normal.to_array(),
    }
}

/// The part of a leaf's list that a light is in.
fn part(state: State, in_map: bool, near: bool) -> u32 {
    match (state, in_map, near) {
        (State::Full, ..) => NO_PART,
        (State::Unoccluded, _, true) => NEAR_UNSHADOWED,
        (State::Partial, _, true) => NEAR_SHADOWED,
        (State::Unoccluded, true, false) => MAPPED_UNSHADOWED,
        (State::Unoccluded, false, false) => UNSHADOWED,
        (State::Partial, false, false) => SHADOWED,
        (State::Partial, true, false) => MAPPED_SHADOWED,
    }
}

/// Whether some point of a leaf may be near to what a light stands for.
fn is_near(light: &LightSample, leaf_rectangle: Option<&LeafRectangle>, leaf: &Leaf) -> bool {
    const SLACK: f32 = 1.001;
    light.rectangle.is_some_and(|lit| {
        let distance = match leaf_rectangle {
            Some(leaf) => leaf.nearest(lit.center).distance(lit.center),
            None => leaf.center.distance(lit.center) - leaf.radius,
        };
        distance < SLACK * lit.reach()
    })
}

/// Whether a leaf patch reflects what a light map holds and nothing else: its shading normal is that of its plane,
/// and it has no specular lobe, which depends on where one looks from.
fn is_plain(scene: &Scene, geometry: &Geometry, database: &VisibilityDatabase, leaf: usize) -> bool {
    let tree = database.receivers();
    let LeafKind::Patch { grid, .. } = tree.leaves[leaf].kind else { return false };
    let Some(patch) = geometry.patches.get(tree.grids[grid as usize].patch as usize) else { return false };
    let material = &scene.materials[patch.material as usize];
    is_flat(scene, geometry, patch) && material.specular == 0.0 && material.metallic == 0.0
}

/// Which lights a leaf's light map holds: those whose contribution changes little from texel to texel. The error of
/// bilinear interpolation is about h² / 8 · |G″| in either direction; over a plane at distance z, z² / r⁴ has |G″| ≤
/// 4 / r⁴.
fn in_map(lights: &[LightSample], states: &[State], rectangle: Option<&LeafRectangle>) -> Vec<bool> {
    let Some(r) = rectangle else { return vec![false; lights.len()] };
    let center = r.corner + (r.across + r.up) * 0.5;
    let (u2, v2) = (r.across.length_squared(), r.up.length_squared());
    let spacing2 = u2.max(v2) / ((SIDE - 1) * (SIDE - 1)) as f32;
    let luminance = |l: &LightSample| luminance(l.intensity);
    let received: f32 = lights
        .iter()
        .zip(states)
        .filter(|(_, s)| **s != State::Full)
        .filter_map(|(l, _)| {
            l.geometric_factor(center, r.normal, r.normal, Clamp::Own).map(|(g, _)| g * luminance(l))
        })
        .sum();
    lights
        .iter()
        .map(|light| match light.profile {
            Profile::Directional => true,
            // Its cone has an edge.
            Profile::Spot { .. } => false,
            Profile::Cosine | Profile::Hemisphere => {
                let d = light.position - r.corner;
                let distance2 = (light.position - r.nearest(light.position)).length_squared();
                let height = d.dot(r.normal);
                let error = luminance(light) * height * spacing2 / (distance2 * distance2 * distance2.sqrt());
                error <= INTERPOLATION_ERROR * received
            }
        })
        .collect()
}
