//! The thesis's low-resolution pass (§4.3.3) on the CPU: light at every few pixels, bilinear in between, and all
//! pixels near edges.
//!
//! Girandole has several grids and decides by the light itself; this is what it is compared with.

use anyhow::Result;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::scene::{Geometry, Scene, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use std::f32::consts::PI;

/// Planes are the same where normals differ by less than 5° ...
const LEAST_COSINE: f32 = 0.996;
/// ... and one's point is nearer than this to the other, metres.
const MOST_DISTANCE: f32 = 0.01;
/// A pixel is wrong where its luminance is off by more than this share.
const WRONG: f32 = 0.1;

/// What is seen through each pixel's centre.
pub struct Surfaces {
    size: [u32; 2],
    points: Vec<Option<Point>>,
}

/// A point of a surface, and its plane.
#[derive(Clone, Copy)]
struct Point {
    position: Vec3,
    normal: Vec3,
    albedo: Vec3,
    emission: Vec3,
}

/// A picture by interpolation.
pub struct Interpolated {
    /// Its radiance.
    pub picture: Image,
    /// Which pixels were interpolated; the others were shaded.
    pub pixels: Vec<bool>,
}

impl Surfaces {
    /// Those of a view, by rays.
    pub fn new(scene: &Scene, view: &View, size: [u32; 2]) -> Self {
        let geometry = Geometry::new(scene);
        let tracer = SceneTracer::new(scene, &geometry);
        let view = view.relative_to(geometry.origin);
        let point = |index: u32| {
            let at = Vec2::new((index % size[0]) as f32, (index / size[0]) as f32) + 0.5;
            let (origin, direction) = view.pixel_ray(at, size);
            let hit = tracer.closest_visible(origin, direction)?;
            let surface =
                geometry.surface(scene, hit.triangle, hit.barycentric, -direction.normalize_or_zero());
            Some(Point {
                position: surface.position,
                normal: surface.shading_normal,
                albedo: surface.albedo,
                emission: surface.emission,
            })
        };
        Self { size, points: (0..size[0] * size[1]).map(point).collect() }
    }

    /// The pixel so far away, kept inside the picture.
    fn beside(&self, pixel: usize, [x, y]: [i32; 2]) -> usize {
        let width = self.size[0] as usize;
        let moved = |at: usize, by: i32, size: u32| (at as i32 + by).clamp(0, size as i32 - 1) as usize;
        moved(pixel / width, y, self.size[1]) * width + moved(pixel % width, x, self.size[0])
    }

    /// Pixels whose plane is not that of a pixel so many pixels away, straight or diagonally. A step of 0 finds none.
    pub fn edges(&self, step: u32) -> Vec<bool> {
        let steps = [-1, 0, 1].map(|sign| sign * step as i32);
        let is_edge = |pixel: usize| {
            let mut others = steps.iter().flat_map(|&y| steps.map(|x| [x, y]));
            others.any(|by| !self.are_in_one_plane(pixel, self.beside(pixel, by)))
        };
        (0..self.points.len()).map(is_edge).collect()
    }

    fn are_in_one_plane(&self, a: usize, b: usize) -> bool {
        match (&self.points[a], &self.points[b]) {
            (Some(a), Some(b)) => {
                let to = b.position - a.position;
                let distance = a.normal.dot(to).abs().max(b.normal.dot(to).abs());
                a.normal.dot(b.normal) >= LEAST_COSINE && distance <= MOST_DISTANCE
            }
            (a, b) => a.is_none() && b.is_none(),
        }
    }

    /// The low-resolution pass: a picture that is shaded at every `spacing`-th pixel in x and y and at edges, where
    /// it is what `full` is, and interpolated elsewhere. Light is interpolated, not what surfaces make of it.
    pub fn interpolate(&self, full: &Image, spacing: u32, edges: &[bool]) -> Interpolated {
        let light: Vec<Option<Vec3>> = (0..full.pixels.len()).map(|i| self.irradiance(i, full)).collect();
        let mut result = Interpolated { picture: full.clone(), pixels: vec![false; full.pixels.len()] };
        for (pixel, &is_edge) in edges.iter().enumerate() {
            let at = [pixel as u32 % self.size[0], pixel as u32 / self.size[0]];
            let is_shaded = is_edge || at.iter().all(|x| x % spacing == 0);
            let Some((point, light)) = self.points[pixel]
                .filter(|_| !is_shaded)
                .and_then(|point| Some((point, self.between(&light, at, spacing)?)))
            else {
                continue;
            };
            result.pixels[pixel] = true;
            result.picture.pixels[pixel] = point.emission + point.albedo * light / PI;
        }
        result
    }

    /// What a pixel of a picture receives; nothing is known where nothing is reflected.
    fn irradiance(&self, pixel: usize, full: &Image) -> Option<Vec3> {
        let Point { albedo, emission, .. } = self.points[pixel]?;
        (albedo.min_element() > 0.0).then(|| (full.pixels[pixel] - emission) * PI / albedo)
    }

    /// Bilinear, of what is known of four points; beyond the last column and row of points those count.
    fn between(&self, light: &[Option<Vec3>], at: [u32; 2], spacing: u32) -> Option<Vec3> {
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        let share = at.map(|x| (x % spacing) as f32 / spacing as f32);
        for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let corner = [i, j];
            let place = [0, 1].map(|axis| {
                let next = (at[axis] / spacing + corner[axis]) * spacing;
                if next < self.size[axis] { next } else { next - spacing }
            });
            let of_axis = |axis: usize| if corner[axis] == 1 { share[axis] } else { 1.0 - share[axis] };
            let weight = of_axis(0) * of_axis(1);
            if let Some(light) = light[(place[1] * self.size[0] + place[0]) as usize] {
                (sum, weights) = (sum + light * weight, weights + weight);
            }
        }
        (weights > 0.0).then(|| sum / weights)
    }
}

impl Interpolated {
    /// Share of the pixels that were shaded, %.
    pub fn shaded(&self) -> f64 {
        100.0 - percent(&self.pixels)
    }
}

/// How many are true, %.
pub fn percent(pixels: &[bool]) -> f64 {
    100.0 * pixels.iter().filter(|&&is| is).count() as f64 / pixels.len().max(1) as f64
}

/// How far a picture is from what it should be.
///
/// # Errors
/// Those of [`compare`].
pub fn error(full: &Image, test: &Image) -> Result<Comparison> {
    Ok(compare(full, test, &CompareOptions::default())?)
}

/// Pixels whose luminance is off by more than a tenth.
pub fn wrong(full: &Image, test: &Image) -> Vec<bool> {
    relative_errors(full, test).into_iter().map(|error| error > WRONG).collect()
}

/// By how much of it the luminance of each pixel is off.
pub fn relative_errors(full: &Image, test: &Image) -> Vec<f32> {
    let luminance = girandole_core::image::luminance;
    let pairs = full.pixels.iter().zip(&test.pixels);
    pairs
        .map(|(&full, &test)| (luminance(test) - luminance(full)).abs() / luminance(full).max(1e-3))
        .collect()
}
