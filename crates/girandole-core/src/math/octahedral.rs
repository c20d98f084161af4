//! The octahedral hemisphere: the four upper faces of an octahedron unfolded to a square (Barczak §4.2.1; Praun and
//! Hoppe 2003). Mirrored in `shaders/lib/octahedral.wgsl`.
//!
//! In light space (z along the light's normal) a direction `(x, y, z)`, z ≥ 0, is `q = (x, y) / (|x| + |y| + z)`, and
//! `u = (qx + qy + 1) / 2`, `v = (qx − qy + 1) / 2`. Worked example: `(0, 0, 1)` is the square's centre
//! `(0.5, 0.5)`; `(1, 0, 0)` is its corner `(1, 1)`; `(1, 1, 0)` is the middle `(1, 0.5)` of an edge.

use glam::{Vec2, Vec3};

/// The square's coordinates of a direction in the upper hemisphere.
///
/// ```
/// use girandole_core::{glam::{Vec2, Vec3}, math::octahedral::{decode, encode}};
/// assert_eq!(encode(Vec3::Z), Vec2::splat(0.5));
/// assert_eq!(decode(encode(Vec3::X)), Vec3::X);
/// ```
pub fn encode(direction: Vec3) -> Vec2 {
    let q = direction.truncate() / (direction.x.abs() + direction.y.abs() + direction.z);
    Vec2::new(q.x + q.y, q.x - q.y) * 0.5 + 0.5
}

/// The direction of a point of the square, with |x| + |y| + z = 1.
pub fn decode(uv: Vec2) -> Vec3 {
    let s = uv * 2.0 - 1.0;
    let q = Vec2::new(s.x + s.y, s.x - s.y) * 0.5;
    q.extend(1.0 - q.x.abs() - q.y.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: u32 = 257;

    fn grid() -> impl Iterator<Item = Vec2> {
        (0..N * N).map(|i| Vec2::new((i % N) as f32, (i / N) as f32) / (N - 1) as f32)
    }

    /// The largest distance between a point of the square and where it comes back to.
    fn round_trip(encode: impl Fn(Vec3) -> Vec2) -> f32 {
        grid().map(|uv| (encode(decode(uv).normalize()) - uv).length()).fold(0.0, f32::max)
    }

    #[test]
    fn every_point_of_the_square_comes_back() {
        assert!(round_trip(encode) < 1e-6);
        // Negative control: v mirrored.
        assert!(round_trip(|d| encode(d) * Vec2::new(1.0, -1.0) + Vec2::Y) > 0.5);
        for uv in grid() {
            let d = decode(uv);
            assert!(d.z >= 0.0 && (d.x.abs() + d.y.abs() + d.z - 1.0).abs() < 1e-6, "{uv}");
        }
    }

    #[test]
    fn the_worked_example_and_the_corners_hold() {
        for (direction, uv) in [
            (Vec3::Z, Vec2::new(0.5, 0.5)),
            (Vec3::X, Vec2::ONE),
            (Vec3::NEG_X, Vec2::ZERO),
            (Vec3::Y, Vec2::X),
            (Vec3::NEG_Y, Vec2::Y),
            (Vec3::new(1.0, 1.0, 0.0), Vec2::new(1.0, 0.5)),
        ] {
            assert_eq!(encode(direction), uv);
        }
    }

    #[test]
    fn faces_meet_without_a_step_and_turn_lines_into_lines() {
        let e = 1e-4;
        for i in 0..=100 {
            let t = i as f32 / 100.0;
            // Across x = 0 and y = 0.
            for (a, b) in [
                (Vec3::new(e, t, 1.0 - t), Vec3::new(-e, t, 1.0 - t)),
                (Vec3::new(-t, e, 1.0 - t), Vec3::new(-t, -e, 1.0 - t)),
            ] {
                assert!((encode(a) - encode(b)).length() < 4.0 * e);
            }
        }
        // On one face a straight edge stays straight: what makes a face one projective transform.
        let (a, b) = (Vec3::new(0.2, 3.0, 0.5), Vec3::new(4.0, 0.1, 1.0));
        let bend = |map: &dyn Fn(Vec3) -> Vec2| {
            let (start, end) = (map(a), map(b));
            (1..20)
                .map(|i| (end - start).normalize().perp_dot(map(a.lerp(b, i as f32 / 20.0)) - start).abs())
                .fold(0.0, f32::max)
        };
        assert!(bend(&encode) < 1e-6);
        // Negative control: a paraboloid bends it.
        let parabolic = |d: Vec3| d.truncate() / (d.length() + d.z);
        assert!(bend(&parabolic) > 1e-2);
    }
}
