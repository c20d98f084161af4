//! Indirect samples: the random walk of instant radiosity (Keller 1997; Barczak §4.1).
//!
//! 1. A path starts on a source in proportion to power, in a direction distributed as its light is: with the flux
//!    `Φ = π · Le / p_A` (per channel) of that start.
//! 2. At every hit it leaves a sample of intensity `ρ · Φ / π` and goes on, cosine-weighted, with `Φ ← ρ · Φ`.
//! 3. All deposits are divided by the number of paths.
//!
//! The number of paths must not depend on their deposits: stopping once there are enough samples, in the middle of a
//! path, favours short paths (measured with independent paths: 5 to 9 % too bright at 8 samples, 1 % at 75), and even
//! leaving out the path that overflows, which is unbiased for independent paths, is off by 1 % at 8 for well-spread ones.
//! So a short pilot walk with a seed of its own estimates the number of deposits a path leaves, which fixes the number of
//! paths. Worked example: 225 samples with 16 candidates each need 3600 deposits; the pilot leaves
//! 2.1 a path; 1719 paths are walked, and divided by.

use super::emitters::{SourceTree, SpotCone};
use super::{LightSample, LightSettings, Profile, SampleOrigin, Termination};
use crate::math::{sequence, warp};
use crate::scene::{Geometry, PunctualKind, Scene};
use crate::trace::{SceneTracer, ray_offset_distance};
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f32::consts::PI;

/// Dimensions of the sequence: two to choose a point, two for the first direction, then three for each bounce.
const FIRST_BOUNCE: u32 = 4;
/// Upper bound of the factor by which a shading normal brightens a deposit.
const MAX_SHADING_FACTOR: f32 = 8.0;

/// Deposits after which the pilot walk ends: the rate then has a standard error of some 6 %.
const PILOT_DEPOSITS: usize = 256;
/// Paths after which the pilot gives up.
const PILOT_PATHS: u32 = 1 << 16;

/// The result of the walk.
pub(super) struct Deposits {
    pub samples: Vec<LightSample>,
    /// The paths that the samples were divided by.
    pub paths: u32,
    /// There are fewer samples than wanted because little light is reflected.
    pub exhausted: bool,
}

struct Walk<'a> {
    scene: &'a Scene,
    geometry: &'a Geometry,
    tracer: SceneTracer<'a>,
    tree: &'a SourceTree,
    settings: &'a LightSettings,
    seed: u32,
}

struct Photon {
    origin: Vec3,
    direction: Vec3,
    flux: Vec3,
}

/// Walks as many paths as are likely to leave `candidates` deposits for each of `wanted` samples.
pub(super) fn walk(
    scene: &Scene,
    geometry: &Geometry,
    tree: &SourceTree,
    settings: &LightSettings,
    [wanted, candidates]: [u32; 2],
    seed: u32,
) -> Deposits {
    let tracer = SceneTracer::new(scene, geometry);
    let mut walk = Walk { scene, geometry, tracer, tree, settings, seed: sequence::hash(seed) };
    // The pilot.
    let (mut left, mut paths) = (0, 0);
    while left < PILOT_DEPOSITS && paths < PILOT_PATHS {
        left += walk.paths(paths..paths + 256).iter().map(Vec::len).sum::<usize>();
        paths += 256;
    }
    if left == 0 {
        return Deposits { samples: Vec::new(), paths, exhausted: true };
    }
    // The walk, with a margin where there is a single candidate for each sample.
    let rate = left as f64 / f64::from(paths);
    let deposits = f64::from(wanted) * f64::from(candidates).max(1.2) + 8.0;
    let most = PILOT_PATHS + wanted.saturating_mul(32);
    let paths = (deposits / rate).ceil().min(f64::from(most)) as u32;
    walk.seed = seed;
    let mut samples = walk.paths(0..paths).concat();
    let scale = 1.0 / f64::from(paths);
    for sample in &mut samples {
        sample.intensity = (sample.intensity.as_dvec3() * scale).as_vec3();
    }
    let exhausted = samples.is_empty() || paths == most && samples.len() < wanted as usize;
    Deposits { samples, paths, exhausted }
}

impl Walk<'_> {
    /// Paths in order, whatever the number of threads.
    fn paths(&self, range: std::ops::Range<u32>) -> Vec<Vec<LightSample>> {
        #[cfg(feature = "parallel")]
        {
            use rayon::prelude::*;
            range.into_par_iter().with_min_len(16).map(|path| self.path(path)).collect()
        }
        #[cfg(not(feature = "parallel"))]
        range.map(|path| self.path(path)).collect()
    }

    fn at(&self, path: u32, dimension: u32) -> f32 {
        sequence::sample(path, dimension, self.seed)
    }

    fn path(&self, path: u32) -> Vec<LightSample> {
        let mut deposits = Vec::new();
        let Some(mut photon) = self.start(path) else { return deposits };
        for bounce in 1..=self.settings.bounces {
            let accept = |triangle: u32, _| {
                let object = self.geometry.triangles[triangle as usize].object;
                self.settings.walk_dynamic || !self.scene.objects[object as usize].dynamic
            };
            let hit = self.tracer.closest_hit_where(photon.origin, photon.direction, f32::INFINITY, accept);
            let Some(hit) = hit else { break };
            let surface = self.geometry.surface(self.scene, hit.triangle, hit.barycentric, -photon.direction);
            let normal = surface.geometric_normal;
            // Photons arrive by the geometric normal, radiance is received by the shading normal: correct for the
            // difference (Veach 1996, §5.3.2).
            let arriving = -normal.dot(photon.direction);
            let shading = -surface.shading_normal.dot(photon.direction);
            if arriving <= 0.0 || shading <= 0.0 {
                break;
            }
            let rho = surface.albedo * (shading / arriving).min(MAX_SHADING_FACTOR);
            let survival = match self.settings.termination {
                Termination::Throughput if rho.max_element() > 0.0 => 1.0,
                Termination::Throughput => 0.0,
                // The share of the path's brightest channel that is reflected.
                Termination::Albedo => {
                    ((rho * photon.flux).max_element() / photon.flux.max_element()).min(1.0)
                }
            };
            let dimension = FIRST_BOUNCE + 3 * (bounce - 1);
            if self.at(path, dimension) >= survival {
                break;
            }
            photon.flux *= rho / survival;
            let position = surface.position + normal * ray_offset_distance(self.geometry, surface.position);
            deposits.push(LightSample {
                position,
                normal,
                intensity: photon.flux / PI,
                profile: Profile::Cosine,
                origin: SampleOrigin::Bounce { path, bounce, triangle: hit.triangle },
            });
            photon.origin = position;
            photon.direction = self.leave(path, dimension + 1, normal);
        }
        deposits
    }

    /// A cosine-weighted direction from a surface.
    fn leave(&self, path: u32, dimension: u32, normal: Vec3) -> Vec3 {
        let local =
            warp::cosine_hemisphere(Vec2::new(self.at(path, dimension), self.at(path, dimension + 1)));
        let (x, y) = warp::frame(normal);
        (x * local.x + y * local.y + normal * local.z).normalize()
    }

    fn start(&self, path: u32) -> Option<Photon> {
        let at = DVec2::new(f64::from(self.at(path, 0)), f64::from(self.at(path, 1)));
        let (source, at) = self.tree.choose(at);
        let probability = self.tree.probability(source);
        let Some(light) = source.punctual() else {
            let point = source.point(self.scene, self.geometry, at)?;
            let flux = point.radiance.as_dvec3() * (std::f64::consts::PI * point.area / probability);
            return (flux.max_element() > 0.0).then(|| Photon {
                origin: point.position + point.normal * ray_offset_distance(self.geometry, point.position),
                direction: self.leave(path, 2, point.normal),
                flux: flux.as_vec3(),
            });
        };
        let light = &self.scene.lights[light as usize];
        let node = self.scene.world_from_node(light.node);
        let position = (node.translation - self.geometry.origin).as_vec3();
        let forward = node.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Y).as_vec3();
        let s = Vec2::new(self.at(path, 2), self.at(path, 3));
        let (origin, direction) = match light.kind {
            PunctualKind::Point => (position, warp::sphere(s)),
            PunctualKind::Spot { inner, outer } => {
                let cos = SpotCone::new(inner, outer).cosine(f64::from(s.x)) as f32;
                let sin = (1.0 - cos * cos).max(0.0).sqrt();
                let phi = 2.0 * PI * s.y;
                let (x, y) = warp::frame(forward);
                let across = x * libm::cosf(phi) + y * libm::sinf(phi);
                (position, (across * sin + forward * cos).normalize())
            }
            PunctualKind::Directional => {
                let (x, y) = warp::frame(forward);
                let disc = warp::disc(s) * (self.geometry.extent() * 0.5);
                let center = (self.geometry.bounds.0 + self.geometry.bounds.1) * 0.5;
                (center + x * disc.x + y * disc.y - forward * self.geometry.extent(), forward)
            }
        };
        // A source's weight is its flux by luminance.
        let luminance = f64::from(crate::image::luminance(light.intensity));
        let flux = light.intensity.as_dvec3() * (source.weight / luminance / probability);
        Some(Photon { origin, direction, flux: flux.as_vec3() })
    }
}
