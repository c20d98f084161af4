//! Where an environment's light comes from and where it comes in, found from what is seen.
//!
//! Most of what a sky sends on a disc before the scene never comes to what is seen: through a window of one of a building's rooms comes
//! a ten-thousandth of it.
//!
//! 1. Rays leave the points that views see as light would arrive there, cosine-weighted, and go on from what they hit. Where one leaves
//!    the scene, light comes in the other way: radiance times the throughput to the view is what a start there is worth. Rays that
//!    left a point that is seen tell of directions for direct samples, the others of starts of the walk. Rays towards the sun tell
//!    where the walk's paths from there start.
//! 2. Directions and places on the disc are points of the unit cube of the random numbers that choose them, two for the
//!    direction and two for the place: plain sampling is uniform there (primary sample space: Guo et al. 2018, §4). The disc lies about
//!    the point that those rays pass closest to, as it would about a window: then its place hardly depends on the direction.
//! 3. Where more than a [quarter](OUTDOORS) of the rays from what is seen leave the scene, plain sampling does as well, and stays.
//! 4. A [density](Density) of what they are worth, a fifth of it uniform, warps the numbers of candidates and paths, which stay well
//!    spread, and their light is divided by it: whatever it is, there is the same light in the mean.

mod density;

use self::density::Density;
use super::LightSettings;
use super::emitters::Source;
use super::source_tree::SourceTree;
use super::view_points::ViewPoint;
use crate::image::luminance;
use crate::math::{sequence, warp};
use crate::parallel::in_slices;
use crate::scene::{Environment, Geometry};
use crate::trace::SceneTracer;
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

/// Of the sequence that rays are spread by.
const RAYS_SEED: u32 = 0x1b87_3593;
/// Share of cosine-weighted rays from what is seen that leave the scene at once, from which on it is taken for outdoors.
const OUTDOORS: f64 = 0.25;
/// Rays that leave the scene, of those that left a point that is seen and of others, after which there are enough…
const ENOUGH: usize = 2048;
/// …and rays in all after which no more are traced.
const MOST_RAYS: usize = 1 << 17;
/// Each of them counts for so many near it in each tree…
const COPIES: u32 = 2;
const NEAR_SEED: u32 = 0x7d2c_5f19;
/// …at this angle, radians, …
const DIRECTION_BLUR: f32 = 0.15;
/// …and at this share of the median distance from the point that they pass closest to.
const PLACE_BLUR: f32 = 0.3;
/// Share of starts from any direction at the places where others start: an edge in the numbers that choose directions, where few rays
/// tell of it, is no edge of a window.
const ANY_DIRECTION: f64 = 0.2;
/// Steps towards the point that rays pass closest to.
const STEPS: u32 = 16;
/// Rays that pass as close as this, in the scene's size, pass through a point.
const CLOSE: f64 = 1e-3;
/// How much the middle of the scene counts beside all rays.
const MIDDLE: f64 = 1e-4;
/// Points of a slice.
const SLICE: usize = 256;

/// What guides the sampling of light from infinitely far away.
#[derive(Clone, Debug, Default)]
pub(super) struct Guides {
    /// By group of sources, of directions.
    directions: BTreeMap<usize, Density<2>>,
    /// By tree of sources.
    starts: BTreeMap<usize, Starts>,
}

/// Where paths from one tree of sources start.
#[derive(Clone, Debug)]
pub(super) struct Starts {
    density: Density<4>,
    /// A disc with this middle and radius holds the scene, seen from any direction.
    disc: (Vec3, f32),
}

/// The numbers that a path from infinitely far away starts with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// Of the direction.
    pub at: DVec2,
    /// Of the place on the disc.
    pub across: Vec2,
    /// Middle and radius of the disc.
    pub disc: (Vec3, f32),
    /// What light is multiplied by.
    pub scale: f64,
}

/// A ray that leaves the scene.
struct Escape {
    from: Vec3,
    direction: Vec3,
    /// Share of the light that comes the other way that a view sees in the end.
    throughput: f64,
    /// How often that is reflected before it comes to what is seen.
    bounces: u32,
    towards: Towards,
}

/// How a ray's direction was chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Towards {
    /// Cosine-weighted.
    Any,
    /// By the power of the sky.
    Sky,
    Sun,
}

impl Guides {
    /// For what is seen at these points; none without an environment.
    pub async fn new(
        tracer: &SceneTracer<'_>,
        settings: &LightSettings,
        points: &[ViewPoint],
        groups: &[Vec<Source>],
        trees: &[SourceTree],
    ) -> Self {
        let Some(environment) = tracer.scene().environment.as_ref().filter(|_| !points.is_empty()) else {
            return Self::default();
        };
        // A group that has no tree of its own shares it with other emitters.
        let has_own_tree = trees.len() >= groups.len();
        let of = |is: fn(&Source) -> bool| -> Vec<(usize, &SourceTree)> {
            let trees = groups.iter().zip(trees).enumerate();
            let chosen = trees.filter(|(_, (group, _))| has_own_tree && group.iter().all(is));
            chosen.map(|(index, (_, tree))| (index, tree)).collect()
        };
        let (distant, suns) = (of(|source| source.cell().is_some()), of(Source::is_sun));
        if distant.is_empty() && suns.is_empty() {
            return Self::default();
        }
        let sky = Sky::new(environment, [&distant, &suns]);
        let (of_sun, of_sky): (Vec<Escape>, Vec<Escape>) = escapes(tracer, settings, points, &sky)
            .await
            .into_iter()
            .partition(|e| e.towards == Towards::Sun);
        let (direct, reflected): (Vec<Escape>, Vec<Escape>) =
            of_sky.into_iter().partition(|escape| escape.bounces == 0);
        let mut result = Self::default();
        for (index, tree) in distant {
            let square = Square::new(tree, environment);
            let place = |near: Near| square.place(near.direction, near.throughput);
            let blurs = [DIRECTION_BLUR, 0.0];
            let density = Density::new(COPIES, |tree| {
                near(&direct, Vec3::ZERO, blurs, tree).filter_map(place).collect()
            });
            result.directions.extend(density.map(|density| (index, density)));
            let place = |direction, throughput| {
                square.place(direction, throughput).map(|(at, weight)| (Some(at), weight))
            };
            let starts = Starts::new(tracer.geometry(), &reflected, DIRECTION_BLUR, place);
            result.starts.extend(starts.map(|starts| (index, starts)));
        }
        for (index, _) in suns {
            // Its disc is so small that any direction of it is as good as another.
            let starts =
                Starts::new(tracer.geometry(), &of_sun, 0.0, |_, throughput| Some((None, throughput)));
            result.starts.extend(starts.map(|starts| (index, starts)));
        }
        result
    }

    /// Whether nothing is guided.
    pub fn is_empty(&self) -> bool {
        self.directions.is_empty() && self.starts.is_empty()
    }

    /// For a group of sources, where a point of the unit square goes, and the density of such points there.
    pub fn direction(&self, group: usize, at: [f64; 2]) -> ([f64; 2], f64) {
        self.directions.get(&group).map_or((at, 1.0), |density| density.warp(at))
    }

    /// For a tree of sources, what a path from infinitely far away starts with, by four numbers.
    pub fn start(&self, tree: usize, at: [f32; 4], geometry: &Geometry) -> Start {
        let radius = geometry.extent() * 0.5;
        let (at, density, disc) = match self.starts.get(&tree) {
            Some(Starts { density, disc }) => {
                let (at, density) = density.warp(at.map(f64::from));
                (at, density, *disc)
            }
            None => (at.map(f64::from), 1.0, (geometry.center(), radius)),
        };
        let area = f64::from(disc.1 / radius).powi(2);
        Start {
            at: DVec2::new(at[0], at[1]),
            across: DVec2::new(at[2], at[3]).as_vec2(),
            disc,
            scale: area / density,
        }
    }
}

impl Starts {
    /// Where rays came from that left the scene. `place` says of a direction and a throughput which numbers choose it, if not any do,
    /// and what light from there is worth.
    fn new(
        geometry: &Geometry,
        escapes: &[Escape],
        direction_blur: f32,
        place: impl Fn(Vec3, f64) -> Option<(Option<[f64; 2]>, f64)>,
    ) -> Option<Self> {
        let line = |escape: &Escape| {
            let (_, weight) = place(escape.direction, escape.throughput)?;
            Some((escape.from.as_dvec3(), escape.direction.as_dvec3(), weight))
        };
        let lines: Vec<(DVec3, DVec3, f64)> = escapes.iter().filter_map(line).collect();
        let center = closest_point(geometry, &lines).as_vec3().clamp(geometry.bounds.0, geometry.bounds.1);
        let radius = geometry.extent() * 0.5 + center.distance(geometry.center());
        let blur = PLACE_BLUR * median_distance(center.as_dvec3(), &lines) as f32;
        let points = |near: Near| {
            let (x, y) = warp::frame(-near.direction);
            let across = Vec2::new(near.across.dot(x), near.across.dot(y)) / radius;
            let across = warp::square_of_disc(across).as_dvec2();
            let place = place(near.direction, near.throughput);
            place.into_iter().flat_map(move |(at, weight)| {
                let with = |at: [f64; 2], share| ([at[0], at[1], across.x, across.y], weight * share);
                [with(at.unwrap_or(near.any), 1.0 - ANY_DIRECTION), with(near.any, ANY_DIRECTION)]
            })
        };
        let blurs = [direction_blur, blur];
        let density =
            Density::new(2 * COPIES, |tree| near(escapes, center, blurs, tree).flat_map(points).collect())?;
        Some(Self { density, disc: (center, radius) })
    }
}

/// Where cells of an environment lie in the unit square that chooses among them.
struct Square<'a> {
    environment: &'a Environment,
    /// By cell, lower corner and size.
    cells: FxHashMap<u32, [DVec2; 2]>,
}

impl<'a> Square<'a> {
    fn new(tree: &SourceTree, environment: &'a Environment) -> Self {
        let cell = |(source, place): (&Source, [DVec2; 2])| Some((source.cell()?, place));
        let cells = tree.sources().iter().zip(tree.places()).filter_map(cell).collect();
        Self { environment, cells }
    }

    /// The point that chooses a direction, and what light from there is worth.
    fn place(&self, direction: Vec3, throughput: f64) -> Option<([f64; 2], f64)> {
        let (cell, within) = self.environment.cell_and_place(direction);
        let [low, size] = self.cells.get(&cell)?;
        let radiance = f64::from(luminance(self.environment.cell_radiance_beside_sun(cell)));
        Some(((*low + *size * within).to_array(), radiance * throughput))
    }
}

/// All directions that light from infinitely far away comes from, by its power.
struct Sky<'a> {
    environment: &'a Environment,
    trees: Vec<&'a SourceTree>,
    suns: Vec<&'a SourceTree>,
    power: f64,
    /// By cell, the density of its directions, sr⁻¹.
    densities: Vec<f64>,
}

impl<'a> Sky<'a> {
    /// Of the trees of a sky and of a sun, with their places among all.
    fn new(environment: &'a Environment, trees: [&[(usize, &'a SourceTree)]; 2]) -> Self {
        let [trees, suns] =
            trees.map(|trees| trees.iter().map(|(_, tree)| *tree).collect::<Vec<&SourceTree>>());
        let power: f64 = trees.iter().map(|tree| tree.power()).sum();
        let mut densities = vec![0.0; environment.cells() as usize];
        for source in trees.iter().flat_map(|tree| tree.sources()) {
            if let Some(cell) = source.cell() {
                densities[cell as usize] = source.weight / power / environment.cell_solid_angle();
            }
        }
        Self { environment, trees, suns, power, densities }
    }

    fn direction(&self, at: [f32; 2]) -> Option<Vec3> {
        let mut along = f64::from(at[0]) * self.power;
        for tree in &self.trees {
            if along < tree.power() {
                let (source, at) = tree.choose(DVec2::new(along / tree.power(), f64::from(at[1])));
                return Some(self.environment.cell_direction(source.cell()?, at));
            }
            along -= tree.power();
        }
        None
    }

    /// A direction of the sun.
    fn sunward(&self, at: [f32; 2]) -> Option<Vec3> {
        let (source, at) = self.suns.first()?.choose(DVec2::new(f64::from(at[0]), f64::from(at[1])));
        source.sun_direction(self.environment, at)
    }

    /// What a direction of one of two rays from a surface counts for, where one is cosine-weighted and the other's is chosen by power
    /// (balance heuristic: Veach and Guibas 1995).
    fn share(&self, direction: Vec3, normal: Vec3) -> f64 {
        let cosine = f64::from(normal.dot(direction)).max(0.0) / std::f64::consts::PI;
        let by_power = self.densities[self.environment.cell_at(direction) as usize];
        if cosine > 0.0 { cosine / (cosine + by_power) } else { 0.0 }
    }
}

/// A line near a ray that leaves the scene.
struct Near {
    direction: Vec3,
    /// How far aside it passes a point.
    across: Vec3,
    throughput: f64,
    /// Numbers that choose any direction.
    any: [f64; 2],
}

/// What is near rays that leave the scene, as it is known of few of them; for one of the trees of a density.
fn near(
    escapes: &[Escape],
    point: Vec3,
    [direction_blur, place_blur]: [f32; 2],
    tree: u32,
) -> impl Iterator<Item = Near> {
    let all = (0..).zip(escapes).flat_map(|escape| (0..COPIES).map(move |copy| (escape, copy)));
    all.map(move |((i, &Escape { from, direction, throughput, .. }), copy)| {
        let random = |d| sequence::sample(i * COPIES + copy, d, sequence::hash(NEAR_SEED ^ tree));
        let (x, y) = warp::frame(direction);
        let aside = |d: u32| {
            let disc = warp::disc(Vec2::new(random(d), random(d + 1)));
            x * disc.x + y * disc.y
        };
        let across = from - point - direction * (from - point).dot(direction);
        Near {
            direction: (direction + aside(0) * direction_blur).normalize(),
            across: across + aside(2) * place_blur,
            throughput,
            any: [4, 5].map(|d| f64::from(random(d))),
        }
    })
}

/// Rays from what is seen to what is infinitely far away, in order, whatever the number of threads; none outdoors.
async fn escapes(
    tracer: &SceneTracer<'_>,
    settings: &LightSettings,
    points: &[ViewPoint],
    sky: &Sky<'_>,
) -> Vec<Escape> {
    let mut found: Vec<Escape> = Vec::new();
    let mut rays = 0;
    for round in 0.. {
        let is_enough = |of: fn(&Escape) -> bool| {
            found.iter().filter(|e| e.towards != Towards::Sun && of(e)).count() >= ENOUGH
        };
        if is_enough(|e| e.bounces == 0) && (settings.bounces == 0 || is_enough(|e| e.bounces > 0))
            || rays >= MOST_RAYS
        {
            break;
        }
        let path = |i: usize| {
            let index = (round * points.len() + i) as u32;
            let random = |dimension| sequence::sample(index, dimension, RAYS_SEED);
            let mut found = Vec::new();
            let traced = path((tracer, sky), settings, &points[i], random, &mut found);
            (traced, found)
        };
        for (traced, escapes) in in_slices(points.len(), SLICE, path).await {
            rays += traced;
            found.extend(escapes);
        }
        let leaves_at_once = |escape: &&Escape| escape.bounces == 0 && escape.towards == Towards::Any;
        let share = found.iter().filter(leaves_at_once).count() as f64 / points.len() as f64;
        if round == 0 && share > OUTDOORS {
            return Vec::new();
        }
    }
    found
}

/// Rays of a path from a point that is seen, at every place one that goes on and one towards the sky: how many they are, and those that
/// leave the scene.
fn path(
    (tracer, sky): (&SceneTracer, &Sky),
    settings: &LightSettings,
    point: &ViewPoint,
    random: impl Fn(u32) -> f32,
    found: &mut Vec<Escape>,
) -> usize {
    let (scene, geometry) = (tracer.scene(), tracer.geometry());
    let mut throughput = f64::from(point.reflectance);
    let (mut from, mut normal) = (point.surface.position, point.surface.geometric_normal);
    let hit = |from: Vec3, direction: Vec3| {
        let accept = |triangle: u32, _| {
            let object = geometry.triangles[triangle as usize].object;
            settings.walk_dynamic || !scene.objects[object as usize].dynamic
        };
        tracer.closest_hit_where(from, direction, f32::INFINITY, accept)
    };
    let mut rays = 0;
    for bounces in 0..=settings.bounces {
        let escape = |direction: Vec3, towards| {
            let share = match towards {
                Towards::Sun => f64::from(normal.dot(direction)),
                Towards::Any | Towards::Sky => sky.share(direction, normal),
            };
            Escape { from, direction, throughput: throughput * share, bounces, towards }
        };
        let numbers = [0, 1, 2, 3].map(|d| random(4 * bounces + d));
        let towards_sky = sky.direction([numbers[2], numbers[3]]).filter(|d| d.dot(normal) > 0.0);
        if let Some(direction) = towards_sky {
            rays += 1;
            found.extend(hit(from, direction).is_none().then(|| escape(direction, Towards::Sky)));
        }
        // The walk has no paths that come to what is seen at once.
        let towards_sun = [0, 1].map(|d| random(4 * (settings.bounces + 1) + 2 * bounces + d));
        let towards_sun = sky.sunward(towards_sun).filter(|d| bounces > 0 && d.dot(normal) > 0.0);
        if let Some(direction) = towards_sun {
            rays += 1;
            found.extend(hit(from, direction).is_none().then(|| escape(direction, Towards::Sun)));
        }
        let local = warp::cosine_hemisphere(Vec2::new(numbers[0], numbers[1]));
        let (x, y) = warp::frame(normal);
        let direction = (x * local.x + y * local.y + normal * local.z).normalize();
        rays += 1;
        let Some(hit) = hit(from, direction) else {
            found.push(escape(direction, Towards::Any));
            break;
        };
        let surface = geometry.surface(scene, hit.triangle, hit.barycentric, -direction);
        throughput *= f64::from(luminance(surface.albedo));
        if throughput <= 0.0 || surface.geometric_normal.dot(direction) >= 0.0 {
            break;
        }
        normal = surface.geometric_normal;
        from = tracer.offset_ray_origin(surface.position, normal);
    }
    rays
}

/// The point with the least weighted distance to lines, each a point and a unit direction (by iteratively reweighted least squares:
/// Weiszfeld 1937). Where they hardly say, as near the middle of the scene as that leaves it.
fn closest_point(geometry: &Geometry, lines: &[(DVec3, DVec3, f64)]) -> DVec3 {
    let middle = geometry.center().as_dvec3();
    let close = CLOSE * f64::from(geometry.extent());
    let mut result = middle;
    for step in 0..STEPS {
        let (mut matrix, mut vector, mut all) = (DMat3::ZERO, DVec3::ZERO, 0.0);
        for &(point, direction, weight) in lines {
            let across = |v: DVec3| v - direction * direction.dot(v);
            let weight = if step == 0 { weight } else { weight / across(result - point).length().max(close) };
            matrix += DMat3::from_cols(across(DVec3::X), across(DVec3::Y), across(DVec3::Z)) * weight;
            vector += across(point) * weight;
            all += weight;
        }
        if all <= 0.0 {
            break;
        }
        let held = MIDDLE * all;
        result = (matrix + DMat3::from_diagonal(DVec3::splat(held))).inverse() * (vector + middle * held);
    }
    result
}

/// The median distance of lines to a point, m.
fn median_distance(point: DVec3, lines: &[(DVec3, DVec3, f64)]) -> f64 {
    let across = |&(from, direction, _): &(DVec3, DVec3, f64)| (from - point).cross(direction).length();
    let mut distances: Vec<f64> = lines.iter().map(across).collect();
    distances.sort_unstable_by(f64::total_cmp);
    distances.get(distances.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
pub(super) mod tests;
