//! What is drawn into shadow maps: all occluders merged in world space, in clusters of a fixed number of triangles
//! (Barczak §4.2.2).

use super::bounds::{Bounds, sort_by_place};
use super::non_blockers::NonBlockers;
use super::occlusion_culling::OcclusionCulling;
use crate::parallel::in_order;
use crate::settings::ShadowMap;
use crate::shader_constants::NONE;
use girandole_core::glam::Vec3;
use girandole_core::scene::{Geometry, ObjectId, Scene, WorldPatch};
use std::ops::Range;

/// Triangles in a cluster.
pub(crate) const CLUSTER: u32 = 32;

/// Triangles of one kind, in clusters: those of static objects, then those of each dynamic one.
#[derive(Default)]
pub(crate) struct Clusters {
    /// Indices into the geometry's triangles, cluster by cluster; [`NONE`] where a cluster is not full.
    pub triangles: Vec<u32>,
    /// About each cluster.
    pub bounds: Vec<Bounds>,
    /// Ascending.
    pub dynamic: Vec<DynamicObject>,
}

/// A dynamic object.
pub(crate) struct DynamicObject {
    pub id: ObjectId,
    pub clusters: Range<usize>,
    /// About all of it.
    pub bounds: Bounds,
}

/// The occluders of a scene.
#[derive(Default)]
pub(crate) struct Occluders {
    /// Those that block wherever they are.
    pub opaque: Clusters,
    /// Those with an alpha mask.
    pub masked: Clusters,
    /// Which static ones are hidden.
    pub culling: OcclusionCulling,
    /// Triangles left out because they cannot block anything.
    pub left_out: usize,
}

impl Occluders {
    pub fn new(scene: &Scene, geometry: &Geometry, non_blockers: &NonBlockers, shape: ShadowMap) -> Self {
        let mut blocks = vec![true; geometry.triangles.len()];
        for &patch in non_blockers.patches() {
            for triangle in geometry.patches[patch as usize].triangles.clone() {
                blocks[triangle as usize] = false;
            }
        }
        for (triangle, blocks) in (0..).zip(&mut blocks) {
            *blocks &= !geometry.is_transparent(scene, triangle);
        }
        let is_drawn = |triangle: u32, masked: bool| {
            let material = &scene.materials[geometry.triangles[triangle as usize].material];
            blocks[triangle as usize] && material.alpha_cutoff.is_some() == masked
        };
        let select = |masked: bool| {
            let chosen = (0..geometry.triangles.len() as u32).filter(|&t| is_drawn(t, masked));
            Clusters::new(scene, geometry, chosen.collect())
        };
        let hides = |patch: &&WorldPatch| {
            // In parabolic maps, edges are not straight.
            shape != ShadowMap::Parabolic
                && !scene.objects[patch.object as usize].dynamic
                && patch.triangles.clone().all(|t| is_drawn(t, false))
        };
        let [opaque, masked] = [false, true].map(select);
        let still = [&opaque, &masked].map(|set| &set.bounds[..set.first_dynamic()]);
        Self {
            culling: OcclusionCulling::new(geometry.patches.iter().filter(hides), still),
            opaque,
            masked,
            left_out: blocks.iter().filter(|b| !**b).count(),
        }
    }

    /// Both kinds.
    pub fn sets(&self) -> [&Clusters; 2] {
        [&self.opaque, &self.masked]
    }

    /// Boxes about a dynamic object's clusters of each kind.
    pub fn of_object(&self, object: ObjectId) -> impl Iterator<Item = Bounds> {
        self.sets()
            .into_iter()
            .filter_map(move |clusters| Some(clusters.dynamic[clusters.find(object)?].bounds))
    }
}

impl Clusters {
    /// Groups triangles that lie close together.
    fn new(scene: &Scene, geometry: &Geometry, mut triangles: Vec<u32>) -> Self {
        // The dynamic object that a triangle belongs to, 0 for static ones.
        let owner = |t: u32| {
            let object = geometry.triangles[t as usize].object;
            if scene.objects[object as usize].dynamic { object + 1 } else { 0 }
        };
        triangles.sort_by_key(|&t| owner(t));
        let mut result = Self::default();
        for part in triangles.chunk_by_mut(|&a, &b| owner(a) == owner(b)) {
            let object = owner(part[0]).checked_sub(1);
            // What moves, as its mesh has it: wherever it is, it is in the same clusters, so that maps are the same to the bit.
            let middle = |t: u32| match object {
                Some(object) => middle_in_mesh(scene, geometry, (object, t)),
                None => geometry.corners(t).into_iter().sum(),
            };
            let mut places: Vec<(Vec3, u32)> = part.iter().map(|&t| (middle(t), t)).collect();
            sort_by_place(&mut places, CLUSTER as usize);
            let first = result.triangles.len() / CLUSTER as usize;
            result.triangles.extend(places.iter().map(|place| place.1));
            result.triangles.resize(result.triangles.len().next_multiple_of(CLUSTER as usize), NONE);
            let clusters = first..result.triangles.len() / CLUSTER as usize;
            let all = clusters.clone().map(|cluster| result.bounds_of(geometry, cluster));
            let bounds: Vec<Bounds> = all.collect();
            if let Some(object) = object {
                let about = Bounds::about(bounds.iter());
                result.dynamic.push(DynamicObject { id: ObjectId(object), clusters, bounds: about });
            }
            result.bounds.extend(bounds);
        }
        result
    }

    /// The triangles of a cluster.
    pub fn of_cluster(&self, cluster: usize) -> &[u32] {
        let triangles = &self.triangles[cluster * CLUSTER as usize..][..CLUSTER as usize];
        &triangles[..triangles.partition_point(|t| *t != NONE)]
    }

    fn bounds_of(&self, geometry: &Geometry, cluster: usize) -> Bounds {
        Bounds::around(self.of_cluster(cluster).iter().flat_map(|&t| geometry.corners(t)))
    }

    fn find(&self, object: ObjectId) -> Option<usize> {
        self.dynamic.binary_search_by_key(&object, |dynamic| dynamic.id).ok()
    }

    /// The first cluster of a dynamic object; those of static ones come before.
    pub fn first_dynamic(&self) -> usize {
        self.dynamic.first().map_or(self.bounds.len(), |object| object.clusters.start)
    }

    /// Brings what is known of dynamic objects' clusters up to where they are. Returns which moved, as indices in `dynamic`.
    pub fn follow(&mut self, geometry: &Geometry, objects: &[ObjectId]) -> Vec<usize> {
        let mut moved: Vec<usize> = objects.iter().filter_map(|&object| self.find(object)).collect();
        moved.sort_unstable();
        moved.dedup();
        let bounds = in_order(&moved, |&index| {
            let clusters = self.dynamic[index].clusters.clone();
            clusters.map(|cluster| self.bounds_of(geometry, cluster)).collect::<Vec<_>>()
        });
        for (&index, bounds) in moved.iter().zip(bounds) {
            let object = &mut self.dynamic[index];
            object.bounds = Bounds::about(bounds.iter());
            self.bounds[object.clusters.clone()].copy_from_slice(&bounds);
        }
        moved
    }

    /// The words that shaders bind as `occluders`, see `lib/map_set_up.wgsl`.
    pub fn words(&self, geometry: &Geometry) -> Vec<[u32; 4]> {
        let [mut spheres, corners] = self.words_of(geometry, 0..self.bounds.len());
        spheres.extend(corners);
        spheres
    }

    /// Those of some clusters: of the clusters themselves, and of their corners.
    fn words_of(&self, geometry: &Geometry, clusters: Range<usize>) -> [Vec<[u32; 4]>; 2] {
        let (mut spheres, mut corners) = (Vec::new(), Vec::new());
        for cluster in clusters {
            let triangles = self.of_cluster(cluster);
            let center = self.bounds[cluster].center;
            let radius = triangles.iter().flat_map(|&t| geometry.corners(t)).map(|p| p.distance(center));
            // Rounding is no more than that.
            let radius = radius.fold(0.0, f32::max) * (1.0 + 1e-5);
            spheres.push(center.extend(radius).to_array().map(f32::to_bits));
            for &triangle in triangles {
                corners.extend(geometry.corners(triangle).map(|p| {
                    let [x, y, z] = p.to_array().map(f32::to_bits);
                    [x, y, z, triangle]
                }));
            }
            if let Some(&filler) = corners.last() {
                corners.resize(corners.len().next_multiple_of(3 * CLUSTER as usize), filler);
            }
        }
        [spheres, corners]
    }

    /// What is to be written of objects that moved, and where, in words of four.
    pub fn moved_words(&self, geometry: &Geometry, moved: &[usize]) -> Vec<(usize, Vec<[u32; 4]>)> {
        let of_runs = in_order(moved, |&index| {
            let clusters = self.dynamic[index].clusters.clone();
            let [spheres, corners] = self.words_of(geometry, clusters.clone());
            let at = self.bounds.len() + 3 * CLUSTER as usize * clusters.start;
            [(clusters.start, spheres), (at, corners)]
        });
        // Neighbours in one.
        let mut runs: Vec<(usize, Vec<[u32; 4]>)> = Vec::new();
        for kind in 0..2 {
            for (at, words) in of_runs.iter().map(|of_run| &of_run[kind]) {
                match runs.last_mut() {
                    Some((first, before)) if *first + before.len() == *at => before.extend_from_slice(words),
                    _ => runs.push((*at, words.clone())),
                }
            }
        }
        runs
    }
}

/// Three times the middle of a triangle of an object in its mesh's own space.
fn middle_in_mesh(scene: &Scene, geometry: &Geometry, (object, triangle): (u32, u32)) -> Vec3 {
    let first = geometry.objects[object as usize].vertices.start;
    let positions = &scene.meshes[scene.objects[object as usize].mesh].positions;
    geometry.triangles[triangle as usize]
        .vertices
        .iter()
        .map(|vertex| positions[(vertex - first) as usize])
        .sum()
}
