//! Normals of faces that have none: smooth, but for edges that are sharp.

use super::polygons::{Part, Polygons, Smoothing};
use crate::scene::mesh::weld;
use glam::{DVec3, Vec3};

/// Cosine of 60°: edges between faces whose normals are further apart are sharp. Coarse meshes of round things have
/// others.
const SHARP: f64 = 0.5;
/// Cosine of 35°: those between planes of some size are sharp beyond that.
const SHARP_BETWEEN_PLANES: f64 = 0.819_152_044_288_991_8;
/// Cosine of 1°, within which faces go on in a plane.
const PLANAR: f64 = 0.999_847_695_156_391_3;
/// A plane of some size has at least this share of the model's diagonal squared.
const PLANE: f64 = 3e-4;
/// Faces at one edge that are compared with each, at most.
const MOST_AT_EDGE: usize = 16;

/// Normals of corners.
pub(super) struct Smoothed {
    /// Which of the normals each corner of each part has: corners at one position that are smooth with each other have
    /// the same one.
    pub groups: Vec<[u32; 3]>,
    /// Unit vectors: means over the faces, weighted by angle.
    pub normals: Vec<Vec3>,
}

/// What is known of a part.
#[derive(Clone, Copy)]
struct Facet {
    normal: DVec3,
    face: u32,
    smoothing: Smoothing,
    is_plane: bool,
}

/// Sets that grow together.
struct Sets(Vec<u32>);

impl Sets {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn find(&mut self, mut item: u32) -> u32 {
        while self.0[item as usize] != item {
            let above = self.0[self.0[item as usize] as usize];
            self.0[item as usize] = above;
            item = above;
        }
        item
    }

    /// The least item stands for the set.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// Normals of all corners of the parts of a model.
pub(super) fn smooth(model: &Polygons, parts: &[Part]) -> Smoothed {
    let welded = weld(&model.positions);
    let point = |corner: u32| welded[model.corners[corner as usize].position as usize];
    let points: Vec<[u32; 3]> = parts.iter().map(|part| part.corners.map(point)).collect();
    let at = |point: u32| model.positions[point as usize].as_dvec3();
    let spans: Vec<DVec3> = points.iter().map(|&[a, b, c]| (at(b) - at(a)).cross(at(c) - at(a))).collect();
    let pairs = neighbours(&points, &spans);
    let facets = facets(model, parts, &spans, &pairs);
    let mut sets = Sets::new(parts.len() * 3);
    for &[a, b] in &pairs {
        if is_smooth(facets[a as usize / 3], facets[b as usize / 3]) {
            sets.join(a, next(b));
            sets.join(next(a), b);
        }
    }
    let mut sums = vec![DVec3::ZERO; parts.len() * 3];
    for (part, (corners, facet)) in points.iter().zip(&facets).enumerate() {
        for i in 0..3 {
            let here = at(corners[i]);
            let [to_next, to_last] =
                [1, 2].map(|step| (at(corners[(i + step) % 3]) - here).normalize_or_zero());
            let angle = libm::atan2(to_next.cross(to_last).length(), to_next.dot(to_last));
            sums[sets.find((part * 3 + i) as u32) as usize] += facet.normal * angle;
        }
    }
    let groups = (0..parts.len()).map(|part| [0, 1, 2].map(|i| sets.find((part * 3 + i) as u32))).collect();
    // Where the faces cancel, one of them has to do.
    let normal = |(corner, sum): (usize, &DVec3)| {
        let mean = if sum.length() > 1e-6 { sum.normalize() } else { facets[corner / 3].normal };
        mean.normalize_or(DVec3::Y).as_vec3()
    };
    Smoothed { groups, normals: sums.iter().enumerate().map(normal).collect() }
}

/// The corner after another one, of corners counted through.
fn next(corner: u32) -> u32 {
    if corner % 3 == 2 { corner - 2 } else { corner + 1 }
}

/// Corners at which edges begin that two parts have in common, in opposite directions. Parts without area have no
/// edges.
fn neighbours(points: &[[u32; 3]], spans: &[DVec3]) -> Vec<[u32; 2]> {
    let mut edges: Vec<(u64, u32)> = Vec::with_capacity(points.len() * 3);
    for (part, (corners, span)) in points.iter().zip(spans).enumerate() {
        if *span == DVec3::ZERO {
            continue;
        }
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            edges.push((u64::from(a.min(b)) << 32 | u64::from(a.max(b)), (part * 3 + i) as u32));
        }
    }
    edges.sort_unstable();
    let begin = |corner: u32| points[corner as usize / 3][corner as usize % 3];
    let mut pairs = Vec::with_capacity(edges.len() / 2);
    for same in edges.chunk_by(|a, b| a.0 == b.0) {
        for (i, &(_, a)) in same.iter().enumerate() {
            for &(_, b) in same[i + 1..].iter().take(MOST_AT_EDGE) {
                if begin(a) != begin(b) {
                    pairs.push([a, b]);
                }
            }
        }
    }
    pairs
}

fn facets(model: &Polygons, parts: &[Part], spans: &[DVec3], pairs: &[[u32; 2]]) -> Vec<Facet> {
    let mut facets: Vec<Facet> = parts
        .iter()
        .zip(spans)
        .map(|(part, span)| Facet {
            normal: span.normalize_or_zero(),
            face: part.face,
            smoothing: model.faces[part.face as usize].smoothing,
            is_plane: false,
        })
        .collect();
    let mut planes = Sets::new(parts.len());
    for [a, b] in pairs.iter().map(|pair| pair.map(|corner| corner / 3)) {
        if facets[a as usize].normal.dot(facets[b as usize].normal) >= PLANAR {
            planes.join(a, b);
        }
    }
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for part in parts {
        for position in part.corners.map(|corner| model.position(corner)) {
            (low, high) = (low.min(position), high.max(position));
        }
    }
    let least = PLANE * (high.as_dvec3() - low.as_dvec3()).length_squared();
    let mut areas = vec![0.0; parts.len()];
    for (part, span) in spans.iter().enumerate() {
        areas[planes.find(part as u32) as usize] += 0.5 * span.length();
    }
    for (part, facet) in facets.iter_mut().enumerate() {
        facet.is_plane = areas[planes.find(part as u32) as usize] >= least;
    }
    facets
}

fn is_smooth(a: Facet, b: Facet) -> bool {
    if a.face == b.face {
        return true;
    }
    match (a.smoothing, b.smoothing) {
        (Smoothing::Group(a), Smoothing::Group(b)) => a == b,
        (Smoothing::ByAngle, Smoothing::ByAngle) => {
            let cosine = a.normal.dot(b.normal);
            cosine >= if a.is_plane && b.is_plane { SHARP_BETWEEN_PLANES } else { SHARP }
        }
        _ => false,
    }
}
