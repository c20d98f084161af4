//! Ray tracing against a scene's geometry, on the CPU: for light samples, the reference and tests.
//!
//! The hierarchy comes from `obvhs`; triangles are intersected here, in double precision and watertight, so that
//! neither the machine's vector width nor the order of traversal can change a result.
//!
//! The hierarchy is traversed in a space of its own, where the bounds' diagonal is 1 to 2 long and directions have
//! unit length, because `obvhs` culls boxes whose far side is nearer than 1e-4, and clamps components of a
//! direction below 1.2e-7. Rays start `BACK_UP` earlier there, and boxes are `MARGIN` larger: more than single
//! precision can be wrong by.

mod hierarchy;
mod wide;

pub use hierarchy::HeldHierarchies;
pub(crate) use hierarchy::aabb;
pub use wide::{WideHierarchy, WideNode};

use crate::scene::{Geometry, NONE, ObjectId, Scene};
use crate::slices::{complete, pause};
use glam::{DVec2, DVec3, Vec2, Vec3};
use hierarchy::{Hierarchy, MARGIN};
use obvhs::BvhBuildParams;
use obvhs::ray::{Ray as TreeRay, RayHit};
use std::sync::{Arc, OnceLock};

/// An intersection of a ray and a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter: the hit is at `origin + direction · t`.
    pub t: f32,
    /// Index into [`Geometry::triangles`].
    pub triangle: u32,
    /// Weights of corners 1 and 2.
    pub barycentric: Vec2,
}

/// A ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts, relative to [`Geometry::origin`], metres.
    pub origin: Vec3,
    /// Where it goes; hits are in units of this.
    pub direction: Vec3,
    /// What lies at `t_max` or beyond is not met.
    pub t_max: f32,
    /// A triangle that is not there for it, or [`NONE`].
    pub ignored: u32,
}

/// Finds the first surface along a ray, and whether anything lies between two points. Surfaces that
/// [let light through](crate::scene::Material::is_transparent) are not there for it, but for
/// [`transparent_hits`](SceneTracer::transparent_hits).
pub struct SceneTracer<'a> {
    scene: &'a Scene,
    geometry: &'a Geometry,
    /// All other triangles are in one of them. Into how many they are divided changes no result.
    hierarchies: Vec<Arc<Hierarchy>>,
    /// Over the transparent ones, once somebody asks.
    transparent: OnceLock<Hierarchy>,
    /// From the scene to their space.
    scale: f64,
}

/// What emits is nearer by this share of its distance where rays choose what is nearest: a lamp that lies in one plane with a ceiling
/// is seen before it. Mirrored in `shaders/visibility_buffer.wgsl`.
const EMITTER_BIAS: f64 = 4e-6;
/// How much earlier rays start in the hierarchy's space.
const BACK_UP: f64 = 2e-4;
/// A ray prepared for the watertight intersection test of Woop, Benthin and Wald (2013).
struct WatertightRay {
    origin: DVec3,
    axes: [usize; 3],
    shear: DVec2,
    inverse_z: f64,
}

impl WatertightRay {
    fn new(origin: DVec3, direction: DVec3) -> Option<Self> {
        let size = direction.abs();
        let z = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let inverse_z = 1.0 / direction[z];
        if !(origin.is_finite() && direction.is_finite() && inverse_z.is_finite()) {
            return None;
        }
        let shear = DVec2::new(direction[axes[0]], direction[axes[1]]) * inverse_z;
        Some(Self { origin, axes, shear, inverse_z })
    }

    /// Ray parameter and weights of corners 1 and 2. Corners are sheared so that the ray becomes the z axis; they
    /// come out the same for all triangles that share them, and the signs of the three areas in the plane are exact,
    /// so a ray cannot slip between triangles that share an edge or a vertex.
    #[inline]
    fn intersect(&self, corners: &[Vec3; 3]) -> Option<(f64, f64, f64)> {
        let project = |corner: Vec3| {
            let p = corner.as_dvec3() - self.origin;
            let z = p[self.axes[2]];
            let plane = DVec2::new(p[self.axes[0]], p[self.axes[1]]) - self.shear * z;
            (plane, z * self.inverse_z)
        };
        let [(a, ta), (b, tb), (c, tc)] = corners.map(project);
        let (wa, wb, wc) = (doubled_area(b, c), doubled_area(c, a), doubled_area(a, b));
        let outside = (wa < 0.0 || wb < 0.0 || wc < 0.0) && (wa > 0.0 || wb > 0.0 || wc > 0.0);
        let sum = wa + wb + wc;
        if outside || sum == 0.0 {
            return None;
        }
        let (u, v, w) = (wb / sum, wc / sum, wa / sum);
        Some((w * ta + u * tb + v * tc, u, v))
    }
}

/// Twice the signed area of the triangle (0, a, b). Its sign is exact: rounding keeps the order of two products, and
/// where they round to the same number their rounding errors decide.
#[inline]
fn doubled_area(a: DVec2, b: DVec2) -> f64 {
    let (p, q) = (a.x * b.y, a.y * b.x);
    if p != q || p == 0.0 { p - q } else { a.x.mul_add(b.y, -p) - a.y.mul_add(b.x, -q) }
}

/// A ray in the hierarchy's space.
struct Traversal {
    ray: TreeRay,
    /// Hierarchy's distance = (parameter · `per_t`) + `offset`.
    per_t: f64,
    offset: f64,
}

impl Traversal {
    fn new(tracer: &SceneTracer, origin: DVec3, direction: DVec3, t_max: f64) -> Self {
        let length = direction.length();
        let unit = direction / length;
        let (scale, center) = (tracer.scale, tracer.center());
        // From far away, start near the scene: distances stay as exact as its size allows.
        let extent = f64::from(tracer.geometry.extent());
        let skipped = ((center - origin).dot(unit) - extent).max(0.0);
        let start = (origin + unit * skipped) * scale - unit * BACK_UP;
        let offset = BACK_UP - skipped * scale;
        let per_t = length * scale;
        // `obvhs` is not consistent about the sign of −0: adding 0 makes it +0.
        let ray = TreeRay::new(
            start.as_vec3().to_array().into(),
            (unit.as_vec3() + Vec3::ZERO).to_array().into(),
            0.0,
            f32::INFINITY,
        );
        let mut this = Self { ray, per_t, offset };
        this.ray.tmax = this.reach(t_max);
        this
    }

    /// The distance in the hierarchy's space up to which boxes can hold hits up to `t`.
    fn reach(&self, t: f64) -> f32 {
        (t * self.per_t + self.offset) as f32 + 4.0 * MARGIN
    }
}

impl<'a> SceneTracer<'a> {
    /// Builds the hierarchy over all triangles.
    pub fn new(scene: &'a Scene, geometry: &'a Geometry) -> Self {
        complete(Self::in_slices(scene, geometry))
    }

    /// The same with pauses.
    pub(crate) async fn in_slices(scene: &'a Scene, geometry: &'a Geometry) -> Self {
        Self::with_build(scene, geometry, &BvhBuildParams::medium_build()).await
    }

    /// Builds the hierarchy over all triangles but those of one object: rays do not see it.
    pub fn without(scene: &'a Scene, geometry: &'a Geometry, object: ObjectId) -> Self {
        let own = geometry.objects[object.index()].triangles.clone();
        let others = (0..geometry.triangles.len() as u32)
            .filter(|t| !own.contains(t) && !geometry.is_transparent(scene, *t));
        let build = BvhBuildParams::medium_build();
        let hierarchy = complete(Hierarchy::new(scene, geometry, others.collect(), &build));
        Self::over(scene, geometry, &[Arc::new(hierarchy)])
    }

    /// Over what lets light through, too: where surfaces are, whatever they look like.
    pub(crate) fn of_all_surfaces(scene: &'a Scene, geometry: &'a Geometry) -> Self {
        let all = (0..geometry.triangles.len() as u32).collect();
        let hierarchy = complete(Hierarchy::new(scene, geometry, all, &BvhBuildParams::medium_build()));
        Self::over(scene, geometry, &[Arc::new(hierarchy)])
    }

    async fn with_build(scene: &'a Scene, geometry: &'a Geometry, build: &BvhBuildParams) -> Self {
        let all = (0..geometry.triangles.len() as u32).filter(|&t| !geometry.is_transparent(scene, t));
        let hierarchy = Hierarchy::new(scene, geometry, all.collect(), build).await;
        pause().await;
        Self::over(scene, geometry, &[Arc::new(hierarchy)])
    }

    /// With these hierarchies over all triangles that block.
    fn over(scene: &'a Scene, geometry: &'a Geometry, hierarchies: &[Arc<Hierarchy>]) -> Self {
        let with_triangles = hierarchies.iter().filter(|hierarchy| !hierarchy.is_empty());
        let scale = hierarchy::scale(geometry);
        let hierarchies = with_triangles.cloned().collect();
        Self { scene, geometry, hierarchies, transparent: OnceLock::new(), scale }
    }

    /// The geometry that is traced.
    pub fn geometry(&self) -> &'a Geometry {
        self.geometry
    }

    /// The scene that is traced.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    fn center(&self) -> DVec3 {
        (self.geometry.bounds.0.as_dvec3() + self.geometry.bounds.1.as_dvec3()) * 0.5
    }

    /// The first surface along a ray at `0 < t < t_max`, from either side, leaving out triangle `ignored`
    /// ([`NONE`] for none). At equal distance what emits wins, else the lower triangle index.
    pub fn closest_hit(&self, origin: Vec3, direction: Vec3, t_max: f32, ignored: u32) -> Option<Hit> {
        self.closest_hit_where(origin, direction, t_max, |triangle, _| triangle != ignored)
    }

    /// The first surface that a camera sees: the backs of single-sided surfaces are not there (glTF culls them).
    pub fn closest_visible(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        self.closest_visible_within(origin, direction, f32::INFINITY)
    }

    /// The same at `0 < t < t_max`: a view's rays end at its [far plane](crate::scene::ClipPlanes::reach).
    pub fn closest_visible_within(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<Hit> {
        self.closest_hit_where(origin, direction, t_max, |triangle, _| self.is_visible(triangle, direction))
    }

    /// The first surface along a ray for which `accept(triangle, barycentric)` is true.
    pub fn closest_hit_where(
        &self,
        origin: Vec3,
        direction: Vec3,
        t_max: f32,
        accept: impl Fn(u32, Vec2) -> bool,
    ) -> Option<Hit> {
        let (origin, direction, limit) = (origin.as_dvec3(), direction.as_dvec3(), f64::from(t_max));
        let ray = WatertightRay::new(origin, direction)?;
        let mut traversal = Traversal::new(self, origin, direction, limit);
        // Nearness, parameter, triangle, place.
        let mut best: Option<(f64, f64, u32, Vec2)> = None;
        for hierarchy in &self.hierarchies {
            hierarchy.bvh.ray_traverse(traversal.ray, &mut RayHit::none(), |_, slot| {
                let leaf = hierarchy.leaf(slot);
                let Some((t, u, v)) = ray.intersect(&leaf.corners) else { return f32::INFINITY };
                let barycentric = Vec2::new(u as f32, v as f32);
                let order = if leaf.emits { t * (1.0 - EMITTER_BIAS) } else { t };
                let nearer = best.is_none_or(|(o, _, bi, _)| order < o || order == o && leaf.triangle < bi);
                let taken = t > 0.0
                    && t < limit
                    && nearer
                    && accept(leaf.triangle, barycentric)
                    && !(leaf.masked && self.geometry.is_cut_out(self.scene, leaf.triangle, barycentric));
                if !taken {
                    return f32::INFINITY;
                }
                best = Some((order, t, leaf.triangle, barycentric));
                traversal.reach(t)
            });
            if let Some((_, t, ..)) = best {
                traversal.ray.tmax = traversal.reach(t);
            }
        }
        best.map(|(_, t, triangle, barycentric)| Hit { t: t as f32, triangle, barycentric })
    }

    /// All transparent surfaces along a ray at `0 < t < t_max`, from either side, in the order in which it meets them.
    pub fn transparent_hits(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Vec<Hit> {
        let (scene, geometry) = (self.scene, self.geometry);
        let hierarchy = self.transparent.get_or_init(|| {
            let all = 0..geometry.triangles.len() as u32;
            let transparent = all.filter(|&t| geometry.is_transparent(scene, t)).collect();
            complete(Hierarchy::new(scene, geometry, transparent, &BvhBuildParams::medium_build()))
        });
        if hierarchy.is_empty() {
            return Vec::new();
        }
        let (origin, direction, limit) = (origin.as_dvec3(), direction.as_dvec3(), f64::from(t_max));
        let Some(ray) = WatertightRay::new(origin, direction) else { return Vec::new() };
        let traversal = Traversal::new(self, origin, direction, limit);
        let mut hits = Vec::new();
        hierarchy.bvh.ray_traverse(traversal.ray, &mut RayHit::none(), |_, slot| {
            let leaf = hierarchy.leaf(slot);
            if let Some((t, u, v)) = ray.intersect(&leaf.corners).filter(|(t, ..)| *t > 0.0 && *t < limit) {
                let barycentric = Vec2::new(u as f32, v as f32);
                hits.push((t, Hit { t: t as f32, triangle: leaf.triangle, barycentric }));
            }
            f32::INFINITY
        });
        hits.sort_by(|(a, x), (b, y)| a.total_cmp(b).then(x.triangle.cmp(&y.triangle)));
        // On the edge between two triangles a ray meets both.
        let is_on_edge = |hit: &Hit| {
            let Vec2 { x: u, y: v } = hit.barycentric;
            u.min(v).min(1.0 - u - v) < 1e-6
        };
        let faces = |hit: &Hit| geometry.normal(hit.triangle).as_dvec3().dot(direction) < 0.0;
        hits.dedup_by(|(t, later), (before, hit)| {
            let meet = || is_on_edge(hit) && is_on_edge(later) && faces(hit) == faces(later);
            *t - *before <= 1e-9 * *t && meet()
        });
        hits.into_iter().map(|(_, hit)| hit).collect()
    }

    /// Whether a camera in direction `direction` sees a triangle: the backs of single-sided surfaces are not there (glTF).
    pub fn is_visible(&self, triangle: u32, direction: Vec3) -> bool {
        let t = &self.geometry.triangles[triangle as usize];
        self.scene.materials[t.material].double_sided || self.geometry.normal(triangle).dot(direction) < 0.0
    }

    /// Whether a surface lies strictly between two points, other than the triangles that they lie on ([`NONE`] for
    /// none). Points on a surface should be offset by [`SceneTracer::offset_ray_origin`] first.
    pub fn occluded(&self, from: Vec3, from_triangle: u32, to: Vec3, to_triangle: u32) -> bool {
        self.occluder(from, from_triangle, to, to_triangle, NONE).is_some()
    }

    /// Like [`SceneTracer::occluded`], with some triangle that lies in between (which one is not specified). It
    /// tries triangle `likely` first ([`NONE`] for none): what blocked a neighbour often blocks here.
    pub fn occluder(
        &self,
        from: Vec3,
        from_triangle: u32,
        to: Vec3,
        to_triangle: u32,
        likely: u32,
    ) -> Option<u32> {
        let origin = from.as_dvec3();
        let direction = to.as_dvec3() - origin;
        let ray = WatertightRay::new(origin, direction)?;
        let blocks = |corners: &[Vec3; 3], triangle: u32, masked: bool| {
            triangle != from_triangle
                && triangle != to_triangle
                && ray.intersect(corners).is_some_and(|(t, u, v)| {
                    t > 0.0
                        && t < 1.0
                        && !(masked
                            && self.geometry.is_cut_out(self.scene, triangle, Vec2::new(u as f32, v as f32)))
                })
        };
        if likely != NONE {
            let material = self.geometry.triangles[likely as usize].material.index();
            let masked = self.scene.materials[material].alpha_cutoff.is_some();
            if blocks(&self.geometry.corners(likely), likely, masked) {
                return Some(likely);
            }
        }
        let traversal = Traversal::new(self, origin, direction, 1.0);
        self.hierarchies.iter().find_map(|hierarchy| {
            let mut found = None;
            hierarchy.bvh.ray_traverse_miss(traversal.ray, |_, slot| {
                let leaf = hierarchy.leaf(slot);
                if !blocks(&leaf.corners, leaf.triangle, leaf.masked) {
                    return f32::INFINITY;
                }
                found = Some(leaf.triangle);
                f32::NEG_INFINITY
            });
            found
        })
    }

    /// Offsets a ray's origin from the surface along its unit normal: far enough that neither rounding nor a coplanar
    /// neighbour makes the surface occlude itself, by [`ray_offset_distance`].
    pub fn offset_ray_origin(&self, point: Vec3, normal: Vec3) -> Vec3 {
        point + normal * ray_offset_distance(self.geometry, point)
    }
}

/// Share of [`Geometry::detail`] that ray origins are offset by at least.
pub const RAY_OFFSET: f32 = 1e-6;
/// Share of a point's largest coordinate that its ray origins are offset by at least: eight units in the last place. Points, what
/// they lie on and what is next to that are rounded to half of one in each coordinate, and kernels transform them into the space of
/// lights with an error of three halves of one.
pub(crate) const RAY_OFFSET_BY_ROUNDING: f64 = 8.0 * f32::EPSILON as f64;

/// The distance by which [`SceneTracer::offset_ray_origin`] offsets a point, metres: a millionth of [`Geometry::detail`], or eight units
/// in the last place of its largest coordinate where that is more, which it is farther than that from the origin.
pub fn ray_offset_distance(geometry: &Geometry, point: Vec3) -> f32 {
    (geometry.offset_detail() * RAY_OFFSET).max(point.abs().max_element() * RAY_OFFSET_BY_ROUNDING as f32)
}

#[cfg(test)]
mod tests;
