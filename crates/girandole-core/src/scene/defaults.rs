//! A camera and a light for scenes that have none.

use super::{
    Camera, Environment, Geometry, LocalView, Material, Mesh, NONE, Projection, PunctualKind, PunctualLight,
    Scene, Transform, View,
};
use crate::trace::SceneTracer;
use glam::Vec3;

/// Irradiance that a default light gives the scene's centre, W/m²: a white wall then shines with about 1 W/(sr·m²).
const IRRADIANCE: f32 = 3.0;
/// Aspect for which a default light is kept out of the picture.
const WIDEST: f32 = 16.0 / 9.0;
/// Vertical angle of view of the default camera outside and in a room, radians.
const YFOV: [f32; 2] = [0.8, 1.1];

impl Scene {
    /// Adds a camera if the scene has none: one that sees all of it (in pictures at least as wide as high), or, in a
    /// closed room, one that looks through the room from where it sees farthest.
    pub fn ensure_camera(&mut self) {
        if !self.cameras.is_empty() {
            return;
        }
        let geometry = Geometry::new(self);
        let (min, max) = geometry.main_bounds();
        let center = (min + max) * 0.5;
        let radius = ((max - min).length() * 0.5).max(1e-3);
        let tracer = SceneTracer::new(self, &geometry);
        let (eye, target, yfov) = match inside(&tracer) {
            Some(point) => {
                let (eye, target) = room_view(&tracer, point);
                (eye, target, YFOV[1])
            }
            None => {
                let direction = Vec3::new(0.45, 0.35, 1.0).normalize();
                let distance = radius / libm::sinf(YFOV[0] * 0.5) * 1.05;
                (center + direction * distance, center, YFOV[0])
            }
        };
        let shift = geometry.origin.as_vec3();
        let node = self.add_node("camera", Transform::looking_at(eye + shift, target + shift));
        self.cameras.push(Camera {
            name: "camera".into(),
            node,
            projection: Projection::Perspective { yfov },
        });
    }

    /// Adds a light if nothing in the scene shines, and says so in a warning: a point light under the ceiling of a
    /// closed room, otherwise a square of light above, beside and in front of the scene, outside of what its cameras
    /// see. It gives the scene's centre an irradiance of about 3 W/m².
    pub fn ensure_light(&mut self) {
        if self.shines() {
            return;
        }
        self.warn(format!("`{}` has no light: it is lit by a default one", self.name));
        let geometry = Geometry::new(self);
        let tracer = SceneTracer::new(self, &geometry);
        let room = inside(&tracer);
        let ceiling = room.and_then(|p| Some((p, tracer.closest_hit(p, Vec3::Y, f32::INFINITY, NONE)?.t)));
        let shift = geometry.origin.as_vec3();
        match ceiling {
            Some((point, height)) => {
                let distance = height * 0.9;
                let place = Transform::translation(point + Vec3::Y * distance + shift);
                let node = self.add_node("default light", place);
                self.lights.push(PunctualLight {
                    name: "default light".into(),
                    node,
                    kind: PunctualKind::Point,
                    intensity: Vec3::splat(IRRADIANCE * distance * distance),
                });
            }
            None => self.add_soft_box(&geometry),
        }
    }

    fn shines(&self) -> bool {
        let emits = |material: u32| self.materials.get(material as usize).is_some_and(Material::emits);
        self.environment.as_ref().is_some_and(Environment::shines)
            || self.lights.iter().any(|l| l.intensity.max_element() > 0.0)
            || self
                .placed_objects()
                .any(|(_, o)| self.meshes[o.mesh].triangles.iter().any(|t| emits(t.material)))
    }

    fn add_soft_box(&mut self, geometry: &Geometry) {
        let (min, max) = geometry.main_bounds();
        let center = (min + max) * 0.5;
        let radius = ((max - min).length() * 0.5).max(1e-3);
        let (distance, half) = (radius * 1.6, radius * 0.4);
        let view = |camera| View::new(self, camera, WIDEST).relative_to(geometry.origin);
        let views: Vec<LocalView> = self.cameras.iter().map(view).collect();
        let forward = views.first().map_or(Vec3::NEG_Z, |v| v.forward);
        let front = Vec3::new(-forward.x, 0.0, -forward.z).normalize_or(Vec3::Z);
        let side = Vec3::Y.cross(front);
        // Ever steeper, on either side, until no camera sees it; at last from where the first camera looks.
        let places =
            [(0.8, 0.6, -0.6), (0.8, 0.6, 0.6), (1.0, 0.2, -0.2), (1.0, -0.6, -0.6), (1.0, -0.6, 0.6)];
        let mut directions: Vec<Vec3> =
            places.map(|(up, f, s)| (Vec3::Y * up + front * f + side * s).normalize()).into();
        directions.push((Vec3::Y * 0.5 - forward).normalize_or(Vec3::Y));
        directions.push(-forward);
        let shift = geometry.origin.as_vec3();
        let place =
            |direction: Vec3| Transform::looking_at(center + direction * distance + shift, center + shift);
        let corners =
            [(-half, -half), (-half, half), (half, half), (half, -half)].map(|(x, y)| Vec3::new(x, y, 0.0));
        let hidden = |direction: &Vec3| {
            let world = place(*direction).affine();
            let corners = corners.map(|c| (world.transform_point3(c.as_dvec3()) - geometry.origin).as_vec3());
            views.iter().all(|view| {
                let from_back = (view.eye - corners[0]).dot(*direction) > 0.0;
                from_back || outside(view, &corners)
            })
        };
        let direction = directions.iter().copied().find(hidden).unwrap_or(directions[0]);
        let radiance = IRRADIANCE * distance * distance / (4.0 * half * half);
        let material = self.add_material(Material::emitter("default light", Vec3::splat(radiance)));
        let mut mesh = Mesh::default();
        mesh.add_polygon(&corners, material);
        self.add_object("default light", mesh, place(direction));
    }
}

/// Whether a view has all the points on the far side of one of its edges, or behind it.
fn outside(view: &LocalView, points: &[Vec3]) -> bool {
    let beyond = |axis: Vec3, extent: f32| {
        points.iter().all(|&p| {
            let to = p - view.eye;
            let depth = if view.orthographic { 1.0 } else { to.dot(view.forward) };
            to.dot(axis) > extent * depth
        })
    };
    let behind = !view.orthographic && points.iter().all(|&p| (p - view.eye).dot(view.forward) < 0.0);
    behind
        || beyond(view.right, view.half_extent.x)
        || beyond(-view.right, view.half_extent.x)
        || beyond(view.up, view.half_extent.y)
        || beyond(-view.up, view.half_extent.y)
}

/// A point inside a closed room, if the scene is one: the centre, or one near it where that lies inside of something.
fn inside(tracer: &SceneTracer<'_>) -> Option<Vec3> {
    let (min, max) = tracer.geometry().main_bounds();
    let (center, half) = ((min + max) * 0.5, (max - min) * 0.5);
    let offsets = [(0.0, 0.0, 0.0), (0.0, 0.4, 0.0), (0.4, 0.3, 0.4), (-0.4, 0.3, -0.4), (0.4, 0.3, -0.4)];
    offsets
        .into_iter()
        .map(|(x, y, z)| center + half * Vec3::new(x, y, z))
        .find(|&point| is_enclosed(tracer, point))
}

/// Whether rays in all directions meet surfaces, and most of them fronts. (Seen from inside of a closed object, all
/// would be backs, double-sided or not.)
fn is_enclosed(tracer: &SceneTracer<'_>, point: Vec3) -> bool {
    let (scene, geometry) = (tracer.scene(), tracer.geometry());
    let mut fronts = 0;
    for i in (0..27).filter(|&i| i != 13) {
        let direction = Vec3::new((i % 3) as f32 - 1.0, (i / 3 % 3) as f32 - 1.0, (i / 9) as f32 - 1.0);
        // Not exactly along axes and diagonals, where edges of rooms lie.
        let direction = (direction + Vec3::new(0.013, 0.007, 0.011)).normalize();
        let Some(hit) = tracer.closest_hit(point, direction, f32::INFINITY, NONE) else { return false };
        let material = geometry.triangles[hit.triangle as usize].material;
        if geometry.normal(hit.triangle).dot(direction) < 0.0 {
            fronts += 1;
        } else if !scene.materials[material as usize].double_sided {
            return false;
        }
    }
    fronts >= 21
}

/// Eye and target of the widest of eight views through a room from its walls and corners, past `point`.
fn room_view(tracer: &SceneTracer<'_>, point: Vec3) -> (Vec3, Vec3) {
    let reach = |from: Vec3, direction: Vec3| {
        tracer.closest_hit(from, direction, f32::INFINITY, NONE).map_or(0.0, |hit| hit.t)
    };
    let up = reach(point, Vec3::Y).min(tracer.geometry().diagonal());
    let point = point + Vec3::Y * (0.15 * up);
    let mut best = (f32::NEG_INFINITY, point, point + Vec3::NEG_Z);
    for (x, z) in [(1, 1), (-1, 1), (1, -1), (-1, -1), (0, 1), (1, 0), (-1, 0), (0, -1)] {
        let direction = Vec3::new(x as f32, 0.0, z as f32).normalize();
        let distance = reach(point, direction) * 0.85;
        let eye = point + direction * distance;
        let target = point - direction * distance * 0.3 - Vec3::Y * (0.3 * up);
        // The mean of what rays through a 4:3 picture reach.
        let place = Transform::looking_at(eye, target).affine();
        let half = libm::tanf(YFOV[1] * 0.5);
        let mut sum = 0.0;
        for i in 0..63 {
            let (u, v) = ((i % 9) as f32 / 4.0 - 1.0, (i / 9) as f32 / 3.0 - 1.0);
            let ray = glam::DVec3::new(f64::from(u * half * 4.0 / 3.0), f64::from(v * half), -1.0);
            sum += reach(eye, place.transform_vector3(ray).as_vec3().normalize());
        }
        if sum > best.0 * 1.001 || best.0 < 0.0 {
            best = (sum, eye, target);
        }
    }
    (best.1, best.2)
}
