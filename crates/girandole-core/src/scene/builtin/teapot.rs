//! Martin Newell's teapot (1975), from its Bézier patches.
//!
//! Rim, body, lid and bottom are profile curves turned about the axis, a quarter turn a patch; handle and spout are
//! two patches each and their mirror images. Original axes: x from handle to spout, z up.

use super::shapes::quad;
use crate::scene::{MaterialId, Mesh, MeshTriangle};
use glam::Vec3;

/// Profiles `(radius, height)` from the bottom's centre up to the rim's inner edge: bottom, lower and upper body, rim.
const BODY: [[[f32; 2]; 4]; 4] = [
    [[0.0, 0.0], [1.425, 0.0], [1.5, 0.075], [1.5, 0.15]],
    [[1.5, 0.15], [1.5, 0.225], [2.0, 0.45], [2.0, 0.9]],
    [[2.0, 0.9], [2.0, 1.35], [1.75, 1.875], [1.5, 2.4]],
    [[1.5, 2.4], [1.4375, 2.53125], [1.3375, 2.53125], [1.4, 2.4]],
];

/// Profiles from the lid's edge up to the top of its knob.
const LID: [[[f32; 2]; 4]; 2] =
    [[[1.3, 2.4], [1.3, 2.55], [0.4, 2.55], [0.2, 2.7]], [[0.2, 2.7], [0.0, 2.85], [0.8, 3.15], [0.0, 3.15]]];

/// Where a patch's inner control points lie on a quarter turn, as a share of the radius (a circle needs 0.5523).
const QUARTER: f32 = 0.56;

/// A half tube: `(x, y, z)` of the four control points across, for seven stations along. The other half has −y.
type HalfTube = [[[f32; 3]; 4]; 7];

const HANDLE: HalfTube = [
    [[-1.6, 0.0, 2.025], [-1.6, 0.3, 2.025], [-1.5, 0.3, 2.25], [-1.5, 0.0, 2.25]],
    [[-2.3, 0.0, 2.025], [-2.3, 0.3, 2.025], [-2.5, 0.3, 2.25], [-2.5, 0.0, 2.25]],
    [[-2.7, 0.0, 2.025], [-2.7, 0.3, 2.025], [-3.0, 0.3, 2.25], [-3.0, 0.0, 2.25]],
    [[-2.7, 0.0, 1.8], [-2.7, 0.3, 1.8], [-3.0, 0.3, 1.8], [-3.0, 0.0, 1.8]],
    [[-2.7, 0.0, 1.575], [-2.7, 0.3, 1.575], [-3.0, 0.3, 1.35], [-3.0, 0.0, 1.35]],
    [[-2.5, 0.0, 1.125], [-2.5, 0.3, 1.125], [-2.65, 0.3, 0.9375], [-2.65, 0.0, 0.9375]],
    [[-2.0, 0.0, 0.9], [-2.0, 0.3, 0.9], [-1.9, 0.3, 0.6], [-1.9, 0.0, 0.6]],
];

const SPOUT: HalfTube = [
    [[1.7, 0.0, 1.425], [1.7, 0.66, 1.425], [1.7, 0.66, 0.6], [1.7, 0.0, 0.6]],
    [[2.6, 0.0, 1.425], [2.6, 0.66, 1.425], [3.1, 0.66, 0.825], [3.1, 0.0, 0.825]],
    [[2.3, 0.0, 2.1], [2.3, 0.25, 2.1], [2.4, 0.25, 2.025], [2.4, 0.0, 2.025]],
    [[2.7, 0.0, 2.4], [2.7, 0.25, 2.4], [3.3, 0.25, 2.4], [3.3, 0.0, 2.4]],
    [[2.8, 0.0, 2.475], [2.8, 0.25, 2.475], [3.525, 0.25, 2.49375], [3.525, 0.0, 2.49375]],
    [[2.9, 0.0, 2.475], [2.9, 0.15, 2.475], [3.45, 0.15, 2.5125], [3.45, 0.0, 2.5125]],
    [[2.8, 0.0, 2.4], [2.8, 0.15, 2.4], [3.2, 0.15, 2.4], [3.2, 0.0, 2.4]],
];

/// Cubic Bernstein polynomials and their derivatives.
fn bernstein(t: f32) -> ([f32; 4], [f32; 4]) {
    let s = 1.0 - t;
    (
        [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t],
        [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t],
    )
}

fn mix<const N: usize>(weights: [f32; 4], points: [[f32; N]; 4]) -> [f32; N] {
    std::array::from_fn(|c| weights.iter().zip(points).map(|(w, p)| w * p[c]).sum())
}

/// The teapot standing on y = 0, spout along +X, largest extent 1 m, smooth normals: 1178 vertices at `segments` = 6
/// per patch edge (at least 2). The gap between lid and rim is closed; the spout is open, as in the original.
pub fn teapot(segments: u32, material: MaterialId) -> Mesh {
    let n = segments.max(2);
    let mut mesh = Mesh { name: "teapot".into(), ..Mesh::default() };
    let rim = turned(&mut mesh, &BODY, n, true, material);
    let lid = turned(&mut mesh, &LID, n, false, material);
    let around = 4 * n;
    for j in 0..around {
        let k = (j + 1) % around;
        quad(&mut mesh, [rim + j, rim + k, lid + k, lid + j], material);
        // Both edges share their vertices with this ring: bend their normals up, into a smooth groove.
        mesh.normals[(rim + j) as usize] = Vec3::Z;
        mesh.normals[(lid + j) as usize] = (mesh.normals[(lid + j) as usize] + Vec3::Z).normalize();
    }
    tube(&mut mesh, &HANDLE, n, material);
    tube(&mut mesh, &SPOUT, n, material);
    // Original axes to ours, and to size.
    let (min, max) = bounds(&mesh);
    let scale = 1.0 / (max - min).max_element();
    let center = Vec3::new((min.x + max.x) * 0.5, 0.0, min.z);
    for p in &mut mesh.positions {
        let q = (*p - center) * scale;
        *p = Vec3::new(q.x, q.z, -q.y);
    }
    for n in &mut mesh.normals {
        *n = Vec3::new(n.x, n.z, -n.y);
    }
    mesh
}

fn bounds(mesh: &Mesh) -> (Vec3, Vec3) {
    mesh.positions
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)))
}

/// Turns profiles about z. One end lies on the axis: the first if `pole_first`, else the last. Returns the first
/// vertex of the ring at the other end.
fn turned(
    mesh: &mut Mesh,
    profiles: &[[[f32; 2]; 4]],
    n: u32,
    pole_first: bool,
    material: MaterialId,
) -> u32 {
    let rings = profiles.len() as u32 * n;
    let around = 4 * n;
    let first = mesh.positions.len() as u32;
    let mut rows = Vec::new();
    for i in 0..=rings {
        let profile = profiles[(i.min(rings - 1) / n) as usize];
        let t = (i - i.min(rings - 1) / n * n) as f32 / n as f32;
        let (value, slope) = bernstein(t);
        let [radius, height] = mix(value, profile);
        let [out, up] = mix(slope, profile);
        rows.push(mesh.positions.len() as u32);
        if i == 0 && pole_first || i == rings && !pole_first {
            mesh.positions.push(Vec3::new(0.0, 0.0, height));
            mesh.normals.push(if pole_first { Vec3::NEG_Z } else { Vec3::Z });
            continue;
        }
        for j in 0..around {
            let (circle, tangent) = quarter_turn(j, n);
            let radial = Vec3::new(circle[0], circle[1], 0.0);
            let along = radial * out + Vec3::Z * up;
            let normal = Vec3::new(tangent[0], tangent[1], 0.0).cross(along);
            mesh.positions.push(radial * radius + Vec3::Z * height);
            mesh.normals.push(normal.normalize_or(Vec3::Z));
        }
    }
    for i in 0..rings {
        let (low, high) = (rows[i as usize], rows[i as usize + 1]);
        for j in 0..around {
            let k = (j + 1) % around;
            if i == 0 && pole_first {
                mesh.triangles.push(MeshTriangle { vertices: [low, high + k, high + j], material });
            } else if i + 1 == rings && !pole_first {
                mesh.triangles.push(MeshTriangle { vertices: [low + j, low + k, high], material });
            } else {
                quad(mesh, [low + j, low + k, high + k, high + j], material);
            }
        }
    }
    if pole_first { rows[rings as usize] } else { first }
}

/// Point and tangent of Newell's almost-circle at step `j` of `4n`.
fn quarter_turn(j: u32, n: u32) -> ([f32; 2], [f32; 2]) {
    let (value, slope) = bernstein((j % n) as f32 / n as f32);
    let control = [[1.0, 0.0], [1.0, QUARTER], [QUARTER, 1.0], [0.0, 1.0]];
    let rotate = |[x, y]: [f32; 2]| match j / n {
        0 => [x, y],
        1 => [-y, x],
        2 => [-x, -y],
        _ => [y, -x],
    };
    (rotate(mix(value, control)), rotate(mix(slope, control)))
}

/// A tube of two patches along and two around.
fn tube(mesh: &mut Mesh, half: &HalfTube, n: u32, material: MaterialId) {
    let first = mesh.positions.len() as u32;
    let around = 2 * n;
    for i in 0..=2 * n {
        let part = (i.min(2 * n - 1) / n) as usize;
        let (along, along_slope) = bernstein((i - part as u32 * n) as f32 / n as f32);
        for j in 0..around {
            let mirror = if j < n { 1.0 } else { -1.0 };
            let j = if j < n { j } else { around - j };
            let (across, across_slope) = bernstein(j as f32 / n as f32);
            let at = |a: [f32; 4], b: [f32; 4]| {
                let rows: [[f32; 3]; 4] = std::array::from_fn(|r| mix(b, half[3 * part + r]));
                Vec3::from(mix(a, rows))
            };
            let flip = Vec3::new(1.0, mirror, 1.0);
            let normal = at(along_slope, across).cross(at(along, across_slope)) * flip;
            mesh.positions.push(at(along, across) * flip);
            mesh.normals.push(normal.normalize_or(Vec3::Z));
        }
    }
    let outwards = tube_orientation(half);
    for normal in &mut mesh.normals[first as usize..] {
        *normal *= outwards;
    }
    for i in 0..2 * n {
        let (low, high) = (first + i * around, first + (i + 1) * around);
        for j in 0..around {
            let k = (j + 1) % around;
            let corners = if outwards > 0.0 {
                [low + j, high + j, high + k, low + k]
            } else {
                [low + j, low + k, high + k, high + j]
            };
            quad(mesh, corners, material);
        }
    }
}

/// 1 if (along × across) points out of the tube, −1 if into it: judged at the far side of the first station.
fn tube_orientation(half: &HalfTube) -> f32 {
    let [a, b] = [Vec3::from(half[0][0]), Vec3::from(half[0][3])];
    let along = Vec3::from(half[1][0]) - a;
    let across = b - a;
    // Halfway across, the surface bulges to +y.
    if along.cross(across).y > 0.0 { 1.0 } else { -1.0 }
}
