//! What is drawn into shadow maps: all occluders merged in world space, in clusters of a fixed number of triangles
//! (Barczak §4.2.2).

use super::closed::{Corners, cone, is_closed, normal, outward};
use super::map_view::Bounds;
use super::non_blockers::NonBlockers;
use super::occlusion_culling::{ClusterGroups, HidingPolygons};
use crate::parallel::in_order;
use crate::shader_constants::NONE;
use girandole_core::glam::Vec3;
use girandole_core::scene::{Geometry, ObjectId, Scene, WorldPatch};
use std::ops::Range;

/// Triangles in a cluster.
pub(crate) const CLUSTER: u32 = 32;
/// What half a closed object's extent counts for where its triangles are grouped; the directions of two normals at a right angle
/// count √2.
const PLACE_WEIGHT: f32 = 1.0;

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
    /// Whether its surface is closed.
    pub is_closed: bool,
}

/// The occluders of a scene.
#[derive(Default)]
pub(crate) struct Occluders {
    /// Those that block wherever they are.
    pub opaque: Clusters,
    /// Those with an alpha mask.
    pub masked: Clusters,
    /// What may hide static ones, and these of both kinds.
    pub hiding: HidingPolygons,
    pub still: [ClusterGroups; 2],
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
        for (triangle, blocks) in (0..).zip(&mut blocks) {
            *blocks &= !geometry.is_transparent(scene, triangle);
        }
        let is_drawn = |triangle: u32, masked: bool| {
            let material = &scene.materials[geometry.triangles[triangle as usize].material as usize];
            blocks[triangle as usize] && material.alpha_cutoff.is_some() == masked
        };
        let select = |masked: bool| {
            let chosen = (0..geometry.triangles.len() as u32).filter(|&t| is_drawn(t, masked));
            Clusters::new(scene, geometry, chosen.collect(), !masked)
        };
        let hides = |patch: &&WorldPatch| {
            !scene.objects[patch.object as usize].dynamic
                && patch.triangles.clone().all(|t| is_drawn(t, false))
        };
        let sets = [false, true].map(select);
        let still = [0, 1].map(|set| ClusterGroups::new(&sets[set].bounds[..sets[set].first_dynamic()]));
        let [opaque, masked] = sets;
        Self {
            opaque,
            masked,
            still,
            hiding: HidingPolygons::new(geometry.patches.iter().filter(hides)),
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
    /// Groups triangles that lie close together; those of closed objects also by where they face.
    fn new(scene: &Scene, geometry: &Geometry, mut triangles: Vec<u32>, may_be_closed: bool) -> Self {
        // The dynamic object that a triangle belongs to, 0 for static ones.
        let owner = |t: u32| {
            let object = geometry.triangles[t as usize].object;
            if scene.objects[object as usize].dynamic { object + 1 } else { 0 }
        };
        triangles.sort_by_key(|&t| owner(t));
        let mut result = Self::default();
        for part in triangles.chunk_by_mut(|&a, &b| owner(a) == owner(b)) {
            let object = owner(part[0]).checked_sub(1);
            // What bends may turn inside out.
            let is_rigid = |object: u32| !scene.is_deformed(&scene.objects[object as usize]);
            let is_closed = may_be_closed && object.is_some_and(is_rigid) && is_closed(geometry, part);
            // What moves, as its mesh has it: wherever it is, it is in the same clusters, so that maps are the same to the bit.
            let corners = |t: u32| match object {
                Some(object) => corners_in_mesh(scene, geometry, (object, t)),
                None => geometry.corners(t),
            };
            sort_by_place(part, corners, is_closed);
            let first = result.triangles.len() / CLUSTER as usize;
            result.triangles.extend_from_slice(part);
            result.triangles.resize(result.triangles.len().next_multiple_of(CLUSTER as usize), NONE);
            let clusters = first..result.triangles.len() / CLUSTER as usize;
            let all = clusters.clone().map(|cluster| result.bounds_of(geometry, cluster));
            let bounds: Vec<Bounds> = all.collect();
            if let Some(object) = object {
                let about = Bounds::about(bounds.iter());
                result.dynamic.push(DynamicObject {
                    id: ObjectId(object),
                    clusters,
                    bounds: about,
                    is_closed,
                });
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
        let count = self.bounds.len();
        let mut words = vec![[0; 4]; count * (2 + 3 * CLUSTER as usize)];
        let (records, corners) = words.split_at_mut(2 * count);
        let still = 0..self.first_dynamic();
        let parts = std::iter::once((still, None)).chain(
            self.dynamic.iter().enumerate().map(|(index, object)| (object.clusters.clone(), Some(index))),
        );
        for (clusters, object) in parts {
            let [of_clusters, of_corners] = self.words_of(geometry, clusters.clone(), object);
            records[2 * clusters.start..2 * clusters.end].copy_from_slice(&of_clusters);
            let size = 3 * CLUSTER as usize;
            corners[size * clusters.start..size * clusters.end].copy_from_slice(&of_corners);
        }
        words
    }

    /// Those of some clusters, of a dynamic object or of static ones: of the clusters themselves, and of their corners.
    fn words_of(
        &self,
        geometry: &Geometry,
        clusters: Range<usize>,
        object: Option<usize>,
    ) -> [Vec<[u32; 4]>; 2] {
        let is_closed = object.is_some_and(|object| self.dynamic[object].is_closed);
        // Of closed objects, corners turn left as seen from outside.
        let all = || clusters.clone().flat_map(|cluster| self.of_cluster(cluster)).copied();
        let is_outward = !is_closed || outward(all().map(|t| geometry.corners(t)));
        let owner = object.map_or(NONE, |object| object as u32);
        let (mut records, mut corners) = (Vec::new(), Vec::new());
        for cluster in clusters.clone() {
            let turned = |&t: &u32| {
                let [a, b, c] = geometry.corners(t);
                (if is_outward { [a, b, c] } else { [a, c, b] }, t)
            };
            let triangles: Vec<(Corners, u32)> = self.of_cluster(cluster).iter().map(turned).collect();
            let center = self.bounds[cluster].center;
            let radius = triangles.iter().flat_map(|(corners, _)| corners).map(|p| p.distance(center));
            // Rounding is no more than that.
            let radius = radius.fold(0.0, f32::max) * (1.0 + 1e-5);
            records.push(center.extend(radius).to_array().map(f32::to_bits));
            let cone =
                if is_closed { cone(triangles.iter().map(|(corners, _)| corners)) } else { Vec3::ZERO };
            let [x, y, z] = cone.to_array().map(f32::to_bits);
            records.push([x, y, z, owner]);
            let filler = ([triangles[0].0[0]; 3], triangles[0].1);
            for (of_triangle, index) in
                triangles.iter().chain(std::iter::repeat(&filler)).take(CLUSTER as usize)
            {
                for (p, word) in of_triangle.iter().zip([*index, owner, 0]) {
                    let [x, y, z] = p.to_array().map(f32::to_bits);
                    corners.push([x, y, z, word]);
                }
            }
        }
        [records, corners]
    }

    /// What is to be written of objects that moved, and where, in words of four.
    pub fn moved_words(&self, geometry: &Geometry, moved: &[usize]) -> Vec<(usize, Vec<[u32; 4]>)> {
        let of_runs = in_order(moved, |&index| {
            let clusters = self.dynamic[index].clusters.clone();
            let [records, corners] = self.words_of(geometry, clusters.clone(), Some(index));
            let at = 2 * self.bounds.len() + 3 * CLUSTER as usize * clusters.start;
            [(2 * clusters.start, records), (at, corners)]
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

/// Corners of a triangle of an object in its mesh's own space.
fn corners_in_mesh(scene: &Scene, geometry: &Geometry, (object, triangle): (u32, u32)) -> Corners {
    let first = geometry.objects[object as usize].vertices.start;
    let positions = &scene.meshes[scene.objects[object as usize].mesh].positions;
    geometry.triangles[triangle as usize].vertices.map(|vertex| positions[(vertex - first) as usize])
}

/// Orders triangles so that those of a cluster lie close together, and where `facing` counts too, face similar ways.
fn sort_by_place(triangles: &mut [u32], corners: impl Fn(u32) -> Corners, facing: bool) {
    let middle = |t: u32| corners(t).into_iter().sum::<Vec3>() / 3.0;
    let extent = Bounds::around(triangles.iter().map(|&t| middle(t))).half_extent.max_element();
    let scale = if facing { PLACE_WEIGHT / extent.max(f32::MIN_POSITIVE) } else { 1.0 };
    let mut points: Vec<Point> = triangles
        .iter()
        .map(|&t| ([middle(t) * scale, if facing { normal(corners(t)) } else { Vec3::ZERO }], t))
        .collect();
    split(&mut points);
    triangles.iter_mut().zip(&points).for_each(|(triangle, point)| *triangle = point.1);
}

/// A triangle by place and direction.
type Point = ([Vec3; 2], u32);

/// Halves a list of triangles at a multiple of a cluster, across the axis of its largest extent, until the parts are clusters.
fn split(points: &mut [Point]) {
    let clusters = points.len().div_ceil(CLUSTER as usize);
    if clusters < 2 {
        return;
    }
    let extent = |kind: usize| Bounds::around(points.iter().map(|point| point.0[kind])).half_extent;
    let extents = [extent(0), extent(1)];
    let kind = usize::from(extents[1].max_element() > extents[0].max_element());
    let axis = extents[kind].max_position();
    let middle = clusters / 2 * CLUSTER as usize;
    points.select_nth_unstable_by(middle, |a, b| {
        a.0[kind][axis].total_cmp(&b.0[kind][axis]).then(a.1.cmp(&b.1))
    });
    let (low, high) = points.split_at_mut(middle);
    split(low);
    split(high);
}
