//! What is drawn into shadow maps: all occluders merged in world space, in clusters of a fixed number of triangles;
//! and which cluster goes into which face of which light's map (Barczak §4.2.2).

use super::footprint::{Bounds, MapView, TexelRect};
use super::non_blockers::NonBlockers;
use super::pieces::Piece;
use super::solids::{Corners, Solid, is_closed, normal};
use super::texels::{Centers, TriangleGroups};
use crate::layout::{Item, MapTexel};
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
const PIECES: usize = (CLUSTER / PIECE) as usize;
/// Texels of a box about a cluster above which its pieces are not looked at by themselves: most of them cover one.
const IN_PIECES: f32 = 64.0;
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
    moving: Vec<Mover>,
    /// Whether pieces of the clusters of dynamic objects may be drawn alone.
    in_pieces: bool,
}

/// A dynamic object.
struct Mover {
    object: ObjectId,
    clusters: Range<usize>,
    /// About all of it.
    bounds: Bounds,
    /// Whether its surface is closed.
    is_solid: bool,
    /// The triangles' corners, cluster by cluster.
    corners: Vec<Corners>,
    /// The triangles where they are small, if texels are drawn of those.
    groups: Option<TriangleGroups>,
    /// What is needed where it is not small, from then on until it moves.
    detail: OnceLock<Detail>,
}

/// A dynamic object as clusters.
struct Detail {
    /// If it is one.
    solid: Option<Solid>,
    /// The pieces of its clusters, if they may be drawn alone.
    pieces: Vec<Piece>,
}

impl Mover {
    fn detail(&self, in_pieces: bool) -> &Detail {
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
            sort_by_place(part, |t| geometry.corners(t), is_solid, [CLUSTER, grain]);
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
            mover.bounds = Bounds::about(bounds.iter());
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

    /// Appends the items of one light: each cluster in each face that its box touches, if it may cover a texel of `part` there; of
    /// what moves and is small there, only the pieces that may cover a texel, and of a mover that is small as a whole the texels.
    /// What a solid hides by itself is left out, and dynamic objects that something static hides from the light.
    pub fn cull(
        &self,
        (index, map): (u32, MapView),
        part: TexelRect,
        is_hidden: impl Fn(ObjectId) -> bool,
        items: &mut Items,
    ) -> CullCounts {
        let mut culling =
            Culling { light: index, map, part, items, touched: 0, counts: CullCounts::default() };
        (0..self.first_moving())
            .for_each(|cluster| culling.add((cluster, &self.bounds[cluster]), u32::MAX, &[]));
        for mover in self.moving.iter().filter(|mover| !is_hidden(mover.object)) {
            let faces = culling.add_texels(mover);
            if faces == 0 {
                continue;
            }
            let Detail { solid, pieces } = mover.detail(self.in_pieces);
            let turned_away = solid.as_ref().and_then(|solid| solid.hidden_from(&map));
            for (index, cluster) in mover.clusters.clone().enumerate() {
                if turned_away.as_ref().is_none_or(|is_hidden| !is_hidden(index)) {
                    let pieces = pieces.get(index * PIECES..(index + 1) * PIECES).unwrap_or_default();
                    culling.add((cluster, &self.bounds[cluster]), faces, pieces);
                }
            }
        }
        let Culling { mut counts, touched, .. } = culling;
        counts.faces_drawn = u64::from(touched.count_ones());
        counts.faces_culled = u64::from(map.faces()) - counts.faces_drawn;
        counts.clusters_culled = self.bounds.len() as u64 * u64::from(map.faces()) - counts.clusters_drawn;
        counts
    }
}

/// What is drawn: faces of maps with clusters, and with pieces of clusters; and texels.
#[derive(Default)]
pub(crate) struct Items {
    pub clusters: Vec<Item>,
    pub pieces: Vec<Item>,
    pub texels: Vec<MapTexel>,
}

impl Items {
    /// Appends others.
    pub fn append(&mut self, mut others: Self) {
        self.clusters.append(&mut others.clusters);
        self.pieces.append(&mut others.pieces);
        self.texels.append(&mut others.texels);
    }
}

/// What is found of a part of a light's map.
struct Culling<'a> {
    light: u32,
    map: MapView<'a>,
    part: TexelRect,
    items: &'a mut Items,
    /// Faces in which something is drawn, a bit each.
    touched: u32,
    counts: CullCounts,
}

impl Culling<'_> {
    /// A cluster in those of the faces that it touches; its pieces, if they may be drawn alone.
    fn add(&mut self, (cluster, bounds): (usize, &Bounds), faces: u32, pieces: &[Piece]) {
        let Self { light, map, part, ref mut items, .. } = *self;
        let item = |face: u32, of: usize| Item { light, face_cluster: face | (of as u32) << 3 };
        let faces = faces & map.faces_touched(bounds);
        for face in bits(faces) {
            let Some(extent) = map.extent_drawn(face, bounds, part) else { continue };
            let in_pieces = !pieces.is_empty() && extent.texels() <= IN_PIECES;
            if let Some(view) = map.face(face).filter(|_| in_pieces) {
                let before = items.pieces.len();
                let drawn = pieces.iter().map(|piece| piece.drawn(&view));
                let drawn = (0..).zip(drawn).filter(|(_, drawn)| *drawn != 0);
                items.pieces.extend(drawn.map(|(piece, _)| item(face, cluster * PIECES + piece)));
                let count = (items.pieces.len() - before) as u64;
                if count == 0 {
                    continue;
                }
                self.counts.triangles_drawn += count * u64::from(PIECE);
            } else {
                items.clusters.push(item(face, cluster));
                self.counts.triangles_drawn += u64::from(CLUSTER);
            }
            self.counts.clusters_drawn += 1;
            self.touched |= 1 << face;
        }
    }

    /// The texels of a dynamic object in those faces where it is small. Returns the others that it touches.
    fn add_texels(&mut self, mover: &Mover) -> u32 {
        let Self { map, part, ref mut items, .. } = *self;
        let touched = map.faces_touched(&mover.bounds);
        let mut others = 0;
        for face in bits(touched) {
            let Some(extent) = map.extent_drawn(face, &mover.bounds, part) else { continue };
            let small = Centers::new(&extent, map.size).zip(mover.groups.as_ref()).zip(map.face(face));
            let before = items.texels.len();
            let is_covered = small.is_some_and(|((centers, groups), view)| {
                groups.cover(&view, centers, part, &mut items.texels)
            });
            let count = (items.texels.len() - before) as u64;
            self.counts.texels_drawn += count;
            self.counts.clusters_drawn += if count > 0 { mover.clusters.len() as u64 } else { 0 };
            self.touched |= u32::from(count > 0) << face;
            others |= u32::from(!is_covered) << face;
        }
        others
    }
}

/// The bits that are set, ascending.
fn bits(mut set: u32) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = (set != 0).then(|| set.trailing_zeros());
        set &= set.wrapping_sub(1);
        bit
    })
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

/// How much was drawn and how much was not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CullCounts {
    /// Faces of maps with an occluder in them.
    pub faces_drawn: u64,
    /// Faces without.
    pub faces_culled: u64,
    /// Pairs of a face and a cluster that were drawn; all of an object of which texels were drawn by themselves.
    pub clusters_drawn: u64,
    /// Pairs that were not.
    pub clusters_culled: u64,
    /// Triangles of those that were, of clusters of which a piece was drawn that piece's; those included that fill up clusters.
    pub triangles_drawn: u64,
    /// Texels that were drawn by themselves: those of dynamic objects that are small there.
    pub texels_drawn: u64,
}

impl CullCounts {
    /// Triangles that went through the rasteriser, those included that fill up clusters.
    pub fn triangle_instances(&self) -> u64 {
        self.triangles_drawn
    }
}

impl std::ops::AddAssign for CullCounts {
    fn add_assign(&mut self, other: Self) {
        self.faces_drawn += other.faces_drawn;
        self.faces_culled += other.faces_culled;
        self.clusters_drawn += other.clusters_drawn;
        self.clusters_culled += other.clusters_culled;
        self.triangles_drawn += other.triangles_drawn;
        self.texels_drawn += other.texels_drawn;
    }
}
