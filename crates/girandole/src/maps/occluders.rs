//! What is drawn into shadow maps: all occluders merged in world space, in clusters of a fixed number of triangles;
//! and which cluster goes into which face of which light's map (Barczak §4.2.2).

use super::footprint::{Bounds, MapView, TexelRect};
use super::non_blockers::NonBlockers;
use crate::layout::Item;
use crate::shader_constants::NONE;
use girandole_core::glam::Vec3;
use girandole_core::scene::{Geometry, ObjectId, Scene};
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
    /// The clusters of each dynamic object.
    moving: Vec<(ObjectId, Range<usize>)>,
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
    pub fn new(scene: &Scene, geometry: &Geometry, non_blockers: &NonBlockers) -> Self {
        let mut blocks = vec![true; geometry.triangles.len()];
        for &patch in non_blockers.patches() {
            for triangle in geometry.patches[patch as usize].triangles.clone() {
                blocks[triangle as usize] = false;
            }
        }
        let select = |masked: bool| {
            let chosen = (0..geometry.triangles.len() as u32).filter(|&t| {
                let material = &scene.materials[geometry.triangles[t as usize].material as usize];
                blocks[t as usize] && material.alpha_cutoff.is_some() == masked
            });
            Clusters::new(scene, geometry, chosen.collect())
        };
        Self { opaque: select(false), masked: select(true), left_out: blocks.iter().filter(|b| !**b).count() }
    }

    /// Both kinds.
    pub fn sets(&self) -> [&Clusters; 2] {
        [&self.opaque, &self.masked]
    }

    /// Boxes about a dynamic object's clusters of each kind.
    pub fn of_object(&self, object: ObjectId) -> impl Iterator<Item = Bounds> {
        let sets = self.sets().into_iter();
        sets.filter_map(move |clusters| {
            let bounds = &clusters.bounds[clusters.of_object(object)?];
            let corners = bounds.iter().flat_map(|b| [b.center - b.half_extent, b.center + b.half_extent]);
            Some(Bounds::around(corners))
        })
    }
}

impl Clusters {
    /// Groups triangles that lie close together: by the Morton code of their centroids.
    fn new(scene: &Scene, geometry: &Geometry, mut triangles: Vec<u32>) -> Self {
        let (low, high) = geometry.bounds;
        let scale = 1023.0 / (high - low).max(Vec3::splat(f32::MIN_POSITIVE));
        // The dynamic object that a triangle belongs to, 0 for static ones.
        let mover = |t: u32| {
            let object = geometry.triangles[t as usize].object;
            if scene.objects[object as usize].dynamic { object + 1 } else { 0 }
        };
        triangles.sort_by_cached_key(|&t| {
            let [a, b, c] = geometry.corners(t);
            let cell = (((a + b + c) / 3.0 - low) * scale).as_uvec3();
            (mover(t), spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2, t)
        });
        let mut result = Self::default();
        for part in triangles.chunk_by(|&a, &b| mover(a) == mover(b)) {
            let first = result.triangles.len() / CLUSTER as usize;
            result.triangles.extend(part);
            result.triangles.resize(result.triangles.len().next_multiple_of(CLUSTER as usize), NONE);
            let clusters = first..result.triangles.len() / CLUSTER as usize;
            if let Some(object) = mover(part[0]).checked_sub(1) {
                result.moving.push((ObjectId(object), clusters));
            }
        }
        let all = 0..result.triangles.len() / CLUSTER as usize;
        result.bounds = all.map(|cluster| result.bounds_of(geometry, cluster)).collect();
        result
    }

    fn bounds_of(&self, geometry: &Geometry, cluster: usize) -> Bounds {
        let triangles = &self.triangles[cluster * CLUSTER as usize..][..CLUSTER as usize];
        let triangles = triangles.iter().filter(|t| **t != NONE);
        Bounds::around(triangles.flat_map(|&t| geometry.corners(t)))
    }

    /// The clusters of a dynamic object.
    pub fn of_object(&self, object: ObjectId) -> Option<Range<usize>> {
        let found = self.moving.binary_search_by_key(&object, |(id, _)| *id).ok()?;
        Some(self.moving[found].1.clone())
    }

    /// Brings the boxes about a dynamic object up to where it is.
    pub fn follow(&mut self, geometry: &Geometry, object: ObjectId) {
        for cluster in self.of_object(object).unwrap_or_default() {
            self.bounds[cluster] = self.bounds_of(geometry, cluster);
        }
    }

    /// Corner positions of some clusters for the GPU, three floats each.
    pub fn positions(&self, geometry: &Geometry, clusters: Range<usize>) -> Vec<[f32; 3]> {
        self.corners(clusters, |t| geometry.corners(t).map(|p| p.to_array()))
    }

    /// `value`s of each triangle's corners in some clusters, filled up with their first triangles' first corners.
    pub fn corners<T: Copy>(&self, clusters: Range<usize>, value: impl Fn(u32) -> [T; 3]) -> Vec<T> {
        let of_cluster = |triangles: &[u32]| {
            let filler = [value(triangles[0])[0]; 3];
            let corners = |&t: &u32| if t == NONE { filler } else { value(t) };
            triangles.iter().flat_map(corners).collect::<Vec<T>>()
        };
        let size = CLUSTER as usize;
        self.triangles[clusters.start * size..clusters.end * size].chunks(size).flat_map(of_cluster).collect()
    }

    /// Appends the items of one light: each cluster in each face that its box touches, if it may cover a texel of `part` there.
    pub fn cull(&self, (index, map): (u32, MapView), part: TexelRect, items: &mut Vec<Item>) -> CullCounts {
        let mut counts = CullCounts::default();
        let mut touched = 0u32;
        let is_whole = part == TexelRect::whole(map.size);
        for (cluster, bounds) in self.bounds.iter().enumerate() {
            let faces = map.faces_touched(bounds);
            for face in (0..map.faces()).filter(|face| faces >> face & 1 == 1) {
                if is_whole || map.footprint(face, bounds).meets(&part) {
                    items.push(Item { light: index, face_cluster: face | (cluster as u32) << 3 });
                    counts.clusters_drawn += 1;
                    touched |= 1 << face;
                }
            }
        }
        counts.faces_drawn = u64::from(touched.count_ones());
        counts.faces_culled = u64::from(map.faces()) - counts.faces_drawn;
        counts.clusters_culled = self.bounds.len() as u64 * u64::from(map.faces()) - counts.clusters_drawn;
        counts
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

impl CullCounts {
    /// Triangles that went through the rasteriser, those included that fill up clusters.
    pub fn triangle_instances(&self) -> u64 {
        self.clusters_drawn * u64::from(CLUSTER)
    }
}

impl std::ops::AddAssign for CullCounts {
    fn add_assign(&mut self, other: Self) {
        self.faces_drawn += other.faces_drawn;
        self.faces_culled += other.faces_culled;
        self.clusters_drawn += other.clusters_drawn;
        self.clusters_culled += other.clusters_culled;
    }
}
