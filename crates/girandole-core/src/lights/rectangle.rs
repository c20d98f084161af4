//! The flat piece of surface that a light sample stands for.
//!
//! A sample is one of many candidates of a cluster, and lights for all of them. From afar its place says enough. Close to it
//! the candidates that share its plane are spread over a rectangle, and the geometric factor's mean over that rectangle
//! takes the place of its value for one point: no bright spot where the sample happens to lie, none of the light lost that a
//! bound would cut off.
//!
//! The receiver's plane cuts off what lies behind it: the rest counts by its share of the rectangle, wherever in it the sample lies.
//! So a wall's foot is lit alike by samples to its sides, though each is one of a cluster that the wall's plane cuts. In expectation
//! nothing changes, if the candidates are spread evenly.

use super::LightSample;
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

/// A rectangle in space, seen from the side of its half axes' cross product.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "import", derive(serde::Serialize, serde::Deserialize))]
pub struct Rectangle {
    /// Its centre, relative to the geometry's origin.
    pub center: Vec3,
    /// Half of its sides, perpendicular to each other, m.
    pub half_axes: [Vec3; 2],
    /// Whether it may light what its sample is behind: not where it sticks out of its surface, and ends at one that bends, as within a thin
    /// shade about a lamp, or too few candidates told how large it is.
    pub is_open: bool,
}

/// The shorter side as a share of the longer one, at least.
const THINNEST: f32 = 0.1;

impl Rectangle {
    /// The geometric factor is the mean over the rectangle up to so many times its [radius](Rectangle::radius) from its centre,
    /// that of the point beyond the second, and a mixture in between. With 2 and 3 relMSE is 4 % lower, for half as many pairs
    /// more that are near; with 1 and 2 it is a quarter higher.
    pub const NEAR: [f32; 2] = [1.5, 2.5];
    /// Candidates in a plane that tell a rectangle.
    pub(super) const FEWEST: usize = 3;
    /// A square of so many m² about a point.
    pub(super) fn square(center: Vec3, normal: Vec3, area: f32) -> Self {
        let half = 0.5 * area.sqrt();
        let u = frames(normal).next().unwrap_or(Vec3::X);
        Self { center, half_axes: [u * half, normal.cross(u) * half], is_open: true }
    }

    /// What `sample` stands for among `candidates` of a cluster that is spread over `area` m²: the least rectangle about those
    /// that lie in its plane, along the axes that clusters are split across. Where they are too few to tell, a square of
    /// that area.
    pub(super) fn about(sample: &LightSample, candidates: impl Iterator<Item = Vec3>, area: f32) -> Self {
        let offsets: Vec<Vec3> = candidates.map(|position| position - sample.position).collect();
        let n = offsets.len() as f32;
        // Nothing tells that its surface goes on there.
        let square = Self { is_open: false, ..Self::square(sample.position, sample.normal, area) };
        if offsets.len() < Self::FEWEST {
            return square;
        }
        // Evenly spread points leave out 1 / (n + 1) of the whole on either side.
        let extent = |axis: Vec3| {
            let at = || offsets.iter().map(|offset| offset.dot(axis));
            let (low, high) = (at().fold(f32::MAX, f32::min), at().fold(f32::MIN, f32::max));
            (0.5 * (low + high), 0.5 * (high - low) * (n + 1.0) / (n - 1.0))
        };
        let fitted = frames(sample.normal).map(|u| {
            let v = sample.normal.cross(u);
            let ((at_u, half_u), (at_v, half_v)) = (extent(u), extent(v));
            let half_axes = [u * half_u.max(THINNEST * half_v), v * half_v.max(THINNEST * half_u)];
            Self { center: sample.position + u * at_u + v * at_v, half_axes, is_open: true }
        });
        let least = fitted.min_by(|a, b| a.area().total_cmp(&b.area()));
        least.filter(|fitted| fitted.area() > 1e-3 * square.area()).unwrap_or(square)
    }

    /// Whether a candidate lies in the plane of a sample whose cluster is spread over `area` m².
    pub(super) fn shares_plane(sample: &LightSample, candidate: &LightSample, area: f32) -> bool {
        let height = (candidate.position - sample.position).dot(sample.normal).abs();
        candidate.normal.dot(sample.normal) > 0.95 && height < 0.2 * (area / PI).sqrt()
    }

    /// m².
    pub fn area(&self) -> f32 {
        4.0 * self.half_axes[0].length() * self.half_axes[1].length()
    }

    /// Radius of a disc whose points are as far from its centre, in the root of the mean square, m.
    pub fn radius(&self) -> f32 {
        let [u, v] = self.half_axes.map(Vec3::length_squared);
        (2.0 / 3.0 * (u + v)).sqrt()
    }

    /// The distance from its centre at which it looks like a point, m.
    pub fn reach(&self) -> f32 {
        Self::NEAR[1] * self.radius()
    }

    /// How much of the geometric factor at a point is that of the sample's place: 0 near the rectangle, 1 far from it.
    pub(super) fn point_share(&self, position: Vec3) -> f32 {
        let distance = position.distance(self.center) / self.radius();
        let [near, far] = Self::NEAR;
        let t = ((distance - near) / (far - near)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// Mean over the rectangle of `cos_light / r²` times the unit direction to it, m⁻², as a point in front of it receives it:
    /// its dot product with `normal` is the mean geometric factor. What lies behind the receiver's plane counts as nothing. Lambert's formula for polygons (Photometria, 1760; Arvo 1994, §2). Mirrored in
    /// `shaders/lib/rectangle.wgsl`.
    pub fn mean_vector(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let (c, [u, v]) = (self.center - position, self.half_axes);
        let corners = [c - u - v, c + u - v, c + u + v, c - u + v];
        let mut sum = Vec3::ZERO;
        let (mut exit, mut entry) = (None, None);
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % 4];
            let (height_a, height_b) = (normal.dot(a), normal.dot(b));
            if height_a.max(height_b) <= 0.0 {
                continue;
            }
            let at = || a + (b - a) * (height_a / (height_a - height_b));
            let from = if height_a > 0.0 { a } else { *entry.insert(at()) };
            let to = if height_b > 0.0 { b } else { *exit.insert(at()) };
            sum += edge(from, to);
        }
        if let (Some(exit), Some(entry)) = (exit, entry) {
            sum += edge(exit, entry);
        }
        sum * (-0.5 / self.area())
    }
}

/// Unit vectors perpendicular to a normal, along the world's axes as far as they are.
fn frames(normal: Vec3) -> impl Iterator<Item = Vec3> {
    let across = move |axis: Vec3| axis - normal * axis.dot(normal);
    Vec3::AXES.into_iter().map(across).filter(|u| u.length_squared() > 0.3).map(Vec3::normalize)
}

/// The angle that an edge spans, as seen from the origin, along the normal of the plane that it spans with it.
fn edge(a: Vec3, b: Vec3) -> Vec3 {
    let across = a.cross(b);
    let inverse = 1.0 / (a.length_squared() * b.length_squared()).sqrt();
    let cosine = a.dot(b) * inverse;
    let acute = angle_over_sine(cosine.abs()) * inverse;
    let obtuse = PI / across.length_squared().max(f32::MIN_POSITIVE).sqrt() - acute;
    across * if cosine < 0.0 { obtuse } else { acute }
}

/// θ / sin θ for a cosine of 0 to 1: minimax, within 7e-7.
fn angle_over_sine(cosine: f32) -> f32 {
    let above = FRAC_PI_2 + cosine * (0.909_404_2 + cosine * 0.026_362_872);
    above / (1.0 + cosine * (1.215_530_1 + cosine * 0.291_030_87))
}
