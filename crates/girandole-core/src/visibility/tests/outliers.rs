//! Something far away makes nothing wrong.

use super::*;
use crate::scene::builtin::{self, MovingObject, shapes};

/// The room `table` with a low shelf over its floor, and things far away.
fn scene(far: Option<f32>) -> Scene {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("it is built in");
    let low = 0.004;
    let shelf = [vec3(-1.5, low, 0.5), vec3(-1.5, low, 1.5), vec3(-0.5, low, 1.5), vec3(-0.5, low, 0.5)];
    add(&mut scene, polygon(&shelf, MaterialId(0)));
    if let Some(far) = far {
        let at = |i: f32| Transform::translation(vec3(far, 0.3 * far, far * 0.1 * i));
        scene.add_object("ball", shapes::sphere(0.2, 12, 8, MaterialId(0)), at(1.0));
        scene.add_object("box", shapes::cuboid(Vec3::splat(-0.3), Vec3::splat(0.3), MaterialId(0)), at(-1.0));
        scene.add_object(
            "shade",
            shapes::cuboid(vec3(-0.5, -0.02, -0.5), vec3(0.5, 0.02, 0.5), MaterialId(0)),
            at(-1.001),
        );
    }
    scene
}

#[test]
fn rays_agree_however_far_away_outliers_are() {
    for far in [2e3, 2e4, 2e5] {
        let scene = scene(Some(far));
        let geometry = Geometry::new(&scene);
        assert!(geometry.extent() > 100.0 * geometry.diagonal());
        let mut lights = sampled(&scene, &geometry, 60).samples().to_vec();
        // Some light among what is far away.
        let at = geometry.positions[geometry.objects[scene.objects.len() - 3].vertices.start as usize];
        for i in 0..6 {
            let position = at + vec3(0.5 * i as f32, 1.0, -0.2 * far);
            lights.push(light(position, vec3(0.1, -1.0, 0.2 * i as f32).normalize(), Profile::Hemisphere));
        }
        lights.push(light(vec3(0.0, far, 0.0), vec3(0.3, -1.0, 0.1).normalize(), Profile::Directional));
        let database = build(&scene, &geometry, lights.clone());
        let mut numbers = Numbers(far as u64);
        check_receivers(&geometry, &database, &mut numbers);
        let verdict = verify(&scene, &geometry, &lights, &database, 6000, &mut numbers);
        assert_eq!(verdict.wrong, 0, "{far}: {verdict:?}");
        assert!(verdict.seams * 50 < verdict.rays.iter().sum(), "{verdict:?}");
        assert!(verdict.wrong_if_swapped > 1000, "{verdict:?}");
        let shares = database.counts().area_shares;
        assert!(shares[State::Partial as usize] < 0.5, "{far}: {shares:?}");
    }
}

#[test]
fn the_floor_below_a_low_shelf_stays_dark() {
    for far in [None, Some(2e4)] {
        let scene = scene(far);
        let geometry = Geometry::new(&scene);
        let floor = vec3(-1.0, 0.0, 1.0).as_dvec3() - geometry.origin;
        let floor = floor.as_vec3();
        let tracer = SceneTracer::new(&scene, &geometry);
        let under = tracer.closest_hit(floor + Vec3::Y * 0.002, Vec3::NEG_Y, 0.1, NONE).expect("the floor");
        let origin = tracer.offset_ray_origin(floor, Vec3::Y);
        let mut blocked = 0;
        let lights = sampled(&scene, &geometry, 40);
        for l in lights.samples() {
            if l.geometric_factor(floor, Vec3::Y, Vec3::Y, Clamp::Off).is_some() {
                assert!(tracer.occluded(origin, under.triangle, l.position, l.triangle()), "{far:?}");
                blocked += 1;
            }
        }
        assert!(blocked > 5);
        let database = build(&scene, &geometry, lights.samples().to_vec());
        let leaf = database.receivers().leaf_at(under.triangle, floor, true).expect("it is shaded");
        for (l, state) in lights.samples().iter().zip(database.leaf_states(leaf)) {
            let facing = l.geometric_factor(floor, Vec3::Y, Vec3::Y, Clamp::Off).is_some();
            assert!(!facing || *state != State::Unoccluded, "{far:?}");
        }
        // With the size of all that there is, ray origins would be above the shelf.
        assert!(far.is_none() || geometry.extent() * 1e-5 > 0.004, "the control");
    }
}
