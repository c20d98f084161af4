//! The frame that a scene is worked on in: what positions are relative to, and what epsilons are relative to.
//!
//! Both stay what they are while things move, so that what does not change keeps its bits. And neither may follow an
//! outlier: with a stray vertex 10 km away from a room of 10 m, a share of the bounds would be a thousand times what
//! it should be, and positions relative to their centre would be a thousand times less exact.
//!
//! 1. The bounds of all positions are the scene's size, as a rule.
//! 2. The *core* is the box between the quartiles of its surface in x, y and z. Each corner of a triangle counts for
//!    the square of the triangle's least height, so that the long slivers of a stray vertex count for nothing.
//! 3. If the bounds are more than four times as large as the core, only what is near the core sets origin and scale. The
//!    bounds still hold everything.
//! 4. Dynamic objects that are not within the bounds of the others get room about them, and where animations take them.
//! 5. How large surfaces are, as a rule, is the lower quartile of their extents, weighted like the corners: a building has
//!    walls as large as a single room's.
//!
//! 6. What small distances are relative to, as those that rays start at, is neither: a closed room is no other for a
//!    plain of 10 km that it stands on. It is sixteen times what a quarter of all surfaces are not larger than, rounded
//!    down to a power of two. Each surface that stands still counts alike, and once in one place: patches, and what of
//!    an object is on none. What is far from the origin has larger ones, as its coordinates are rounded.
//!
//! Worked example: the built-in rooms' cores are as large as their bounds, as most surface is on their walls; that of a
//! large building is half as large. A box of 0.4 m that is 100 m away from a room of 10 m has a hundredth of the
//! surface; bounds over core are about 10; origin and scale are those of the room alone, to the bit, and the bounds
//! reach to the box.

use super::hierarchy::WorldFromNode;
use super::{MeshTriangle, Object, ObjectId, Scene};
use glam::{DVec3, Vec3};
use std::cmp::Ordering;

/// Bounds are many times larger than the core from this factor on.
const MANY_TIMES: f64 = 4.0;
/// What is within this many of the core's diagonals of it is near it.
const NEAR: f64 = 1.0;
/// Cells of the histograms that quartiles are found by, in each direction: a core that is many times
/// smaller than the bounds has 256 of them at most, and the next round more.
const CELLS: usize = 1024;

/// What positions and epsilons of a scene are relative to; see the module's documentation for how it is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameOfReference {
    /// World position that positions are relative to: the centre of the scene but for outliers.
    pub origin: DVec3,
    /// Smallest and largest corner, relative to the origin, metres: everything, and room for what moves.
    pub bounds: (Vec3, Vec3),
    /// The scene's size, metres: what epsilons are relative to. The length of the bounds' diagonal, without outliers
    /// and without room for what moves.
    pub scale: f32,
    /// How large surfaces are, as a rule, metres: three quarters of what there is (weighted as in the module's documentation)
    /// is on patches or meshes whose bounds have a diagonal of at least this.
    pub surface_extent: f32,
    /// What small distances are relative to, metres, see the module's documentation. It may be larger than the scale, and is the same
    /// for a room alone and on a plain.
    pub detail: f32,
}

/// [`FrameOfReference::detail`] in units of what a quarter of all surfaces are not larger than: as large as a room with such furniture.
const DETAIL: f64 = 16.0;

impl Default for FrameOfReference {
    /// That of an empty scene.
    fn default() -> Self {
        let least = f32::MIN_POSITIVE;
        Self {
            origin: DVec3::ZERO,
            bounds: (Vec3::ZERO, Vec3::ZERO),
            scale: least,
            surface_extent: least,
            detail: least,
        }
    }
}

impl FrameOfReference {
    /// The frame of a scene as it stands.
    pub fn of(scene: &Scene) -> Self {
        Self::with_movers(scene, |id| scene.objects[id].dynamic)
    }

    /// The frame of a scene in which these objects move.
    pub(super) fn with_movers(scene: &Scene, moves: impl Fn(ObjectId) -> bool) -> Self {
        let world_from_nodes = scene.world_from_nodes();
        let placed = scene.placed_objects();
        let placed =
            placed.map(|(id, object)| Placed::new(scene, id, object, &|node| world_from_nodes[node.index()]));
        let placed: Vec<Placed> = placed.collect();
        let mut all = Box3::EMPTY;
        let mut still = Box3::EMPTY;
        for object in &placed {
            all = all.union(object.bounds);
            if !moves(object.id) {
                still = still.union(object.bounds);
            }
        }
        if all.is_empty() {
            return Self::default();
        }
        let main = main_part(scene, &placed, all);
        let mut with_room = all;
        let movers = placed.iter().filter(|o| moves(o.id));
        let is_animated = scene.animated_objects();
        let animated: Vec<ObjectId> =
            movers.clone().map(|o| o.id).filter(|id| is_animated[id.index()]).collect();
        let poses = scene.all_poses();
        let mut sizes = vec![0.0; scene.objects.len()];
        movers.clone().for_each(|o| sizes[o.id.index()] = o.bounds.size().length());
        let places = movers.map(|o| (o.id, o.bounds)).chain(scene.reaches(&animated, &poses));
        for (object, place) in places.filter(|(_, place)| !still.contains(*place)) {
            with_room = with_room.union(place.grown(sizes[object.index()]));
        }
        let origin = (main.low + main.high) * 0.5;
        let relative = |b: Box3| ((b.low - origin).as_vec3(), (b.high - origin).as_vec3());
        let (low, high) = relative(main);
        let scale = (high - low).length().max(f32::MIN_POSITIVE);
        let surfaces = surfaces(scene, &placed);
        let within_scale = |extent: f64| (extent as f32).clamp(f32::MIN_POSITIVE, scale);
        let surface_extent = within_scale(surface_extent(&surfaces));
        let all_move = surfaces.iter().all(|surface| moves(surface.object));
        let counted = surfaces.iter().filter(|surface| all_move || !moves(surface.object));
        // A power of two: a few surfaces more change nothing, as a rule.
        let detail = DETAIL * lower_quartile(counted);
        let detail = libm::exp2(libm::floor(libm::log2(detail))) as f32;
        let detail = detail.max(f32::MIN_POSITIVE);
        Self { origin, bounds: relative(with_room), scale, surface_extent, detail }
    }

    /// Length of the bounds' diagonal, metres; larger than the scale where there are outliers or room for movers.
    pub fn extent(&self) -> f32 {
        (self.bounds.1 - self.bounds.0).length().max(f32::MIN_POSITIVE)
    }

    /// Whether something with these bounds in the world is within those here.
    pub(super) fn holds(&self, what: Box3) -> bool {
        let [low, high] = [what.low, what.high].map(|p| (p - self.origin).as_vec3());
        what.is_empty() || low.cmpge(self.bounds.0).all() && high.cmple(self.bounds.1).all()
    }
}

/// An object's finite positions in the world.
struct Placed {
    id: ObjectId,
    positions: Vec<DVec3>,
    bounds: Box3,
}

impl Placed {
    fn new(scene: &Scene, id: ObjectId, object: &Object, world_from_node: WorldFromNode) -> Self {
        let positions: Vec<DVec3> = scene.world_positions(object, world_from_node).collect();
        let bounds = positions.iter().filter(|p| p.is_finite()).fold(Box3::EMPTY, |b, p| b.with(*p));
        Self { id, positions, bounds }
    }

    fn corners(&self, triangle: &MeshTriangle) -> [DVec3; 3] {
        triangle.vertices.map(|v| self.positions[v as usize])
    }
}

/// Square of a triangle's least height; 0 where it has no area or a corner is not finite.
fn least_height_squared([a, b, c]: [DVec3; 3]) -> f64 {
    let edges = [b - a, c - b, a - c];
    let longest = edges.map(DVec3::length_squared).into_iter().fold(0.0, f64::max);
    let height_squared = edges[0].cross(edges[1]).length_squared() / longest;
    if height_squared.is_finite() { height_squared } else { 0.0 }
}

/// Smallest and largest corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Box3 {
    pub low: DVec3,
    pub high: DVec3,
}

impl Box3 {
    pub const EMPTY: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    pub fn is_empty(self) -> bool {
        !self.low.cmple(self.high).all()
    }

    fn size(self) -> DVec3 {
        self.high - self.low
    }

    pub fn corners(self) -> [DVec3; 8] {
        let high = |i: usize, bit: usize| i & (1 << bit) != 0;
        let mask = |i: usize| glam::BVec3::new(high(i, 0), high(i, 1), high(i, 2));
        std::array::from_fn(|i| DVec3::select(mask(i), self.high, self.low))
    }

    pub fn with(self, p: DVec3) -> Self {
        Self { low: self.low.min(p), high: self.high.max(p) }
    }

    /// The box of all sums.
    pub fn plus(self, other: Self) -> Self {
        Self { low: self.low + other.low, high: self.high + other.high }
    }

    pub fn times(self, factor: f64) -> Self {
        let [a, b] = [self.low * factor, self.high * factor];
        Self { low: a.min(b), high: a.max(b) }
    }

    /// Whether no coordinate is farther from 0.
    pub fn is_within(self, distance: f64) -> bool {
        self.is_empty() || self.low.min(-self.high).min_element() >= -distance
    }

    fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn grown(self, by: f64) -> Self {
        if self.is_empty() { self } else { Self { low: self.low - by, high: self.high + by } }
    }

    fn holds(self, p: DVec3) -> bool {
        p.cmpge(self.low).all() && p.cmple(self.high).all()
    }

    fn contains(self, other: Self) -> bool {
        other.is_empty() || self.holds(other.low) && self.holds(other.high)
    }
}

/// The bounds of what is not far away from most of the scene's surface: all of it, as a rule.
fn main_part(scene: &Scene, objects: &[Placed], all: Box3) -> Box3 {
    let mut main = all;
    // Each round cuts off what is farther than a cell of its histograms can tell.
    loop {
        let core = core(scene, objects, main);
        let size = core.size().length();
        if core.is_empty() || size <= 0.0 || main.size().length() <= MANY_TIMES * size {
            return main;
        }
        let near = core.grown(NEAR * size);
        let points = objects.iter().flat_map(|o| &o.positions).filter(|p| near.holds(**p));
        let next = points.fold(Box3::EMPTY, |b, p| b.with(*p));
        if next.is_empty() || !main.contains(next) || next == main {
            return main;
        }
        main = next;
    }
}

/// The box between the quartiles of the surface within a box, up to a cell of 1/1024.
fn core(scene: &Scene, objects: &[Placed], within: Box3) -> Box3 {
    let size = within.size();
    let cells = DVec3::splat(CELLS as f64) / size.map(|s| if s > 0.0 { s } else { f64::INFINITY });
    let mut mass = vec![[0.0_f64; 3]; CELLS];
    let mut total = 0.0;
    for object in objects {
        for triangle in &scene.meshes[scene.objects[object.id].mesh].triangles {
            let corners = object.corners(triangle);
            let height_squared = least_height_squared(corners);
            if height_squared == 0.0 {
                continue;
            }
            for corner in corners {
                if within.holds(corner) {
                    let at = ((corner - within.low) * cells).to_array();
                    for (axis, x) in at.into_iter().enumerate() {
                        mass[(x as usize).min(CELLS - 1)][axis] += height_squared;
                    }
                    total += height_squared;
                }
            }
        }
    }
    if total <= 0.0 {
        return Box3::EMPTY;
    }
    let mut core = within;
    for axis in 0..3 {
        let (mut low, mut high) = (0, CELLS - 1);
        let mut below = mass[low][axis];
        while below < total * 0.25 && low + 1 < CELLS {
            low += 1;
            below += mass[low][axis];
        }
        let mut above = mass[high][axis];
        while above < total * 0.25 && high > low {
            high -= 1;
            above += mass[high][axis];
        }
        let width = size[axis] / CELLS as f64;
        core.low[axis] = within.low[axis] + width * low as f64;
        core.high[axis] = within.low[axis] + width * (high + 1) as f64;
    }
    core
}

/// A patch, or what of an object is on none.
struct Surface {
    object: ObjectId,
    bounds: Box3,
    /// Of their diagonal, metres.
    extent: f64,
    /// Of its corners.
    weight: f64,
}

/// All that have an area.
fn surfaces(scene: &Scene, objects: &[Placed]) -> Vec<Surface> {
    let mut surfaces = Vec::new();
    for object in objects {
        let mesh = &scene.meshes[scene.objects[object.id].mesh];
        let mut on_none = vec![true; mesh.triangles.len()];
        let is_deformed = scene.is_deformed(&scene.objects[object.id]);
        for patch in mesh.patches.iter().filter(|_| !is_deformed) {
            let range = patch.triangles.start as usize..patch.triangles.end as usize;
            on_none[range.clone()].fill(false);
            surfaces.extend(surface(object, &mut mesh.triangles[range].iter()));
        }
        let mut rest = mesh.triangles.iter().zip(on_none).filter(|(_, on_none)| *on_none).map(|(t, _)| t);
        surfaces.extend(surface(object, &mut rest));
    }
    surfaces
}

/// Lower quartile of the extents of surfaces, weighted.
fn surface_extent(surfaces: &[Surface]) -> f64 {
    let mut surfaces: Vec<(f64, f64)> = surfaces.iter().map(|s| (s.extent, s.weight)).collect();
    surfaces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = surfaces.iter().map(|s| s.1).sum();
    let mut below = 0.0;
    let quartile = surfaces.iter().find(|(_, weight)| {
        below += weight;
        below >= total * 0.25
    });
    quartile.map_or(0.0, |s| s.0)
}

/// Lower quartile of the extents of surfaces; what is listed twice in the same place counts once.
fn lower_quartile<'a>(surfaces: impl Iterator<Item = &'a Surface>) -> f64 {
    let key = |surface: &Surface| {
        let Box3 { low, high } = surface.bounds;
        [surface.extent, low.x, low.y, low.z, high.x, high.y, high.z]
    };
    let mut keys: Vec<[f64; 7]> = surfaces.map(key).collect();
    keys.sort_by(|a, b| {
        let orders = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
        orders.fold(Ordering::Equal, Ordering::then)
    });
    keys.dedup();
    keys.get(keys.len() / 4).map_or(0.0, |key| key[0])
}

/// Some triangles together, unless they have no area.
fn surface(object: &Placed, triangles: &mut dyn Iterator<Item = &MeshTriangle>) -> Option<Surface> {
    let (mut bounds, mut weight) = (Box3::EMPTY, 0.0);
    for triangle in triangles {
        let corners = object.corners(triangle);
        let height_squared = least_height_squared(corners);
        if height_squared > 0.0 {
            weight += height_squared;
            bounds = corners.into_iter().fold(bounds, Box3::with);
        }
    }
    let extent = if bounds.is_empty() { 0.0 } else { bounds.size().length() };
    (weight > 0.0).then_some(Surface { object: object.id, bounds, extent, weight })
}
