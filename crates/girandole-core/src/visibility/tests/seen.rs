//! Receivers that a view may see, against the eye's rays.

use super::random::{random_lights, random_room};
use super::*;
use crate::scene::{ClipPlanes, LocalView};

/// A view of a right angle from an eye along a direction.
pub fn looking(eye: Vec3, forward: Vec3) -> LocalView {
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

/// Adds walls that hide much, of one side and of two, each of them four polygons that leave a gap sometimes.
pub fn add_walls(scene: &mut Scene, numbers: &mut Numbers) {
    for material in [0, 1, 1] {
        let (at, half, turn) = (numbers.vector(), 1.0 + 2.0 * numbers.unit(), numbers.rotation());
        let gap = if numbers.unit() < 0.3 { 0.02 } else { 0.0 };
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let corner = |u: f32, v: f32| {
                at + turn * vec3((x * (1.0 + gap) + u - 1.0) * half, (y + v - 1.0) * half, 0.0)
            };
            let corners = [corner(0., 0.), corner(1., 0.), corner(1., 1.), corner(0., 1.)];
            add(scene, polygon(&corners, material.into()));
        }
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
        add_walls(&mut scene, &mut numbers);
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let database = build(&scene, &geometry, vec![light(numbers.vector(), Vec3::Y, Profile::Cosine)]);
        for _ in 0..4 {
            let (low, high) = geometry.bounds;
            let eye = (low + high) * 0.5 + (high - low) * 0.45 * numbers.vector();
            let view = looking(eye, numbers.vector().normalize());
            let seen = database.seen_leaves(&view);
            let all =
                database.seen_leaves(&LocalView { clip: ClipPlanes { near: 1e3, ..view.clip }, ..view });
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
    assert!(hits > 40_000 && 8 * hidden > in_view, "{hits} {hidden} {in_view}");
}

#[test]
fn nothing_of_a_light_comes_to_leaves_that_polygons_cover_together() {
    let mut numbers = Numbers(43);
    let [mut covered, mut partial, mut seams, mut wrong, mut wrong_if_swapped] = [0; 5];
    for _ in 0..160 {
        let mut scene = random_room(&mut numbers);
        add_walls(&mut scene, &mut numbers);
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let lights = random_lights(&scene, &geometry, &mut numbers, 16);
        let database = build(&scene, &geometry, lights.clone());
        for _ in 0..300 {
            let triangle = numbers.below(geometry.triangles.len()) as u32;
            let position = geometry.point(triangle, barycentric(&mut numbers));
            let normal = geometry.normal(triangle);
            let leaf = database.receivers().leaf_at(triangle, position, true).expect("it is shaded");
            let lifted = tracer.offset_ray_origin(position, normal);
            for (index, light) in lights.iter().enumerate() {
                if database.leaf_states(leaf)[index] != State::Partial
                    || light.geometric_factor(position, normal, normal, Clamp::Off).is_none()
                {
                    continue;
                }
                let is_covered = database.is_covered(leaf, index as u32);
                let to = match light.profile {
                    Profile::Directional => {
                        lifted - light.normal * (lifted.length() + 2.0 * geometry.extent())
                    }
                    _ => light.position,
                };
                let blocking = tracer.occluder(lifted, triangle, to, light.triangle(), NONE);
                // Where surfaces meet, a point may be rounded to behind the other one.
                let at_seam = geometry.triangles.iter().enumerate().any(|(t, _)| {
                    let height = geometry.normal(t as u32).dot(lifted - geometry.corners(t as u32)[0]);
                    t as u32 != triangle && height.abs() <= 5e-7 * geometry.diagonal()
                });
                partial += 1;
                covered += usize::from(is_covered);
                let free = blocking.is_none();
                wrong += usize::from(is_covered && free && !at_seam);
                seams += usize::from(is_covered && free && at_seam);
                wrong_if_swapped += usize::from(!is_covered && free);
            }
        }
    }
    assert_eq!(wrong, 0, "{covered} of {partial}");
    // The control: enough is covered, and what is not is seen.
    assert!(
        50 * seams < covered && 15 * covered > partial && wrong_if_swapped > 1000,
        "{seams} {covered} {partial}"
    );
}

#[test]
fn what_an_eye_sees_of_a_leaf_is_within_the_polygon_of_that() {
    let mut numbers = Numbers(43);
    let [mut hits, mut smaller] = [0; 2];
    for room in 0..60 {
        let scene = random_room(&mut numbers);
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let database = build(&scene, &geometry, vec![light(numbers.vector(), Vec3::Y, Profile::Cosine)]);
        let (low, high) = geometry.bounds;
        let eye = (low + high) * 0.5 + (high - low) * 0.45 * numbers.vector();
        let view = LocalView { orthographic: room % 4 == 0, ..looking(eye, numbers.vector().normalize()) };
        for _ in 0..200 {
            let ndc = Vec2::new(numbers.unit(), numbers.unit()) * 2.0 - 1.0;
            let (origin, direction) = view.ray(ndc);
            let Some(hit) = tracer.closest_visible(origin, direction) else { continue };
            let (front, point) =
                (geometry.normal(hit.triangle).dot(direction) < 0.0, origin + direction * hit.t);
            let Some(leaf) = database.receivers().leaf_at(hit.triangle, point, front) else { continue };
            let Some(polygon) = database.seen_polygon(leaf, &view) else { continue };
            let whole = database.receivers().polygon(database.receivers().leaves[leaf as usize].node);
            hits += 1;
            smaller += usize::from(polygon != whole);
            for axis in [Vec3::X, Vec3::Y, Vec3::Z, numbers.vector().normalize()] {
                let along = |p: &Vec3| p.dot(axis);
                let most = polygon.iter().map(along).fold(f32::NEG_INFINITY, f32::max);
                let least = polygon.iter().map(along).fold(f32::INFINITY, f32::min);
                let at = along(&point);
                assert!(at <= most + 1e-3 && at >= least - 1e-3, "{room}: {point} {polygon:?}");
            }
        }
    }
    assert!(hits > 2000 && smaller > 1000, "{hits} {smaller}");
}
