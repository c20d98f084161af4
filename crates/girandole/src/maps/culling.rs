//! Which clusters of occluders, pieces of them and texels are drawn into which face of a light's map (Barczak §4.2.2).

use super::footprint::{Bounds, MapView, TexelRect};
use super::occluders::{CLUSTER, Clusters, Detail, Mover, PIECE, PIECES};
use super::pieces::Piece;
use super::texels::Centers;
use crate::layout::{Item, MapTexel, RefreshedPart};
use girandole_core::scene::ObjectId;

/// Texels of a box about a cluster above which its pieces are not looked at by themselves: most of them cover one.
const IN_PIECES: f32 = 64.0;
/// Texels of a box about a cluster up to which a kernel rasterises it: sums of products of 1/256 texel fit its integers.
const BY_KERNEL: f32 = 8192.0;

impl Clusters {
    /// Appends the items of one light: each cluster in each face that its box touches, if it may cover a texel of `part` there; of
    /// what moves and is small there, only the pieces that may cover a texel, and of a mover that is small as a whole the texels.
    /// What a solid hides by itself is left out, and dynamic objects that something static hides from the light.
    pub fn cull(
        &self,
        (index, map): (u32, MapView),
        part: TexelRect,
        is_hidden: impl Fn(ObjectId) -> bool,
        wanted: Wanted,
        items: &mut Items,
    ) -> CullCounts {
        let Wanted { still, moving, by_kernel } = wanted;
        let (covered, counts) = (TexelRect::default(), CullCounts::default());
        let mut culling = Culling { light: index, map, part, by_kernel, items, covered, touched: 0, counts };
        if still {
            let clusters = self.bounds[..self.first_moving()].iter().enumerate();
            clusters.for_each(|cluster| culling.add_still(cluster));
        }
        for mover in self.moving.iter().filter(|mover| moving && !is_hidden(mover.object)) {
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
        culling.end();
        let Culling { mut counts, touched, .. } = culling;
        counts.faces_drawn = u64::from(touched.count_ones());
        counts.faces_culled = u64::from(map.faces()) - counts.faces_drawn;
        counts.clusters_culled = self.bounds.len() as u64 * u64::from(map.faces()) - counts.clusters_drawn;
        counts
    }
}

/// Which occluders are drawn, and how.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    /// Those that do not move.
    pub still: bool,
    /// Those that do.
    pub moving: bool,
    /// Whether a kernel rasterises what is small, instead of the device.
    pub by_kernel: bool,
}

/// What is drawn: faces of maps with clusters, and with pieces of clusters; and texels.
#[derive(Default)]
pub(crate) struct Items {
    /// Clusters of what does not move.
    pub still: Vec<Item>,
    /// Those of what moves.
    pub clusters: Vec<Item>,
    pub pieces: Vec<Item>,
    /// Of what is rasterised by a kernel, those of each part follow each other.
    pub texels: Vec<MapTexel>,
    /// Pieces that a kernel rasterises, as face | piece << 3.
    pub rasterized: Vec<u32>,
    /// Parts of maps in which a kernel does, where each may cover any.
    pub covered: Vec<RefreshedPart>,
}

impl Items {
    /// Appends others.
    pub fn append(&mut self, mut others: Self) {
        let before = [self.rasterized.len(), self.texels.len()].map(|n| n as u32);
        self.covered.extend(others.covered.into_iter().map(|part| part.after(before)));
        self.still.append(&mut others.still);
        self.clusters.append(&mut others.clusters);
        self.pieces.append(&mut others.pieces);
        self.texels.append(&mut others.texels);
        self.rasterized.append(&mut others.rasterized);
    }

    /// Keeps only what a kernel rasterises.
    pub fn forget_drawn(&mut self) {
        self.still.clear();
        self.clusters.clear();
        self.pieces.clear();
        if self.covered.is_empty() {
            self.texels.clear();
        }
    }

    /// Whether the device rasterises any of it.
    pub fn are_drawn(&self) -> bool {
        !(self.still.is_empty() && self.clusters.is_empty() && self.pieces.is_empty())
    }
}

/// What is found of a part of a light's map.
struct Culling<'a> {
    light: u32,
    map: MapView<'a>,
    part: TexelRect,
    by_kernel: bool,
    items: &'a mut Items,
    /// What of the map pieces and texels may cover.
    covered: TexelRect,
    /// Faces in which something is drawn, a bit each.
    touched: u32,
    counts: CullCounts,
}

impl Culling<'_> {
    fn item(&self, face: u32, of: usize) -> Item {
        Item { light: self.light, face_cluster: face | (of as u32) << 3 }
    }

    /// A cluster of what does not move, in those of the faces that it touches.
    fn add_still(&mut self, (cluster, bounds): (usize, &Bounds)) {
        for face in bits(self.map.faces_touched(bounds)) {
            if self.map.extent_drawn(face, bounds, self.part).is_some() {
                let item = self.item(face, cluster);
                self.items.still.push(item);
                self.count(face, CLUSTER);
            }
        }
    }

    /// A cluster of what moves, in those of the faces that it touches; its pieces, if they may be drawn alone.
    fn add(&mut self, (cluster, bounds): (usize, &Bounds), faces: u32, pieces: &[Piece]) {
        for face in bits(faces & self.map.faces_touched(bounds)) {
            let Some(extent) = self.map.extent_drawn(face, bounds, self.part) else { continue };
            let view = self.map.face(face).filter(|_| !pieces.is_empty());
            let by_kernel = self.by_kernel && extent.whole <= BY_KERNEL;
            let Some(view) = view.filter(|_| by_kernel || extent.texels() <= IN_PIECES) else {
                let item = self.item(face, cluster);
                self.items.clusters.push(item);
                self.count(face, CLUSTER);
                continue;
            };
            let mut triangles = 0;
            for (index, piece) in pieces.iter().enumerate() {
                // Of larger clusters, most pieces cover a texel.
                if extent.texels() > IN_PIECES || piece.drawn(&view) != 0 {
                    let item = self.item(face, cluster * PIECES + index);
                    if by_kernel {
                        self.items.rasterized.push(item.face_cluster);
                    } else {
                        self.items.pieces.push(item);
                    }
                    triangles += PIECE;
                }
            }
            if triangles > 0 {
                self.covered = self.covered.union(&extent.rect(self.map.size));
                self.count(face, triangles);
            }
        }
    }

    /// Counts a cluster of which so many triangles are drawn in a face.
    fn count(&mut self, face: u32, triangles: u32) {
        self.counts.clusters_drawn += 1;
        self.counts.triangles_drawn += u64::from(triangles);
        self.touched |= 1 << face;
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
            if count > 0 {
                self.covered = self.covered.union(&extent.rect(map.size));
            }
            self.counts.texels_drawn += count;
            self.counts.clusters_drawn += if count > 0 { mover.clusters.len() as u64 } else { 0 };
            self.touched |= u32::from(count > 0) << face;
            others |= u32::from(!is_covered) << face;
        }
        others
    }

    /// Takes note of where a kernel rasterises.
    fn end(&mut self) {
        let TexelRect { first, end } = self.covered.intersection(&self.part);
        let [end_piece, end_texel] = [self.items.rasterized.len(), self.items.texels.len()].map(|n| n as u32);
        if self.by_kernel && end_piece + end_texel > 0 {
            let covered =
                RefreshedPart { first, end, light: self.light, end_piece, end_texel, ..Default::default() };
            self.items.covered.push(covered);
        }
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

/// What was drawn into maps.
#[derive(Default)]
pub(crate) struct DrawnMaps {
    pub culling: CullCounts,
    /// Lights of whose maps what does not move was kept apart.
    pub kept: Vec<u32>,
}
