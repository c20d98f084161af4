//! What shadow maps of an environment's light show: what views see, in maps of ordinary size.

use super::{LightSample, Profile};
use crate::parallel::in_slices;
use crate::scene::{Geometry, View};
use crate::slices::complete;
use crate::trace::SceneTracer;
use glam::{Vec2, Vec3};

/// Rays that look for what is seen, of all views and of each at least.
const RAYS: u32 = 4096;
const LEAST_RAYS: u32 = 64;
/// Of a slice.
const SLICE: usize = 1024;
/// What is seen may be larger by this factor before others are made.
const MARGIN: f32 = 1.25;
/// Maps stay as they are until they are larger than what is seen by this factor.
const TOO_LARGE: f32 = 2.5;

/// Share of what is seen that the core is to hold.
const MOST: f32 = 0.9;
/// There is a core, smaller than the whole, where that is no more than this share of it across.
const SMALL_CORE: f32 = 0.5;
/// A core stays until it shows less than this share, lest maps change back and forth with every step of a view.
const KEPT: f32 = 0.8;

/// A sphere in the scene, and one with the same centre that shows most of what is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "import", derive(serde::Serialize, serde::Deserialize))]
pub struct BoundingSphere {
    /// Relative to the geometry's origin.
    pub center: Vec3,
    /// Metres.
    pub radius: f32,
    /// That of the core, metres; the same as the radius where one would not be much smaller.
    pub core: f32,
}

impl BoundingSphere {
    /// About all of the scene.
    pub(super) fn of_scene(geometry: &Geometry) -> Self {
        let radius = geometry.extent() * 0.5;
        Self { center: geometry.center(), radius, core: radius }
    }

    /// About what views see, and a little more; all of the scene for no views.
    pub(super) async fn seen(tracer: &SceneTracer<'_>, views: &[View]) -> Self {
        Self::about(tracer.geometry(), &seen(tracer, views).await)
    }

    /// About points.
    fn about(geometry: &Geometry, seen: &[Vec3]) -> Self {
        let all = Self::of_scene(geometry);
        let low = seen.iter().fold(Vec3::INFINITY, |a, &b| a.min(b));
        let high = seen.iter().fold(Vec3::NEG_INFINITY, |a, &b| a.max(b));
        let about = |center: Vec3| {
            let mut distances: Vec<f32> = seen.iter().map(|p| p.distance(center)).collect();
            distances.sort_unstable_by(f32::total_cmp);
            let within = |share: f32| distances.get((share * (distances.len() as f32 - 1.0)) as usize);
            let [core, radius] = [MOST, 1.0].map(|share| MARGIN * within(share).copied().unwrap_or_default());
            Self { center, radius, core }
        };
        let cored = about(middle_of_most(seen));
        if cored.core > 0.0 && cored.core <= SMALL_CORE * cored.radius.min(all.radius) {
            return cored;
        }
        let whole = about((low + high) * 0.5);
        if seen.is_empty() || whole.radius <= 0.0 || whole.radius >= all.radius {
            return all;
        }
        Self { core: whole.radius, ..whole }
    }

    /// The same for other views, as long as it shows all of what they see without wasting much.
    pub(super) fn or_seen(self, tracer: &SceneTracer, views: &[View]) -> Self {
        let seen = complete(seen(tracer, views));
        let next = Self::about(tracer.geometry(), &seen);
        let apart = self.center.distance(next.center);
        let suffices = |held: f32, next: f32| apart + next / MARGIN <= held && held <= TOO_LARGE * next;
        let in_core = seen.iter().filter(|p| p.distance(self.center) <= self.core).count() as f32;
        let is_kept = self.core < self.radius && in_core >= KEPT * seen.len() as f32;
        let has_core = suffices(self.core, next.core) || (is_kept && self.core <= TOO_LARGE * next.core);
        if suffices(self.radius, next.radius) && has_core { self } else { next }
    }

    /// Makes maps of an environment's samples show it.
    pub(super) fn fit(self, samples: &mut [LightSample]) {
        for sample in samples {
            if let Profile::Distant { shown, .. } = &mut sample.profile {
                *shown = self;
            }
        }
    }
}

/// Points that views see, evenly over their pictures.
async fn seen(tracer: &SceneTracer<'_>, views: &[View]) -> Vec<Vec3> {
    let count = (RAYS / views.len().max(1) as u32).max(LEAST_RAYS);
    let side = f64::from(count).sqrt() as u32;
    let origin = tracer.geometry().origin;
    let mut result = Vec::new();
    for view in views.iter().map(|view| view.relative_to(origin)) {
        let at = |i: u32| Vec2::new((i % side) as f32, (i / side) as f32) / (side - 1) as f32;
        let hit = |i: usize| {
            let (eye, direction) = view.ray(2.0 * at(i as u32) - 1.0);
            tracer
                .closest_visible_within(eye, direction, view.clip.reach())
                .map(|hit| eye + direction * hit.t)
        };
        result.extend(in_slices((side * side) as usize, SLICE, hit).await.into_iter().flatten());
    }
    result
}

/// The middle of most of these points, axis by axis.
fn middle_of_most(points: &[Vec3]) -> Vec3 {
    let middle = |axis: usize| {
        let mut along: Vec<f32> = points.iter().map(|p| p[axis]).collect();
        along.sort_unstable_by(f32::total_cmp);
        let last = along.len().saturating_sub(1) as f32;
        let at = |share: f32| along.get((share * last) as usize).copied().unwrap_or_default();
        (at(1.0 - MOST) + at(MOST)) * 0.5
    };
    Vec3::from_array([0, 1, 2].map(middle))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin::{self, MovingObject};
    use crate::scene::{Environment, FieldOfView, Material, MaterialId, Mesh, Scene, Transform, Viewpoint};
    use glam::DVec3;

    fn seen_by(tracer: &SceneTracer, views: &[View]) -> BoundingSphere {
        complete(BoundingSphere::seen(tracer, views))
    }

    /// A view of a room from one side of it, and the room with another one far away.
    fn rooms() -> (Scene, View) {
        let mut scene = builtin::build("table", MovingObject::None).expect("a room");
        let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
        let shell = scene.objects[0].clone();
        let mesh = scene.meshes[shell.mesh].clone();
        scene.add_object("another", mesh, Transform::translation(Vec3::new(40.0, 0.0, 0.0)));
        scene.environment = Some(Environment::constant(Vec3::ONE).expect("light"));
        (scene, view)
    }

    #[test]
    fn maps_show_what_is_seen_and_little_else() {
        let (scene, view) = rooms();
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let all = BoundingSphere::of_scene(&geometry);
        assert_eq!(seen_by(&tracer, &[]), all);
        let shown = seen_by(&tracer, &[view]);
        assert!(shown.radius < 0.4 * all.radius, "{shown:?} of {all:?}");
        // Between the rays that looked for it, too.
        let local = view.relative_to(geometry.origin);
        for i in 0..5000 {
            let at = Vec2::from_array([0, 1].map(|d| crate::math::sequence::sample(i, d, 1)));
            let (eye, direction) = local.ray(2.0 * at - 1.0);
            let hit = tracer.closest_visible(eye, direction).expect("a wall");
            assert!((eye + direction * hit.t).distance(shown.center) < shown.radius);
        }
        // Two views need both.
        let away = Viewpoint {
            eye: DVec3::new(41.0, 1.5, 0.0),
            target: DVec3::new(40.0, 1.0, 0.0),
            up: DVec3::Y,
            field: FieldOfView::Perspective { degrees: 57.0 },
            clip: Default::default(),
        };
        let away = away.view(1.0).expect("a view");
        let both = seen_by(&tracer, &[view, away]);
        assert!(both.radius > 2.0 * shown.radius, "{both:?}");
        // It stays while it suffices.
        let turned = View { forward: (view.forward + view.right * 0.05).normalize(), ..view };
        assert_eq!(shown.or_seen(&tracer, &[turned]), shown);
        assert_ne!(shown.or_seen(&tracer, &[away]), shown);
        assert_eq!(both.or_seen(&tracer, &[view]), shown, "too large by far");
        assert!([shown, both, all].iter().all(|sphere| sphere.core == sphere.radius), "all of it is a room");
    }

    #[test]
    fn most_of_what_is_seen_is_in_the_core() {
        // A wall that fills the picture but for a part on its right, where another one is seen far behind it.
        let seen = |part: f32, held: Option<BoundingSphere>| {
            let wall = |x: f32, size: f32, z: f32| {
                let mut mesh = Mesh::default();
                mesh.add_polygon(
                    &[(-size, -size), (x, -size), (x, size), (-size, size)].map(|(x, y)| Vec3::new(x, y, z)),
                    MaterialId(0),
                );
                mesh
            };
            let mut scene = Scene::default();
            scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
            scene.add_object("wall", wall(1.0 - 2.0 * part, 3.0, -1.0), Transform::IDENTITY);
            scene.add_object("far", wall(200.0, 200.0, -100.0), Transform::IDENTITY);
            let ahead = Viewpoint {
                eye: DVec3::ZERO,
                target: DVec3::NEG_Z,
                up: DVec3::Y,
                field: FieldOfView::Perspective { degrees: 90.0 },
                clip: Default::default(),
            };
            let geometry = Geometry::new(&scene);
            let tracer = SceneTracer::new(&scene, &geometry);
            let views = [ahead.view(1.0).expect("a view")];
            held.map_or_else(|| seen_by(&tracer, &views), |held| held.or_seen(&tracer, &views))
        };
        let cored = seen(0.05, None);
        assert!(cored.core > 1.4 && cored.core < 3.0 && cored.radius > 100.0, "{cored:?}");
        // The controls: where much is seen far away, and where nothing is.
        let [half, none] = [0.5, 0.0].map(|part| seen(part, None));
        assert!(
            half.core == half.radius && none.core == none.radius && none.radius < 3.0,
            "{half:?} {none:?}"
        );
    }
}
