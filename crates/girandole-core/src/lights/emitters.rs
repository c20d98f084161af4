//! Everything that emits, as sources that direct samples and the walk's paths start from.
//!
//! 1. Each emitting triangle (per side) becomes a source; a planar patch that is a parallelogram stays whole, so that
//!    one continuous map leads from the unit square to it. Triangles with a texture are cut into small ones.
//! 2. A source's weight is its power by luminance, for textures found on a regular grid, with a floor so that no
//!    texel is missed.

use super::emission::{Emission, Emissions};
use super::punctual::SpotCone;
use super::source_tree::SourceTree;
use crate::image::luminance;
use crate::scene::{Environment, Geometry, LightId, Material, MaterialId, NONE, PunctualKind, Scene};
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// A textured triangle is cut into at most this many squared…
const MAX_CUTS: f64 = 24.0;
/// …all of them into about this many parts together…
const MAX_PARTS: f64 = (1 << 17) as f64;
/// …and estimated at this many squared points in each part.
const PROBES: u32 = 4;
/// Weight of a part whose samples are all black, as a share of its greatest possible emission.
const FLOOR: f64 = 0.02;

/// A piece of an emitter, a punctual light, or a part of the environment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    kind: Kind,
    /// Power by luminance, watts; for textures an estimate that is never too near zero.
    pub weight: f64,
    pub center: Vec3,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Area(Area),
    Punctual(LightId),
    /// A cell of the environment.
    Distant(u32),
    /// A part of the environment's sun.
    Sun(u32),
}

/// A flat piece of an emitter: corner + a·edge₁ + b·edge₂ with (a, b) in the unit square, or its lower half.
#[derive(Clone, Copy, Debug)]
struct Area {
    /// The triangles that it lies on; the second is [`NONE`] unless it is a parallelogram.
    triangles: [u32; 2],
    corner: DVec3,
    edges: [DVec3; 2],
    area: f64,
    /// Emits behind the triangle.
    back: bool,
    /// Radiance varies, or there are holes.
    textured: bool,
}

/// A point of an emitter.
#[derive(Clone, Copy, Debug)]
pub(super) struct EmitterPoint {
    pub position: Vec3,
    /// Unit, on the side that emits.
    pub normal: Vec3,
    pub radiance: Vec3,
    pub triangle: u32,
    /// Area of the source it was chosen on, m².
    pub area: f64,
}

/// A direction of the environment.
#[derive(Clone, Copy, Debug)]
pub(super) struct EnvironmentPoint {
    /// Unit, from the scene.
    pub direction: Vec3,
    pub radiance: Vec3,
    /// Of the source it was chosen from, sr.
    pub solid_angle: f64,
}

impl Source {
    /// What it is a piece of.
    pub fn emission(&self, geometry: &Geometry) -> Emission {
        match &self.kind {
            Kind::Punctual(light) => Emission::Punctual(*light),
            Kind::Distant(_) | Kind::Sun(_) => Emission::Environment,
            Kind::Area(area) => Emission::Material(geometry.triangles[area.triangles[0] as usize].material),
        }
    }

    /// The triangle that it lies on, if it lies on one.
    pub fn triangle(&self) -> Option<u32> {
        match &self.kind {
            Kind::Punctual(_) | Kind::Distant(_) | Kind::Sun(_) => None,
            Kind::Area(area) => Some(area.triangles[0]),
        }
    }

    /// The punctual light, if it is one.
    pub fn punctual(&self) -> Option<LightId> {
        match self.kind {
            Kind::Punctual(light) => Some(light),
            Kind::Area(_) | Kind::Distant(_) | Kind::Sun(_) => None,
        }
    }

    /// Whether it is a part of the environment's sun.
    pub fn is_sun(&self) -> bool {
        matches!(self.kind, Kind::Sun(_))
    }

    /// The cell of the environment, if it is one.
    pub fn cell(&self) -> Option<u32> {
        match self.kind {
            Kind::Distant(cell) => Some(cell),
            Kind::Area(_) | Kind::Punctual(_) | Kind::Sun(_) => None,
        }
    }

    /// Of a part of the sun, the direction at `at` in the unit square.
    pub fn sun_direction(&self, environment: &Environment, at: DVec2) -> Option<Vec3> {
        match self.kind {
            Kind::Sun(part) => Some(environment.sun_point(part, at)?.direction),
            Kind::Area(_) | Kind::Punctual(_) | Kind::Distant(_) => None,
        }
    }

    /// Of a part of the environment, the direction at `at` in the unit square, uniform over its solid angle.
    pub fn direction(&self, scene: &Scene, emissions: &Emissions, at: DVec2) -> Option<EnvironmentPoint> {
        let environment = scene.environment.as_ref()?;
        let (direction, radiance, solid_angle) = match self.kind {
            Kind::Distant(cell) => (
                environment.cell_direction(cell, at),
                environment.cell_radiance_beside_sun(cell),
                environment.cell_solid_angle(),
            ),
            Kind::Sun(part) => {
                let point = environment.sun_point(part, at)?;
                (point.direction, point.radiance, point.solid_angle)
            }
            Kind::Area(_) | Kind::Punctual(_) => return None,
        };
        let radiance = radiance / environment.strength * emissions.of_environment();
        Some(EnvironmentPoint { direction, radiance, solid_angle })
    }

    /// The point of an area source at `at` in the unit square, uniform over its area.
    pub fn point(
        &self,
        (scene, geometry): (&Scene, &Geometry),
        emissions: &Emissions,
        at: DVec2,
    ) -> Option<EmitterPoint> {
        let Kind::Area(area) = &self.kind else { return None };
        let at = if area.triangles[1] == NONE { fold(at) } else { at };
        let position = (area.corner + area.edges[0] * at.x + area.edges[1] * at.y).as_vec3();
        let (triangle, barycentric) = area
            .triangles
            .iter()
            .filter(|&&t| t != NONE)
            .map(|&t| (t, barycentric(geometry.corners(t), position)))
            .max_by(|(_, a), (_, b)| inside(*a).total_cmp(&inside(*b)))?;
        let emission = emissions.of_material(geometry.triangles[triangle as usize].material);
        let mut radiance = emission * geometry.emission_factor(scene, triangle, barycentric);
        if area.textured && geometry.is_cut_out(scene, triangle, barycentric) {
            radiance = Vec3::ZERO;
        }
        let normal = geometry.normal(triangle);
        let normal = if area.back { -normal } else { normal };
        Some(EmitterPoint { position, normal, radiance, triangle, area: area.area })
    }
}

/// The unit square onto its lower half, where a + b ≤ 1 (Heitz 2019).
fn fold(s: DVec2) -> DVec2 {
    if s.x > s.y { DVec2::new(s.x - s.y * 0.5, s.y * 0.5) } else { DVec2::new(s.x * 0.5, s.y - s.x * 0.5) }
}

/// Weights of corners 1 and 2 at a point of a triangle's plane.
fn barycentric(corners: [Vec3; 3], point: Vec3) -> Vec2 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let normal = (b - a).cross(c - a);
    let p = point.as_dvec3() - a;
    let scale = 1.0 / normal.length_squared();
    Vec2::new(
        (p.cross(c - a).dot(normal) * scale).clamp(0.0, 1.0) as f32,
        ((b - a).cross(p).dot(normal) * scale).clamp(0.0, 1.0) as f32,
    )
}

/// Largest for the triangle that holds a point best.
fn inside(barycentric: Vec2) -> f32 {
    barycentric.min_element().min(1.0 - barycentric.x - barycentric.y)
}

/// The sources on emitting surfaces, one group for each side of an object's material, and last those of the environment and those of
/// its sun.
pub(super) fn groups(scene: &Scene, geometry: &Geometry, emissions: &Emissions) -> Vec<Vec<Source>> {
    let mut groups: BTreeMap<(u32, MaterialId, bool), Vec<Source>> = BTreeMap::new();
    let coarser = coarser(scene, geometry, emissions);
    let mut index = 0;
    while index < geometry.triangles.len() as u32 {
        let triangle = geometry.triangles[index as usize];
        let material = &scene.materials[triangle.material];
        let emission = emissions.of_material(triangle.material);
        if !is_light(emission) {
            index += 1;
            continue;
        }
        let textured = is_textured(material);
        let patch = geometry.patches.get(triangle.patch as usize);
        let whole = patch.filter(|p| !textured && p.triangles.start == index && p.triangles.len() == 2);
        let pieces = match whole.and_then(|p| parallelogram(&p.outline, index)) {
            Some(area) => vec![(area, f64::from(luminance(emission)))],
            None if textured => cut(scene, geometry, emissions, index, coarser),
            None => vec![(part(geometry, index, 1, [0, 0], false), f64::from(luminance(emission)))],
        };
        for (area, radiance) in pieces {
            let weight = radiance * area.area * PI;
            let center = (area.corner + (area.edges[0] + area.edges[1]) * 0.4).as_vec3();
            for back in [false, true] {
                if weight > 0.0 && (!back || material.double_sided) {
                    let source = Source { kind: Kind::Area(Area { back, ..area }), weight, center };
                    groups.entry((triangle.object, triangle.material, back)).or_default().push(source);
                }
            }
            index += u32::from(area.triangles[1] != NONE);
        }
        index += 1;
    }
    let distant = scene.environment.iter().filter(|environment| environment.shines());
    let distant = distant.flat_map(|environment| environment_sources(geometry, environment, emissions));
    groups.into_values().chain(distant.filter(|sources| !sources.is_empty())).collect()
}

/// The power of each emitter by luminance, watts.
pub(super) fn power(groups: &[Vec<Source>]) -> Vec<f64> {
    groups.iter().map(|sources| sources.iter().map(|source| source.weight).sum()).collect()
}

/// Emitters that have sequences of their own, at most; if there are more, neighbours in the scene share one.
const MOST_EMITTERS: usize = 512;

/// A tree for each emitter, and for each punctual light.
pub(super) fn trees(groups: &[Vec<Source>], punctual: &[Source]) -> Vec<SourceTree> {
    let all: Vec<Vec<Source>> = groups.iter().cloned().chain(punctual.iter().map(|&s| vec![s])).collect();
    let together = all.len().div_ceil(MOST_EMITTERS).max(1);
    all.chunks(together).filter_map(|groups| SourceTree::new(groups.concat())).collect()
}

/// A whole patch of two triangles, if its outline is a parallelogram.
fn parallelogram(outline: &[Vec3], first: u32) -> Option<Area> {
    let &[a, b, c, d] = outline else { return None };
    let [a, b, c, d] = [a, b, c, d].map(Vec3::as_dvec3);
    let edges = [b - a, d - a];
    let size = edges[0].length().max(edges[1].length());
    (((a + c) - (b + d)).length() < size * 1e-5).then(|| Area {
        triangles: [first, first + 1],
        corner: a,
        edges,
        area: edges[0].cross(edges[1]).length(),
        back: false,
        textured: false,
    })
}

/// Part `[i, j]` of a triangle cut into `n²` equal ones: row by row, the upright ones first.
fn part(geometry: &Geometry, triangle: u32, n: u32, [i, j]: [u32; 2], textured: bool) -> Area {
    let [a, b, c] = geometry.corners(triangle).map(Vec3::as_dvec3);
    let edges = [(b - a) / f64::from(n), (c - a) / f64::from(n)];
    let upright = i + j < n;
    let (corner, edges) = if upright {
        (a + edges[0] * f64::from(i) + edges[1] * f64::from(j), edges)
    } else {
        // Inverted parts, counted from the far side.
        let (i, j) = (n - i, n - j);
        (a + edges[0] * f64::from(i) + edges[1] * f64::from(j), [-edges[0], -edges[1]])
    };
    let area = edges[0].cross(edges[1]).length() * 0.5;
    Area { triangles: [triangle, NONE], corner, edges, area, back: false, textured }
}

fn is_light(emission: Vec3) -> bool {
    emission.max_element() > 0.0 && emission.is_finite()
}

fn is_textured(material: &Material) -> bool {
    material.emission_texture.is_some() || material.alpha_cutoff.is_some()
}

/// By which factor triangles with a texture are cut along their sides so that there are not too many parts; 1 as a rule.
fn coarser(scene: &Scene, geometry: &Geometry, emissions: &Emissions) -> f64 {
    let is_cut = |&triangle: &u32| {
        let material = geometry.triangles[triangle as usize].material;
        is_textured(&scene.materials[material]) && is_light(emissions.of_material(material))
    };
    let triangles = (0..geometry.triangles.len() as u32).filter(is_cut);
    let parts: f64 = triangles.map(|triangle| cuts(scene, geometry, triangle).powi(2)).sum();
    (MAX_PARTS / parts).sqrt().min(1.0)
}

/// Into how many parts along a side a textured triangle is cut: about one part for 2×2 texels.
fn cuts(scene: &Scene, geometry: &Geometry, triangle: u32) -> f64 {
    let index = geometry.triangles[triangle as usize].material;
    let material = &scene.materials[index];
    let texels = [material.emission_texture, material.base_color_texture]
        .into_iter()
        .flatten()
        .map(|t| {
            let image = &scene.textures[t.texture as usize];
            let [a, b, c] = [Vec2::ZERO, Vec2::X, Vec2::Y].map(|at| {
                t.transform.transform_point2(geometry.uv(triangle, at, t.uv_set)).as_dvec2()
                    * DVec2::new(f64::from(image.width), f64::from(image.height))
            });
            (b - a).perp_dot(c - a).abs() * 0.5
        })
        .fold(0.0, f64::max);
    (texels * 0.25).sqrt().ceil().clamp(1.0, MAX_CUTS)
}

/// The parts of a textured triangle with the luminance that they are weighted by.
fn cut(
    scene: &Scene,
    geometry: &Geometry,
    emissions: &Emissions,
    triangle: u32,
    coarser: f64,
) -> Vec<(Area, f64)> {
    let index = geometry.triangles[triangle as usize].material;
    let n = (cuts(scene, geometry, triangle) * coarser).max(1.0) as u32;
    let floor = FLOOR * f64::from(luminance(emissions.of_material(index)));
    let parts = (0..n).flat_map(|i| (0..n).map(move |j| [i, j]));
    parts
        .map(|at| {
            let area = part(geometry, triangle, n, at, true);
            let source = Source { kind: Kind::Area(area), weight: 0.0, center: Vec3::ZERO };
            let probes = (0..PROBES * PROBES).map(|k| {
                let at = DVec2::new(f64::from(k % PROBES), f64::from(k / PROBES)) + 0.5;
                let point = source.point((scene, geometry), emissions, at / f64::from(PROBES));
                point.map_or(0.0, |s| f64::from(luminance(s.radiance)))
            });
            (area, floor + probes.sum::<f64>() / f64::from(PROBES * PROBES))
        })
        .collect()
}

/// The environment's cells as sources, and the parts of its sun, weighted by the flux that they send through a disc as large as the
/// scene.
fn environment_sources(
    geometry: &Geometry,
    environment: &Environment,
    emissions: &Emissions,
) -> [Vec<Source>; 2] {
    let disc = PI * f64::from(geometry.extent() * 0.5).powi(2);
    let strength = f64::from(luminance(emissions.of_environment()) / environment.strength);
    let each = environment.cell_solid_angle() * disc * strength;
    let is_light = |s: &Source| s.weight > 0.0 && s.weight.is_finite();
    let cell = |cell| Source {
        kind: Kind::Distant(cell),
        weight: f64::from(luminance(environment.cell_radiance_beside_sun(cell))) * each,
        center: environment.cell_direction(cell, DVec2::splat(0.5)) * geometry.extent(),
    };
    let part = |part| {
        let center = environment.sun_point(part, DVec2::splat(0.5))?.direction * geometry.extent();
        let weight = environment.sun_weight(part) * disc * strength;
        Some(Source { kind: Kind::Sun(part), weight, center })
    };
    [
        (0..environment.cells()).map(cell).filter(is_light).collect(),
        (0..environment.sun_parts()).filter_map(part).filter(is_light).collect(),
    ]
}

/// The punctual lights as sources, weighted by the flux that they can send into the scene.
pub(super) fn punctual_sources(scene: &Scene, geometry: &Geometry, emissions: &Emissions) -> Vec<Source> {
    let world_from_nodes = scene.world_from_nodes();
    let sources = scene.lights.iter().enumerate().map(|(index, light)| {
        let solid_angle = match light.kind {
            PunctualKind::Point => 4.0 * PI,
            PunctualKind::Spot { inner, outer } => SpotCone::new(inner, outer).solid_angle(),
            PunctualKind::Directional => PI * f64::from(geometry.extent() * 0.5).powi(2),
        };
        let center = (world_from_nodes[light.node.index()].translation - geometry.origin).as_vec3();
        let weight = f64::from(luminance(emissions.of_punctual(index.into()))) * solid_angle;
        Source { kind: Kind::Punctual(index.into()), weight, center }
    });
    sources.filter(|s| s.weight > 0.0 && s.weight.is_finite()).collect()
}
