//! What is drawn into shadow maps: all occluders merged in world space, in clusters of a fixed number of triangles;
//! and which cluster goes into which face of which light's map (Barczak §4.2.2).

use crate::layout::{Item, Light};
use crate::shader_constants::DIRECTIONAL;
use girandole_core::glam::Vec3;
use girandole_core::scene::{Geometry, Scene};

/// Triangles in a cluster.
pub(crate) const CLUSTER: u32 = 32;

/// Triangles of one kind, in clusters; the last one is filled up with degenerate triangles.
#[derive(Default)]
pub(crate) struct Clusters {
    /// Indices into the geometry's triangles, cluster by cluster.
    pub triangles: Vec<u32>,
    /// Centre and half-extent of each cluster's box.
    pub bounds: Vec<(Vec3, Vec3)>,
}

/// The occluders of a scene.
#[derive(Default)]
pub(crate) struct Occluders {
    /// Those that block wherever they are.
    pub opaque: Clusters,
    /// Those with an alpha mask.
    pub masked: Clusters,
    /// Triangles left out because they cannot block anything.
    pub left_out: usize,
}

impl Occluders {
    pub fn new(scene: &Scene, geometry: &Geometry, lights: &[Light], skip_non_blockers: bool) -> Self {
        let mut blocks = vec![true; geometry.triangles.len()];
        if skip_non_blockers {
            for patch in &geometry.patches {
                if is_non_blocker(geometry, patch.outline[0], patch.normal, lights) {
                    for triangle in patch.triangles.clone() {
                        blocks[triangle as usize] = false;
                    }
                }
            }
        }
        let select = |masked: bool| {
            let chosen = (0..geometry.triangles.len() as u32).filter(|&t| {
                let material = &scene.materials[geometry.triangles[t as usize].material as usize];
                blocks[t as usize] && material.alpha_cutoff.is_some() == masked
            });
            Clusters::new(geometry, chosen.collect())
        };
        Self { opaque: select(false), masked: select(true), left_out: blocks.iter().filter(|b| !**b).count() }
    }
}

/// Whether everything in the scene and all lights lie on one side of a plane: then nothing on it can come between
/// two of them (the outer walls of a room).
fn is_non_blocker(geometry: &Geometry, point: Vec3, normal: Vec3, lights: &[Light]) -> bool {
    let tolerance = geometry.diagonal() * 1e-6;
    let height = |p: Vec3| normal.dot(p - point);
    let lights_in_front = lights.iter().all(|l| l.profile == DIRECTIONAL || height(l.position) >= 0.0);
    let all_in_front = geometry.positions.iter().all(|&p| height(p) >= -tolerance);
    // A directional light comes from outside of the scene: whatever it passes on its way in can block.
    let sun = lights.iter().any(|l| l.profile == DIRECTIONAL);
    lights_in_front && all_in_front && !sun
}

impl Clusters {
    /// Groups triangles that lie close together: by the Morton code of their centroids.
    fn new(geometry: &Geometry, mut triangles: Vec<u32>) -> Self {
        let (low, high) = geometry.bounds;
        let scale = 1023.0 / (high - low).max(Vec3::splat(f32::MIN_POSITIVE));
        triangles.sort_by_cached_key(|&t| {
            let [a, b, c] = geometry.corners(t);
            let cell = (((a + b + c) / 3.0 - low) * scale).as_uvec3();
            (spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2, t)
        });
        let bounds = triangles
            .chunks(CLUSTER as usize)
            .map(|chunk| {
                let corners = || chunk.iter().flat_map(|&t| geometry.corners(t));
                let low = corners().fold(Vec3::INFINITY, Vec3::min);
                let high = corners().fold(Vec3::NEG_INFINITY, Vec3::max);
                ((low + high) * 0.5, (high - low) * 0.5)
            })
            .collect();
        Self { triangles, bounds }
    }

    /// Corner positions for the GPU, three floats each, clusters filled up.
    pub fn positions(&self, geometry: &Geometry) -> Vec<f32> {
        self.corners(|t| geometry.corners(t).map(|p| p.to_array())).into_iter().flatten().collect()
    }

    /// `value`s of each triangle's corners, the last cluster filled up with the last triangle's first corner.
    pub fn corners<T: Copy>(&self, value: impl Fn(u32) -> [T; 3]) -> Vec<T> {
        let mut all: Vec<T> = self.triangles.iter().flat_map(|&t| value(t)).collect();
        if let Some(&last) = all.last() {
            all.resize(self.bounds.len() * CLUSTER as usize * 3, last);
        }
        all
    }
}

/// Ten bits, two zeros between each.
fn spread(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00ff;
    let x = (x | x << 8) & 0x0300_f00f;
    let x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

/// How much was drawn and how much was not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CullCounts {
    /// Faces of maps with an occluder in them.
    pub faces_drawn: u64,
    /// Faces without.
    pub faces_culled: u64,
    /// Pairs of a face and a cluster that were drawn.
    pub clusters_drawn: u64,
    /// Pairs that were not.
    pub clusters_culled: u64,
}

impl std::ops::AddAssign for CullCounts {
    fn add_assign(&mut self, other: Self) {
        self.faces_drawn += other.faces_drawn;
        self.faces_culled += other.faces_culled;
        self.clusters_drawn += other.clusters_drawn;
        self.clusters_culled += other.clusters_culled;
    }
}

/// Appends the items of one light: each cluster in each of `faces` faces that its box touches.
pub(crate) fn cull(
    (index, light): (u32, &Light),
    map_size: f32,
    faces: u32,
    clusters: &Clusters,
    items: &mut Vec<Item>,
) -> CullCounts {
    let bitangent = light.normal.cross(light.tangent);
    let mut counts = CullCounts::default();
    let faces = if light.profile == DIRECTIONAL { 1 } else { faces };
    let mut touched = 0u32;
    for (cluster, &(centre, extent)) in clusters.bounds.iter().enumerate() {
        let d = centre - light.position;
        // Range of each light-space coordinate over the box; faces overlap by up to a texel at their seams.
        let overlap = (d.length() + extent.length()) * 2.0 / map_size;
        let range = |axis: Vec3| (axis.dot(d), axis.abs().dot(extent) + overlap);
        let [x, y, z] = [light.tangent, bitangent, light.normal].map(range);
        if light.profile != DIRECTIONAL && z.0 + z.1 < 0.0 {
            continue;
        }
        for face in 0..faces {
            let side = |bit: u32| if face & bit == 0 { -1.0 } else { 1.0 };
            let inside = match faces {
                4 => side(1) * x.0 + x.1 >= 0.0 && side(2) * y.0 + y.1 >= 0.0,
                5 => match face {
                    0 | 1 => side(1) * x.0 + x.1 >= 0.0,
                    2 | 3 => side(1) * y.0 + y.1 >= 0.0,
                    _ => true,
                },
                _ => true,
            };
            if inside {
                items.push(Item { light: index, face_cluster: face | (cluster as u32) << 3 });
                counts.clusters_drawn += 1;
                touched |= 1 << face;
            }
        }
    }
    counts.faces_drawn = u64::from(touched.count_ones());
    counts.faces_culled = u64::from(faces) - counts.faces_drawn;
    counts.clusters_culled = clusters.bounds.len() as u64 * u64::from(faces) - counts.clusters_drawn;
    counts
}
