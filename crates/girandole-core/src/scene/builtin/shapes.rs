//! Simple meshes: what rooms are furnished with, and test objects for library users.
//!
//! Curved surfaces share their vertices all around and have smooth normals and no texture coordinates; flat ones are
//! patches. All faces point outwards.

use crate::scene::{MaterialId, Mesh, MeshTriangle};
use glam::Vec3;

/// Sine and cosine of `i / n` of a full turn, exact at quarters and the same on every machine.
pub(in crate::scene) fn turn(i: u32, n: u32) -> (f32, f32) {
    let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let exact = |v: f64| if v.abs() < 1e-12 { 0.0 } else { v as f32 };
    (exact(libm::sin(angle)), exact(libm::cos(angle)))
}

/// Two triangles of the quad `a b c d`, counter-clockwise seen from its front.
pub(super) fn quad(mesh: &mut Mesh, [a, b, c, d]: [u32; 4], material: MaterialId) {
    mesh.triangles.push(MeshTriangle { vertices: [a, b, c], material });
    mesh.triangles.push(MeshTriangle { vertices: [a, c, d], material });
}

/// An axis-aligned box of six patches, corners in metres.
#[cfg(test)]
pub(crate) fn cuboid(min: Vec3, max: Vec3, material: MaterialId) -> Mesh {
    let mut mesh = Mesh { name: "box".into(), ..Mesh::default() };
    mesh.add_box(min, max, material);
    mesh
}

/// A torus about the Y axis, centred: `major` is the radius of its centre line, `minor` that of its tube (metres).
/// It has `major_segments × minor_segments` vertices; at least 3 segments each way are used.
pub fn torus(major: f32, minor: f32, major_segments: u32, minor_segments: u32, material: MaterialId) -> Mesh {
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

/// A square of 1 m × 1 m about the origin that faces −Z, as lights do.
pub fn panel(material: MaterialId) -> Mesh {
    let mut mesh = Mesh { name: "panel".into(), ..Mesh::default() };
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    mesh.add_polygon(&[corner(-0.5, -0.5), corner(-0.5, 0.5), corner(0.5, 0.5), corner(0.5, -0.5)], material);
    mesh
}

/// The torus of the thesis's experiments: 820 vertices, largest extent 1 m, axis along Y.
pub fn thesis_torus(material: MaterialId) -> Mesh {
    torus(0.36, 0.14, 41, 20, material)
}

/// A sphere about the origin, radius in metres; `segments` around the Y axis (at least 3), `rings` of faces from pole
/// to pole (at least 2).
pub fn sphere(radius: f32, segments: u32, rings: u32, material: MaterialId) -> Mesh {
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
pub fn cylinder(radius: f32, height: f32, segments: u32, material: MaterialId) -> Mesh {
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

/// What an outline sweeps that is turned once about the Y axis: radius and height of its points in metres, from
/// bottom to top with the outside to the right, in `segments` faces (at least 3). Outlines from axis to axis
/// enclose a solid. Surfaces are smooth; a point that is given twice is an edge.
pub fn revolved(outline: &[[f32; 2]], segments: u32, material: MaterialId) -> Mesh {
    let (segments, count) = (segments.max(3), outline.len());
    let mut mesh = Mesh { name: "revolved".into(), ..Mesh::default() };
    // Before and after a point, as far as the outline is smooth there.
    let normal = |i: usize| {
        let before = if i > 0 && outline[i - 1] != outline[i] { i - 1 } else { i };
        let after = if i + 1 < count && outline[i + 1] != outline[i] { i + 1 } else { i };
        let [from, to] = [before, after].map(|i| glam::Vec2::from(outline[i]));
        glam::Vec2::new((to - from).y, (from - to).x).normalize_or(glam::Vec2::Y)
    };
    let normals: Vec<glam::Vec2> = (0..count).map(normal).collect();
    for j in 0..segments {
        let (sin, cos) = turn(j, segments);
        for (&[r, y], n) in outline.iter().zip(&normals) {
            mesh.positions.push(Vec3::new(r * cos, y, -r * sin));
            mesh.normals.push(Vec3::new(n.x * cos, n.y, -n.x * sin));
        }
    }
    for j in 0..segments {
        let (this, next) = (j * count as u32, (j + 1) % segments * count as u32);
        for i in (1..count).filter(|&i| outline[i - 1] != outline[i]) {
            let (low, high) = (i as u32 - 1, i as u32);
            let corners = [this + low, next + low, next + high, this + high];
            match [outline[i - 1][0], outline[i][0]].map(|r| r > 0.0) {
                [true, true] => quad(&mut mesh, corners, material),
                [false, _] => mesh
                    .triangles
                    .push(MeshTriangle { vertices: [corners[0], corners[2], corners[3]], material }),
                [true, false] => mesh
                    .triangles
                    .push(MeshTriangle { vertices: [corners[0], corners[1], corners[2]], material }),
            }
        }
    }
    mesh
}

/// A box with round edges and corners that stands on y = 0 about the Y axis: sizes and radius in metres, `steps`
/// faces around a quarter of an edge.
pub fn rounded_box(size: Vec3, radius: f32, steps: u32, material: MaterialId) -> Mesh {
    let mut mesh = Mesh { name: "rounded box".into(), ..Mesh::default() };
    let half = size * 0.5;
    let inner = (half - radius).max(Vec3::ZERO);
    let side = 2 * steps + 2;
    // Sign of the corner and tangent of the angle from the middle of a face, half of a quarter on each side.
    let at = |i: u32| {
        let (sign, k) = if i <= steps { (-1.0, steps - i) } else { (1.0, i - steps - 1) };
        let (sin, cos) = turn(k, 8 * steps.max(1));
        (sign, sign * sin / cos)
    };
    for (axis, sign) in [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0), (2, -1.0), (2, 1.0)] {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let first = mesh.positions.len() as u32;
        for (j, i) in (0..side).flat_map(|j| (0..side).map(move |i| (j, i))) {
            let mut corner = Vec3::ZERO;
            let mut normal = Vec3::ZERO;
            (corner[axis], normal[axis]) = (sign, sign);
            (corner[u], normal[u]) = at(i);
            (corner[v], normal[v]) = at(j);
            // In double precision, so that faces meet to the bit.
            let normal = normal.as_dvec3().normalize().as_vec3();
            mesh.positions.push(corner * inner + normal * (half - inner) + Vec3::Y * half.y);
            mesh.normals.push(normal);
        }
        for (j, i) in (0..side - 1).flat_map(|j| (0..side - 1).map(move |i| (j, i))) {
            let a = first + j * side + i;
            let corners = [a, a + 1, a + side + 1, a + side];
            quad(&mut mesh, if sign > 0.0 { corners } else { [a, a + side, a + side + 1, a + 1] }, material);
        }
    }
    mesh
}

/// A pillow that lies on y = 0 about the Y axis: a superellipsoid of this size in metres, `steps` faces from its
/// middle to a pole.
pub fn pillow(size: Vec3, steps: u32, material: MaterialId) -> Mesh {
    let mut mesh = Mesh { name: "pillow".into(), ..Mesh::default() };
    let (half, around, rings) = (size * 0.5, 4 * steps, 2 * steps);
    let power = |x: f32, exponent: f32| libm::powf(x.abs(), exponent).copysign(x);
    for (i, j) in (0..=rings).flat_map(|i| (0..around).map(move |j| (i, j))) {
        let (sin, up) = turn(i, 2 * rings);
        let (z, x) = turn(j, around);
        let at = |flat: f32, square: f32| {
            Vec3::new(power(sin, flat) * power(x, square), up, power(sin, flat) * power(z, square))
        };
        mesh.positions.push(at(0.9, 0.5) * half + Vec3::Y * half.y);
        mesh.normals.push((at(1.1, 1.5) / half).normalize());
    }
    for (i, j) in (0..rings).flat_map(|i| (0..around).map(move |j| (i, j))) {
        let next = (j + 1) % around;
        let [a, b, c, d] = [i * around + j, i * around + next, (i + 1) * around + next, (i + 1) * around + j];
        if i > 0 {
            mesh.triangles.push(MeshTriangle { vertices: [a, b, c], material });
        }
        if i + 1 < rings {
            mesh.triangles.push(MeshTriangle { vertices: [a, c, d], material });
        }
    }
    mesh
}

/// A cylinder from one point to another.
pub fn rod(from: Vec3, to: Vec3, radius: f32, segments: u32, material: MaterialId) -> Mesh {
    let along = to - from;
    let mut mesh = cylinder(radius, along.length(), segments, material);
    let turned = glam::Quat::from_rotation_arc(Vec3::Y, along.normalize_or(Vec3::Y));
    mesh.positions.iter_mut().for_each(|p| *p = from + turned * *p);
    mesh.normals.iter_mut().for_each(|n| *n = turned * *n);
    mesh.name = "rod".into();
    mesh
}

/// A toy balloon on a string, which hangs down to y = 0: 80 cm high.
pub fn balloon(material: MaterialId) -> Mesh {
    let mut outline = vec![[0.0, 0.338], [0.024, 0.342], [0.01, 0.368]];
    for i in 1..18 {
        // From the knot to the top.
        let (sin, cos) = turn(i, 36);
        let (narrow, deep) = if cos > 0.0 { (1.0 - 0.25 * cos * cos, 0.224) } else { (1.0, 0.2) };
        outline.push([0.17 * sin * narrow, 0.6 - deep * cos]);
    }
    outline.push([0.0, 0.8]);
    let mut mesh = revolved(&outline, 36, material);
    let string = rod(Vec3::ZERO, Vec3::Y * 0.342, 0.0025, 5, material);
    append(&mut mesh, &string, Vec3::ZERO, glam::Quat::IDENTITY);
    mesh.name = "balloon".into();
    mesh
}

/// Adds a mesh to another one, turned and then shifted; neither keeps its patches or texture coordinates.
pub(super) fn append(mesh: &mut Mesh, other: &Mesh, shift: Vec3, turned: glam::Quat) {
    let first = mesh.positions.len() as u32;
    mesh.uvs.clear();
    mesh.patches.clear();
    mesh.positions.extend(other.positions.iter().map(|&p| turned * p + shift));
    mesh.normals.extend(other.normals.iter().map(|&n| turned * n));
    let moved = |t: &MeshTriangle| MeshTriangle { vertices: t.vertices.map(|v| v + first), ..*t };
    mesh.triangles.extend(other.triangles.iter().map(moved));
}
