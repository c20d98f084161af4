//! Which texels of a light's shadow map a box may cover.

use super::bounds::Bounds;
use crate::layout::Light;
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
    fn between(low: [f32; 2], high: [f32; 2], size: u32) -> Self {
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
    /// How many faces it has.
    faces: u32,
}

impl<'a> MapView<'a> {
    /// `faces` are those of the parameterisation; parallel light has one.
    pub fn new(light: &'a Light, size: u32, faces: u32) -> Self {
        Self { light, size, faces: if light.is_parallel() { 1 } else { faces } }
    }

    /// Which faces a box touches, a bit each.
    fn faces_touched(&self, bounds: &Bounds) -> u32 {
        let light = self.light;
        let bitangent = light.normal.cross(light.tangent);
        let d = bounds.center - light.position;
        // Range of each light-space coordinate over the box, with room for rounding.
        let margin = (d.length() + bounds.half_extent.length()) * 2.0 / self.size as f32;
        let range = |axis: Vec3| (axis.dot(d), axis.abs().dot(bounds.half_extent) + margin);
        let [x, y, z] = [light.tangent, bitangent, light.normal].map(range);
        if light.is_parallel() {
            let is_shown = [x, y].iter().all(|(center, half)| (center.abs() - half) * light.scale <= 1.0);
            return u32::from(is_shown);
        }
        if z.0 + z.1 < 0.0 {
            return 0;
        }
        let is_inside = |face: u32| {
            let side = |bit: u32| if face & bit == 0 { -1.0 } else { 1.0 };
            match self.faces {
                4 => side(1) * x.0 + x.1 >= 0.0 && side(2) * y.0 + y.1 >= 0.0,
                5 => match face {
                    0 | 1 => side(1) * x.0 + x.1 >= 0.0,
                    2 | 3 => side(1) * y.0 + y.1 >= 0.0,
                    _ => true,
                },
                _ => true,
            }
        };
        (0..self.faces).filter(|&face| is_inside(face)).fold(0, |bits, face| bits | 1 << face)
    }

    /// The lowest and highest coordinates of a box in the part of the map that a face has, if they are known.
    fn extent(&self, face: u32, bounds: &Bounds) -> Option<[[f32; 2]; 2]> {
        let light = self.light;
        let bitangent = light.normal.cross(light.tangent);
        let into = |v: Vec3| Vec3::new(v.dot(light.tangent), v.dot(bitangent), v.dot(light.normal));
        let center = into(bounds.center - light.position);
        let Vec3 { x, y, z } = bounds.half_extent;
        let axes = [Vec3::X * x, Vec3::Y * y, Vec3::Z * z].map(into);
        // The corners, four side by side.
        let sides = [Vec4::new(-1.0, 1.0, -1.0, 1.0), Vec4::new(-1.0, -1.0, 1.0, 1.0)];
        let corners = [-1.0, 1.0].map(|far| {
            [0, 1, 2].map(|i| {
                Vec4::splat(center[i]) + sides[0] * axes[0][i] + sides[1] * axes[1][i] + far * axes[2][i]
            })
        });
        let bounds = |[near, far]: [[Vec4; 2]; 2]| {
            let low = [0, 1].map(|i| near[i].min(far[i]).min_element());
            let high = [0, 1].map(|i| near[i].max(far[i]).max_element());
            [low, high]
        };
        if light.is_parallel() {
            return Some(bounds(corners.map(|[x, y, _]| [x, y].map(|q| q * light.scale * 0.5 + 0.5))));
        }
        if self.faces != 4 {
            return None;
        }
        // On a face of the octahedron coordinates are ratios of linear functions: over a box in front of the plane where
        // the denominator is 0, their extremes lie at corners.
        let [sx, sy] = [1, 2].map(|bit| if face & bit == 0 { -1.0 } else { 1.0 });
        let [mut low, mut high] = [[0.0; 2], [1.0; 2]];
        let denominators = corners.map(|[x, y, z]| x * sx + y * sy + z);
        let is_before =
            |([x, y, z], w): ([Vec4; 3], Vec4)| w.cmpgt((x.abs() + y.abs() + z.abs()) * 1e-6).all();
        if corners.into_iter().zip(denominators).all(is_before) {
            let places = |i: usize| {
                let ([x, y, _], w) = (corners[i], denominators[i]);
                [x + y, x - y].map(|p| (p / w + 1.0) * 0.5)
            };
            [low, high] = bounds([places(0), places(1)]);
        }
        // The face's own part of the map.
        let axis = usize::from(sx != sy);
        if sx > 0.0 {
            low[axis] = low[axis].max(0.5);
        } else {
            high[axis] = high[axis].min(0.5);
        }
        Some([low, high])
    }

    /// The texels that a box may cover, on all faces.
    pub fn covered(&self, bounds: &Bounds) -> TexelRect {
        let touched = self.faces_touched(bounds);
        (0..self.faces).filter(|face| touched >> face & 1 == 1).fold(TexelRect::default(), |rect, face| {
            let covered = match self.extent(face, bounds) {
                Some([low, high]) => TexelRect::between(low, high, self.size),
                None => TexelRect::whole(self.size),
            };
            rect.union(&covered)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_constants::DIRECTIONAL;
    use girandole_core::math::sequence;

    /// Where a map shows what lies in a direction of the light's frame, as `lib/octahedral.wgsl` has it.
    fn project(light: &Light, point: Vec3) -> [f32; 2] {
        let d = point - light.position;
        let bitangent = light.normal.cross(light.tangent);
        let [x, y, z] = [light.tangent, bitangent, light.normal].map(|axis| axis.dot(d));
        if light.profile == DIRECTIONAL {
            return [x, y].map(|p| p * light.scale * 0.5 + 0.5);
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
            let covered = MapView::new(&light, SIZE, 4).covered(&bounds);
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
