//! What is drawn into shadow maps: all occluders merged in world space, in clusters of a fixed number of triangles
//! (Barczak §4.2.2).

use super::footprint::Bounds;
use super::non_blockers::NonBlockers;
use super::pieces::Piece;
use super::solids::{Corners, Solid, is_closed, normal};
use super::texels::TriangleGroups;
use crate::parallel::each;
use crate::shader_constants::NONE;
use girandole_core::glam::Vec3;
use girandole_core::scene::{Geometry, ObjectId, Scene};
use std::ops::Range;
use std::sync::OnceLock;

/// Triangles in a cluster.
pub(crate) const CLUSTER: u32 = 32;
/// Triangles in a piece of a cluster: what moves is often smaller than a texel, and most of its pieces leave no trace in a map.
pub(crate) const PIECE: u32 = 4;
/// Pieces of a cluster.
pub(super) const PIECES: usize = (CLUSTER / PIECE) as usize;
/// What half a solid's extent counts for where its triangles are grouped; the directions of two normals at a right angle
/// count √2.
const PLACE_WEIGHT: f32 = 1.0;

/// Triangles of one kind, in clusters: those of static objects, then those of each dynamic one.
#[derive(Default)]
pub(crate) struct Clusters {
    /// Indices into the geometry's triangles, cluster by cluster; [`NONE`] where a cluster is not full.
    pub triangles: Vec<u32>,
    /// About each cluster.
    pub bounds: Vec<Bounds>,
    /// Dynamic objects, ascending.
    pub(super) moving: Vec<Mover>,
    /// Whether pieces of the clusters of dynamic objects may be drawn alone.
    pub(super) in_pieces: bool,
}

/// A dynamic object.
pub(super) struct Mover {
    pub object: ObjectId,
    pub clusters: Range<usize>,
    /// About all of it.
    pub bounds: Bounds,
    /// Whether its surface is closed.
    is_solid: bool,
    /// The triangles' corners, cluster by cluster.
    corners: Vec<Corners>,
    /// The triangles where they are small, if texels are drawn of those.
    pub groups: Option<TriangleGroups>,
    /// What is needed where it is not small, from then on until it moves.
    detail: OnceLock<Detail>,
}

/// A dynamic object as clusters.
pub(super) struct Detail {
    /// If it is one.
    pub solid: Option<Solid>,
    /// The pieces of its clusters, if they may be drawn alone.
    pub pieces: Vec<Piece>,
}

impl Mover {
    pub fn detail(&self, in_pieces: bool) -> &Detail {
        self.detail.get_or_init(|| {
            let clusters: Vec<&[Corners]> = self.corners.chunks(CLUSTER as usize).collect();
            let pieces = |cluster: &&[Corners]| {
                let filler = [cluster[0][0]; 3];
                let corners = |i: usize| cluster.get(i).copied().unwrap_or(filler);
                std::array::from_fn(|piece| {
                    Piece::new([0, 1, 2, 3].map(|i| corners(piece * PIECE as usize + i)))
                })
            };
            let all = if in_pieces { &clusters[..] } else { &[] };
            Detail {
                solid: self.is_solid.then(|| Solid::new(&clusters)),
                pieces: all.iter().flat_map(|cluster| -> [Piece; PIECES] { pieces(cluster) }).collect(),
            }
        })
    }
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
    /// Those of a scene; of small dynamic ones, texels are drawn if that is wanted.
    pub fn new(scene: &Scene, geometry: &Geometry, non_blockers: &NonBlockers, texels: bool) -> Self {
        let mut blocks = vec![true; geometry.triangles.len()];
        for &patch in non_blockers.patches() {
            for triangle in geometry.patches[patch as usize].triangles.clone() {
                blocks[triangle as usize] = false;
            }
        }
        for (triangle, blocks) in (0..).zip(&mut blocks) {
            *blocks &= !geometry.is_transparent(scene, triangle);
        }
        let select = |masked: bool| {
            let chosen = (0..geometry.triangles.len() as u32).filter(|&t| {
                let material = &scene.materials[geometry.triangles[t as usize].material as usize];
                blocks[t as usize] && material.alpha_cutoff.is_some() == masked
            });
            Clusters::new(scene, geometry, chosen.collect(), (!masked, texels && !masked))
        };
        Self { opaque: select(false), masked: select(true), left_out: blocks.iter().filter(|b| !**b).count() }
    }

    /// Both kinds.
    pub fn sets(&self) -> [&Clusters; 2] {
        [&self.opaque, &self.masked]
    }

    /// Whether any of them are of dynamic objects.
    pub fn move_at_all(&self) -> bool {
        self.sets().iter().any(|clusters| !clusters.moving.is_empty())
    }

    /// Boxes about a dynamic object's clusters of each kind.
    pub fn of_object(&self, object: ObjectId) -> impl Iterator<Item = Bounds> {
        let sets = self.sets().into_iter();
        sets.filter_map(move |clusters| {
            let bounds = &clusters.bounds[clusters.of_object(object)?];
            Some(Bounds::about(bounds.iter()))
        })
    }
}

impl Clusters {
    /// Groups triangles that lie close together; those of solids also by where they face. Clusters of dynamic objects may be drawn
    /// in pieces, and where these are small, as texels.
    fn new(
        scene: &Scene,
        geometry: &Geometry,
        mut triangles: Vec<u32>,
        (in_pieces, as_texels): (bool, bool),
    ) -> Self {
        // The dynamic object that a triangle belongs to, 0 for static ones.
        let mover = |t: u32| {
            let object = geometry.triangles[t as usize].object;
            if scene.objects[object as usize].dynamic { object + 1 } else { 0 }
        };
        triangles.sort_by_key(|&t| mover(t));
        let mut result = Self { in_pieces, ..Self::default() };
        for part in triangles.chunk_by_mut(|&a, &b| mover(a) == mover(b)) {
            let object = mover(part[0]).checked_sub(1);
            // What bends may turn inside out.
            let is_rigid = |object: u32| !scene.is_deformed(&scene.objects[object as usize]);
            let is_solid = object.is_some_and(is_rigid) && is_closed(geometry, part);
            let grain = if object.is_some() && in_pieces { PIECE } else { CLUSTER };
            // What moves, as its mesh has it: wherever it is, it is in the same clusters, so that maps are the same to the bit.
            let corners = |t: u32| match object {
                Some(object) => corners_in_mesh(scene, geometry, (object, t)),
                None => geometry.corners(t),
            };
            sort_by_place(part, corners, is_solid, [CLUSTER, grain]);
            let first = result.triangles.len() / CLUSTER as usize;
            result.triangles.extend_from_slice(part);
            result.triangles.resize(result.triangles.len().next_multiple_of(CLUSTER as usize), NONE);
            let clusters = first..result.triangles.len() / CLUSTER as usize;
            if let Some(object) = object {
                let corners: Vec<Corners> = part.iter().map(|&t| geometry.corners(t)).collect();
                let groups = as_texels.then(|| {
                    let mut order: Vec<u32> = (0..part.len() as u32).collect();
                    sort_by_place(&mut order, |i| corners[i as usize], false, [PIECE; 2]);
                    TriangleGroups::new(&corners, order)
                });
                result.moving.push(Mover {
                    object: ObjectId(object),
                    clusters,
                    bounds: Bounds::around(corners.as_flattened().iter().copied()),
                    is_solid,
                    corners,
                    groups,
                    detail: OnceLock::new(),
                });
            }
        }
        let all = 0..result.triangles.len() / CLUSTER as usize;
        result.bounds = all.map(|cluster| result.bounds_of(geometry, cluster)).collect();
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
        self.moving.binary_search_by_key(&object, |mover| mover.object).ok()
    }

    /// The clusters of a dynamic object.
    pub fn of_object(&self, object: ObjectId) -> Option<Range<usize>> {
        Some(self.moving[self.find(object)?].clusters.clone())
    }

    /// The first cluster of a dynamic object; those of static ones come before.
    pub fn first_moving(&self) -> usize {
        self.moving.first().map_or(self.bounds.len(), |mover| mover.clusters.start)
    }

    /// Brings what is known of dynamic objects' clusters up to where they are.
    pub fn follow(&mut self, geometry: &Geometry, objects: &[ObjectId]) {
        let mut has_moved = vec![false; self.moving.len()];
        for index in objects.iter().filter_map(|&object| self.find(object)) {
            has_moved[index] = true;
        }
        let Self { triangles, bounds, moving, .. } = self;
        let mut moved: Vec<&mut Mover> = moving
            .iter_mut()
            .zip(has_moved)
            .filter_map(|(mover, has_moved)| has_moved.then_some(mover))
            .collect();
        each(&mut moved, |mover| {
            let triangles = triangles[mover.clusters.start * CLUSTER as usize..].iter();
            mover.corners.iter_mut().zip(triangles).for_each(|(corners, &t)| *corners = geometry.corners(t));
            mover.groups.iter_mut().for_each(|groups| groups.follow(&mover.corners));
            mover.detail.take();
        });
        for mover in moved {
            let bounds = &mut bounds[mover.clusters.clone()];
            for (bounds, corners) in bounds.iter_mut().zip(mover.corners.chunks(CLUSTER as usize)) {
                *bounds = Bounds::around(corners.as_flattened().iter().copied());
            }
            mover.bounds = Bounds::around(mover.corners.as_flattened().iter().copied());
        }
    }

    /// Corner positions of some clusters for the GPU, three floats each.
    pub fn positions(&self, geometry: &Geometry, clusters: Range<usize>) -> Vec<[f32; 3]> {
        self.corners(clusters, |t| geometry.corners(t).map(|p| p.to_array()))
    }

    /// The same of all clusters of dynamic objects, some of which moved, in runs of neighbours; each begins at a cluster.
    pub fn moved_positions(&self, objects: &[ObjectId]) -> Vec<(usize, Vec<Vec3>)> {
        let mut movers: Vec<usize> = objects.iter().filter_map(|&object| self.find(object)).collect();
        movers.sort_unstable();
        movers.dedup();
        let mut runs: Vec<(usize, Vec<Vec3>)> = Vec::new();
        for run in movers.chunk_by(|before, after| before + 1 == *after) {
            let mut corners = Vec::new();
            for mover in run.iter().map(|&index| &self.moving[index]) {
                for cluster in mover.corners.chunks(CLUSTER as usize) {
                    corners.extend_from_slice(cluster.as_flattened());
                    let filled = corners.len().next_multiple_of(3 * CLUSTER as usize);
                    corners.resize(filled, cluster[0][0]);
                }
            }
            runs.push((self.moving[run[0]].clusters.start, corners));
        }
        runs
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
}

/// Corners of a triangle of an object in its mesh's own space.
fn corners_in_mesh(scene: &Scene, geometry: &Geometry, (object, triangle): (u32, u32)) -> Corners {
    let first = geometry.objects[object as usize].vertices.start;
    let positions = &scene.meshes[scene.objects[object as usize].mesh].positions;
    geometry.triangles[triangle as usize].vertices.map(|vertex| positions[(vertex - first) as usize])
}

/// Orders triangles so that those of a cluster, and of the smaller grain, lie close together, and where `facing` counts too, face similar
/// ways.
fn sort_by_place(
    triangles: &mut [u32],
    corners: impl Fn(u32) -> Corners,
    facing: bool,
    [cluster, grain]: [u32; 2],
) {
    let middle = |t: u32| corners(t).into_iter().sum::<Vec3>() / 3.0;
    let extent = Bounds::around(triangles.iter().map(|&t| middle(t))).half_extent.max_element();
    let scale = if facing { PLACE_WEIGHT / extent.max(f32::MIN_POSITIVE) } else { 1.0 };
    let mut points: Vec<Point> = triangles
        .iter()
        .map(|&t| ([middle(t) * scale, if facing { normal(corners(t)) } else { Vec3::ZERO }], t))
        .collect();
    split(&mut points, cluster, grain);
    triangles.iter_mut().zip(&points).for_each(|(triangle, point)| *triangle = point.1);
}

/// A triangle by place and direction.
type Point = ([Vec3; 2], u32);

/// Halves a list of triangles at a multiple of a cluster, across the axis of its largest extent, until the parts are clusters; then in
/// the same way until they are as small as the grain.
fn split(points: &mut [Point], cluster: u32, grain: u32) {
    let clusters = points.len().div_ceil(cluster as usize);
    if clusters < 2 {
        if cluster > grain {
            split(points, grain, grain);
        }
        return;
    }
    let extent = |kind: usize| Bounds::around(points.iter().map(|point| point.0[kind])).half_extent;
    let extents = [extent(0), extent(1)];
    let kind = usize::from(extents[1].max_element() > extents[0].max_element());
    let axis = extents[kind].max_position();
    let middle = clusters / 2 * cluster as usize;
    points.select_nth_unstable_by(middle, |a, b| {
        a.0[kind][axis].total_cmp(&b.0[kind][axis]).then(a.1.cmp(&b.1))
    });
    let (low, high) = points.split_at_mut(middle);
    split(low, cluster, grain);
    split(high, cluster, grain);
}
