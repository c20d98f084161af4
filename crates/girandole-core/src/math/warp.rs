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
