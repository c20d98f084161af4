//! Ray tracing against a scene's geometry, on the CPU: for light samples, the reference and tests.
//!
//! The hierarchy comes from `obvhs`; triangles are intersected here, in double precision and watertight, so that
//! neither the machine's vector width nor the order of traversal can change a result.

use crate::scene::{Geometry, Scene};
use glam::{DVec3, Vec2, Vec3, Vec3A};
use obvhs::{Boundable, aabb::Aabb, cwbvh::CwBvh, ray::Ray, ray::RayHit};

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter: the hit is at `origin + direction · t`.
    pub t: f32,
    /// Index into [`Geometry::triangles`].
    pub triangle: u32,
    /// Weights of corners 1 and 2.
    pub barycentric: Vec2,
}

/// Answers which surface a ray meets first, and whether anything lies between two points.
pub struct SceneTracer<'a> {
    scene: &'a Scene,
    geometry: &'a Geometry,
    bvh: CwBvh,
    masked: Vec<bool>,
}

struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// A ray prepared for the intersection test.
struct Probe {
    origin: DVec3,
    direction: DVec3,
}

impl Probe {
    /// Intersection by signed volumes (Plücker coordinates): the sign at a shared edge is exactly opposite for the
    /// two triangles that share it, so a ray cannot slip between them.
    fn intersect(&self, corners: [Vec3; 3]) -> Option<(f64, f64, f64)> {
        let [a, b, c] = corners.map(|p| p.as_dvec3() - self.origin);
        let u = self.direction.dot(c.cross(a));
        let v = self.direction.dot(a.cross(b));
        let w = self.direction.dot(b.cross(c));
        if !(u >= 0.0 && v >= 0.0 && w >= 0.0 || u <= 0.0 && v <= 0.0 && w <= 0.0) {
            return None;
        }
        let normal = (b - a).cross(c - a);
        let slope = normal.dot(self.direction);
        let sum = u + v + w;
        if slope == 0.0 || sum == 0.0 {
            return None;
        }
        Some((normal.dot(a) / slope, u / sum, v / sum))
    }
}

impl<'a> SceneTracer<'a> {
    /// Builds the hierarchy over all triangles.
    pub fn new(scene: &'a Scene, geometry: &'a Geometry) -> Self {
        // Boxes grow by a few rounding errors of their largest coordinate: flat ones must not be missed.
        let bounds: Vec<Bounds> = (0..geometry.triangles.len() as u32)
            .map(|i| {
                let corners = geometry.corners(i).map(Vec3A::from);
                let mut aabb = Aabb::from_points(&corners);
                let margin = (aabb.min.abs().max(aabb.max.abs()).max_element() * 4.0 * f32::EPSILON)
                    .max(geometry.diagonal() * f32::EPSILON);
                aabb.min -= margin;
                aabb.max += margin;
                Bounds(aabb)
            })
            .collect();
        let bvh = if bounds.is_empty() {
            CwBvh::default()
        } else {
            obvhs::cwbvh::builder::build_cwbvh(
                &bounds,
                obvhs::BvhBuildParams::medium_build(),
                &mut std::time::Duration::default(),
            )
        };
        let masked = geometry
            .triangles
            .iter()
            .map(|t| scene.materials[t.material as usize].alpha_cutoff.is_some())
            .collect();
        Self { scene, geometry, bvh, masked }
    }

    /// The geometry that is traced.
    pub fn geometry(&self) -> &'a Geometry {
        self.geometry
    }

    /// The scene that is traced.
    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    fn is_surface(&self, triangle: u32, barycentric: Vec2) -> bool {
        !self.masked[triangle as usize] || !self.geometry.is_cut_out(self.scene, triangle, barycentric)
    }

    /// The first surface along a ray at `0 < t < t_max`, from either side, leaving out triangle `ignored`
    /// ([`NONE`](crate::scene::NONE) for none). At equal distance the lower triangle index wins.
    pub fn closest_hit(&self, origin: Vec3, direction: Vec3, t_max: f32, ignored: u32) -> Option<Hit> {
        self.closest_hit_where(origin, direction, t_max, |triangle, _| triangle != ignored)
    }

    /// The first surface that a camera sees: the backs of single-sided surfaces are not there (glTF culls them).
    pub fn closest_visible(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        self.closest_hit_where(origin, direction, f32::INFINITY, |triangle, _| {
            let t = &self.geometry.triangles[triangle as usize];
            self.scene.materials[t.material as usize].double_sided
                || self.geometry.normal(triangle).dot(direction) < 0.0
        })
    }

    /// The first surface along a ray among those that `accept(triangle, barycentric)` takes.
    pub fn closest_hit_where(
        &self,
        origin: Vec3,
        direction: Vec3,
        t_max: f32,
        accept: impl Fn(u32, Vec2) -> bool,
    ) -> Option<Hit> {
        if self.bvh.nodes.is_empty() || !(origin.is_finite() && direction.is_finite()) {
            return None;
        }
        let probe = Probe { origin: origin.as_dvec3(), direction: direction.as_dvec3() };
        let mut best: Option<(f64, u32, Vec2)> = None;
        let limit = f64::from(t_max);
        let ray = Ray::new(origin.into(), direction.into(), 0.0, t_max);
        self.bvh.ray_traverse(ray, &mut RayHit::none(), |_, slot| {
            let triangle = self.bvh.primitive_indices[slot];
            let Some((t, u, v)) = probe.intersect(self.geometry.corners(triangle)) else {
                return f32::INFINITY;
            };
            let barycentric = Vec2::new(u as f32, v as f32);
            let nearer = best.is_none_or(|(bt, bi, _)| t < bt || t == bt && triangle < bi);
            if !(t > 0.0 && t < limit && nearer) || !accept(triangle, barycentric) {
                return f32::INFINITY;
            }
            if !self.is_surface(triangle, barycentric) {
                return f32::INFINITY;
            }
            best = Some((t, triangle, barycentric));
            // Boxes are tested in single precision: leave room so that an equally distant one is still visited.
            (t as f32) * (1.0 + 4.0 * f32::EPSILON)
        });
        best.map(|(t, triangle, barycentric)| Hit { t: t as f32, triangle, barycentric })
    }

    /// Whether a surface lies strictly between two points, other than the triangles that they lie on
    /// ([`NONE`](crate::scene::NONE) for none). Points on a surface are best lifted by [`SceneTracer::lift`] first.
    pub fn occluded(&self, from: Vec3, from_triangle: u32, to: Vec3, to_triangle: u32) -> bool {
        if self.bvh.nodes.is_empty() {
            return false;
        }
        let direction = to.as_dvec3() - from.as_dvec3();
        let probe = Probe { origin: from.as_dvec3(), direction };
        let ray = Ray::new(from.into(), direction.as_vec3a(), 0.0, 1.0);
        !self.bvh.ray_traverse_miss(ray, |_, slot| {
            let triangle = self.bvh.primitive_indices[slot];
            if triangle == from_triangle || triangle == to_triangle {
                return f32::INFINITY;
            }
            match probe.intersect(self.geometry.corners(triangle)) {
                Some((t, u, v))
                    if t > 0.0 && t < 1.0 && self.is_surface(triangle, Vec2::new(u as f32, v as f32)) =>
                {
                    0.5
                }
                _ => f32::INFINITY,
            }
        })
    }

    /// Moves a point off a surface along its unit normal: far enough for neither rounding nor a coplanar neighbour
    /// to matter, and 1e-5 of the scene's diagonal at least.
    pub fn lift(&self, point: Vec3, normal: Vec3) -> Vec3 {
        point + normal * lift_distance(self.geometry, point)
    }
}

/// How far [`SceneTracer::lift`] moves a point, metres.
pub fn lift_distance(geometry: &Geometry, point: Vec3) -> f32 {
    (geometry.diagonal() * 1e-5).max(point.abs().max_element() * 16.0 * f32::EPSILON)
}
