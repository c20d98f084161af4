//! Receivers that a view may see, against the eye's rays.

use super::random::random_room;
use super::*;
use crate::scene::{ClipPlanes, LocalView};

/// A view of a right angle from an eye along a direction.
fn looking(eye: Vec3, forward: Vec3) -> LocalView {
    let right = forward.any_orthonormal_vector();
    LocalView {
        eye,
        right,
        up: right.cross(forward),
        forward,
        half_extent: Vec2::ONE,
        center: Vec2::ZERO,
        orthographic: false,
        depth: None,
        clip: ClipPlanes::NONE,
    }
}

/// What a ray of a view hits and was not to be seen; and whether it hits anything.
fn stray(
    (database, tracer, seen): (&VisibilityDatabase, &SceneTracer, &[bool]),
    view: &LocalView,
    ndc: Vec2,
) -> (Option<u32>, bool) {
    let (origin, direction) = view.ray(ndc);
    let Some(hit) = tracer.closest_visible(origin, direction) else { return (None, false) };
    let front = tracer.geometry().normal(hit.triangle).dot(direction) < 0.0;
    let leaf = database.receivers().leaf_at(hit.triangle, origin + direction * hit.t, front);
    (leaf.filter(|leaf| !seen[*leaf as usize]), true)
}

#[test]
fn whatever_an_eye_sees_is_among_the_leaves_that_it_may_see() {
    let mut numbers = Numbers(41);
    let [mut hits, mut strays, mut hidden, mut in_view] = [0; 4];
    for _ in 0..240 {
        let mut scene = random_room(&mut numbers);
        // Walls that hide much, of one side and of two.
        for material in [0, 1, 1] {
            let (at, half) = (numbers.vector(), 1.0 + 2.0 * numbers.unit());
            let turn = numbers.rotation();
            let corner = |x: f32, y: f32| at + turn * vec3(x * half, y * half, 0.0);
            let corners = [corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)];
            add(&mut scene, polygon(&corners, material));
        }
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let database = build(&scene, &geometry, vec![light(numbers.vector(), Vec3::Y, Profile::Cosine)]);
        for _ in 0..4 {
            let (low, high) = geometry.bounds;
            let eye = (low + high) * 0.5 + (high - low) * 0.45 * numbers.vector();
            let view = looking(eye, numbers.vector().normalize());
            let seen = database.seen_leaves(&view);
            let all =
                database.seen_leaves(&LocalView { clip: ClipPlanes { near: 1e-6, ..view.clip }, ..view });
            assert!(seen.iter().zip(&all).all(|(seen, all)| all >= seen), "what is cut off hides nothing");
            in_view += all.iter().filter(|all| **all).count();
            hidden += seen.iter().zip(&all).filter(|(seen, all)| *all > *seen).count();
            for _ in 0..200 {
                let ndc = Vec2::new(numbers.unit(), numbers.unit()) * 2.0 - 1.0;
                let (stray, is_hit) = stray((&database, &tracer, &seen), &view, ndc);
                hits += usize::from(is_hit);
                strays += usize::from(stray.is_some());
            }
        }
    }
    assert_eq!(strays, 0, "of {hits}");
    // The control: enough is hidden, and hit.
    assert!(hits > 40_000 && 4 * hidden > in_view, "{hits} {hidden} {in_view}");
}
