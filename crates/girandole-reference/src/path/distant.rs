//! The environment: directions drawn in proportion to what comes from their cell, and towards openings that it is seen through.

use super::Opening;
use super::random::Random;
use girandole_core::glam::{DVec2, Vec3};
use girandole_core::image::luminance;
use girandole_core::scene::Environment;
use girandole_core::trace::SceneTracer;

/// Share of directions that are drawn alike: what a cell's mean hides is found, too.
const UNIFORM: f64 = 0.05;

/// Share of directions that are drawn towards openings, if there are any.
const TOWARDS_OPENINGS: f32 = 0.8;

/// The scene's environment, if it shines.
pub(super) struct Distant<'a> {
    environment: &'a Environment,
    cumulative: Vec<f64>,
    openings: &'a [Opening],
}

impl Opening {
    fn sample(&self, from: Vec3, random: &mut Random) -> Vec3 {
        let at = random.square();
        (self.corner + self.sides[0] * at.x + self.sides[1] * at.y - from).normalize_or(Vec3::Y)
    }

    /// Density of a direction, sr⁻¹; 0 if it does not lead through the opening.
    fn pdf(&self, from: Vec3, direction: Vec3) -> f32 {
        let [u, v] = self.sides;
        let normal = u.cross(v);
        let t = (self.corner - from).dot(normal) / direction.dot(normal);
        let at = from + direction * t - self.corner;
        let inside = [at.cross(v).dot(normal), u.cross(at).dot(normal)];
        let all = normal.length_squared();
        if t > 0.0 && inside.iter().all(|part| (0.0..=all).contains(part)) {
            t * t / direction.dot(normal).abs()
        } else {
            0.0
        }
    }
}

impl<'a> Distant<'a> {
    pub(super) fn new(tracer: &'a SceneTracer<'a>, openings: &'a [Opening]) -> Option<Self> {
        let environment = tracer.scene().environment.as_ref().filter(|environment| environment.shines())?;
        let weight = |cell| f64::from(luminance(environment.cell_radiance(cell)));
        let all: f64 = (0..environment.cells()).map(weight).sum();
        let mut total = 0.0;
        let cumulative = (0..environment.cells()).map(|cell| {
            total += UNIFORM / f64::from(environment.cells()) + (1.0 - UNIFORM) * weight(cell) / all;
            total
        });
        Some(Self { environment, cumulative: cumulative.collect(), openings })
    }

    /// Whether it is seen behind the scene.
    pub(super) fn is_visible(&self) -> bool {
        self.environment.visible
    }

    pub(super) fn radiance(&self, direction: Vec3) -> Vec3 {
        self.environment.radiance(direction)
    }

    pub(super) fn sample(&self, from: Vec3, random: &mut Random) -> Vec3 {
        if !self.openings.is_empty() && random.unit() < TOWARDS_OPENINGS {
            return self.openings[random.below(self.openings.len())].sample(from, random);
        }
        let chosen = random.fine_unit();
        let cell = self.cumulative.partition_point(|&c| c <= chosen);
        let [x, y] = random.square().to_array().map(f64::from);
        self.environment.cell_direction(cell.min(self.cumulative.len() - 1) as u32, DVec2::new(x, y))
    }

    /// Density of a direction from a point, sr⁻¹.
    pub(super) fn pdf(&self, from: Vec3, direction: Vec3) -> f32 {
        let cell = self.environment.cell_at(direction) as usize;
        let below = if cell > 0 { self.cumulative[cell - 1] } else { 0.0 };
        let by_cell = ((self.cumulative[cell] - below) / self.environment.cell_solid_angle()) as f32;
        if self.openings.is_empty() {
            return by_cell;
        }
        let towards: f32 = self.openings.iter().map(|opening| opening.pdf(from, direction)).sum();
        (1.0 - TOWARDS_OPENINGS) * by_cell + TOWARDS_OPENINGS * towards / self.openings.len() as f32
    }
}
