//! Few triangles at a time, as a face of a map shows them: whether one of them may cover a texel's centre.
//!
//! Which of them face away is no help: rasterisation moves corners by a part of a texel, and turns those over that are smaller.

use super::footprint::{MapView, OVERLAP, ROUNDING};
use girandole_core::glam::{Vec3, Vec4};

/// The least share of a point's distance that its denominator is, for its place in the map to be known.
const LEAST: f32 = 1e-3;

/// What boxes about spheres are enlarged by for rounding, texels.
const MARGIN: f32 = 0.01;

/// Numbers as large as this have no fraction.
const WHOLE: f32 = (1 << 23) as f32;

/// Four triangles side by side: x, y and z of each corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece([[Vec4; 3]; 3]);

/// Where a face of a map shows a point: two ratios of linear functions of it.
pub(super) struct FaceView {
    position: Vec3,
    /// The two numerators and the denominator, in texels.
    axes: [Vec3; 3],
    /// Signs of the tangent's and the bitangent's axis on the face.
    signs: [i32; 2],
    /// Texels across the map.
    size: u32,
    /// What the ratio is added to, and the first and last centres of texels on the face.
    pub offset: [f32; 2],
    low: [f32; 2],
    high: [f32; 2],
}

impl Piece {
    pub fn new(triangles: [[Vec3; 3]; 4]) -> Self {
        let of = |corner: usize, axis: usize| Vec4::from(triangles.map(|triangle| triangle[corner][axis]));
        Self([0, 1, 2].map(|corner| [0, 1, 2].map(|axis| of(corner, axis))))
    }

    /// x, y and z of each corner.
    pub fn corners(&self) -> [[Vec4; 3]; 3] {
        self.0
    }

    /// Which of them may cover the centre of a texel of the face, a bit each.
    pub fn drawn(&self, view: &FaceView) -> u32 {
        let mut low = [Vec4::INFINITY; 2];
        let mut high = [Vec4::NEG_INFINITY; 2];
        let mut is_known = true;
        for corners in self.0 {
            let (places, _, known) = view.project(corners);
            is_known &= known;
            for (i, place) in places.into_iter().enumerate() {
                (low[i], high[i]) = (low[i].min(place), high[i].max(place));
            }
        }
        let covers = |i: usize| {
            let low = (low[i] + (view.offset[i] - ROUNDING)).max(Vec4::splat(view.low[i])).ceil();
            let high = (high[i] + (view.offset[i] + ROUNDING)).min(Vec4::splat(view.high[i])).floor();
            low.cmple(high)
        };
        if is_known { (covers(0) & covers(1)).bitmask() } else { 0b1111 }
    }
}

impl FaceView {
    /// Where four points are shown, less [`Self::offset`]; the reciprocals of their denominators; and whether all are well before the
    /// light.
    pub fn project(&self, [x, y, z]: [Vec4; 3]) -> ([Vec4; 2], Vec4, bool) {
        let [x, y, z] = [x - self.position.x, y - self.position.y, z - self.position.z];
        let dot = |axis: Vec3| x * axis.x + y * axis.y + z * axis.z;
        let [u, v, w] = self.axes.map(dot);
        let is_known = w.cmpgt((x.abs() + y.abs() + z.abs()) * LEAST).all();
        let inverse = w.recip();
        ([u * inverse, v * inverse], inverse, is_known)
    }

    /// Which of four spheres may cover one of the centres in a box, a bit each.
    pub fn may_show(&self, [x, y, z, radius]: &[Vec4; 4], first: [u32; 2], count: [u32; 2]) -> u32 {
        let [x, y, z] = [*x - self.position.x, *y - self.position.y, *z - self.position.z];
        let dot = |axis: Vec3| x * axis.x + y * axis.y + z * axis.z;
        let [u, v, w] = self.axes.map(dot);
        // How far the denominator goes at most; its axis has the length √3.
        let reach = *radius * 3f32.sqrt();
        let (inverse, least) = (w.recip(), (w - reach).recip());
        // Of the place p = u / w the gradient is (U − p W) / w: the axes' lengths and their product give that of U − p W.
        let half = 0.5 * self.size as f32;
        let [sx, sy] = self.signs.map(|sign| sign as f32);
        let products = [sx + sy, sx - sy].map(|product| product * half);
        let [beside, above] = [0, 1].map(|i| {
            let place = [u, v][i] * inverse;
            let squared = (place * 3.0 - 2.0 * products[i]) * place + 2.0 * half * half;
            let margin = *radius * Vec4::from(squared.to_array().map(f32::sqrt)) * least + MARGIN;
            // The nearest centre; adding and taking away a large number rounds.
            let from_first = place + (self.offset[i] - first[i] as f32);
            let within = from_first.max(Vec4::ZERO).min(Vec4::splat((count[i] - 1) as f32));
            let nearest = (within + WHOLE) - WHOLE;
            (from_first - nearest).abs().cmpgt(margin)
        });
        (!(w.cmpgt(reach) & (beside | above))).bitmask()
    }

    /// Whether a texel's centre lies on the face, or on its seam.
    pub fn shows(&self, texel: [u32; 2]) -> bool {
        let [column, row] = texel.map(|i| i as i32);
        self.signs[0] * (column + row + 1 - self.size as i32) >= 0 && self.signs[1] * (column - row) >= 0
    }
}

impl MapView<'_> {
    /// How a face shows points; none, where that is not by ratios.
    pub(super) fn face(&self, face: u32) -> Option<FaceView> {
        let light = self.light;
        if light.is_parallel() || self.faces() != 4 {
            return None;
        }
        let bitangent = light.normal.cross(light.tangent);
        let [sx, sy] = [1, 2].map(|bit| if face & bit == 0 { -1.0 } else { 1.0 });
        let half = self.size as f32 * 0.5;
        let axes = [
            (light.tangent + bitangent) * half,
            (light.tangent - bitangent) * half,
            light.tangent * sx + bitangent * sy + light.normal,
        ];
        // A place less a half is a whole number at a texel's centre.
        let offset = [half - 0.5; 2];
        let (mut low, mut high) = ([-0.5; 2], [self.size as f32 - 0.5; 2]);
        // The face's own part of the map.
        let axis = usize::from(sx != sy);
        if sx > 0.0 {
            low[axis] = offset[axis] - OVERLAP - ROUNDING;
        } else {
            high[axis] = offset[axis] + OVERLAP + ROUNDING;
        }
        let signs = [sx, sy].map(|sign: f32| sign as i32);
        Some(FaceView { position: light.position, axes, signs, size: self.size, offset, low, high })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::footprint::Bounds;
    use super::*;
    use crate::layout::Light;
    use girandole_core::glam::DVec3;
    use girandole_core::math::sequence;

    const SIZE: u32 = 64;
    const FACES: u32 = 4;

    /// The direction that a place in a map of a size shows, in texels; its coordinates on the axes sum to 1 on the face that it is
    /// on. The inverse of `lib/octahedral.wgsl`.
    pub fn direction(light: &Light, size: u32, place: [f64; 2]) -> DVec3 {
        let [s, t] = place.map(|x| x / f64::from(size) * 2.0 - 1.0);
        let [x, y] = [(s + t) * 0.5, (s - t) * 0.5];
        let z = 1.0 - x.abs() - y.abs();
        let bitangent = light.normal.cross(light.tangent);
        light.tangent.as_dvec3() * x + bitangent.as_dvec3() * y + light.normal.as_dvec3() * z
    }

    /// Three numbers of −½ to ½.
    pub fn vector(case: u32, what: u32) -> Vec3 {
        Vec3::from([0, 1, 2].map(|axis| sequence::sample(case, axis, what) - 0.5))
    }

    /// A light, and four triangles before or behind it of a texel or a few across.
    fn light_and_triangles(case: u32) -> (Light, [[Vec3; 3]; 4]) {
        let normal = vector(case, 0).normalize();
        let tangent = normal.any_orthonormal_vector();
        let light = Light { normal, tangent, position: vector(case, 1), ..Light::default() };
        let extent = if case.is_multiple_of(3) { 0.3 } else { 0.05 };
        let middle = vector(case, 2) * 4.0;
        let corner = |i: u32| middle + vector(case, 3 + i) * extent;
        (light, [0, 1, 2, 3].map(|triangle| [0, 1, 2].map(|i| corner(3 * triangle + i))))
    }

    /// The faces that a box about triangles touches.
    fn views(map: &MapView, triangles: &[[Vec3; 3]; 4]) -> impl Iterator<Item = FaceView> {
        let touched = map.faces_touched(&Bounds::around(triangles.iter().flatten().copied()));
        (0..FACES).filter(move |face| touched >> face & 1 == 1).filter_map(|face| map.face(face))
    }

    /// Whether the ray from the light through a texel's centre meets a triangle.
    fn covers(light: &Light, triangle: &[Vec3; 3], texel: [u32; 2]) -> bool {
        let direction = direction(light, SIZE, texel.map(|i| f64::from(i) + 0.5));
        let [a, b, c] = triangle.map(|p| (p - light.position).as_dvec3());
        let volume = |p: DVec3, q: DVec3| p.cross(q).dot(direction);
        let sides = [volume(a, b), volume(b, c), volume(c, a)];
        let is_within = sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0);
        is_within && (a + b + c).dot(direction) > 0.0
    }

    #[test]
    fn triangles_that_cover_a_centre_are_drawn_and_few_others() {
        let (mut covering, mut drawn_all, mut all) = (0, 0, 0);
        for case in 0..400 {
            let (light, triangles) = light_and_triangles(case);
            let map = MapView::new(&light, SIZE, FACES);
            let piece = Piece::new(triangles);
            let drawn = views(&map, &triangles).fold(0, |drawn, view| drawn | piece.drawn(&view));
            for (i, triangle) in triangles.iter().enumerate() {
                let mut texels = (0..SIZE * SIZE).map(|texel| [texel % SIZE, texel / SIZE]);
                let is_drawn = drawn >> i & 1 == 1;
                if texels.any(|texel| covers(&light, triangle, texel)) {
                    assert!(is_drawn, "case {case}: triangle {i}");
                    covering += 1;
                }
                (drawn_all, all) = (drawn_all + u32::from(is_drawn), all + 1);
            }
        }
        // The controls: many cover something, and most of those that do not are not drawn.
        let [others, drawn_others] = [all, drawn_all].map(|count| count - covering);
        assert!(covering > 100 && drawn_others * 4 < others, "{covering} {drawn_all} {all}");
    }
}
