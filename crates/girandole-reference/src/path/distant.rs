//! The environment: directions drawn in proportion to what comes from their cell.

use super::random::Random;
use girandole_core::glam::{DVec2, Vec3};
use girandole_core::image::luminance;
use girandole_core::scene::Environment;
use girandole_core::trace::SceneTracer;

/// Share of directions that are drawn alike: what a cell's mean hides is found, too.
const UNIFORM: f64 = 0.05;

/// The scene's environment, if it shines.
pub(super) struct Distant<'a> {
    environment: &'a Environment,
    cumulative: Vec<f64>,
}

impl<'a> Distant<'a> {
    pub(super) fn new(tracer: &'a SceneTracer<'a>) -> Option<Self> {
        let environment = tracer.scene().environment.as_ref().filter(|environment| environment.shines())?;
        let weight = |cell| f64::from(luminance(environment.cell_radiance(cell)));
        let all: f64 = (0..environment.cells()).map(weight).sum();
        let mut total = 0.0;
        let cumulative = (0..environment.cells()).map(|cell| {
            total += UNIFORM / f64::from(environment.cells()) + (1.0 - UNIFORM) * weight(cell) / all;
            total
        });
        Some(Self { environment, cumulative: cumulative.collect() })
    }

    /// Whether it is seen behind the scene.
    pub(super) fn is_visible(&self) -> bool {
        self.environment.visible
    }

    pub(super) fn radiance(&self, direction: Vec3) -> Vec3 {
        self.environment.radiance(direction)
    }

    pub(super) fn sample(&self, random: &mut Random) -> Vec3 {
        let chosen = random.fine_unit();
        let cell = self.cumulative.partition_point(|&c| c <= chosen);
        let [x, y] = random.square().to_array().map(f64::from);
        self.environment.cell_direction(cell.min(self.cumulative.len() - 1) as u32, DVec2::new(x, y))
    }

    /// Density of a direction, sr⁻¹.
    pub(super) fn pdf(&self, direction: Vec3) -> f32 {
        let cell = self.environment.cell_at(direction) as usize;
        let below = if cell > 0 { self.cumulative[cell - 1] } else { 0.0 };
        ((self.cumulative[cell] - below) / self.environment.cell_solid_angle()) as f32
    }
}
