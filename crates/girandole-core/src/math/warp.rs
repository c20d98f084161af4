//! From the unit square to surfaces and directions. No platform trigonometry: `libm` gives the same bits everywhere.

use glam::{Vec2, Vec3};

/// Barycentric weights of corners 1 and 2, uniform over a triangle (Heitz 2019, low distortion).
pub fn triangle(s: Vec2) -> Vec2 {
    if s.x > s.y {
        let y = s.y * 0.5;
        Vec2::new(s.x - y, y)
    } else {
        let x = s.x * 0.5;
        Vec2::new(x, s.y - x)
    }
}

/// Uniform over the unit disc, concentric (Shirley and Chiu 1997).
pub fn disc(s: Vec2) -> Vec2 {
    let p = s * 2.0 - 1.0;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let quarter = std::f32::consts::FRAC_PI_4;
    let (r, phi) = if p.x.abs() > p.y.abs() {
        (p.x, quarter * (p.y / p.x))
    } else {
        (p.y, 2.0 * quarter - quarter * (p.x / p.y))
    };
    Vec2::new(r * libm::cosf(phi), r * libm::sinf(phi))
}

/// The point of the unit square that [`disc`] leads to a point of the unit disc.
pub fn square_of_disc(d: Vec2) -> Vec2 {
    let r = d.length();
    if r == 0.0 {
        return Vec2::splat(0.5);
    }
    let per_eighth = 4.0 / std::f32::consts::PI;
    let p = if d.x.abs() > d.y.abs() {
        let x = r.copysign(d.x);
        Vec2::new(x, x * (per_eighth * libm::atanf(d.y / d.x)))
    } else {
        let y = r.copysign(d.y);
        Vec2::new(y * (per_eighth * libm::atanf(d.x / d.y)), y)
    };
    ((p + 1.0) * 0.5).clamp(Vec2::ZERO, Vec2::ONE)
}

/// Cosine-weighted over the hemisphere about +Z; density cos θ / π per solid angle.
pub fn cosine_hemisphere(s: Vec2) -> Vec3 {
    let d = disc(s);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Uniform over the unit sphere.
pub fn sphere(s: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * s.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let phi = 2.0 * std::f32::consts::PI * s.y;
    Vec3::new(r * libm::cosf(phi), r * libm::sinf(phi), z)
}

/// Two unit vectors that with unit `n` make a right-handed frame (Duff et al. 2017).
pub fn frame(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    const N: u32 = 128;

    /// The mean of a function over a regular grid of the unit square.
    fn mean(f: impl Fn(Vec2) -> DVec3) -> DVec3 {
        let at = |i: u32| Vec2::new((i % N) as f32 + 0.5, (i / N) as f32 + 0.5) / N as f32;
        (0..N * N).map(|i| f(at(i))).sum::<DVec3>() / f64::from(N * N)
    }

    fn near(a: DVec3, b: DVec3) -> bool {
        (a - b).length() < 2e-3
    }

    fn squares(v: Vec3) -> DVec3 {
        v.as_dvec3() * v.as_dvec3()
    }

    #[test]
    fn triangles_are_covered_evenly() {
        let weights = |s| triangle(s).extend(0.0);
        assert!(near(mean(|s| weights(s).as_dvec3()), DVec3::new(1.0, 1.0, 0.0) / 3.0));
        assert!(near(mean(|s| squares(weights(s))), DVec3::new(1.0, 1.0, 0.0) / 6.0));
        assert!(mean(|s| DVec3::X * f64::from(triangle(s).element_sum() > 1.0 + 1e-6)).x == 0.0);
        // Negative control: the square squeezed into the triangle.
        let squeezed = |s: Vec2| Vec3::new(s.x, s.y * (1.0 - s.x), 0.0);
        assert!(!near(mean(|s| squeezed(s).as_dvec3()), DVec3::new(1.0, 1.0, 0.0) / 3.0));
    }

    #[test]
    fn discs_are_covered_evenly() {
        assert!(near(mean(|s| squares(disc(s).extend(0.0))), DVec3::new(0.25, 0.25, 0.0)));
        let r4 = |s: Vec2| DVec3::X * f64::from(disc(s).length_squared().powi(2));
        assert!(near(mean(r4), DVec3::X / 3.0));
        assert!(near(mean(|s| disc(s).extend(0.0).as_dvec3()), DVec3::ZERO));
        // Negative control: radius without the square root.
        let polar = |s: Vec2| Vec2::from_angle(std::f32::consts::TAU * s.y) * s.x;
        assert!(!near(mean(|s| squares(polar(s).extend(0.0))), DVec3::new(0.25, 0.25, 0.0)));
        assert_eq!(disc(Vec2::splat(0.5)), Vec2::ZERO);
        // And back.
        let astray = |back: fn(Vec2) -> Vec2| mean(|s| DVec3::X * f64::from(back(disc(s)).distance(s))).x;
        assert!(astray(square_of_disc) < 1e-6 && square_of_disc(Vec2::ZERO) == Vec2::splat(0.5));
        assert!(astray(|d| (d + 1.0) * 0.5) > 0.05, "negative control");
    }

    #[test]
    fn directions_have_the_moments_of_their_density() {
        let unit = |f: fn(Vec2) -> Vec3| mean(|s| DVec3::X * f64::from(f(s).length())).x;
        assert!((unit(cosine_hemisphere) - 1.0).abs() < 1e-6 && (unit(sphere) - 1.0).abs() < 1e-6);
        let cosine = |f: fn(Vec2) -> Vec3| {
            near(mean(|s| f(s).as_dvec3()), DVec3::Z * 2.0 / 3.0)
                && near(mean(|s| squares(f(s))), DVec3::new(0.25, 0.25, 0.5))
        };
        assert!(cosine(cosine_hemisphere));
        // Negative control: uniform over the hemisphere.
        assert!(!cosine(|s| sphere(Vec2::new(s.x * 0.5, s.y))));
        assert!(near(mean(|s| sphere(s).as_dvec3()), DVec3::ZERO));
        assert!(near(mean(|s| squares(sphere(s))), DVec3::ONE / 3.0));
        assert!(!near(mean(|s| squares(cosine_hemisphere(s))), DVec3::ONE / 3.0), "negative control");
    }

    #[test]
    fn frames_are_right_handed_everywhere() {
        let poles = [Vec3::Z, Vec3::NEG_Z, Vec3::new(0.0, 0.0, -1.0), Vec3::X, Vec3::NEG_Y];
        let many = (0..1000)
            .map(|i| sphere(Vec2::new(i as f32 / 1000.0, (i * 619 % 1000) as f32 / 1000.0)).normalize());
        for n in many.chain(poles) {
            let (x, y) = frame(n);
            for (a, b, dot) in [(x, x, 1.0), (y, y, 1.0), (x, y, 0.0), (x, n, 0.0), (y, n, 0.0)] {
                assert!((a.dot(b) - dot).abs() < 2e-6, "{n}");
            }
            assert!((x.cross(y) - n).length() < 3e-6, "{n}");
            assert!((y.cross(x) - n).length() > 1.0, "negative control");
        }
    }
}
