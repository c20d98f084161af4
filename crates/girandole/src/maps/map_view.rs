//! Which texels of a light's shadow map a box may cover.

use super::bounds::Bounds;
use crate::layout::Light;
use crate::shader_constants::{DIRECTIONAL, DISTANT};
use girandole_core::glam::{Vec3, Vec4};

/// Texels of a map, from the first column and row up to before the last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TexelRect {
    pub first: [u32; 2],
    pub end: [u32; 2],
}

/// What rounding may add to a box of texels, texels.
const MARGIN: f32 = 2.0;

impl TexelRect {
    /// A whole map.
    pub fn whole(size: u32) -> Self {
        Self { first: [0; 2], end: [size; 2] }
    }

    pub fn is_empty(&self) -> bool {
        (0..2).any(|i| self.first[i] >= self.end[i])
    }

    /// How many.
    pub fn texels(&self) -> u64 {
        (0..2).map(|i| u64::from(self.end[i].saturating_sub(self.first[i]))).product()
    }

    /// The smallest one about both.
    pub fn union(&self, other: &Self) -> Self {
        match (self.is_empty(), other.is_empty()) {
            (true, _) => *other,
            (_, true) => *self,
            _ => Self {
                first: [0, 1].map(|i| self.first[i].min(other.first[i])),
                end: [0, 1].map(|i| self.end[i].max(other.end[i])),
            },
        }
    }

    /// The smallest one about it of whole blocks of so many texels.
    pub fn in_blocks(&self, block: u32) -> Self {
        Self {
            first: self.first.map(|x| x / block * block),
            end: self.end.map(|x| x.next_multiple_of(block)),
        }
    }

    /// The part of a map between two of its coordinates, with a margin.
    fn between([low, high]: [[f32; 2]; 2], size: u32) -> Self {
        let texel = |x: f32| (x * size as f32).clamp(0.0, size as f32);
        let margin = MARGIN / size as f32;
        Self {
            first: low.map(|x| texel(x - margin).floor() as u32),
            end: high.map(|x| texel(x + margin).ceil() as u32),
        }
    }
}

/// A light's map: how it sees.
#[derive(Clone, Copy)]
pub(crate) struct MapView<'a> {
    pub light: &'a Light,
    /// Texels across.
    pub size: u32,
    /// Whether it is known where in a map a box is shown; it is for parallel light, too.
    pub is_octahedral: bool,
}

impl MapView<'_> {
    /// The texels that a box may cover.
    pub fn covered(&self, bounds: &Bounds) -> TexelRect {
        let &Self { light, size, is_octahedral } = self;
        let axes = [light.tangent, light.normal.cross(light.tangent), light.normal];
        let to_center = bounds.center - light.position;
        // The box's corners in the light's frame, four and four.
        let sides = [Vec4::new(-1.0, 1.0, -1.0, 1.0), Vec4::new(-1.0, -1.0, 1.0, 1.0)];
        let corners: [[Vec4; 3]; 2] = [-1.0, 1.0].map(|far| {
            axes.map(|axis| {
                let half = axis * bounds.half_extent;
                sides[0] * half.x + sides[1] * half.y + (far * half.z + axis.dot(to_center))
            })
        });
        let extremes = |[near, far]: [[Vec4; 2]; 2]| {
            let low = [0, 1].map(|i| near[i].min(far[i]).min_element());
            let high = [0, 1].map(|i| near[i].max(far[i]).max_element());
            [low, high]
        };
        if light.is_parallel() {
            let map = light.parallel_map();
            let places = corners.map(|[x, y, _]| [x, y].map(|q| map.shown_at(q * light.scale) * 0.5 + 0.5));
            return TexelRect::between(extremes(places), size);
        }
        // With room for rounding.
        let margin = (to_center.length() + bounds.half_extent.length()) * 2.0 / size as f32;
        let may_be =
            |axis: usize, sign: f32| corners.iter().any(|c| (c[axis] * sign).max_element() >= -margin);
        if !may_be(2, 1.0) {
            return TexelRect::default();
        }
        if !is_octahedral {
            return TexelRect::whole(size);
        }
        let faces = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
        let touched = faces.into_iter().filter(|&[x, y]| may_be(0, x) && may_be(1, y));
        touched.fold(TexelRect::default(), |rect, [sign_x, sign_y]| {
            // On a face, coordinates are ratios of linear functions: over a box in front of the plane where the denominator is 0, their
            // extremes lie at corners.
            let denominators = corners.map(|[x, y, z]| x * sign_x + y * sign_y + z);
            let is_before = (0..2).all(|i| {
                let [x, y, z] = corners[i].map(Vec4::abs);
                denominators[i].cmpgt((x + y + z) * 1e-6).all()
            });
            let places = |i: usize| {
                let [x, y, _] = corners[i];
                [x + y, x - y].map(|p| (p / denominators[i] + 1.0) * 0.5)
            };
            let [mut low, mut high] =
                if is_before { extremes([places(0), places(1)]) } else { [[0.0; 2], [1.0; 2]] };
            // The face's own part of the map.
            let axis = usize::from(sign_x != sign_y);
            if sign_x > 0.0 {
                low[axis] = low[axis].max(0.5);
            } else {
                high[axis] = high[axis].min(0.5);
            }
            rect.union(&TexelRect::between([low, high], size))
        })
    }
}

impl Light {
    /// Whether its map shows a square of the scene that views choose: it stands for all light from its direction, not for a part of a sky.
    pub fn shows_square(&self) -> bool {
        self.profile == DIRECTIONAL
    }

    /// Whether its map has to show all that is seen sharply: a sun's, and those of a sky of few samples.
    pub fn has_large_map(&self) -> bool {
        self.shows_square() || self.profile == DISTANT && self.rectangle.w > 0.0
    }
}

/// What part of the scene a map shows, bit for bit: of parallel light with a large map; all others show all directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ShownSquare([u32; 4]);

impl ShownSquare {
    /// What the map of a light shows.
    pub fn of(light: &Light) -> Self {
        let middle_and_scale = light.position.extend(light.scale).to_array();
        if light.shows_square() { Self(middle_and_scale.map(f32::to_bits)) } else { Self::default() }
    }

    /// The light, with a map that shows this.
    pub fn shown_by(self, light: &Light) -> Light {
        let [x, y, z, scale] = self.0.map(f32::from_bits);
        if light.shows_square() { Light { position: Vec3::new(x, y, z), scale, ..*light } } else { *light }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parallel_map::tests::found_by_halves;
    use girandole_core::glam::Vec3;
    use girandole_core::math::sequence;

    /// Where a map shows what lies in a direction of the light's frame, as `lib/octahedral.wgsl` has it.
    fn project(light: &Light, point: Vec3) -> [f32; 2] {
        let d = point - light.position;
        let bitangent = light.normal.cross(light.tangent);
        let [x, y, z] = [light.tangent, bitangent, light.normal].map(|axis| axis.dot(d));
        if light.profile == DIRECTIONAL {
            return [x, y].map(|p| found_by_halves(light.rectangle.z, p * light.scale) * 0.5 + 0.5);
        }
        let sum = x.abs() + y.abs() + z;
        [(x + y) / sum, (x - y) / sum].map(|p| p * 0.5 + 0.5)
    }

    /// Three numbers of −½ to ½.
    fn vector(case: u32, what: u32) -> Vec3 {
        let random = |what: u32| sequence::hash(case ^ sequence::hash(what)) as f32 / u32::MAX as f32 - 0.5;
        Vec3::new(random(what), random(what + 1), random(what + 2))
    }

    /// A light, every eighth parallel, and a box before or behind it, half as large as that at most.
    fn light_and_box(case: u32, extent: f32) -> (Light, Bounds) {
        let normal = vector(case, 0).normalize();
        let mut light =
            Light { normal, tangent: normal.any_orthonormal_vector(), scale: 0.4, ..Light::default() };
        light.position = vector(case, 3);
        if case.is_multiple_of(8) {
            light.profile = DIRECTIONAL;
            light.position -= normal * 5.0;
            light.rectangle.z = if case.is_multiple_of(16) { 0.4 } else { 0.0 };
        }
        let bounds = Bounds { center: vector(case, 6) * 4.0, half_extent: vector(case, 9).abs() * extent };
        (light, bounds)
    }

    /// A point of a box; corners and edges, too.
    fn point_of(bounds: &Bounds, case: u32, point: u32) -> Vec3 {
        let at = (vector(case, 100 + 3 * point) * 3.0).clamp(Vec3::NEG_ONE, Vec3::ONE);
        bounds.center + bounds.half_extent * at
    }

    #[test]
    fn boxes_stay_within_their_footprints_and_footprints_are_tight() {
        const SIZE: u32 = 256;
        let (mut footprints, mut tight, mut by_itself) = (0.0, 0.0, 0.0);
        for case in 0..400 {
            let (light, bounds) = light_and_box(case, 0.8);
            let covered = MapView { light: &light, size: SIZE, is_octahedral: true }.covered(&bounds);
            let mut seen = TexelRect::default();
            for point in 0..512 {
                let at = point_of(&bounds, case, point);
                if (at - light.position).dot(light.normal) <= 0.0 {
                    continue;
                }
                let texel = project(&light, at).map(|p| (p * SIZE as f32) as u32);
                if texel.iter().all(|t| *t < SIZE) {
                    let texel = TexelRect { first: texel, end: texel.map(|t| t + 1) };
                    assert!(covered.union(&texel) == covered, "case {case}: {texel:?} of {covered:?}");
                    seen = seen.union(&texel);
                }
            }
            if !seen.is_empty() {
                footprints += covered.texels() as f64;
                tight += seen.texels() as f64;
                by_itself += f64::from(SIZE * SIZE);
            }
        }
        // The control: they are not simply the whole map.
        assert!(footprints < 3.0 * tight && footprints < 0.1 * by_itself, "{footprints} {tight} {by_itself}");
    }
}
