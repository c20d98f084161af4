//! The octahedral hemisphere: the four upper faces of an octahedron unfolded to a square (Barczak §4.2.1; Praun and
//! Hoppe 2003). Mirrored in `shaders/lib/octahedral.wgsl`.
//!
//! In light space (z along the light's normal) a direction `(x, y, z)`, z ≥ 0, is `q = (x, y) / (|x| + |y| + z)`, and
//! `u = (qx + qy + 1) / 2`, `v = (qx − qy + 1) / 2`. Worked example: `(0, 0, 1)` is the square's centre
//! `(0.5, 0.5)`; `(1, 0, 0)` is its corner `(1, 1)`; `(1, 1, 0)` is the middle `(1, 0.5)` of an edge.

use glam::{Vec2, Vec3};

/// The square's coordinates of a direction in the upper hemisphere.
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
