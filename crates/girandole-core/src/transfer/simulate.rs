//! Transfer vectors by rays.
//!
//! 1. *Shadows*: of well-spread, cosine-weighted directions over each vertex's hemisphere, which ones the object blocks. T is that of an
//!    unoccluded vertex, which is known exactly, less the mean of the harmonics in blocked directions: what nothing blocks has no noise.
//! 2. *Interreflection*, bounce by bounce: the same blocked directions are traced to where they end, and bring `albedo / π` times T of the bounce
//!    before there, interpolated in its triangle. Only a bit a direction is held between bounces.
//!
//! Under constant radiance the sum after any bounce is at most that of an unoccluded vertex: a share 1 − h of directions is open, and the rest
//! brings a mean of what is at most that, times the albedo.
//!
//! Directions are two scrambled sequences of half the number: both are estimates, and half of their difference is that of their mean from
//! the truth.

use super::alone::Alone;
use super::{TransferSettings, parallel};
use crate::math::sh::{self, coefficient_count};
use crate::math::{sequence, warp};
use crate::scene::{Geometry, NONE};
use crate::trace::{Hit, SceneTracer};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};

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
}

/// What is found.
pub(super) struct Simulated {
    pub channels: usize,
    pub sides: usize,
    pub coefficients: Vec<f32>,
    pub error: TransferError,
}

/// Vertices that are worked on together.
const CHUNK: usize = 32;
/// Half of the directions are one estimate.
const HALVES: u32 = 2;

/// Simulates an object.
pub(super) fn simulate(
    alone: &Alone,
    settings: &TransferSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Simulated {
    let geometry = Geometry::new(&alone.scene);
    let tracer = SceneTracer::new(&alone.scene, &geometry);
    let simulator = Simulator::new(alone, &tracer, settings);
    let points = simulator.points.len();
    let stride = simulator.stride();
    let passes = 1 + settings.bounces as usize;
    let done = AtomicUsize::new(0);
    let all = points.div_ceil(CHUNK).max(1) * passes;
    let report = || progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / all as f32);

    // Shadows.
    let mut sum = vec![0.0; points * stride];
    let mut difference = vec![0.0; points * stride];
    let words = simulator.mask_words();
    let mut blocked = vec![0u64; points * words];
    let chunks = chunks(&mut sum, &mut difference, stride).zip(blocked.chunks_mut(words * CHUNK)).collect();
    parallel::for_each(chunks, |((first, sums, differences), blocked): (Chunk, &mut [u64])| {
        for (i, mask) in blocked.chunks_exact_mut(words).enumerate() {
            let of_point = i * stride..(i + 1) * stride;
            simulator.shadows(first + i, mask, &mut sums[of_point.clone()], &mut differences[of_point]);
        }
        report();
    });

    // Interreflection.
    let mut before = if settings.bounces > 0 { sum.clone() } else { Vec::new() };
    for _ in 0..settings.bounces {
        let mut next = vec![0.0; points * stride];
        let chunks: Vec<Chunk> = chunks_of(&mut next, &mut difference, stride);
        parallel::for_each(chunks, |(first, next, differences)| {
            for i in 0..next.len() / stride {
                let of_point = i * stride..(i + 1) * stride;
                let mask = &blocked[(first + i) * words..(first + i + 1) * words];
                let (next, differences) = (&mut next[of_point.clone()], &mut differences[of_point]);
                simulator.reflected(first + i, mask, &before, next, differences);
            }
            report();
        });
        sum.iter_mut().zip(&next).for_each(|(sum, next)| *sum += next);
        before = next;
    }
    let error = simulator.error(&difference);
    Simulated { channels: simulator.channels, sides: simulator.sides, coefficients: sum, error }
}

/// The first point of some, and their part of two lists.
type Chunk<'a> = (usize, &'a mut [f32], &'a mut [f32]);

fn chunks<'a>(a: &'a mut [f32], b: &'a mut [f32], stride: usize) -> impl Iterator<Item = Chunk<'a>> {
    let both = a.chunks_mut(stride * CHUNK).zip(b.chunks_mut(stride * CHUNK));
    both.enumerate().map(|(i, (a, b))| (i * CHUNK, a, b))
}

fn chunks_of<'a>(a: &'a mut [f32], b: &'a mut [f32], stride: usize) -> Vec<Chunk<'a>> {
    chunks(a, b, stride).collect()
}

/// One side of a vertex.
#[derive(Clone, Copy)]
struct Point {
    /// Where rays start.
    start: Vec3,
    /// Unit normal; zero where nothing is received.
    normal: Vec3,
}

struct Simulator<'a> {
    tracer: &'a SceneTracer<'a>,
    /// Side by side, vertex by vertex.
    points: Vec<Point>,
    sides: usize,
    channels: usize,
    bands: u32,
    /// Directions of either half.
    directions: u32,
    /// By material.
    albedos: Vec<Option<Vec3>>,
}

impl<'a> Simulator<'a> {
    fn new(alone: &Alone, tracer: &'a SceneTracer<'a>, settings: &TransferSettings) -> Self {
        let geometry = tracer.geometry();
        let double_sided = alone.is_double_sided();
        let sides = if double_sided.iter().any(|&d| d) { 2 } else { 1 };
        let channels = if settings.bounces == 0 || alone.is_grey() { 1 } else { 3 };
        Self {
            tracer,
            points: points(tracer, &double_sided, sides),
            sides,
            channels,
            bands: settings.bands,
            directions: settings.directions.div_ceil(HALVES),
            albedos: alone.uniform_albedos(geometry),
        }
    }

    fn length(&self) -> usize {
        coefficient_count(self.bands)
    }

    /// Coefficients of a point, of all channels.
    fn stride(&self) -> usize {
        self.channels * self.length()
    }

    fn mask_words(&self) -> usize {
        (self.directions * HALVES).div_ceil(64) as usize
    }

    /// Direction `ray` of a point; those of one half come after those of the other.
    fn direction(&self, point: usize, ray: u32) -> Vec3 {
        let seed = sequence::hash(point as u32 ^ sequence::hash(ray / self.directions));
        let at = [0, 1].map(|dimension| sequence::sample(ray % self.directions, dimension, seed));
        let normal = self.points[point].normal;
        let (x, y) = warp::frame(normal);
        let local = warp::cosine_hemisphere(Vec2::from_array(at));
        (x * local.x + y * local.y + normal * local.z).normalize()
    }

    /// Writes down which directions are blocked, and what is received in others: the mean of both halves, and half of their difference.
    fn shadows(&self, index: usize, mask: &mut [u64], mean: &mut [f32], difference: &mut [f32]) {
        let Point { start, normal } = self.points[index];
        if normal == Vec3::ZERO {
            return;
        }
        let reach = start.length() + 2.0 * self.tracer.geometry().extent();
        let mut blocked = [[0.0; coefficient_count(sh::MAX_BANDS)]; HALVES as usize];
        let mut harmonics = [0.0; coefficient_count(sh::MAX_BANDS)];
        let mut likely = NONE;
        for ray in 0..self.directions * HALVES {
            let direction = self.direction(index, ray);
            let end = start + direction * reach;
            let Some(by) = self.tracer.occluder(start, NONE, end, NONE, likely) else { continue };
            likely = by;
            mask[(ray / 64) as usize] |= 1 << (ray % 64);
            sh::basis(direction, self.bands, &mut harmonics);
            let sum = &mut blocked[(ray / self.directions) as usize];
            sum.iter_mut().zip(&harmonics).for_each(|(sum, y)| *sum += y);
        }
        sh::clamped_cosine(normal, self.bands, &mut harmonics);
        let length = self.length();
        let share = PI / (self.directions * HALVES) as f32;
        for k in 0..length {
            let [a, b] = blocked.map(|half| half[k]);
            for channel in 0..self.channels {
                mean[channel * length + k] = harmonics[k] - (a + b) * share;
                difference[channel * length + k] = (b - a) * share;
            }
        }
    }

    /// What comes along blocked directions of what was there `before`, likewise; the difference is added to.
    fn reflected(
        &self,
        index: usize,
        mask: &[u64],
        before: &[f32],
        mean: &mut [f32],
        difference: &mut [f32],
    ) {
        let (length, stride) = (self.length(), self.stride());
        let start = self.points[index].start;
        let mut halves = [[0.0; 3 * coefficient_count(sh::MAX_BANDS)]; HALVES as usize];
        for ray in 0..self.directions * HALVES {
            if mask[(ray / 64) as usize] >> (ray % 64) & 1 == 0 {
                continue;
            }
            let direction = self.direction(index, ray);
            let Some(hit) = self.tracer.closest_hit(start, direction, f32::INFINITY, NONE) else { continue };
            let Some((albedo, corners)) = self.reflecting(&hit, direction) else { continue };
            let weights = [1.0 - hit.barycentric.x - hit.barycentric.y, hit.barycentric.x, hit.barycentric.y];
            let sum = &mut halves[(ray / self.directions) as usize];
            for (corner, weight) in corners.into_iter().zip(weights) {
                let vectors = before[corner * stride..(corner + 1) * stride].chunks_exact(length);
                for (channel, vector) in vectors.enumerate() {
                    let weight = weight * albedo[channel];
                    let sum = &mut sum[channel * length..(channel + 1) * length];
                    sum.iter_mut().zip(vector).for_each(|(sum, t)| *sum += t * weight);
                }
            }
        }
        // π of the density, and 1/π of the reflection.
        let share = 1.0 / (self.directions * HALVES) as f32;
        for k in 0..stride {
            let [a, b] = halves.map(|half| half[k]);
            mean[k] = (a + b) * share;
            difference[k] += (a - b) * share;
        }
    }

    /// What is reflected diffusely where a ray ends, and the points that its corners are.
    fn reflecting(&self, hit: &Hit, direction: Vec3) -> Option<(Vec3, [usize; 3])> {
        let (geometry, scene) = (self.tracer.geometry(), self.tracer.scene());
        let triangle = &geometry.triangles[hit.triangle as usize];
        let from_back = geometry.normal(hit.triangle).dot(direction) > 0.0;
        if from_back && !scene.materials[triangle.material as usize].double_sided {
            return None;
        }
        let albedo = self.albedos[triangle.material as usize]
            .unwrap_or_else(|| geometry.surface(scene, hit.triangle, hit.barycentric, -direction).albedo);
        let first = if from_back { self.points.len() / 2 } else { 0 };
        (albedo != Vec3::ZERO).then(|| (albedo, triangle.vertices.map(|v| first + v as usize)))
    }

    fn error(&self, difference: &[f32]) -> TransferError {
        let mut unoccluded = [0.0; coefficient_count(sh::MAX_BANDS)];
        sh::clamped_cosine(Vec3::Z, self.bands, &mut unoccluded);
        let whole = unoccluded.iter().map(|t| f64::from(t * t)).sum::<f64>();
        let constant = f64::from(unoccluded[0]).powi(2);
        let (mut sums, mut worst, mut count) = ([0.0; 2], [0f64; 2], 0.0);
        let used = self.points.iter().zip(difference.chunks_exact(self.stride()));
        for (_, vectors) in used.filter(|(point, _)| point.normal != Vec3::ZERO) {
            for vector in vectors.chunks_exact(self.length()) {
                let square = vector.iter().map(|d| f64::from(d * d)).sum::<f64>() / whole;
                let each = [f64::from(vector[0]).powi(2) / constant, square];
                for i in 0..2 {
                    sums[i] += each[i];
                    worst[i] = worst[i].max(each[i]);
                }
                count += 1.0;
            }
        }
        let [constant, vector] = sums.map(|sum| (sum / f64::max(count, 1.0)).sqrt() as f32);
        let [constant_worst, vector_worst] = worst.map(|w| w.sqrt() as f32);
        TransferError { constant, constant_worst, vector, vector_worst }
    }
}

/// Both sides of vertices that triangles have. Rays start a little above the surface, and a little towards the middles of a vertex's own
/// triangles: at the foot of a wall, not in it.
fn points(tracer: &SceneTracer, double_sided: &[bool], sides: usize) -> Vec<Point> {
    let geometry = tracer.geometry();
    let count = geometry.positions.len();
    let mut inwards = vec![(Vec3::ZERO, 0u32); count];
    let mut has_back = vec![false; count];
    for triangle in &geometry.triangles {
        let corners = triangle.vertices.map(|v| geometry.positions[v as usize]);
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        for (vertex, corner) in triangle.vertices.into_iter().zip(corners) {
            let (sum, triangles) = &mut inwards[vertex as usize];
            *sum += (middle - corner).normalize_or_zero();
            *triangles += 1;
            has_back[vertex as usize] |= double_sided[triangle.material as usize];
        }
    }
    let point = |(side, vertex): (usize, usize)| {
        let (sum, triangles) = inwards[vertex];
        let mut normal = geometry.normals[vertex];
        if triangles == 0 || side == 1 && !has_back[vertex] {
            normal = Vec3::ZERO;
        } else if side == 1 {
            normal = -normal;
        }
        let towards = sum / triangles.max(1) as f32;
        let along = towards - normal * normal.dot(towards);
        let position = geometry.positions[vertex];
        let start = tracer.offset_ray_origin(position, normal + along);
        Point { start, normal }
    };
    (0..sides).flat_map(|side| (0..count).map(move |vertex| (side, vertex))).map(point).collect()
}
