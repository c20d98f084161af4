//! A plain path tracer: next-event estimation and BSDF sampling, combined by multiple importance sampling (Veach
//! 1997). It is written to be verified by reading, not to be fast.

mod bsdf;
mod distant;
mod emitters;
mod irradiance;
mod progressive;
mod random;
mod sky;

pub use irradiance::{Irradiance, irradiance};
pub use progressive::ProgressivePathTracer;

use crate::tiles;
use distant::Distant;
use emitters::{Emitters, Punctual};
use girandole_core::brdf::Surface;
use girandole_core::glam::{DVec3, Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::scene::{LocalView, NONE, View};
use girandole_core::trace::{Hit, SceneTracer};
use random::Random;
use sky::Sky;

/// Number and length of the paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathSettings {
    /// Paths a pixel; 0 counts as 1. The error falls with the square root.
    pub paths: u32,
    /// Bounce limit B: paths have at most B + 2 segments, the camera's included, so 0 is direct light. `None` = no
    /// limit; Russian roulette ends the paths.
    pub bounces: Option<u32>,
    /// Same seed, same picture, whatever the number of threads.
    pub seed: u32,
}

impl Default for PathSettings {
    /// 256 paths without a bounce limit: enough for a preview.
    fn default() -> Self {
        Self { paths: 256, bounces: None, seed: 0 }
    }
}

/// A picture and its variance.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Radiance, W/(sr·m²): mean over a pixel (box filter). The background is the scene's environment, black without one.
    pub mean: Image,
    /// Variance of that mean, by pixel and channel: the sample variance of the paths divided by their number.
    /// Infinite for a single path.
    pub variance: Image,
}

/// An unbiased picture of the scene with all its light: emitters, punctual lights, and what they light.
///
/// `progress` is called with the finished share, 0 to 1, from any thread.
pub fn path_trace(
    tracer: &SceneTracer,
    view: &View,
    size: [u32; 2],
    settings: &PathSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Estimate {
    path_trace_through(&[], tracer, view, size, settings, progress)
}

/// A rectangle, or another parallelogram, that light from infinitely far away comes in by, relative to the geometry's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening {
    /// Metres.
    pub corner: Vec3,
    /// From there, metres.
    pub sides: [Vec3; 2],
}

/// The same picture in the mean, with less noise where an environment lights the scene through openings: directions are drawn towards
/// these too.
pub fn path_trace_through(
    openings: &[Opening],
    tracer: &SceneTracer,
    view: &View,
    size: [u32; 2],
    settings: &PathSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Estimate {
    let integrator = Integrator::new(tracer, settings.bounces, openings);
    let paths = settings.paths.max(1);
    let view = view.relative_to(tracer.geometry().origin);
    let pixels = tiles::render(
        size,
        progress,
        || (),
        |(), [x, y]| {
            let mut pixel = Pixel::new(settings.seed, [x, y]);
            (0..paths).for_each(|_| pixel.add_path(&integrator, &view, ([x, y], size)));
            (pixel.mean.as_vec3(), pixel.variance())
        },
    );
    let picture = |pixels| Image { width: size[0], height: size[1], pixels };
    Estimate {
        mean: picture(pixels.iter().map(|p| p.0).collect()),
        variance: picture(pixels.iter().map(|p| p.1).collect()),
    }
}

/// What is known of a pixel: Welford's running mean and sum of squares, and the random numbers to come.
#[derive(Clone, Debug)]
struct Pixel {
    random: Random,
    paths: u32,
    mean: DVec3,
    squares: DVec3,
}

impl Pixel {
    fn new(seed: u32, [x, y]: [u32; 2]) -> Self {
        let random = Random::new(seed, u64::from(y) << 32 | u64::from(x));
        Self { random, paths: 0, mean: DVec3::ZERO, squares: DVec3::ZERO }
    }

    fn add_path(&mut self, integrator: &Integrator, view: &LocalView, ([x, y], size): ([u32; 2], [u32; 2])) {
        let at = Vec2::new(x as f32, y as f32) + self.random.square();
        let (origin, direction) = view.pixel_ray(at, size);
        let value = integrator.radiance((origin, direction), view.clip.reach(), &mut self.random).as_dvec3();
        self.paths += 1;
        let step = value - self.mean;
        self.mean += step / f64::from(self.paths);
        self.squares += step * (value - self.mean);
    }

    fn variance(&self) -> Vec3 {
        if self.paths < 2 {
            return Vec3::INFINITY;
        }
        (self.squares / (f64::from(self.paths) * f64::from(self.paths - 1))).as_vec3()
    }
}

/// Bounces before Russian roulette starts.
const SURE_BOUNCES: u32 = 3;
/// Punctual lights sampled at every vertex; if there are more, this many are chosen at random.
const PUNCTUAL_SAMPLES: usize = 8;

struct Integrator<'a> {
    tracer: &'a SceneTracer<'a>,
    emitters: Emitters,
    punctual: Vec<Punctual>,
    distant: Option<Sky<'a>>,
    bounces: Option<u32>,
}

/// A vertex of a path.
struct Vertex {
    surface: Surface,
    triangle: u32,
    /// The origin of rays: the position, offset from the surface.
    start: Vec3,
    wo: Vec3,
}

impl<'a> Integrator<'a> {
    fn new(tracer: &'a SceneTracer<'a>, bounces: Option<u32>, openings: &'a [Opening]) -> Self {
        Self {
            tracer,
            emitters: Emitters::new(tracer),
            punctual: Punctual::all(tracer),
            distant: Distant::new(tracer, openings).map(Sky::Map),
            bounces,
        }
    }

    fn emits(&self, triangle: u32) -> bool {
        let material = self.tracer.geometry().triangles[triangle as usize].material;
        self.tracer.scene().materials[material].emits()
    }

    /// The radiance that one random path finds along a camera ray, which shows what is up to `reach`.
    fn radiance(&self, (origin, direction): (Vec3, Vec3), reach: f32, random: &mut Random) -> Vec3 {
        let mut beta = Vec3::ONE;
        let hit = self.tracer.closest_visible_within(origin, direction, reach);
        let is_seen = |hit: &Hit| hit.t < reach && self.tracer.is_visible(hit.triangle, direction);
        let Some(vertex) = self.scattering((origin, direction), hit, is_seen, &mut beta, random) else {
            let seen = self.distant.as_ref().filter(|distant| distant.is_visible());
            return beta * seen.map_or(Vec3::ZERO, |distant| distant.radiance(direction.normalize()));
        };
        let emitted = beta * vertex.surface.emission;
        self.reflected(emitted, vertex, (beta, 0), random)
    }

    /// What is `found` already, and what a path brings that is reflected at a vertex for the `first` time, from 0 on.
    fn reflected(
        &self,
        found: Vec3,
        mut vertex: Vertex,
        (mut beta, first): (Vec3, u32),
        random: &mut Random,
    ) -> Vec3 {
        let geometry = self.tracer.geometry();
        let mut result = found;
        for bounce in first.. {
            if self.bounces.is_some_and(|limit| bounce > limit) || !reflects(&vertex.surface) {
                break;
            }
            result += beta
                * (self.light_from_emitters(&vertex, random)
                    + self.light_from_punctual(&vertex, random)
                    + self.light_from_distant(&vertex, random));

            // Continue by the BSDF; weight emission found there against emitter sampling.
            let Some((wi, pdf)) = bsdf::sample(&vertex.surface, vertex.wo, random) else { break };
            let reflection = bsdf::evaluate(&vertex.surface, vertex.wo, wi);
            if reflection == Vec3::ZERO {
                break;
            }
            beta *= reflection / pdf;
            let hit = self.tracer.closest_hit(vertex.start, wi, f32::INFINITY, vertex.triangle);
            let is_other = |hit: &Hit| hit.triangle != vertex.triangle;
            let Some(next) = self.scattering((vertex.start, wi), hit, is_other, &mut beta, random) else {
                if let Some(distant) = &self.distant {
                    result +=
                        beta * distant.radiance(wi) * power_heuristic(pdf, distant.pdf(vertex.start, wi));
                }
                break;
            };
            // What is unlit shows itself to the eye alone.
            if next.surface.emission != Vec3::ZERO && self.emits(next.triangle) {
                let emitter_pdf = self.emitters.pdf_solid_angle(
                    next.triangle,
                    geometry.normal(next.triangle),
                    vertex.start,
                    next.surface.position,
                );
                result += beta * next.surface.emission * power_heuristic(pdf, emitter_pdf);
            }
            vertex = next;

            if self.bounces.is_none() && bounce >= SURE_BOUNCES {
                let survival = beta.max_element().min(0.95);
                if random.unit() >= survival {
                    break;
                }
                beta /= survival;
            }
        }
        result
    }

    /// The surface at which a ray that ends at `hit` goes on: that, or one before it that lets light through, by chance; `beta` is
    /// what passes those before, and what chance owes. Of the transparent ones, those count that are accepted.
    fn scattering(
        &self,
        (origin, direction): (Vec3, Vec3),
        hit: Option<Hit>,
        accept: impl Fn(&Hit) -> bool,
        beta: &mut Vec3,
        random: &mut Random,
    ) -> Option<Vertex> {
        let wo = -direction.normalize();
        let reach = hit.map_or(f32::INFINITY, |hit| hit.t);
        for hit in self.tracer.transparent_hits(origin, direction, reach).into_iter().filter(accept) {
            let vertex = self.vertex(hit.triangle, hit.barycentric, wo);
            let passes = vertex.surface.transmittance;
            let share = passes.element_sum() / 3.0;
            if random.unit() >= share {
                *beta /= 1.0 - share;
                return Some(vertex);
            }
            *beta *= passes / share;
        }
        hit.map(|hit| self.vertex(hit.triangle, hit.barycentric, wo))
    }

    /// The share of light that passes from a vertex to a point on a triangle ([`NONE`] for none).
    fn passed(&self, vertex: &Vertex, to: Vec3, to_triangle: u32) -> Vec3 {
        if self.tracer.occluded(vertex.start, vertex.triangle, to, to_triangle) {
            return Vec3::ZERO;
        }
        let direction = to - vertex.start;
        let wo = -direction.normalize();
        let between = self.tracer.transparent_hits(vertex.start, direction, 1.0).into_iter();
        between
            .filter(|hit| hit.triangle != vertex.triangle && hit.triangle != to_triangle)
            .map(|hit| self.vertex(hit.triangle, hit.barycentric, wo).surface.transmittance)
            .product()
    }

    fn vertex(&self, triangle: u32, barycentric: Vec2, wo: Vec3) -> Vertex {
        let surface = self.tracer.geometry().surface(self.tracer.scene(), triangle, barycentric, wo);
        let start = self.tracer.offset_ray_origin(surface.position, surface.geometric_normal);
        Vertex { surface, triangle, start, wo }
    }

    /// Reflected light of one point on the emitters, weighted against BSDF sampling.
    fn light_from_emitters(&self, vertex: &Vertex, random: &mut Random) -> Vec3 {
        let Some(point) = self.emitters.sample(self.tracer, random) else { return Vec3::ZERO };
        let Some(wi) = (point.position - vertex.start).try_normalize() else { return Vec3::ZERO };
        let pdf = self.emitters.pdf_solid_angle(point.triangle, point.normal, vertex.start, point.position);
        let reflection = bsdf::evaluate(&vertex.surface, vertex.wo, wi);
        let towards = if point.normal.dot(wi) < 0.0 {
            point.normal
        } else if point.double_sided {
            -point.normal
        } else {
            return Vec3::ZERO;
        };
        let light = reflection * point.emission;
        if light == Vec3::ZERO || pdf <= 0.0 {
            return Vec3::ZERO;
        }
        let end = self.tracer.offset_ray_origin(point.position, towards);
        let passed = self.passed(vertex, end, point.triangle);
        passed * light / pdf * power_heuristic(pdf, bsdf::pdf(&vertex.surface, vertex.wo, wi))
    }

    /// Reflected light of one direction of the environment, weighted against BSDF sampling.
    fn light_from_distant(&self, vertex: &Vertex, random: &mut Random) -> Vec3 {
        let Some(distant) = &self.distant else { return Vec3::ZERO };
        let wi = distant.sample(vertex.start, random);
        let pdf = distant.pdf(vertex.start, wi);
        let light = bsdf::evaluate(&vertex.surface, vertex.wo, wi) * distant.radiance(wi);
        if light == Vec3::ZERO || pdf <= 0.0 {
            return Vec3::ZERO;
        }
        let end = vertex.start + wi * (vertex.start.length() + 2.0 * self.tracer.geometry().extent());
        self.passed(vertex, end, NONE) * light / pdf
            * power_heuristic(pdf, bsdf::pdf(&vertex.surface, vertex.wo, wi))
    }

    fn light_from_punctual(&self, vertex: &Vertex, random: &mut Random) -> Vec3 {
        if self.punctual.len() <= PUNCTUAL_SAMPLES {
            return self.punctual.iter().map(|light| self.light_from(light, vertex)).sum();
        }
        let drawn = (0..PUNCTUAL_SAMPLES).map(|_| random.below(self.punctual.len()));
        let sum: Vec3 = drawn.map(|i| self.light_from(&self.punctual[i], vertex)).sum();
        sum * (self.punctual.len() as f32 / PUNCTUAL_SAMPLES as f32)
    }

    fn light_from(&self, light: &Punctual, vertex: &Vertex) -> Vec3 {
        let (to, wi, irradiance) = light.towards(vertex.surface.position, self.tracer.geometry().extent());
        let contribution = bsdf::evaluate(&vertex.surface, vertex.wo, wi) * irradiance;
        if contribution == Vec3::ZERO {
            return Vec3::ZERO;
        }
        contribution * self.passed(vertex, to, NONE)
    }
}

fn reflects(surface: &Surface) -> bool {
    surface.albedo != Vec3::ZERO || surface.is_specular()
}

/// The weight of a sample with density `pdf` where another strategy has density `other_pdf` (Veach 1997, §9.2.4).
fn power_heuristic(pdf: f32, other_pdf: f32) -> f32 {
    let ratio = other_pdf / pdf;
    1.0 / (1.0 + ratio * ratio)
}
