//! Real spherical harmonics: orthonormal over the sphere, without the Condon-Shortley sign. [`basis`] is mirrored in the
//! renderer's shaders.
//!
//! Harmonic m (−l ≤ m ≤ l) of band l has index l(l + 1) + m. Worked example: `Y₁ = √(3/4π) (y, z, x)`, indices 1 to 3.
//!
//! No crate has evaluation, projection and rotation together: `sphrs` evaluates only, `spherical-harmonics` has had one release,
//! in 2019, and no rotation.

mod rotation;
#[cfg(test)]
mod tests;

pub use rotation::Rotation;

use super::warp;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;
use std::ops::{Add, Mul};

/// Bands that [`basis`] and everything here can have at most.
pub const MAX_BANDS: u32 = 8;

const MOST: usize = MAX_BANDS as usize;

/// Factors of the recurrence for normalised associated Legendre polynomials without their power of sin θ, by band l and order m ≤ l:
/// `P(l, m) = A z P(l − 1, m) − B P(l − 2, m)` is `LEGENDRE[l][m] = [A, B]`, and `P(m, m)` is the first element of `LEGENDRE[m][m]`.
pub const LEGENDRE: [[[f32; 2]; MOST]; MOST] = legendre();

/// How many coefficients so many bands have.
pub const fn coefficient_count(bands: u32) -> usize {
    (bands * bands) as usize
}

const fn legendre() -> [[[f32; 2]; MOST]; MOST] {
    let mut factors = [[[0.0; 2]; MOST]; MOST];
    let mut diagonal = square_root(0.25 / std::f64::consts::PI);
    let mut m = 0;
    while m < MOST {
        if m > 0 {
            // For orders above 0 there is a √2, which comes in with the first.
            let ratio = (2 * m + 1) as f64 / (2 * m) as f64;
            diagonal *= square_root(if m == 1 { 2.0 * ratio } else { ratio });
        }
        factors[m][m] = [diagonal as f32, 0.0];
        let mut l = m + 1;
        while l < MOST {
            let (l2, m2, below2) = ((l * l) as f64, (m * m) as f64, ((l - 1) * (l - 1)) as f64);
            let a = square_root((4.0 * l2 - 1.0) / (l2 - m2));
            let b = if l == m + 1 {
                0.0
            } else {
                let (above, below) = ((2 * l + 1) as f64, (2 * l - 3) as f64);
                square_root(above * (below2 - m2) / (below * (l2 - m2)))
            };
            factors[l][m] = [a as f32, b as f32];
            l += 1;
        }
        m += 1;
    }
    factors
}

/// Newton's iteration, as the library's is no constant.
const fn square_root(x: f64) -> f64 {
    let mut root = if x > 1.0 { x } else { 1.0 };
    let mut step = 0;
    while step < 64 {
        root = 0.5 * (root + x / root);
        step += 1;
    }
    root
}

/// All harmonics of so many bands (at most [`MAX_BANDS`]) at a unit direction, `out` having [`coefficient_count`] elements: polynomials
/// in x, y and z by recurrence (Sloan 2013).
///
/// ```
/// use girandole_core::{glam::Vec3, math::sh};
/// let mut values = [0.0; sh::coefficient_count(2)];
/// sh::basis(Vec3::X, 2, &mut values);
/// assert!(values[1] == 0.0 && values[2] == 0.0 && (values[3] - 0.488_602_5).abs() < 1e-6);
/// ```
pub fn basis(direction: Vec3, bands: u32, out: &mut [f32]) {
    let Vec3 { x, y, z } = direction;
    let bands = bands.min(MAX_BANDS) as usize;
    // Real and imaginary part of (x + iy)ᵐ: sin θ to the power of m times cos mφ and sin mφ.
    let (mut cosine, mut sine) = (1.0, 0.0);
    for m in 0..bands {
        let (mut before, mut legendre) = (0.0, LEGENDRE[m][m][0]);
        for (l, factors) in LEGENDRE.iter().enumerate().take(bands).skip(m) {
            if l > m {
                let [a, b] = factors[m];
                (before, legendre) = (legendre, a * z * legendre - b * before);
            }
            let middle = l * (l + 1);
            out[middle + m] = legendre * cosine;
            if m > 0 {
                out[middle - m] = legendre * sine;
            }
        }
        (cosine, sine) = (x * cosine - y * sine, x * sine + y * cosine);
    }
}

/// What a band of the clamped cosine max(0, n·ω) has as its factor: its coefficients are this times the harmonics at n (Ramamoorthi and
/// Hanrahan 2001, eq. 8).
pub const CLAMPED_COSINE: [f32; MOST] = [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0, 0.0, PI / 64.0, 0.0];

/// Coefficients of the clamped cosine about a unit normal: irradiance is their dot product with those of the incident radiance.
pub fn clamped_cosine(normal: Vec3, bands: u32, out: &mut [f32]) {
    basis(normal, bands, out);
    for (i, value) in out.iter_mut().enumerate().take(coefficient_count(bands)) {
        *value *= CLAMPED_COSINE[i.isqrt()];
    }
}

/// The value in a unit direction of what these coefficients stand for: one number each, or a colour.
pub fn evaluate<T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>>(
    coefficients: &[T],
    direction: Vec3,
) -> T {
    let mut values = [0.0; coefficient_count(MAX_BANDS)];
    basis(direction, coefficients.len().isqrt() as u32, &mut values);
    coefficients.iter().zip(values).fold(T::default(), |sum, (&c, value)| sum + c * value)
}

/// Coefficients of a function on the sphere, from its values in so many well-spread directions (a Fibonacci lattice). Where it is one
/// of as many bands, 10 000 directions have an error of some 1e-4 of it.
pub fn project<T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>>(
    bands: u32,
    directions: u32,
    f: impl Fn(Vec3) -> T,
) -> Vec<T> {
    let mut sum = vec![T::default(); coefficient_count(bands)];
    let mut values = [0.0; coefficient_count(MAX_BANDS)];
    let solid_angle = 4.0 * PI / directions.max(1) as f32;
    for i in 0..directions {
        let direction = spread_direction(i, directions);
        basis(direction, bands, &mut values);
        let value = f(direction) * solid_angle;
        sum.iter_mut().zip(values).for_each(|(sum, y)| *sum = *sum + value * y);
    }
    sum
}

/// One of so many directions that are spread evenly over the sphere.
pub fn spread_direction(i: u32, count: u32) -> Vec3 {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let turn = f64::from(i) * golden;
    warp::sphere(Vec2::new(((f64::from(i) + 0.5) / f64::from(count)) as f32, (turn - turn.floor()) as f32))
}
