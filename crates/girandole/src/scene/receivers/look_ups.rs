//! Which shadow maps a view looks up, and how fine they have to be for it.

use super::Receivers;
use crate::layout::Light;
use crate::maps::layout::coarseness;
use crate::parallel::in_order;
use crate::shader_constants::{JOINTED, MAPPED_SHADOWED, NEAR_SHADOWED, SHADOWED};
use girandole_core::glam::Vec3;
use girandole_core::scene::LocalView;

/// Pixels from the bottom to the top of the pictures that maps are made for, whatever their size: so views of several sizes share them.
const PICTURE_HEIGHT: f32 = 1080.0;
/// Pixels of such a picture that a texel may be as wide as: of light that is one of many, and of light that one map stands for.
const PIXELS_PER_TEXEL: [f32; 2] = [8.0, 2.0];
/// Texels are as wide as the distance times this over the number of them across: √2π, as a map shows half of all directions.
const TEXEL_WIDTH: f32 = 2.506_628_3;

impl Receivers {
    /// For each leaf, whether a view may show it.
    pub fn in_view(&self, view: &LocalView) -> Vec<bool> {
        let all = || vec![true; self.leaves as usize];
        self.database.as_ref().map_or_else(all, |database| database.seen_leaves(view))
    }

    /// For each light, how many texels across its map should have for what leaves in view look up in it; 0 where none does.
    pub fn look_ups(&self, in_view: &[bool], view: &LocalView) -> Vec<f32> {
        let pixel = 2.0 * view.half_extent.y / PICTURE_HEIGHT;
        let lights = self.lights as usize;
        let coarseness = coarseness(&self.gpu_lights);
        let leaves: Vec<usize> = (0..self.leaves as usize).filter(|leaf| in_view[*leaf]).collect();
        let of_leaves = |leaves: &&[usize]| {
            let mut most = vec![0.0_f32; lights];
            for &leaf in *leaves {
                let (center, radius) = self.bounds[leaf];
                let distance = (center.distance(view.eye) - radius).max(0.1 * radius);
                let per_metre =
                    1.0 / (PIXELS_PER_TEXEL[0] * pixel * if view.orthographic { 1.0 } else { distance });
                let kinds = &self.kinds[self.row(leaf)];
                let pairs = kinds.iter().zip(&self.gpu_lights).zip(&mut most);
                for ((_, light), most) in pairs.filter(|((kind, _), _)| is_looked_up(**kind)) {
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
        let is_looked_up = |leaf: usize| is_looked_up(self.kinds[leaf * self.lights as usize + light]);
        let covered = |leaf: usize| {
            self.database.as_ref().is_some_and(|database| database.is_covered(leaf as u32, light as u32))
        };
        leaves.iter().any(|&leaf| is_looked_up(leaf) && !covered(leaf))
    }
}

/// Leaves that one thread looks at.
const LEAVES: usize = 64;

/// Whether lights of this part of the lists are looked up.
fn is_looked_up(kind: u8) -> bool {
    matches!(u32::from(kind), NEAR_SHADOWED | JOINTED | SHADOWED | MAPPED_SHADOWED)
}

/// What a map's texels across cover together at a leaf, metres.
fn extent(light: &Light, (center, radius): (Vec3, f32)) -> f32 {
    let [many, one] = PIXELS_PER_TEXEL;
    match light.is_parallel() {
        true => 2.0 / light.scale * if light.has_large_map() { many / one } else { 1.0 },
        false => TEXEL_WIDTH * (center.distance(light.position) + radius),
    }
}
