//! Rotation of spherical harmonics, band by band.

use super::{MAX_BANDS, coefficient_count};
use glam::{DMat3, Mat3};
use std::ops::{Add, Mul};

/// A rotation of coefficients, exact but for rounding: each band has a matrix of its own, from that of the band below
/// (Ivanic and Ruedenberg 1996, with the
/// correction of 1998). Reflections are rotations here as well.
#[derive(Clone, Debug, PartialEq)]
pub struct Rotation {
    /// Band by band, row by row.
    matrices: Vec<Vec<f64>>,
}

impl Rotation {
    /// Of so many bands, by an orthogonal matrix: what had a value in direction `d` has it in `matrix * d` afterwards.
    pub fn new(matrix: Mat3, bands: u32) -> Self {
        let mut matrices = vec![vec![1.0]];
        let matrix = matrix.as_dmat3();
        for l in 1..i32::try_from(bands.min(MAX_BANDS)).unwrap_or(1) {
            let below = Band { matrix, below: &matrices[l as usize - 1], l };
            let rows = (-l..=l).flat_map(|m| (-l..=l).map(move |n| (m, n)));
            let all = rows.map(|(m, n)| below.element(m, n)).collect();
            matrices.push(all);
        }
        matrices.truncate(bands as usize);
        Self { matrices }
    }

    /// Bands that it is for.
    pub fn bands(&self) -> u32 {
        self.matrices.len() as u32
    }

    /// Writes the rotated coefficients, one number each or a colour, to `out`.
    pub fn apply<T: Copy + Default + Add<Output = T> + Mul<f32, Output = T>>(
        &self,
        coefficients: &[T],
        out: &mut [T],
    ) {
        let mut first = 0;
        for matrix in &self.matrices {
            let size = matrix.len().isqrt();
            let band = &coefficients[first..first + size];
            for (row, out) in matrix.chunks_exact(size).zip(&mut out[first..first + size]) {
                *out = row.iter().zip(band).fold(T::default(), |sum, (&r, &c)| sum + c * r as f32);
            }
            first += size;
        }
        debug_assert_eq!(first, coefficient_count(self.bands()));
    }
}

/// What a band's matrix is made of.
struct Band<'a> {
    matrix: DMat3,
    below: &'a [f64],
    l: i32,
}

impl Band<'_> {
    /// Band 1 is (y, z, x).
    fn first(&self, m: i32, n: i32) -> f64 {
        let axis = |m: i32| [1, 2, 0][(m + 1) as usize];
        self.matrix.col(axis(n))[axis(m)]
    }

    fn below(&self, m: i32, n: i32) -> f64 {
        let l = self.l - 1;
        self.below[((m + l) * (2 * l + 1) + n + l) as usize]
    }

    /// Table 2 of the paper.
    fn p(&self, i: i32, a: i32, n: i32) -> f64 {
        let l = self.l;
        if n == l {
            self.first(i, 1) * self.below(a, l - 1) - self.first(i, -1) * self.below(a, 1 - l)
        } else if n == -l {
            self.first(i, 1) * self.below(a, 1 - l) + self.first(i, -1) * self.below(a, l - 1)
        } else {
            self.first(i, 0) * self.below(a, n)
        }
    }

    /// Equation 8.1, with the factors of table 1. Where a factor is 0, what it multiplies refers to orders that do not exist.
    fn element(&self, m: i32, n: i32) -> f64 {
        let (l, size) = (self.l, m.abs());
        if l == 1 {
            return self.first(m, n);
        }
        let share = |a: i32, b: i32| {
            let whole = if n.abs() == l { 2 * l * (2 * l - 1) } else { (l + n) * (l - n) };
            (f64::from(a * b) / f64::from(whole)).sqrt()
        };
        let u = share(l + m, l - m);
        let v = if m == 0 { -0.5 * 2f64.sqrt() } else { 0.5 } * share(l + size - 1, l + size);
        let w = if m == 0 { 0.0 } else { -0.5 * share(l - size - 1, l - size) };
        let mut element = 0.0;
        if u != 0.0 {
            element += u * self.p(0, m, n);
        }
        if v != 0.0 {
            element += v * self.next_order(m, n);
        }
        if w != 0.0 {
            let (a, b) = (self.p(1, m + m.signum(), n), self.p(-1, -m - m.signum(), n));
            element += w * if m > 0 { a + b } else { a - b };
        }
        element
    }

    /// V of table 2.
    fn next_order(&self, m: i32, n: i32) -> f64 {
        let root = 2f64.sqrt();
        match m {
            0 => self.p(1, 1, n) + self.p(-1, -1, n),
            1 => root * self.p(1, 0, n),
            -1 => root * self.p(-1, 0, n),
            2.. => self.p(1, m - 1, n) - self.p(-1, 1 - m, n),
            _ => self.p(1, m + 1, n) + self.p(-1, -m - 1, n),
        }
    }
}
