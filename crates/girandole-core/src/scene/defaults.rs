//! A camera for scenes that have none.

use super::{Camera, Geometry, NONE, Projection, Scene, Transform};
#[cfg(feature = "import")]
use super::{ClipPlanes, View};
use crate::math::{sequence, warp};
use crate::trace::SceneTracer;
use glam::Vec3;

/// Vertical angle of view of the default camera outside and in a room, radians.
const YFOV: [f32; 2] = [0.8, 1.1];
/// What is lower than this share of its width is seen from above.
const FLAT: f32 = 0.15;
/// Lines of sight from outside that tell a room from a hollow object.
const SIGHT_LINES: u32 = 64;
/// Lines of sight that tell whether a camera sees anything.
#[cfg(feature = "import")]
const LINES_OF_SIGHT: u32 = 1024;

impl Scene {
    /// Adds a camera if the scene has none: one that sees all of it (in pictures at least as wide as high), or, in a
    /// closed room, one that looks through the room from where it sees farthest.
    pub fn ensure_camera(&mut self) {
        if self.cameras.is_empty() {
            self.ensure_camera_in(&Geometry::new(self));
        }
    }

    /// The same, with its geometry.
    pub(super) fn ensure_camera_in(&mut self, geometry: &Geometry) {
        if !self.cameras.is_empty() {
            return;
        }
        let (min, max) = geometry.main_bounds();
        let center = (min + max) * 0.5;
        let radius = ((max - min).length() * 0.5).max(1e-3);
        let tracer = SceneTracer::of_all_surfaces(self, geometry);
        let (eye, target, yfov) = match inside(&tracer) {
            Some(point) => {
                let (eye, target) = room_view(&tracer, point);
                (eye, target, YFOV[1])
            }
            None => {
                let size = max - min;
                let is_flat = size.y < FLAT * size.x.max(size.z);
                let direction = Vec3::new(0.45, if is_flat { 1.2 } else { 0.35 }, 1.0).normalize();
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
            clip: Default::default(),
        });
    }
}

impl Scene {
    /// Takes the planes of cameras away that leave nothing of what they see, as those of files in other units do, and says so.
    #[cfg(feature = "import")]
    pub(super) fn doubt_clip_planes(&mut self, geometry: &Geometry) {
        let doubtful: Vec<usize> =
            (0..self.cameras.len()).filter(|&i| cuts_into(self, geometry, &self.cameras[i])).collect();
        if doubtful.is_empty() {
            return;
        }
        let tracer = SceneTracer::of_all_surfaces(self, geometry);
        let cut: Vec<usize> = doubtful.into_iter().filter(|&i| cuts_all(&tracer, &self.cameras[i])).collect();
        for index in cut {
            let Camera { name, clip: ClipPlanes { near, far }, .. } = &self.cameras[index];
            self.warn(format!(
                "camera `{name}` sees nothing between its near plane at {near} m and its far plane at {far} m: it cuts nothing off"
            ));
            self.cameras[index].clip = ClipPlanes::NONE;
        }
    }
}

/// Whether a camera's planes may cut off anything worth mentioning.
#[cfg(feature = "import")]
fn cuts_into(scene: &Scene, geometry: &Geometry, camera: &Camera) -> bool {
    let view = View::new(scene, camera, 1.0).relative_to(geometry.origin);
    let (center, half) = (geometry.center(), geometry.extent() * 0.5);
    let middle = view.project(center).1;
    camera.clip.near > 1e-3 * geometry.extent() || camera.clip.far < middle + half
}

/// Whether nothing is seen between a camera's planes, and something without them.
#[cfg(feature = "import")]
fn cuts_all(tracer: &SceneTracer, camera: &Camera) -> bool {
    let view = View::new(tracer.scene(), camera, 1.0).relative_to(tracer.geometry().origin);
    let sees = |clip: ClipPlanes| {
        let view = super::LocalView { clip, ..view };
        (0..LINES_OF_SIGHT).any(|i| {
            let at = [0, 1].map(|d| 2.0 * sequence::sample(i, d, 0) - 1.0);
            let (origin, direction) = view.ray(at.into());
            tracer.closest_visible_within(origin, direction, clip.reach()).is_some()
        })
    };
    !sees(camera.clip) && sees(ClipPlanes::NONE)
}

/// A point inside a closed room, if the scene is one: the centre, or one near it where that lies inside of something.
pub(super) fn inside(tracer: &SceneTracer<'_>) -> Option<Vec3> {
    let (min, max) = tracer.geometry().main_bounds();
    let (center, half) = ((min + max) * 0.5, (max - min) * 0.5);
    let offsets = [(0.0, 0.0, 0.0), (0.0, 0.4, 0.0), (0.4, 0.3, 0.4), (-0.4, 0.3, -0.4), (0.4, 0.3, -0.4)];
    if shows_fronts(tracer, center, half.length()) {
        return None;
    }
    offsets
        .into_iter()
        .map(|(x, y, z)| center + half * Vec3::new(x, y, z))
        .find(|&point| is_enclosed(tracer, point))
}

/// Whether most of what is seen from outside are fronts: then it is something that was made to be looked at, hollow or not.
fn shows_fronts(tracer: &SceneTracer<'_>, center: Vec3, radius: f32) -> bool {
    let mut balance = 0;
    for i in 0..SIGHT_LINES {
        let s = [0, 1].map(|d| sequence::sample(i, d, 0));
        let direction = warp::sphere(s.into());
        let from = center + direction * (2.0 * radius);
        if let Some(hit) = tracer.closest_hit(from, -direction, f32::INFINITY, NONE) {
            let is_front = tracer.geometry().normal(hit.triangle).dot(direction) > 0.0;
            balance += if is_front { 1 } else { -1 };
        }
    }
    balance > 0
}

/// Whether rays in all directions meet surfaces, and most of them fronts. (Seen from inside of a closed object, all
/// would be backs, double-sided or not.)
pub(super) fn is_enclosed(tracer: &SceneTracer<'_>, point: Vec3) -> bool {
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
        } else if !scene.materials[material].double_sided {
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
