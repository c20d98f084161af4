//! What points receive: past the object, and from it.

use super::points::Point;
use super::reflectors::Reflectors;
use crate::math::sequence;
use crate::math::sh::{self, coefficient_count};
use crate::parallel;
use crate::scene::NONE;
use crate::trace::{Hit, SceneTracer};
use glam::Vec3;
use std::f32::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

/// How much of all rays has been traced.
pub(super) struct Progress<'a> {
    done: AtomicU64,
    all: u64,
    report: &'a (dyn Fn(f32) + Sync),
}

impl<'a> Progress<'a> {
    /// Of this many rays.
    pub fn new(all: u64, report: &'a (dyn Fn(f32) + Sync)) -> Self {
        Self { done: AtomicU64::new(0), all: all.max(1), report }
    }

    fn add(&self, rays: u64) {
        let done = self.done.fetch_add(rays, Ordering::Relaxed) + rays;
        (self.report)((done as f32 / self.all as f32).min(1.0));
    }
}

/// An object that lights itself.
pub(super) struct Object<'a> {
    pub tracer: &'a SceneTracer<'a>,
    pub channels: usize,
    pub bands: u32,
    /// By material.
    pub albedos: Vec<Option<Vec3>>,
    pub reflectors: &'a Reflectors,
}

impl Object<'_> {
    pub fn length(&self) -> usize {
        coefficient_count(self.bands)
    }

    /// Coefficients of a point, of all channels.
    pub fn stride(&self) -> usize {
        self.channels * self.length()
    }

    /// What is reflected diffusely where a ray ends, and the reflector that is there.
    fn reflecting(&self, hit: &Hit, direction: Vec3) -> Option<(Vec3, usize)> {
        let (geometry, scene) = (self.tracer.geometry(), self.tracer.scene());
        let triangle = &geometry.triangles[hit.triangle as usize];
        let from_back = geometry.normal(hit.triangle).dot(direction) > 0.0;
        if from_back && !scene.materials[triangle.material].double_sided {
            return None;
        }
        let albedo = self.albedos[triangle.material.index()]
            .unwrap_or_else(|| geometry.surface(scene, hit.triangle, hit.barycentric, -direction).albedo);
        let first = if from_back { self.reflectors.count() } else { 0 };
        (albedo != Vec3::ZERO).then(|| (albedo, first + self.reflectors.at(hit.triangle, hit.barycentric)))
    }
}

/// Points that are worked on together.
const CHUNK: usize = 32;
/// Half of the directions are one estimate.
const HALVES: u32 = 2;

/// Points that receive light from the same number of directions each.
pub(super) struct Receivers<'a> {
    object: &'a Object<'a>,
    points: Vec<Point>,
    /// Directions of either half.
    directions: u32,
    /// A bit for each direction of each point in which the object is.
    blocked: Vec<u64>,
    progress: &'a Progress<'a>,
}

/// Vectors of points and, of each, half of the difference of what both halves of the directions found.
pub(super) type Found = (Vec<f32>, Vec<f32>);

impl<'a> Receivers<'a> {
    pub fn new(
        object: &'a Object<'a>,
        points: Vec<Point>,
        directions: u32,
        progress: &'a Progress<'a>,
    ) -> Self {
        Self { object, points, directions: directions.div_ceil(HALVES), blocked: Vec::new(), progress }
    }

    pub fn points(&self) -> &[Point] {
        &self.points
    }

    fn mask_words(&self) -> usize {
        (self.directions * HALVES).div_ceil(64) as usize
    }

    /// What comes past the object; writes down in which directions it is.
    pub fn shadows(&mut self) -> Found {
        let (stride, words) = (self.object.stride(), self.mask_words());
        let (mut mean, mut difference) = self.nothing();
        let mut blocked = vec![0; self.points.len() * words];
        let chunks =
            chunks(&mut mean, &mut difference, stride).zip(blocked.chunks_mut(words * CHUNK)).collect();
        parallel::for_each(chunks, |((first, sums, differences), blocked): (Chunk, &mut [u64])| {
            for (i, mask) in blocked.chunks_exact_mut(words).enumerate() {
                let of_point = i * stride..(i + 1) * stride;
                self.shadows_of(first + i, mask, &mut sums[of_point.clone()], &mut differences[of_point]);
            }
            self.progress.add(blocked.len() as u64 / words as u64 * u64::from(self.directions * HALVES));
        });
        self.blocked = blocked;
        (mean, difference)
    }

    /// What comes along blocked directions of what reflectors have `received`.
    pub fn reflected(&self, received: &[f32]) -> Found {
        let (stride, words) = (self.object.stride(), self.mask_words());
        let (mut mean, mut difference) = self.nothing();
        let chunks = chunks(&mut mean, &mut difference, stride).collect();
        parallel::for_each(chunks, |(first, mean, differences): Chunk| {
            for i in 0..mean.len() / stride {
                let of_point = i * stride..(i + 1) * stride;
                let mask = &self.blocked[(first + i) * words..(first + i + 1) * words];
                let (mean, differences) = (&mut mean[of_point.clone()], &mut differences[of_point]);
                self.reflected_to(first + i, mask, received, mean, differences);
            }
            self.progress.add((mean.len() / stride) as u64 * u64::from(self.directions * HALVES));
        });
        (mean, difference)
    }

    fn nothing(&self) -> Found {
        let zeros = vec![0.0; self.points.len() * self.object.stride()];
        (zeros.clone(), zeros)
    }

    /// Direction `ray` of a point; those of one half come after those of the other.
    fn direction(&self, point: usize, ray: u32) -> Vec3 {
        let seed = sequence::hash(point as u32 ^ sequence::hash(ray / self.directions));
        self.points[point].direction(ray % self.directions, seed)
    }

    /// Writes down which directions are blocked, and what is received in others: the mean of both halves, and half of their difference.
    fn shadows_of(&self, index: usize, mask: &mut [u64], mean: &mut [f32], difference: &mut [f32]) {
        let Point { start, normal, surface } = self.points[index];
        if normal == Vec3::ZERO {
            return;
        }
        let (tracer, bands, length) = (self.object.tracer, self.object.bands, self.object.length());
        let reach = start.length() + 2.0 * tracer.geometry().extent();
        let mut blocked = [[0.0; coefficient_count(sh::MAX_BANDS)]; HALVES as usize];
        let mut harmonics = [0.0; coefficient_count(sh::MAX_BANDS)];
        let mut likely = NONE;
        for ray in 0..self.directions * HALVES {
            let direction = self.direction(index, ray);
            // Nothing is reflected from below a triangle, though it may be above the curved surface that normals tell of.
            if surface.dot(direction) >= 0.0 {
                let end = start + direction * reach;
                let Some(by) = tracer.occluder(start, NONE, end, NONE, likely) else { continue };
                likely = by;
                mask[(ray / 64) as usize] |= 1 << (ray % 64);
            }
            sh::basis(direction, bands, &mut harmonics);
            let sum = &mut blocked[(ray / self.directions) as usize];
            sum.iter_mut().zip(&harmonics).for_each(|(sum, y)| *sum += y);
        }
        sh::clamped_cosine(normal, bands, &mut harmonics);
        let share = PI / (self.directions * HALVES) as f32;
        for k in 0..length {
            let [a, b] = blocked.map(|half| half[k]);
            for channel in 0..self.object.channels {
                mean[channel * length + k] = harmonics[k] - (a + b) * share;
                difference[channel * length + k] = (b - a) * share;
            }
        }
    }

    /// What comes along a point's blocked directions of what reflectors have `received`, likewise.
    fn reflected_to(
        &self,
        index: usize,
        mask: &[u64],
        received: &[f32],
        mean: &mut [f32],
        difference: &mut [f32],
    ) {
        let (length, stride) = (self.object.length(), self.object.stride());
        let start = self.points[index].start;
        let mut halves = [[0.0; 3 * coefficient_count(sh::MAX_BANDS)]; HALVES as usize];
        for ray in 0..self.directions * HALVES {
            if mask[(ray / 64) as usize] >> (ray % 64) & 1 == 0 {
                continue;
            }
            let direction = self.direction(index, ray);
            let Some(hit) = self.object.tracer.closest_hit(start, direction, f32::INFINITY, NONE) else {
                continue;
            };
            let Some((albedo, reflector)) = self.object.reflecting(&hit, direction) else { continue };
            let sum = &mut halves[(ray / self.directions) as usize];
            let vectors = received[reflector * stride..(reflector + 1) * stride].chunks_exact(length);
            for (channel, vector) in vectors.enumerate() {
                let sum = &mut sum[channel * length..(channel + 1) * length];
                sum.iter_mut().zip(vector).for_each(|(sum, t)| *sum += t * albedo[channel]);
            }
        }
        // π of the density, and 1/π of the reflection.
        let share = 1.0 / (self.directions * HALVES) as f32;
        for k in 0..stride {
            let [a, b] = halves.map(|half| half[k]);
            mean[k] = (a + b) * share;
            difference[k] = (a - b) * share;
        }
    }
}

/// The first point of some, and their part of two lists.
type Chunk<'a> = (usize, &'a mut [f32], &'a mut [f32]);

fn chunks<'a>(a: &'a mut [f32], b: &'a mut [f32], stride: usize) -> impl Iterator<Item = Chunk<'a>> {
    let both = a.chunks_mut(stride * CHUNK).zip(b.chunks_mut(stride * CHUNK));
    both.enumerate().map(|(i, (a, b))| (i * CHUNK, a, b))
}
