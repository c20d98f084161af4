//! Indirect samples: the random walk of instant radiosity (Keller 1997; Barczak §4.1).
//!
//! 1. A path starts on a source of its emitter in proportion to power, in a direction distributed as its light is: with the flux
//!    `Φ = π · Le / p_A` (per channel) of that start.
//! 2. At every hit it leaves a sample of intensity `ρ · Φ / π` and goes on, cosine-weighted, with `Φ ← ρ · Φ`; where surfaces
//!    shine, `ρ` is all that they reflect, and it may go on by the specular lobe instead ([`scattering`](super::scattering)).
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
use super::emission::{Emission, Emissions};
use super::emitters::{EnvironmentPoint, Source};
use super::guide::{Guides, Start};
use super::punctual::SpotCone;
use super::scattering::{Scattering, cosine_weighted};
use super::source_tree::SourceTree;
use super::{LightSample, LightSettings, SampleOrigin, Termination};
use crate::math::{sequence, warp};
use crate::parallel::in_slices;
use crate::scene::PunctualKind;
use crate::trace::{SceneTracer, ray_offset_distance};
use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};
use std::f32::consts::PI;

/// Dimensions of the sequence: two to choose a point, two for the first direction, then three for each bounce.
const FIRST_BOUNCE: u32 = 4;

/// Deposits after which the pilot walk ends, at least…
const PILOT_DEPOSITS: usize = 256;
/// …and the share of those that are wanted.
const PILOT_SHARE: f64 = 0.125;
/// Paths after which the pilot gives up.
const PILOT_PATHS: u32 = 1 << 16;
/// Paths of a slice.
const SLICE: usize = 512;

/// The result of the walk.
#[derive(Clone, Debug, Default)]
pub(super) struct Walked {
    /// Ascending by index.
    pub paths: Vec<Path>,
    /// How many paths started on each emitter.
    pub counts: Vec<u32>,
    /// How many paths were walked; where they left nothing at all, in the pilot.
    pub walked: u32,
    /// There are fewer deposits than samples wanted because little light is reflected.
    pub exhausted: bool,
}

/// A path of light.
#[derive(Clone, Debug)]
pub(super) struct Path {
    /// Which one it is.
    pub index: u32,
    /// What its light comes from.
    pub emission: Emission,
    /// Where it starts, if it has any light.
    pub start: Option<Vec3>,
    /// What it leaves, bounce by bounce, each with all of its light.
    pub deposits: Vec<LightSample>,
    /// Where it ends: on a surface, or beyond the scene.
    pub end: Vec3,
}

/// What paths are walked with.
#[derive(Clone, Copy)]
pub(super) struct Walk<'a> {
    pub tracer: &'a SceneTracer<'a>,
    /// Of the scene's nodes.
    pub world_from_nodes: &'a [DAffine3],
    /// How much everything emits.
    pub emissions: &'a Emissions,
    pub emitters: &'a [SourceTree],
    /// Where light from infinitely far away is to come from and to start.
    pub guides: &'a Guides,
    pub settings: &'a LightSettings,
    pub seed: u32,
}

struct Photon {
    origin: Vec3,
    direction: Vec3,
    flux: Vec3,
}

/// A short walk that finds out how many deposits a path leaves, and on which emitters those start that matter.
#[derive(Clone, Debug)]
pub(super) struct Pilot {
    /// Each with all of its path's light.
    pub deposits: Vec<LightSample>,
    /// How many paths started on each emitter.
    counts: Vec<u32>,
    power: Vec<f64>,
    /// How many samples are wanted, and candidates for each.
    wanted: [u32; 2],
}

impl Pilot {
    /// With a seed of its own.
    pub async fn new(walk: &Walk<'_>, wanted: [u32; 2]) -> Self {
        let walk = Walk { seed: sequence::hash(walk.seed), ..*walk };
        let power: Vec<f64> = walk.emitters.iter().map(SourceTree::power).collect();
        let mut result = Self { deposits: Vec::new(), counts: vec![0; power.len()], power, wanted };
        let enough = PILOT_DEPOSITS.max((result.deposits_wanted() * PILOT_SHARE) as usize);
        let mut paths = 256;
        while result.deposits.len() < enough && result.walked() < PILOT_PATHS {
            let more = allocate(&result.power, paths.max(walk.emitters.len() as u32));
            let left = walk.range(&result.counts, &more).await;
            result.deposits.extend(left.into_iter().flat_map(|path| path.deposits));
            result.counts.iter_mut().zip(&more).for_each(|(count, more)| *count += more);
            paths *= 2;
        }
        result
    }

    /// How many paths it has.
    pub fn walked(&self) -> u32 {
        self.counts.iter().sum()
    }

    /// With a margin where there is a single candidate for each sample.
    fn deposits_wanted(&self) -> f64 {
        let [wanted, candidates] = self.wanted;
        f64::from(wanted) * f64::from(candidates).max(1.2) + 8.0
    }

    /// How many paths are walked at most.
    fn most(&self) -> u32 {
        (PILOT_PATHS + self.wanted[0].saturating_mul(32)).min(u32::MAX / self.counts.len() as u32)
    }

    /// How many paths from each emitter are likely to leave as many candidates as are wanted: more from those whose deposits
    /// have a larger weight. There is some deposit.
    pub fn counts(&self, weights: &[f64]) -> Vec<u32> {
        let (mut worth, mut rates) = (vec![0.0; self.counts.len()], vec![0.0; self.counts.len()]);
        for (sample, weight) in self.deposits.iter().zip(weights) {
            let emitter = emitter_of(sample, self.counts.len());
            worth[emitter] += weight / f64::from(self.counts[emitter]);
            rates[emitter] += 1.0 / f64::from(self.counts[emitter]);
        }
        let shares = mixture(&self.power, &worth);
        let rate: f64 = shares.iter().zip(&rates).map(|(share, rate)| share * rate).sum();
        let paths = (self.deposits_wanted() / rate).ceil().min(f64::from(self.most())) as u32;
        allocate(&shares, paths.max(self.counts.len() as u32))
    }
}

/// The emitter, of so many, that a deposit's light comes from.
fn emitter_of(deposit: &LightSample, emitters: usize) -> usize {
    match deposit.origin {
        SampleOrigin::Bounce { path, .. } => path as usize % emitters,
        SampleOrigin::Emitter { .. } | SampleOrigin::Punctual { .. } | SampleOrigin::Environment { .. } => 0,
    }
}

/// Walks as many paths from each emitter as a pilot finds to be worth it, by the weights of its deposits.
pub(super) async fn walk_as_found(with: &Walk<'_>, pilot: &Pilot, weights: &[f64]) -> Walked {
    if pilot.deposits.is_empty() {
        return Walked { walked: pilot.walked(), exhausted: true, ..Walked::default() };
    }
    walk(with, pilot, pilot.counts(weights)).await
}

/// Walks so many paths from each emitter, as the pilot says.
pub(super) async fn walk(walk: &Walk<'_>, pilot: &Pilot, counts: Vec<u32>) -> Walked {
    let paths = walk.range(&vec![0; counts.len()], &counts).await;
    let mut result = Walked { paths, walked: counts.iter().sum(), counts, exhausted: false };
    let found = result.deposits();
    result.exhausted = found == 0 || result.walked >= pilot.most() && found < pilot.wanted[0];
    result
}

impl Walked {
    /// How many deposits the paths left.
    pub fn deposits(&self) -> u32 {
        self.paths.iter().map(|path| path.deposits.len() as u32).sum()
    }

    /// A path's deposits, with its part of their light, as there are others from the same emitter.
    pub fn shares_of<'a>(&self, path: &'a Path) -> impl Iterator<Item = LightSample> + 'a {
        let scale = 1.0 / f64::from(self.counts[path.emitter(self.counts.len())]);
        let shared = move |d: &LightSample| (d.intensity.as_dvec3() * scale).as_vec3();
        path.deposits.iter().map(move |deposit| LightSample { intensity: shared(deposit), ..*deposit })
    }
}

impl Path {
    /// The emitter that it starts on, of so many.
    pub fn emitter(&self, emitters: usize) -> usize {
        self.index as usize % emitters
    }

    /// Where it goes, from point to point.
    pub fn points(&self) -> impl Iterator<Item = Vec3> {
        let ends = self.start.map(|_| self.end);
        self.start.into_iter().chain(self.deposits.iter().map(|deposit| deposit.position)).chain(ends)
    }
}

impl Walk<'_> {
    /// So many paths of each emitter from its `first` on, in order, whatever the number of threads.
    async fn range(&self, first: &[u32], counts: &[u32]) -> Vec<Path> {
        let all = self.emitters.len() as u32;
        let of = |(emitter, (&first, &count)): (u32, (&u32, &u32))| {
            (first..first + count).map(move |index| index * all + emitter)
        };
        self.paths((0..).zip(first.iter().zip(counts)).flat_map(of).collect()).await
    }

    /// These paths, in order, whatever the number of threads.
    pub async fn paths(&self, paths: Vec<u32>) -> Vec<Path> {
        in_slices(paths.len(), SLICE, |i| self.path(paths[i])).await
    }

    /// The source that a path starts from, the point of it, and how light from infinitely far away starts.
    fn choose(&self, path: u32) -> (&Source, DVec2, Start) {
        let tree = path as usize % self.emitters.len();
        let at = std::array::from_fn(|dimension| self.at(path, dimension as u32));
        let start = self.guides.start(tree, at, self.tracer.geometry());
        let (source, at) = self.emitters[tree].choose(start.at);
        (source, at, start)
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

    fn path(&self, path: u32) -> Path {
        let (scene, geometry) = (self.tracer.scene(), self.tracer.geometry());
        // Neighbouring emitters may share a sequence.
        let chosen = self.choose(path);
        let emission = chosen.0.emission(geometry);
        let mut result = Path { index: path, emission, start: None, deposits: Vec::new(), end: Vec3::ZERO };
        let Some(mut photon) = self.start(path, chosen) else { return result };
        result.start = Some(photon.origin);
        result.end = photon.origin;
        for bounce in 1..=self.settings.bounces {
            let accept = |triangle: u32, _| {
                let object = geometry.triangles[triangle as usize].object;
                self.settings.walk_dynamic || !scene.objects[object as usize].dynamic
            };
            let hit = self.tracer.closest_hit_where(photon.origin, photon.direction, f32::INFINITY, accept);
            let Some(hit) = hit else {
                result.end = photon.origin + photon.direction * (2.0 * geometry.extent());
                break;
            };
            let surface = geometry.surface(scene, hit.triangle, hit.barycentric, -photon.direction);
            let normal = surface.geometric_normal;
            result.end = surface.position;
            let Some(scattering) = Scattering::new(&surface, -photon.direction) else { break };
            let rho = scattering.albedo();
            let survival = match self.settings.termination {
                Termination::Throughput if rho.max_element() > 0.0 => 1.0,
                Termination::Throughput => 0.0,
                // The share of the path's brightest channel that is reflected.
                Termination::Albedo => {
                    ((rho * photon.flux).max_element() / photon.flux.max_element()).min(1.0)
                }
            };
            let dimension = FIRST_BOUNCE + 3 * (bounce - 1);
            let chance = self.at(path, dimension);
            if chance >= survival {
                break;
            }
            let position = surface.position + normal * ray_offset_distance(geometry, surface.position);
            result.deposits.push(LightSample {
                position,
                normal,
                intensity: photon.flux * (rho / survival) / PI,
                profile: scattering.profile(),
                origin: SampleOrigin::Bounce { path, bounce, triangle: hit.triangle },
                rectangle: None,
            });
            // What is left of the number that let it survive is a number again.
            let at = Vec2::new(self.at(path, dimension + 1), self.at(path, dimension + 2));
            let Some((direction, flux)) = scattering.go_on(photon.flux, survival, chance / survival, at)
            else {
                break;
            };
            photon = Photon { origin: position, direction, flux };
        }
        result
    }

    /// A cosine-weighted direction from a surface.
    fn leave(&self, path: u32, dimension: u32, normal: Vec3) -> Vec3 {
        cosine_weighted(normal, Vec2::new(self.at(path, dimension), self.at(path, dimension + 1)))
    }

    /// A point outside of the scene on a disc as large as that, from where light goes in that direction.
    fn on_disc(&self, start: &Start, forward: Vec3) -> Vec3 {
        let (center, radius) = start.disc;
        let (x, y) = warp::frame(forward);
        let disc = warp::disc(start.across) * radius;
        center + x * disc.x + y * disc.y - forward * self.tracer.geometry().extent()
    }

    fn start(&self, path: u32, (source, at, start): (&Source, DVec2, Start)) -> Option<Photon> {
        let (scene, geometry) = (self.tracer.scene(), self.tracer.geometry());
        let tree = &self.emitters[path as usize % self.emitters.len()];
        let probability = tree.probability(source);
        if let Some(EnvironmentPoint { direction, radiance, .. }) =
            source.direction(scene, self.emissions, at)
        {
            let luminance = f64::from(crate::image::luminance(radiance));
            let flux = radiance.as_dvec3() * (source.weight / luminance / probability * start.scale);
            let origin = self.on_disc(&start, -direction);
            return (flux.max_element() > 0.0).then(|| Photon {
                origin,
                direction: -direction,
                flux: flux.as_vec3(),
            });
        }
        let Some(light) = source.punctual() else {
            let point = source.point((scene, geometry), self.emissions, at)?;
            let flux = point.radiance.as_dvec3() * (std::f64::consts::PI * point.area / probability);
            return (flux.max_element() > 0.0).then(|| Photon {
                origin: point.position + point.normal * ray_offset_distance(geometry, point.position),
                direction: self.leave(path, 2, point.normal),
                flux: flux.as_vec3(),
            });
        };
        let intensity = self.emissions.of_punctual(light);
        let (id, light) = (light, &scene.lights[light]);
        let node = self.world_from_nodes[light.node.index()];
        let position = geometry.light_position(id, &node);
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
            PunctualKind::Directional => (self.on_disc(&start, forward), forward),
        };
        // A source's weight is its flux by luminance.
        let luminance = f64::from(crate::image::luminance(intensity));
        let flux = intensity.as_dvec3() * (source.weight / luminance / probability);
        Some(Photon { origin, direction, flux: flux.as_vec3() })
    }
}
