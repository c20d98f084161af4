//! Where an environment's light comes from and where it comes in, found from what is seen.
//!
//! Most of what a sky sends on a disc before the scene never comes to what is seen: through a window of one of a building's rooms comes
//! a ten-thousandth of it.
//!
//! 1. Rays leave the points that views see as light would arrive there, cosine-weighted, and go on from what they hit. Where one leaves
//!    the scene, light comes in the other way: radiance times the throughput to the view is what a start there is worth. Rays that
//!    left a point that is seen tell of directions for direct samples, the others of starts of the walk.
//! 2. Directions and places on the disc are points of the unit cube of the random numbers that choose them, two for the
//!    direction and two for the place: plain sampling is uniform there (primary sample space: Guo et al. 2018, §4). The disc lies about
//!    the point that those rays pass closest to, as it would about a window: then its place hardly depends on the direction.
//! 3. A [density](Density) of what they are worth, a fifth of it uniform, warps the numbers of candidates and paths, which stay well
//!    spread, and their light is divided by it: whatever it is, there is the same light in the mean.

mod density;

use self::density::Density;
use super::LightSettings;
use super::emitters::{Source, SourceTree};
use super::view_points::ViewPoint;
use crate::image::luminance;
use crate::math::{sequence, warp};
use crate::scene::{Environment, Geometry};
use crate::trace::SceneTracer;
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

/// Of the sequence that rays are spread by.
const RAYS_SEED: u32 = 0x1b87_3593;
/// Rays that leave the scene, of those that left a point that is seen and of others, after which there are enough…
const ENOUGH: usize = 2048;
/// …and rays in all after which no more are traced.
const MOST_RAYS: usize = 1 << 17;
/// Steps towards the point that rays pass closest to.
const STEPS: u32 = 16;
/// Rays that pass as close as this, in the scene's size, pass through a point.
const CLOSE: f64 = 1e-3;
/// How much the middle of the scene counts beside all rays.
const MIDDLE: f64 = 1e-4;

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
}

impl Guides {
    /// For what is seen at these points; none without an environment.
    pub fn new(
        tracer: &SceneTracer,
        settings: &LightSettings,
        points: &[ViewPoint],
        groups: &[Vec<Source>],
        trees: &[SourceTree],
    ) -> Self {
        let Some(environment) = tracer.scene().environment.as_ref().filter(|_| !points.is_empty()) else {
            return Self::default();
        };
        let escapes = escapes(tracer, settings, points);
        let are_distant = |sources: &[Source]| sources.iter().all(|source| source.cell().is_some());
        let mut result = Self::default();
        for (index, group) in groups.iter().enumerate().filter(|(_, group)| are_distant(group)) {
            let direct = escapes.iter().filter(|escape| escape.bounces == 0);
            let density = SourceTree::new(group.clone()).and_then(|tree| {
                let square = Square::new(&tree, environment);
                Density::new(direct.filter_map(|escape| square.place(escape)).collect())
            });
            result.directions.extend(density.map(|density| (index, density)));
        }
        for (index, tree) in trees.iter().enumerate().filter(|(_, tree)| are_distant(tree.sources())) {
            let reflected = escapes.iter().filter(|escape| escape.bounces > 0);
            let starts = Starts::new(tracer.geometry(), &Square::new(tree, environment), reflected);
            result.starts.extend(starts.map(|starts| (index, starts)));
        }
        result
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
    fn new<'a>(
        geometry: &Geometry,
        square: &Square,
        escapes: impl Iterator<Item = &'a Escape>,
    ) -> Option<Self> {
        let placed: Vec<(&Escape, [f64; 2], f64)> =
            escapes.filter_map(|escape| square.place(escape).map(|(at, weight)| (escape, at, weight))).collect();
        let lines: Vec<(DVec3, DVec3, f64)> = placed
            .iter()
            .map(|(escape, _, weight)| (escape.from.as_dvec3(), escape.direction.as_dvec3(), *weight))
            .collect();
        let center = closest_point(geometry, &lines).as_vec3().clamp(geometry.bounds.0, geometry.bounds.1);
        let radius = geometry.extent() * 0.5 + center.distance(geometry.center());
        let with_place = |(escape, at, weight): (&Escape, [f64; 2], f64)| {
            let (x, y) = warp::frame(-escape.direction);
            let from = escape.from - center;
            let across = warp::square_of_disc(Vec2::new(from.dot(x), from.dot(y)) / radius).as_dvec2();
            ([at[0], at[1], across.x, across.y], weight)
        };
        let density = Density::new(placed.into_iter().map(with_place).collect())?;
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

    /// The point that chooses a ray's direction, and what light from there is worth.
    fn place(&self, escape: &Escape) -> Option<([f64; 2], f64)> {
        let (cell, within) = self.environment.cell_and_place(escape.direction);
        let [low, size] = self.cells.get(&cell)?;
        let radiance = f64::from(luminance(self.environment.cell_radiance(cell)));
        Some(((*low + *size * within).to_array(), radiance * escape.throughput))
    }
}

/// Rays from what is seen to what is infinitely far away, in order, whatever the number of threads.
fn escapes(tracer: &SceneTracer, settings: &LightSettings, points: &[ViewPoint]) -> Vec<Escape> {
    let mut found: Vec<Escape> = Vec::new();
    let mut rays = 0;
    for round in 0.. {
        let direct = found.iter().filter(|escape| escape.bounces == 0).count();
        let is_enough = |count: usize| count >= ENOUGH;
        if is_enough(direct) && (settings.bounces == 0 || is_enough(found.len() - direct)) || rays >= MOST_RAYS {
            break;
        }
        let path = |i: usize| {
            let index = (round * points.len() + i) as u32;
            path(tracer, settings, &points[i], |dimension| sequence::sample(index, dimension, RAYS_SEED))
        };
        for (traced, escape) in in_order(points.len(), path) {
            rays += traced;
            found.extend(escape);
        }
    }
    found
}

/// A path from a point that is seen: how many rays it has, and the one that leaves the scene.
fn path(
    tracer: &SceneTracer,
    settings: &LightSettings,
    point: &ViewPoint,
    random: impl Fn(u32) -> f32,
) -> (usize, Option<Escape>) {
    let (scene, geometry) = (tracer.scene(), tracer.geometry());
    let mut throughput = f64::from(point.reflectance);
    let (mut from, mut normal) = (point.surface.position, point.surface.geometric_normal);
    for bounces in 0..=settings.bounces {
        let local = warp::cosine_hemisphere(Vec2::new(random(2 * bounces), random(2 * bounces + 1)));
        let (x, y) = warp::frame(normal);
        let direction = (x * local.x + y * local.y + normal * local.z).normalize();
        let accept = |triangle: u32, _| {
            let object = geometry.triangles[triangle as usize].object;
            settings.walk_dynamic || !scene.objects[object as usize].dynamic
        };
        let Some(hit) = tracer.closest_hit_where(from, direction, f32::INFINITY, accept) else {
            return (bounces as usize + 1, Some(Escape { from, direction, throughput, bounces }));
        };
        let surface = geometry.surface(scene, hit.triangle, hit.barycentric, -direction);
        throughput *= f64::from(luminance(surface.albedo));
        if throughput <= 0.0 || surface.geometric_normal.dot(direction) >= 0.0 {
            return (bounces as usize + 1, None);
        }
        normal = surface.geometric_normal;
        from = tracer.offset_ray_origin(surface.position, normal);
    }
    (settings.bounces as usize + 1, None)
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

/// A function of 0 to `count`, whatever the number of threads.
fn in_order<T: Send>(count: usize, f: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().with_min_len(16).map(f).collect()
    }
    #[cfg(not(feature = "parallel"))]
    (0..count).map(f).collect()
}

#[cfg(test)]
mod tests;
