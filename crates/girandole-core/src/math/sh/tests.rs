use super::*;
use crate::math::sequence;
use glam::{Mat3, Quat};

const ALL: usize = coefficient_count(MAX_BANDS);

fn harmonics(direction: Vec3) -> [f32; ALL] {
    let mut values = [0.0; ALL];
    basis(direction, MAX_BANDS, &mut values);
    values
}

fn random(i: u32, dimension: u32) -> f32 {
    sequence::sample(i, dimension, 5)
}

fn random_direction(i: u32) -> Vec3 {
    warp::sphere(Vec2::new(random(i, 0), random(i, 1))).normalize()
}

fn random_coefficients(seed: u32) -> [f32; ALL] {
    std::array::from_fn(|k| sequence::sample(k as u32, 2, seed) - 0.5)
}

#[test]
fn harmonics_are_orthonormal() {
    let count = 20_000;
    let mut sums = vec![0f64; ALL * ALL];
    for i in 0..count {
        let values = harmonics(spread_direction(i, count));
        for (j, sum) in sums.iter_mut().enumerate() {
            *sum += f64::from(values[j / ALL] * values[j % ALL]);
        }
    }
    let astray = |shift: usize| {
        let each = sums.iter().enumerate().map(|(j, sum)| {
            let wanted = if (j / ALL + shift) % ALL == j % ALL { 1.0 } else { 0.0 };
            (sum * 4.0 * std::f64::consts::PI / f64::from(count) - wanted).abs()
        });
        each.fold(0.0, f64::max)
    };
    assert!(astray(0) < 2e-3, "{}", astray(0));
    assert!(astray(1) > 0.5, "negative control");
}

#[test]
fn harmonics_have_the_signs_and_the_order_that_are_said() {
    for i in 0..100 {
        let d = random_direction(i);
        let values = harmonics(d);
        let expected = [
            0.282_094_8,
            0.488_602_5 * d.y,
            0.488_602_5 * d.z,
            0.488_602_5 * d.x,
            1.092_548_4 * d.x * d.y,
            1.092_548_4 * d.y * d.z,
            0.315_391_57 * (3.0 * d.z * d.z - 1.0),
            1.092_548_4 * d.z * d.x,
            0.546_274_2 * (d.x * d.x - d.y * d.y),
        ];
        for (k, wanted) in expected.into_iter().enumerate() {
            assert!((values[k] - wanted).abs() < 1e-6, "{k}: {} for {wanted}", values[k]);
        }
        // Bands of less than all are the same.
        let mut few = [0.0; coefficient_count(3)];
        basis(d, 3, &mut few);
        assert_eq!(few, values[..9]);
        // The sum of a band's squares is the same everywhere (Unsöld).
        for l in 0..MOST {
            let band = &values[l * l..(l + 1) * (l + 1)];
            let sum: f32 = band.iter().map(|y| y * y).sum();
            let wanted = (2 * l + 1) as f32 / (4.0 * PI);
            assert!((sum / wanted - 1.0).abs() < 1e-5, "band {l}: {sum} for {wanted}");
            assert!(l == 0 || (sum / ((2 * l) as f32 / (4.0 * PI)) - 1.0).abs() > 0.05, "negative control");
        }
    }
}

/// The largest difference of two lists.
fn apart(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn what_is_projected_is_found_again() {
    let coefficients = random_coefficients(1);
    let found = project(MAX_BANDS, 10_000, |d| evaluate(&coefficients, d));
    assert!(apart(&found, &coefficients) < 1e-3, "{}", apart(&found, &coefficients));
    let mirrored = project(MAX_BANDS, 10_000, |d| evaluate(&coefficients, -d));
    assert!(apart(&mirrored, &coefficients) > 0.1, "negative control");
    // The clamped cosine is that of its closed form.
    let normal = random_direction(7);
    let mut closed = [0.0; ALL];
    clamped_cosine(normal, MAX_BANDS, &mut closed);
    let cosine = project(MAX_BANDS, 100_000, |d| normal.dot(d).max(0.0));
    assert!(apart(&cosine, &closed) < 1e-3, "{}", apart(&cosine, &closed));
    let unclamped = project(MAX_BANDS, 100_000, |d| normal.dot(d).abs());
    assert!(apart(&unclamped, &closed) > 0.1, "negative control");
    // Colours are three functions.
    let colored = project(3, 1000, |d| Vec3::new(1.0, d.x, 0.0));
    let red = project(3, 1000, |_| 1.0);
    assert!(colored.iter().zip(&red).all(|(c, r)| c.x == *r && c.z == 0.0));
}

fn random_rotation(i: u32) -> Mat3 {
    let [x, y, z, w] = [2, 3, 4, 5].map(|d| random(i, d) - 0.5);
    Mat3::from_quat(Quat::from_xyzw(x, y, z, w).normalize())
}

/// How far apart in some directions what is rotated by one matrix, and what is evaluated through another one, are.
fn rotation_error(rotated_by: Mat3, seen_through: Mat3) -> f32 {
    let coefficients = random_coefficients(3);
    let mut rotated = [0.0; ALL];
    Rotation::new(rotated_by, MAX_BANDS).apply(&coefficients, &mut rotated);
    let each = (0..200).map(random_direction).map(|d| {
        let before = evaluate(&coefficients, (seen_through.transpose() * d).normalize());
        (evaluate(&rotated, d) - before).abs()
    });
    each.fold(0.0, f32::max)
}

#[test]
fn rotations_are_exact_in_all_bands() {
    let half_turn = Mat3::from_diagonal(Vec3::new(-1.0, -1.0, 1.0));
    let special = [Mat3::IDENTITY, half_turn, Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X)];
    for rotation in (0..30).map(random_rotation).chain(special) {
        let mirrored = rotation * Mat3::from_diagonal(Vec3::new(1.0, 1.0, -1.0));
        for matrix in [rotation, mirrored, -rotation] {
            let error = rotation_error(matrix, matrix);
            assert!(error < 5e-6, "{matrix}: {error}");
            // Negative controls: the other way around, and turned a little more.
            let is_its_own_inverse = matrix.abs_diff_eq(matrix.transpose(), 0.1);
            assert!(is_its_own_inverse || rotation_error(matrix, matrix.transpose()) > 0.05);
            assert!(rotation_error(matrix, matrix * Mat3::from_rotation_y(0.01)) > 1e-3);
        }
    }
}

#[test]
fn rotations_are_those_of_projection_band_by_band() {
    let rotation = random_rotation(3);
    for k in 0..ALL {
        let mut one = [0.0; ALL];
        one[k] = 1.0;
        let mut rotated = [0.0; ALL];
        Rotation::new(rotation, MAX_BANDS).apply(&one, &mut rotated);
        let back = rotation.transpose();
        let projected = project(MAX_BANDS, 10_000, |d| evaluate(&one, back * d));
        assert!(apart(&rotated, &projected) < 2e-3, "{k}: {}", apart(&rotated, &projected));
        let l = k.isqrt();
        let outside = rotated.iter().enumerate().filter(|(j, _)| j.isqrt() != l);
        assert!(outside.into_iter().all(|(_, &value)| value == 0.0), "a band stays what it is");
    }
    // Fewer bands are the first of more.
    let few = Rotation::new(rotation, 5);
    assert_eq!(few.bands(), 5);
    let coefficients = random_coefficients(4);
    let (mut of_few, mut of_all) = ([0.0; coefficient_count(5)], [0.0; ALL]);
    few.apply(&coefficients[..25], &mut of_few);
    Rotation::new(rotation, MAX_BANDS).apply(&coefficients, &mut of_all);
    assert_eq!(of_few, of_all[..25]);
}
