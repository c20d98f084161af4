//! Transfer vectors by rays.
//!
//! 1. *Shadows*: of well-spread, cosine-weighted directions over each point's hemisphere, which ones the object blocks. T is that of an
//!    unoccluded point, which is known exactly, less the mean of the harmonics in blocked directions: what nothing blocks has no noise.
//! 2. *Interreflection*: the same blocked directions are traced to where they end, and bring `albedo / π` times T there. Only a bit a
//!    direction is held between bounces.
//!
//! Where rays end T is that of a reflector, a small piece of a triangle (`reflectors.rs`). Reflectors light each other bounce by bounce; vertices
//! receive the sum of all bounces but the last from them, once.
//!
//! Under constant radiance the sum after any bounce is at most that of an unoccluded point: a share 1 − h of directions is open, and the rest
//! brings a mean of what is at most that, times the albedo.
//!
//! Directions are two scrambled sequences of half the number: both are estimates, and half of their difference is that of their mean from
//! the truth.

use super::TransferSettings;
use super::alone::Alone;
use super::points::{Point, at_reflectors, at_vertices, nearest};
use super::receivers::{Object, Progress, Receivers};
use super::reflectors::Reflectors;
use crate::math::sh::{self, coefficient_count};
use crate::scene::Geometry;
use crate::trace::SceneTracer;
use glam::Vec3;

/// How far transfer vectors are from the truth for want of rays, as a share of what an unoccluded vertex receives. Its estimate, by vertices that have
/// triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TransferError {
    /// Under constant radiance: root of the mean square over vertices.
    pub constant: f32,
    /// Under constant radiance: the worst vertex.
    pub constant_worst: f32,
    /// All bands together, as the length of the vector: root of the mean square over vertices.
    pub vector: f32,
    /// All bands together: the worst vertex.
    pub vector_worst: f32,
}

impl TransferError {
    /// The most that a mean error may be.
    pub const MOST: f32 = 0.01;
    /// The most that the worst vertex may be wrong by.
    pub const MOST_WORST: f32 = 0.03;

    /// Whether there were rays enough: 1 % in the mean and 3 % at the worst vertex, under constant radiance and for all bands.
    pub fn has_enough_rays(&self) -> bool {
        self.constant.max(self.vector) <= Self::MOST
            && self.constant_worst.max(self.vector_worst) <= Self::MOST_WORST
    }

    /// Of half of the differences between two estimates of vectors.
    fn of<'a>(differences: impl Iterator<Item = &'a [f32]>, bands: u32) -> Self {
        let mut unoccluded = [0.0; coefficient_count(sh::MAX_BANDS)];
        sh::clamped_cosine(Vec3::Z, bands, &mut unoccluded);
        let whole = unoccluded.iter().map(|t| f64::from(t * t)).sum::<f64>();
        let constant = f64::from(unoccluded[0]).powi(2);
        let (mut sums, mut worst, mut count) = ([0.0; 2], [0f64; 2], 0.0);
        for vector in differences {
            let square = vector.iter().map(|d| f64::from(d * d)).sum::<f64>() / whole;
            let each = [f64::from(vector[0]).powi(2) / constant, square];
            for i in 0..2 {
                sums[i] += each[i];
                worst[i] = worst[i].max(each[i]);
            }
            count += 1.0;
        }
        let [constant, vector] = sums.map(|sum| (sum / f64::max(count, 1.0)).sqrt() as f32);
        let [constant_worst, vector_worst] = worst.map(|w| w.sqrt() as f32);
        Self { constant, constant_worst, vector, vector_worst }
    }
}

/// What is found.
pub(super) struct Simulated {
    pub channels: usize,
    pub sides: usize,
    pub coefficients: Vec<f32>,
    pub error: TransferError,
}

/// Reflectors have an eighth of the rays of vertices: each vertex sees many of them.
const SHARE_OF_REFLECTORS: u32 = 8;
/// Fewer are too few for any.
const LEAST_OF_REFLECTORS: u32 = 64;

/// Simulates an object.
pub(super) fn simulate(
    alone: &Alone,
    settings: &TransferSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Simulated {
    let geometry = Geometry::new(&alone.scene);
    let tracer = SceneTracer::new(&alone.scene, &geometry);
    let double_sided = alone.is_double_sided();
    let sides = if double_sided.iter().any(|&d| d) { 2 } else { 1 };
    let channels = if settings.bounces == 0 || alone.is_grey() { 1 } else { 3 };
    let vertices = at_vertices(&tracer, &double_sided, sides);

    // What reflects is divided, and finely where something is near.
    let middles = |reflectors: &Reflectors| at_reflectors(&tracer, &double_sided, sides, reflectors);
    let mut reflectors = Reflectors::default();
    if settings.bounces > 0 {
        let coarse = Reflectors::new(&geometry, &vec![f32::INFINITY; geometry.triangles.len()]);
        let points = [middles(&coarse), vertices.clone()].concat();
        reflectors = Reflectors::new(&geometry, &nearest(&tracer, &points));
    }
    let on_reflectors = middles(&reflectors);
    let albedos = alone.uniform_albedos(&geometry);
    let object =
        Object { tracer: &tracer, channels, bands: settings.bands, albedos, reflectors: &reflectors };
    let of_reflectors = (settings.directions / SHARE_OF_REFLECTORS).max(LEAST_OF_REFLECTORS);
    let rays = |points: &[Point], passes: u32, each: u32| points.len() as u64 * u64::from(passes * each);
    let all = rays(&vertices, 1 + settings.bounces.min(1), settings.directions)
        + rays(&on_reflectors, settings.bounces, of_reflectors);
    let progress = Progress::new(all, progress);

    // What is reflected: bounce by bounce, from reflectors to reflectors.
    let mut reflecting = Receivers::new(&object, on_reflectors, of_reflectors, &progress);
    let mut before = reflecting.shadows().0;
    let mut reflected = before.clone();
    for _ in 1..settings.bounces {
        before = reflecting.reflected(&before).0;
        reflected.iter_mut().zip(&before).for_each(|(sum, next)| *sum += next);
    }
    drop(reflecting);

    // What comes to vertices: past the object, and of all bounces from it.
    let mut receiving = Receivers::new(&object, vertices, settings.directions, &progress);
    let (mut coefficients, mut difference) = receiving.shadows();
    if settings.bounces > 0 {
        let (sum, by) = receiving.reflected(&reflected);
        coefficients.iter_mut().zip(&sum).for_each(|(mean, brought)| *mean += brought);
        difference.iter_mut().zip(&by).for_each(|(difference, by)| *difference += by);
    }
    let vectors = receiving.points().iter().zip(difference.chunks_exact(object.stride()));
    let received = vectors.filter(|(point, _)| point.normal != Vec3::ZERO);
    let error =
        TransferError::of(received.flat_map(|(_, v)| v.chunks_exact(object.length())), settings.bands);
    Simulated { channels, sides, coefficients, error }
}
