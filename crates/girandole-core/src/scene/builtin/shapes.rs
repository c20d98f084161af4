//! Simple meshes: what rooms are furnished with, and test objects for library users.
//!
//! Curved surfaces share their vertices all around and have smooth normals and no texture coordinates; flat ones are
//! patches. All faces point outwards.

use crate::scene::{Mesh, MeshTriangle};
use glam::Vec3;

/// Sine and cosine of `i / n` of a full turn, exact at quarters and the same on every machine.
pub(super) fn turn(i: u32, n: u32) -> (f32, f32) {
    let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let exact = |v: f64| if v.abs() < 1e-12 { 0.0 } else { v as f32 };
    (exact(libm::sin(angle)), exact(libm::cos(angle)))
}

/// Two triangles of the quad `a b c d`, counter-clockwise seen from its front.
pub(super) fn quad(mesh: &mut Mesh, [a, b, c, d]: [u32; 4], material: u32) {
    mesh.triangles.push(MeshTriangle { vertices: [a, b, c], material });
    mesh.triangles.push(MeshTriangle { vertices: [a, c, d], material });
}

/// An axis-aligned box of six patches, corners in metres.
#[cfg(test)]
pub(crate) fn cuboid(min: Vec3, max: Vec3, material: u32) -> Mesh {
    let mut mesh = Mesh { name: "box".into(), ..Mesh::default() };
    mesh.add_box(min, max, material);
    mesh
}

/// A torus about the Y axis, centred: `major` is the radius of its centre line, `minor` that of its tube (metres).
/// It has `major_segments × minor_segments` vertices; at least 3 segments each way are used.
pub fn torus(major: f32, minor: f32, major_segments: u32, minor_segments: u32, material: u32) -> Mesh {
    let (around, tube) = (major_segments.max(3), minor_segments.max(3));
    let mut mesh = Mesh { name: "torus".into(), ..Mesh::default() };
    for i in 0..around {
        let (sin, cos) = turn(i, around);
        for j in 0..tube {
            let (up, out) = turn(j, tube);
            mesh.normals.push(Vec3::new(out * cos, up, -out * sin));
            let r = major + minor * out;
            mesh.positions.push(Vec3::new(r * cos, minor * up, -r * sin));
        }
    }
    for i in 0..around {
        let (this, next) = (i * tube, (i + 1) % around * tube);
        for j in 0..tube {
            let k = (j + 1) % tube;
            quad(&mut mesh, [this + j, next + j, next + k, this + k], material);
        }
    }
    mesh
}

/// The torus of the thesis's experiments: 820 vertices, largest extent 1 m, axis along Y.
pub fn thesis_torus(material: u32) -> Mesh {
    torus(0.36, 0.14, 41, 20, material)
}

/// A sphere about the origin, radius in metres; `segments` around the Y axis (at least 3), `rings` of faces from pole
/// to pole (at least 2).
pub fn sphere(radius: f32, segments: u32, rings: u32, material: u32) -> Mesh {
    let (segments, rings) = (segments.max(3), rings.max(2));
    let mut mesh = Mesh { name: "sphere".into(), ..Mesh::default() };
    mesh.normals.push(Vec3::Y);
    for i in 1..rings {
        let (sin, cos) = turn(i, 2 * rings);
        for j in 0..segments {
            let (s, c) = turn(j, segments);
            mesh.normals.push(Vec3::new(sin * c, cos, -sin * s));
        }
    }
    mesh.normals.push(Vec3::NEG_Y);
    mesh.positions = mesh.normals.iter().map(|&n| n * radius).collect();
    let last = mesh.positions.len() as u32 - 1;
    let ring = |i: u32, j: u32| 1 + (i - 1) * segments + j % segments;
    for j in 0..segments {
        mesh.triangles.push(MeshTriangle { vertices: [0, ring(1, j), ring(1, j + 1)], material });
        for i in 1..rings - 1 {
            quad(&mut mesh, [ring(i, j), ring(i + 1, j), ring(i + 1, j + 1), ring(i, j + 1)], material);
        }
        mesh.triangles
            .push(MeshTriangle { vertices: [ring(rings - 1, j), last, ring(rings - 1, j + 1)], material });
    }
    mesh
}

/// An upright cylinder that stands on y = 0, sizes in metres: two patches as caps, a smooth mantle of `segments`
/// faces (at least 3).
pub fn cylinder(radius: f32, height: f32, segments: u32, material: u32) -> Mesh {
    let segments = segments.max(3);
    let mut mesh = Mesh { name: "cylinder".into(), ..Mesh::default() };
    let rim = |i: u32, y: f32| {
        let (sin, cos) = turn(i, segments);
        Vec3::new(radius * cos, y, -radius * sin)
    };
    let top: Vec<Vec3> = (0..segments).map(|i| rim(i, height)).collect();
    let bottom: Vec<Vec3> = (0..segments).rev().map(|i| rim(i, 0.0)).collect();
    mesh.add_polygon(&top, material);
    mesh.add_polygon(&bottom, material);
    mesh.uvs.clear();
    let first = mesh.positions.len() as u32;
    for i in 0..segments {
        let (sin, cos) = turn(i, segments);
        mesh.positions.extend([rim(i, 0.0), rim(i, height)]);
        mesh.normals.extend([Vec3::new(cos, 0.0, -sin); 2]);
    }
    for i in 0..segments {
        let (this, next) = (first + 2 * i, first + 2 * ((i + 1) % segments));
        quad(&mut mesh, [this, next, next + 1, this + 1], material);
    }
    mesh
}
