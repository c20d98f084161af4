//! Points on an object that receive light.

use super::reflectors::Reflectors;
use crate::math::{sequence, warp};
use crate::parallel;
use crate::scene::NONE;
use crate::trace::SceneTracer;
use glam::{Vec2, Vec3};

/// A point that receives light.
#[derive(Clone, Copy)]
pub(super) struct Point {
    /// Where rays start.
    pub start: Vec3,
    /// Unit normal; zero where nothing is received.
    pub normal: Vec3,
    /// The normal of the triangle that it lies in, below which nothing is reflected; zero at vertices.
    pub surface: Vec3,
}

impl Point {
    /// Direction `ray` of a sequence of cosine-weighted ones.
    pub fn direction(&self, ray: u32, seed: u32) -> Vec3 {
        let at = [0, 1].map(|dimension| sequence::sample(ray, dimension, seed));
        let (x, y) = warp::frame(self.normal);
        let local = warp::cosine_hemisphere(Vec2::from_array(at));
        (x * local.x + y * local.y + self.normal * local.z).normalize()
    }
}

/// Both sides of vertices that triangles have. Rays start a little above the surface, and a little towards the middles of a vertex's own
/// triangles: at the foot of a wall, not in it.
pub(super) fn at_vertices(tracer: &SceneTracer, double_sided: &[bool], sides: usize) -> Vec<Point> {
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
            has_back[vertex as usize] |= double_sided[triangle.material.index()];
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
        Point { start, normal, surface: Vec3::ZERO }
    };
    (0..sides).flat_map(|side| (0..count).map(move |vertex| (side, vertex))).map(point).collect()
}

/// Both sides of the middles of reflectors.
pub(super) fn at_reflectors(
    tracer: &SceneTracer,
    double_sided: &[bool],
    sides: usize,
    reflectors: &Reflectors,
) -> Vec<Point> {
    let (geometry, scene) = (tracer.geometry(), tracer.scene());
    let point = |side: usize, (triangle, at): (u32, Vec2)| {
        let turned = if side == 1 { -1.0 } else { 1.0 };
        let surface = geometry.normal(triangle) * turned;
        let start = tracer.offset_ray_origin(geometry.point(triangle, at), surface);
        let has_side = side == 0 || double_sided[geometry.triangles[triangle as usize].material.index()];
        let normal = || geometry.surface(scene, triangle, at, surface).shading_normal;
        Point { start, normal: if has_side { normal() } else { Vec3::ZERO }, surface }
    };
    (0..sides).flat_map(|side| reflectors.middles().map(move |middle| point(side, middle))).collect()
}

/// Rays by which a point finds out what is near.
const RAYS_TO_NEAR: u32 = 16;
/// Points that are worked on together.
const CHUNK: usize = 256;

/// Points, and of each ray the triangle that it hits and how far that is.
type Chunk<'a> = (&'a [Point], &'a mut [(u32, f32)]);

/// By triangle, how near to it the nearest of some points is that it may light, as far as a few rays tell.
pub(super) fn nearest(tracer: &SceneTracer, points: &[Point]) -> Vec<f32> {
    let mut hits = vec![(NONE, 0.0); points.len() * RAYS_TO_NEAR as usize];
    let chunks = points.chunks(CHUNK).zip(hits.chunks_mut(CHUNK * RAYS_TO_NEAR as usize));
    let find = |(chunk, (points, hits)): (usize, Chunk)| {
        let of_point = points.iter().zip(hits.chunks_exact_mut(RAYS_TO_NEAR as usize)).enumerate();
        for (index, (point, hits)) in of_point.filter(|(_, (point, _))| point.normal != Vec3::ZERO) {
            for (ray, found) in (0..).zip(hits) {
                let direction = point.direction(ray, sequence::hash((chunk * CHUNK + index) as u32));
                if let Some(hit) = tracer.closest_hit(point.start, direction, f32::INFINITY, NONE) {
                    *found = (hit.triangle, hit.t);
                }
            }
        }
    };
    parallel::for_each(chunks.enumerate().collect(), find);
    let mut nearest = vec![f32::INFINITY; tracer.geometry().triangles.len()];
    for (triangle, distance) in hits.into_iter().filter(|(triangle, _)| *triangle != NONE) {
        let near = &mut nearest[triangle as usize];
        *near = near.min(distance);
    }
    nearest
}
