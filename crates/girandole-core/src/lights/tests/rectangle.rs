//! What light samples stand for, and the light near it.

use super::*;
use crate::math::warp;
use glam::Vec2;

fn random(index: u32, dimension: u32) -> f32 {
    sequence::sample(index, dimension, 11)
}

fn direction(index: u32, dimension: u32) -> Vec3 {
    warp::sphere(Vec2::new(random(index, dimension), random(index, dimension + 1)))
}

/// A rectangle of random place and proportions about the origin, and its normal.
fn random_rectangle(index: u32) -> (Rectangle, Vec3) {
    let normal = direction(index, 0);
    let (x, y) = warp::frame(normal);
    let half = [0.2 + random(index, 2), 0.05 + random(index, 3)];
    let center = direction(index, 4) * 0.3;
    (Rectangle { center, half_axes: [x * half[0], y * half[1]], is_open: true }, normal)
}

/// The mean over a rectangle of what lies in front of the receiver's plane, point by point, and that part's share.
fn point_by_point(rectangle: &Rectangle, normal: Vec3, position: Vec3, facing: Vec3) -> (Vec3, f32) {
    const N: u32 = 400;
    let [u, v] = rectangle.half_axes;
    let (mut sum, mut count) = (DVec3::ZERO, 0);
    for i in 0..N * N {
        let at = (Vec2::new((i % N) as f32, (i / N) as f32) + 0.5) * (2.0 / N as f32) - 1.0;
        let to = rectangle.center + u * at.x + v * at.y - position;
        if to.dot(facing) > 0.0 {
            let r2 = to.length_squared();
            sum += (to * (-normal.dot(to) / (r2 * r2))).as_dvec3();
            count += 1;
        }
    }
    ((sum / f64::from(N * N)).as_vec3(), count as f32 / (N * N) as f32)
}

#[test]
fn lamberts_formula_is_the_mean_over_what_is_in_front() {
    let (mut whole, mut cut) = (0, 0);
    for index in 0..300 {
        let (rectangle, normal) = random_rectangle(index);
        let position = rectangle.center + direction(index, 6) * (0.3 + 2.0 * random(index, 8));
        let facing = direction(index, 9);
        if (position - rectangle.center).dot(normal) < 0.05 {
            continue;
        }
        let (expected, part) = point_by_point(&rectangle, normal, position, facing);
        if part < 0.51 {
            continue;
        }
        *(if part == 1.0 { &mut whole } else { &mut cut }) += 1;
        let found = rectangle.mean_vector(position, facing);
        let tolerance = if part == 1.0 { 1e-3 } else { 1e-2 } * expected.length();
        assert!((found - expected).length() < tolerance, "{index}: {found} for {expected}, {part}");
        // Not both sides lie along where nothing changes.
        let differs = |axis: Vec3| {
            let beside = Rectangle { center: rectangle.center + axis * 0.2, ..rectangle };
            (beside.mean_vector(position, facing) - expected).length() > tolerance
        };
        assert!(rectangle.half_axes.into_iter().any(differs), "negative control");
    }
    assert!(whole > 20 && cut > 20, "{whole} {cut}");
}

/// A sample at a point of a plane, for fitting.
fn sample_at(position: Vec3, normal: Vec3) -> LightSample {
    LightSample {
        position,
        normal,
        intensity: Vec3::ONE,
        profile: Profile::Cosine,
        origin: SampleOrigin::Punctual { light: LightId(0) },
        rectangle: None,
    }
}

#[test]
fn rectangles_are_fitted_about_candidates_in_the_plane() {
    for (index, normal) in (0..).zip([Vec3::Y, Vec3::NEG_X, vec3(1.0, 1.0, 1.0).normalize()]) {
        let u = if index == 2 { vec3(2.0, -1.0, -1.0).normalize() } else { vec3(0.0, 0.0, 1.0) };
        let v = normal.cross(u);
        let whole = Rectangle { center: vec3(3.0, -1.0, 2.0), half_axes: [u * 0.5, v * 0.2], is_open: true };
        let at =
            |i: u32| whole.center + u * (random(i, index) - 0.5) + v * (0.4 * (random(i, index + 1) - 0.5));
        let candidates: Vec<LightSample> = (0..40).map(|i| sample_at(at(i), normal)).collect();
        let positions = || candidates.iter().map(|c| c.position);
        let fitted = Rectangle::about(&candidates[7], positions(), 0.4);
        assert!((fitted.area() / whole.area() - 1.0).abs() < 0.15, "{} {}", fitted.area(), whole.area());
        assert!(fitted.center.distance(whole.center) < 0.05, "{fitted:?}");
        let seen_from = fitted.half_axes[0].cross(fitted.half_axes[1]);
        assert!(seen_from.normalize().distance(normal) < 1e-5);
        // Too few, or all at one place: a square of the given area about the sample.
        for few in [&candidates[7..9], &[candidates[7]; 9]] {
            let square = Rectangle::about(&candidates[7], few.iter().map(|c| c.position), 0.4);
            assert!((square.area() - 0.4).abs() < 1e-5 && square.center == candidates[7].position);
        }
        // What lies on another plane, or in another one of the same normal, has no part in it.
        let other = sample_at(candidates[7].position, v);
        let above = sample_at(candidates[7].position + normal * 0.2, normal);
        assert!(Rectangle::shares_plane(&candidates[7], &candidates[8], 0.4));
        assert!(!Rectangle::shares_plane(&candidates[7], &other, 0.4));
        assert!(!Rectangle::shares_plane(&candidates[7], &above, 0.4));
    }
}

#[test]
fn points_far_away_see_a_point() {
    let (rectangle, normal) = random_rectangle(3);
    let sample = LightSample { rectangle: Some(rectangle), ..sample_at(rectangle.center, normal) };
    let g = |distance: f32, clamp| {
        let position = rectangle.center + normal * distance;
        sample.geometric_factor(position, -normal, -normal, clamp).map_or(0.0, |(g, _)| g)
    };
    let r = rectangle.radius();
    let both = |distance: f32| [g(distance, Clamp::Own), g(distance, Clamp::Off)];
    let [own, point] = both(Rectangle::NEAR[1] * r * 1.001);
    assert_eq!(own, point);
    let [own, point] = both(0.1 * r);
    assert!(own < 0.1 * point && own < std::f32::consts::PI / rectangle.area());
    // In between nothing jumps.
    let steps = (0..1000).map(|i| both(r * (Rectangle::NEAR[0] - 0.1 + 1.2e-3 * i as f32)));
    let ratios: Vec<f32> = steps.map(|[own, point]| own / point).collect();
    let jump = ratios.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
    assert!(ratios[0] < 0.95 && jump < 2e-3, "{} {jump}", ratios[0]);
}

#[test]
fn a_foot_is_lit_alike_wherever_in_what_is_before_and_behind_it_the_sample_lies() {
    let rectangle = Rectangle { center: Vec3::ZERO, half_axes: [Vec3::X, Vec3::NEG_Z], is_open: true };
    // On a wall whose plane leaves a quarter of the rectangle before it.
    let foot = vec3(0.5, 0.1, 0.0);
    let with_sample_at = |x: f32, clamp| {
        let sample = LightSample { rectangle: Some(rectangle), ..sample_at(vec3(x, 0.0, 0.3), Vec3::Y) };
        let g = sample.geometric_factor(foot, Vec3::X, Vec3::X, clamp);
        (g.map(|(g, _)| g), sample.is_before(foot, Vec3::X, Vec3::X))
    };
    let (expected, part) = point_by_point(&rectangle, Vec3::Y, foot, Vec3::X);
    assert!((part - 0.25).abs() < 0.01, "{part}");
    for (x, is_before) in [(-0.9, false), (0.4, false), (0.6, true), (0.9, true)] {
        let (g, found) = with_sample_at(x, Clamp::Own);
        assert!(g.is_some_and(|g| (g / expected.x - 1.0).abs() < 0.01), "{x}: {g:?} for {}", expected.x);
        assert_eq!(found, is_before);
        // The control: by its place alone, one behind the wall lights nothing.
        assert_eq!(with_sample_at(x, Clamp::Off).0.is_some(), is_before);
    }
    // Nothing of the rectangle lies before a wall beside it.
    let sample = LightSample { rectangle: Some(rectangle), ..sample_at(Vec3::ZERO, Vec3::Y) };
    assert_eq!(sample.geometric_factor(vec3(1.01, 0.1, 0.0), Vec3::X, Vec3::X, Clamp::Own), None);
}

#[test]
fn a_rectangle_without_extent_is_a_point() {
    let sample = sample_at(Vec3::ZERO, Vec3::Y);
    let lone = LightSample { rectangle: Some(Rectangle::square(Vec3::ZERO, Vec3::Y, 0.0)), ..sample };
    let g = |clamp| lone.geometric_factor(Vec3::Y * 0.1, Vec3::NEG_Y, Vec3::NEG_Y, clamp).map(|(g, _)| g);
    assert_eq!(g(Clamp::Own), g(Clamp::Off));
    assert!(g(Clamp::Own).is_some_and(f32::is_finite));
}

#[test]
fn samples_have_the_mean_colour_of_their_plane() {
    // Red and green deposits on a wall, blue ones beside it on another.
    let deposits: Vec<LightSample> = (0..300)
        .map(|i| {
            let (place, normal, intensity) = match i % 3 {
                0 => (vec3(random(i, 0), random(i, 1), 0.0), Vec3::Z, vec3(1.0, 0.0, 0.0)),
                1 => (vec3(random(i, 0), random(i, 1), 0.0), Vec3::Z, vec3(0.0, 1.0, 0.0)),
                _ => (vec3(0.0, random(i, 0), random(i, 1)), Vec3::X, vec3(0.0, 0.0, 1.0)),
            };
            let origin = SampleOrigin::Bounce { path: i, bounce: 1, triangle: 0 };
            LightSample { intensity, origin, ..sample_at(place, normal) }
        })
        .collect();
    let weights: Vec<f64> = deposits.iter().map(importance::power).collect();
    let sources = vec![Emission::Material(MaterialId(0)); deposits.len()];
    let candidates = Candidates {
        samples: &deposits,
        sources: &sources,
        weights: &weights,
        is_guided: false,
        tracer: None,
    };
    for Chosen { sample, .. } in resample(candidates, (6, &importance::Importance::uniform()), 0.5, 1).0 {
        let [red, green, blue] = sample.intensity.to_array();
        if sample.normal == Vec3::Z {
            assert!((0.3..0.7).contains(&(red / (red + green))) && blue == 0.0, "{sample:?}");
        } else {
            assert!(red == 0.0 && green == 0.0 && blue > 0.0, "{sample:?}");
        }
    }
}

#[test]
fn what_brings_little_does_not_stand_for_what_brings_much() {
    // Deposits at these heights and of these weights, for one sample: how often it lies higher than half a metre.
    let chosen_above = |deposits: &[(f32, f64)], is_guided: bool| {
        let (samples, weights): (Vec<LightSample>, Vec<f64>) = (0..)
            .zip(deposits)
            .map(|(i, &(height, weight))| {
                let origin = SampleOrigin::Bounce { path: i, bounce: 1, triangle: 0 };
                (
                    LightSample { origin, ..sample_at(vec3(random(i, 0), height, random(i, 1)), Vec3::Y) },
                    weight,
                )
            })
            .unzip();
        let sources = vec![Emission::Material(MaterialId(0)); samples.len()];
        let candidates =
            Candidates { samples: &samples, sources: &sources, weights: &weights, is_guided, tracer: None };
        let one = |seed| resample(candidates, (1, &importance::Importance::uniform()), 0.5, seed).0.remove(0);
        let is_above = |chosen: &Chosen| chosen.sample.position.y > 0.5;
        (0..500).filter(|&seed| is_above(&one(seed))).count() as f64 / 500.0
    };
    // A floor, and a board a metre above it.
    let chosen_on_board = |on_board: usize, weight: f64| {
        let mut deposits = [(0.0, 1.0); 60];
        deposits[..on_board].fill((1.0, weight));
        chosen_above(&deposits, false)
    };
    // Ten of sixty that bring a tenth for their power would be fifty times as bright as what is about them.
    assert_eq!(chosen_on_board(10, 0.1), 0.0);
    // Nor do two, too few to tell how large the board is.
    assert_eq!(chosen_on_board(2, 0.4), 0.0);
    // The controls: what brings as much as others, and what would be four times as bright, are chosen as often as they weigh.
    for (count, weight, expected) in [(10, 1.0, 1.0 / 6.0), (30, 0.3, 9.0 / 39.0), (2, 4.0, 8.0 / 66.0)] {
        let share = chosen_on_board(count, weight);
        assert!((share - expected).abs() < 0.06, "{share} for {expected}");
    }
    // Where there is nothing else it is chosen.
    assert_eq!(chosen_on_board(60, 0.1), 1.0);
    // Four boards with one each: of guided paths, the uppermost is not chosen where it would be eleven times as bright as it is.
    let uppermost = |weight: f64, is_guided: bool| {
        chosen_above(&[(2.0, weight), (-1.0, 1.0), (-2.0, 1.0), (-3.0, 1.0)], is_guided)
    };
    assert_eq!(uppermost(0.3, true), 0.0);
    for (weight, is_guided, expected) in [(0.3, false, 0.3 / 3.3), (1.0, true, 0.25)] {
        let share = uppermost(weight, is_guided);
        assert!((share - expected).abs() < 0.06 && share > 0.0, "{share} for {expected}");
    }
}

#[test]
fn what_lies_in_a_narrow_gap_does_not_stand_for_what_lies_beside_it() {
    // A floor, half of it below a board.
    let chosen_below = |height: f32, beside: u32| {
        let mut mesh = Mesh::default();
        square(&mut mesh, Vec3::ZERO, 2.0, true, MaterialId(0));
        mesh.add_box(vec3(0.0, height, -1.0), vec3(1.0, height + 0.1, 1.0), MaterialId(0));
        let (scene, geometry) = scene_of(mesh, vec![Material::default()]);
        let tracer = SceneTracer::new(&scene, &geometry);
        let deposits: Vec<LightSample> = (0..60)
            .map(|i| {
                let side = if i < beside { -1.0 } else { 1.0 };
                let place = vec3(side * (0.1 + 0.9 * random(i, 0)), 0.0, 2.0 * random(i, 1) - 1.0);
                let origin = SampleOrigin::Bounce { path: i, bounce: 1, triangle: 0 };
                LightSample { origin, ..sample_at(place - geometry.origin.as_vec3(), Vec3::Y) }
            })
            .collect();
        let weights: Vec<f64> = deposits.iter().map(importance::power).collect();
        let sources = vec![Emission::Material(MaterialId(0)); deposits.len()];
        let candidates = Candidates {
            samples: &deposits,
            sources: &sources,
            weights: &weights,
            is_guided: false,
            tracer: Some(&tracer),
        };
        let one = |seed| resample(candidates, (1, &importance::Importance::uniform()), 0.5, seed).0.remove(0);
        let is_below = |chosen: &Chosen| chosen.sample.position.x + geometry.origin.as_vec3().x > 0.0;
        f64::from((0..500).filter(|&seed| is_below(&one(seed))).count() as u32) / 500.0
    };
    // Eight are asked, and half of them lie beside: one in 256 finds none.
    let in_gap = chosen_below(0.02, 30);
    assert!(in_gap < 0.02, "{in_gap}");
    // The controls: below a high board half of them, and in the gap where nothing else is.
    let below_high_board = chosen_below(0.8, 30);
    assert!((below_high_board - 0.5).abs() < 0.08, "{below_high_board}");
    assert_eq!(chosen_below(0.02, 0), 1.0);
}

/// Light at points in a corner of a closed box, shadows not looked at.
fn in_a_corner(geometry: &Geometry, samples: &[LightSample], clamp: Clamp) -> DVec3 {
    let points = [vec3(0.1, 0.001, 0.1), vec3(0.03, 0.001, 0.5), vec3(0.5, 0.001, 0.5)];
    let sums = points.map(|point| -> f64 {
        let x = (point.as_dvec3() - geometry.origin).as_vec3();
        let arrives = |s: &LightSample| {
            s.geometric_factor(x, Vec3::Y, Vec3::Y, clamp).map_or(0.0, |(g, _)| f64::from(s.intensity.x * g))
        };
        samples.iter().map(arrives).sum()
    });
    DVec3::from_array(sums)
}

#[test]
fn corners_get_their_light_from_few_samples() {
    let materials = vec![Material::default(), Material::emitter("light", Vec3::ONE)];
    let (scene, geometry) = scene_of(closed_box(), materials);
    // All of the box but the floor glows: the irradiance on the floor is π everywhere.
    let mean = |clamp| {
        over_seeds(200, |seed| {
            let settings = LightSettings { count: 100, bounces: 0, seed, ..LightSettings::default() };
            in_a_corner(&geometry, LightSet::sample(&scene, &geometry, &settings).unwrap().samples(), clamp)
        })
    };
    let truth = DVec3::splat(std::f64::consts::PI);
    let (own, error) = mean(Clamp::Own);
    assert!(agrees((own, error), truth, 0.01) && error.max_element() < 0.02, "{own} ± {error}");
    // The controls: with a bound light is missing, without one it varies more.
    let (bounded, bounded_error) = mean(Clamp::At(4.0));
    assert!(!agrees((bounded, bounded_error), truth, 0.01), "{bounded} ± {bounded_error}");
    assert!(mean(Clamp::Off).1.y > 4.0 * error.y, "{} {}", mean(Clamp::Off).1, error);
}
