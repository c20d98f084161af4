//! Which shadow maps a view looks up, and how fine they have to be for it.

use super::Receivers;
use crate::layout::Light;
use crate::maps::layout::coarseness;
use crate::parallel::in_order;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::scene::LocalView;
use std::f32::consts::FRAC_1_SQRT_2;

/// Pixels from the bottom to the top of the pictures that maps are made for, whatever their size: so views of several sizes share them.
const PICTURE_HEIGHT: f32 = 1080.0;
/// Pixels of such a picture that a texel may be as wide as: of light that is one of many, and of light that one map stands for.
const PIXELS_PER_TEXEL: [f32; 2] = [8.0, 2.0];
/// Texels are as wide as the distance times this over the number of them across: √2π, as a map shows half of all directions.
const TEXEL_WIDTH: f32 = 2.506_628_3;

impl Receivers {
    /// For each leaf, whether a view may show it, in mirrors too if they are asked for; and whether it shows mirrors.
    pub fn shown(&self, view: &LocalView, mirrors: bool) -> (Vec<bool>, bool) {
        let all = || (vec![true; self.leaves.len()], mirrors);
        self.database.as_ref().map_or_else(all, |database| database.shown_leaves(view, mirrors))
    }

    /// Directional lights, each with a map that shows no more than it takes for what a view shows of leaves that look it up, or of all of
    /// them; with mirrors for all of these leaves.
    pub fn suns(
        &self,
        in_view: &[bool],
        (view, in_mirrors): (&LocalView, bool),
        looks_up_lists: bool,
    ) -> Vec<(usize, Light)> {
        let of = |(index, light): (usize, &Light)| {
            let is_shown = |leaf: &usize| {
                in_view[*leaf] && (!looks_up_lists || self.pairs.row(*leaf)[index].is_looked_up())
            };
            let leaves = (0..self.leaves.len()).filter(is_shown);
            let none = [Vec2::INFINITY, Vec2::NEG_INFINITY];
            let [low, high] = leaves.fold(none, |range, leaf| {
                let database = self.database.as_ref().filter(|_| !in_mirrors);
                let polygon = database.and_then(|d| d.seen_polygon(leaf as u32, view));
                let (center, radius) = self.leaves[leaf].place.bounds();
                let (places, around) = polygon.map_or((vec![center], radius), |polygon| (polygon, 0.0));
                places
                    .iter()
                    .map(|&place| light.across(place))
                    .fold(range, |[low, high], place| [low.min(place - around), high.max(place + around)])
            });
            let (middle, half) = shown_square(low, high, 1.0 / light.offset);
            (index, light.showing(middle, half))
        };
        let suns = self.lights.on_gpu.iter().enumerate().filter(|(_, light)| light.shows_square());
        suns.map(of).collect()
    }

    /// For each light, how many texels across its map should have for what leaves in view look up in it; 0 where none does.
    pub fn look_ups(&self, in_view: &[bool], view: &LocalView, suns: &[(usize, Light)]) -> Vec<f32> {
        let mut of_view = self.lights.on_gpu.clone();
        suns.iter().for_each(|&(index, sun)| of_view[index] = sun);
        let pixel = 2.0 * view.half_extent.y / PICTURE_HEIGHT;
        let lights = self.pairs.lights;
        let coarseness = coarseness(&of_view);
        let leaves: Vec<usize> = (0..self.leaves.len()).filter(|leaf| in_view[*leaf]).collect();
        let of_leaves = |leaves: &&[usize]| {
            let mut most = vec![0.0_f32; lights];
            for &leaf in *leaves {
                let (center, radius) = self.leaves[leaf].place.bounds();
                let distance = (center.distance(view.eye) - radius).max(0.1 * radius);
                let per_metre =
                    1.0 / (PIXELS_PER_TEXEL[0] * pixel * if view.orthographic { 1.0 } else { distance });
                let pairs = self.pairs.row(leaf).iter().zip(&of_view).zip(&mut most);
                for ((_, light), most) in pairs.filter(|((pair, _), _)| pair.is_looked_up()) {
                    let coarser = if light.is_sample() { coarseness } else { 1.0 };
                    *most = most.max(extent(light, (center, radius)) * per_metre / coarser);
                }
            }
            most
        };
        let parts = in_order(&leaves.chunks(LEAVES).collect::<Vec<_>>(), of_leaves);
        let texels = parts.into_iter().fold(vec![0.0_f32; lights], |mut all, part| {
            all.iter_mut().zip(part).for_each(|(all, part)| *all = all.max(part));
            all
        });
        let of_lights: Vec<(usize, f32)> = texels.into_iter().enumerate().collect();
        in_order(&of_lights, |&(light, texels)| if self.reaches(light, &leaves) { texels } else { 0.0 })
    }

    /// Whether static polygons leave anything of a light to those of these leaves that look it up.
    fn reaches(&self, light: usize, leaves: &[usize]) -> bool {
        let covered = |leaf: usize| {
            self.database.as_ref().is_some_and(|database| database.is_covered(leaf as u32, light as u32))
        };
        leaves.iter().any(|&leaf| self.pairs.row(leaf)[light].is_looked_up() && !covered(leaf))
    }
}

/// The square that a map of parallel light shows for what lies in a rectangle: one of few, so that most steps of a camera change nothing.
/// Half its sides is that of the whole scene's over a power of √2; its middle is a multiple of an eighth of that.
fn shown_square(low: Vec2, high: Vec2, whole: f32) -> (Vec2, f32) {
    let square = |power: usize| {
        let half = whole * [1.0, FRAC_1_SQRT_2][power % 2] / (1 << (power / 2)) as f32;
        let step = half / STEPS;
        (((low + high) * 0.5 / step).round() * step, half)
    };
    let holds = |&(middle, half): &(Vec2, f32)| {
        // A few texels more, of which slopes are found.
        let room = Vec2::splat(half * (1.0 - MARGIN));
        (high - middle).cmple(room).all() && (middle - low).cmple(room).all() && low.cmple(high).all()
    };
    (1..=MOST_POWERS).rev().map(square).find(holds).unwrap_or((Vec2::ZERO, whole))
}

const MOST_POWERS: usize = 16;
const STEPS: f32 = 8.0;
const MARGIN: f32 = 1.0 / 32.0;

/// Leaves that one thread looks at.
const LEAVES: usize = 64;

/// What a map's texels across cover together at a leaf, metres.
fn extent(light: &Light, (center, radius): (Vec3, f32)) -> f32 {
    let [many, one] = PIXELS_PER_TEXEL;
    match light.is_parallel() {
        true => light.shown_width(center) * if light.has_large_map() { many / one } else { 1.0 },
        false => TEXEL_WIDTH * (center.distance(light.position) + radius),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use girandole_core::math::sequence;

    #[test]
    fn squares_hold_what_is_looked_up_and_are_little_larger() {
        let number = |case: u32, what: u32| sequence::sample(case, 0, what);
        let (mut squares, mut larger) = (Vec::new(), 0.0);
        for case in 0..500 {
            let low = Vec2::new(number(case, 0), number(case, 1)) * 16.0 - 8.0;
            let size = Vec2::new(number(case, 2), number(case, 3)) * 4.0;
            let (middle, half) = shown_square(low, low + size, 20.0);
            let room = half * (1.0 - MARGIN) * (1.0 + 1e-5);
            assert!((low - middle).abs().max_element() <= room, "{low} {middle} {half}");
            assert!((low + size - middle).abs().max_element() <= room, "{low} {size} {middle} {half}");
            larger += half / (0.5 * size.max_element()).max(20.0 / 256.0) / 500.0;
            // What is a little farther on is shown by the same one, mostly.
            squares.push((middle, half) == shown_square(low + 0.01, low + size + 0.01, 20.0));
        }
        assert!(larger < 1.6, "{larger}");
        assert!(squares.iter().filter(|same| **same).count() > 400);
        // Nothing, and what reaches beyond the scene: all of it.
        let whole = (Vec2::ZERO, 20.0);
        assert_eq!(shown_square(Vec2::INFINITY, Vec2::NEG_INFINITY, 20.0), whole);
        assert_eq!(shown_square(Vec2::splat(-21.0), Vec2::splat(21.0), 20.0), whole);
    }
}
