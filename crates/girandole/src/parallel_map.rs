//! Where maps of parallel light show what: the host's side of `lib/parallel_map.wgsl`.

use crate::shader_constants::CORE;
use girandole_core::glam::Vec4;

/// `ParallelMap` there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ParallelMap {
    spacing: f32,
    growth: f32,
}

impl ParallelMap {
    /// By how much less than [`CORE`] is the share of half the width that the core shows, if that is this share of it: so that kernels of
    /// maps and of shading have the same number.
    pub fn less(core: f32) -> f32 {
        ((CORE - core).max(0.0) * 65536.0).floor() / 65536.0
    }

    pub fn new(less: f32) -> Self {
        Self { spacing: (CORE - less) / CORE, growth: less / ((1.0 - CORE) * CORE * (1.0 - CORE + less)) }
    }

    /// Where a map shows a place across the light, from its middle, both in halves of its width.
    pub fn shown_at(&self, place: Vec4) -> Vec4 {
        let (p, core) = (place.abs(), Vec4::splat(CORE * self.spacing));
        let beyond = (p - core).max(Vec4::ZERO);
        (p.min(core) / self.spacing + beyond / (self.spacing + self.growth * beyond)) * place.signum()
    }

    /// How far apart places are that it shows a unit apart, about one of them along either axis at most.
    pub fn spacing_about(&self, place: Vec4) -> f32 {
        let beyond = (self.shown_at(place).abs().max_element() - CORE).max(0.0);
        self.spacing / (1.0 - self.growth * beyond).powi(2)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The same, found by halves, as what a map shows somewhere.
    pub fn found_by_halves(less: f32, place: f32) -> f32 {
        let spacing = (CORE - less) / CORE;
        // So that 1 is shown at 1.
        let growth = (1.0 - spacing * (1.0 - CORE) / (1.0 - (CORE - less))) / (1.0 - CORE);
        let place_shown = |at: f32| {
            let beyond = (at - CORE).max(0.0);
            spacing * (at.min(CORE) + beyond / (1.0 - growth * beyond))
        };
        let (mut low, mut high) = (0.0, CORE + 0.999 / growth.max(0.1));
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if place_shown(middle) < place.abs() { low = middle } else { high = middle }
        }
        low * place.signum()
    }

    #[test]
    fn maps_show_a_core_evenly_and_less_of_what_is_far() {
        let shown = |less: f32, place: f32| ParallelMap::new(less).shown_at(Vec4::splat(place)).x;
        for place in [0.0, 0.1, -0.3, 0.49, 0.51, -0.77, 1.0] {
            assert_eq!(shown(0.0, place), place);
            for less in [0.1, 0.4, 0.49] {
                let found = shown(less, place);
                assert!((found - found_by_halves(less, place)).abs() < 1e-5, "{less} {place}: {found}");
            }
        }
        // A core of a tenth is five times as fine, and what is at the end far coarser.
        assert!((ParallelMap::less(0.1) - 0.4).abs() < 2e-5 && ParallelMap::less(1.0) == 0.0);
        assert!((shown(0.4, 0.05) - 0.25).abs() < 1e-6 && (shown(0.4, 1.0) - 1.0).abs() < 1e-6);
        let [inside, at_end] = [0.03, 1.0].map(|x| ParallelMap::new(0.4).spacing_about(Vec4::X * x));
        assert!((inside - 0.2).abs() < 1e-5 && at_end > 7.5, "{inside} {at_end}");
    }
}
