//! Indirect samples: the random walk of instant radiosity (Keller 1997; Barczak §4.1).
//!
//! 1. A path starts on a source of its emitter in proportion to power, in a direction distributed as its light is: with the flux
//!    `Φ = π · Le / p_A` (per channel) of that start.
//! 2. At every hit it leaves a sample of intensity `ρ · Φ / π` and goes on, cosine-weighted, with `Φ ← ρ · Φ`.
//! 3. Deposits are divided by the number of paths from the same emitter.
//!
//! The number of paths must not depend on their deposits: stopping once there are enough samples, in the middle of a
//! path, favours short paths (measured with independent paths: 5 to 9 % too bright at 8 samples, 1 % at 75), and even
//! leaving out the path that overflows, which is unbiased for independent paths, is off by 1 % at 8 for well-spread ones.
//! So a short pilot walk with a seed of its own estimates how many deposits a path leaves, and what they are worth: in a
//! building, most lamps light nothing that is seen. That fixes the number of paths of each emitter.
//! Worked example: 225 samples with 16 candidates each need 3600 deposits; the pilot leaves
//! 2.1 a path; 1719 paths are walked, and divided by. Of two lamps of which one is worth nine times the other, one gets
//! 1479 paths (a fifth goes by power alone), the other 240, and its deposits are divided by those.

use super::direct::{allocate, mixture};
use super::emission::Emission;
use super::emitters::{Source, SourceTree, SpotCone};
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

/// Deposits after which the pilot walk ends, at least…
const PILOT_DEPOSITS: usize = 256;
/// …and the share of those that are wanted.
const PILOT_SHARE: f64 = 0.125;
/// Paths after which the pilot gives up.
const PILOT_PATHS: u32 = 1 << 16;

/// The result of the walk.
pub(super) struct Deposits {
    pub samples: Vec<LightSample>,
    /// Where their light comes from, in the same order.
    pub emissions: Vec<Emission>,
    /// How many paths were walked.
    pub paths: u32,
    /// There are fewer samples than wanted because little light is reflected.
    pub exhausted: bool,
}

struct Walk<'a> {
    scene: &'a Scene,
    geometry: &'a Geometry,
    tracer: &'a SceneTracer<'a>,
    emitters: &'a [SourceTree],
    settings: &'a LightSettings,
    seed: u32,
}

struct Photon {
    origin: Vec3,
    direction: Vec3,
    flux: Vec3,
}

/// Walks as many paths as are likely to leave `candidates` deposits for each of `wanted` samples; more from emitters whose
/// deposits have a larger `weight`.
pub(super) fn walk(
    tracer: &SceneTracer,
    emitters: &[SourceTree],
    settings: &LightSettings,
    [wanted, candidates]: [u32; 2],
    seed: u32,
    weigh: &dyn Fn(&[LightSample]) -> Vec<f64>,
) -> Deposits {
    let (scene, geometry) = (tracer.scene(), tracer.geometry());
    let mut walk = Walk { scene, geometry, tracer, emitters, settings, seed: sequence::hash(seed) };
    let power: Vec<f64> = emitters.iter().map(SourceTree::power).collect();
    let deposits = f64::from(wanted) * f64::from(candidates).max(1.2) + 8.0;

    // The pilot.
    let enough = PILOT_DEPOSITS.max((deposits * PILOT_SHARE) as usize);
    let (mut left, mut counts) = (Vec::new(), vec![0; emitters.len()]);
    let mut paths = 256;
    while left.iter().map(Vec::len).sum::<usize>() < enough && counts.iter().sum::<u32>() < PILOT_PATHS {
        let more = allocate(&power, paths.max(emitters.len() as u32));
        left.extend(walk.paths(&counts, &more));
        counts.iter_mut().zip(&more).for_each(|(count, more)| *count += more);
        paths *= 2;
    }
    let walked = counts.iter().sum::<u32>();
    let pilot: Vec<LightSample> = left.concat();
    if pilot.is_empty() {
        return Deposits { samples: Vec::new(), emissions: Vec::new(), paths: walked, exhausted: true };
    }
    let (mut worth, mut rates) = (vec![0.0; emitters.len()], vec![0.0; emitters.len()]);
    for (sample, weight) in pilot.iter().zip(weigh(&pilot)) {
        let emitter = walk.emitter_of(sample);
        worth[emitter] += weight / f64::from(counts[emitter]);
        rates[emitter] += 1.0 / f64::from(counts[emitter]);
    }
    let shares = mixture(&power, &worth);

    // The walk, with a margin where there is a single candidate for each sample.
    let rate: f64 = shares.iter().zip(&rates).map(|(share, rate)| share * rate).sum();
    let most = (PILOT_PATHS + wanted.saturating_mul(32)).min(u32::MAX / emitters.len() as u32);
    let paths = (deposits / rate).ceil().min(f64::from(most)) as u32;
    walk.seed = seed;
    let counts = allocate(&shares, paths.max(emitters.len() as u32));
    let mut samples = walk.paths(&vec![0; emitters.len()], &counts).concat();
    for sample in &mut samples {
        let scale = 1.0 / f64::from(counts[walk.emitter_of(sample)]);
        sample.intensity = (sample.intensity.as_dvec3() * scale).as_vec3();
    }
    let exhausted = samples.is_empty() || paths == most && samples.len() < wanted as usize;
    let emissions = samples.iter().map(|deposit| walk.emission_of(deposit)).collect();
    Deposits { samples, emissions, paths: counts.iter().sum(), exhausted }
}

impl Walk<'_> {
    /// So many paths of each emitter from its `first` on, in order, whatever the number of threads.
    fn paths(&self, first: &[u32], counts: &[u32]) -> Vec<Vec<LightSample>> {
        let all = self.emitters.len() as u32;
        let of = |(emitter, (&first, &count)): (u32, (&u32, &u32))| {
            (first..first + count).map(move |index| index * all + emitter)
        };
        let paths: Vec<u32> = (0..).zip(first.iter().zip(counts)).flat_map(of).collect();
        #[cfg(feature = "parallel")]
        {
            use rayon::prelude::*;
            paths.into_par_iter().with_min_len(16).map(|path| self.path(path)).collect()
        }
        #[cfg(not(feature = "parallel"))]
        paths.into_iter().map(|path| self.path(path)).collect()
    }

    /// The emitter that a deposit's light comes from.
    fn emitter_of(&self, deposit: &LightSample) -> usize {
        match deposit.origin {
            SampleOrigin::Bounce { path, .. } => path as usize % self.emitters.len(),
            SampleOrigin::Emitter { .. } | SampleOrigin::Punctual { .. } => 0,
        }
    }

    /// The source that a path starts from, and the point of it.
    fn choose(&self, path: u32) -> (&Source, DVec2) {
        let at = DVec2::new(f64::from(self.at(path, 0)), f64::from(self.at(path, 1)));
        self.emitters[path as usize % self.emitters.len()].choose(at)
    }

    /// What emitted a deposit's light: neighbouring emitters may share a sequence.
    fn emission_of(&self, deposit: &LightSample) -> Emission {
        let SampleOrigin::Bounce { path, .. } = deposit.origin else { return Emission::Material(0) };
        self.choose(path).0.emission(self.geometry)
    }

    /// Each emitter has a sequence of its own, and every so many paths are its own.
    fn at(&self, path: u32, dimension: u32) -> f32 {
        let all = self.emitters.len() as u32;
        let seed = match path % all {
            0 => self.seed,
            emitter => sequence::hash(self.seed ^ sequence::hash(emitter)),
        };
        sequence::sample(path / all, dimension, seed)
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
                rectangle: None,
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
        let tree = &self.emitters[path as usize % self.emitters.len()];
        let (source, at) = self.choose(path);
        let probability = tree.probability(source);
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
