//! Floor, walls, windows and what hangs on them.

use super::{BACK, FRONT, HALF, HEIGHT, Palette, Room, boxes, none, shapes, sin_cos};
use crate::scene::{MaterialId, Mesh, MeshTriangle};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::TAU;

/// From where to where the windows are along the left wall and in height, and how deep.
const WINDOWS: [[f32; 2]; 2] = [[-1.75, -0.45], [0.35, 1.65]];
const SILL: f32 = 0.32;
const LINTEL: f32 = 2.38;
const DEPTH: f32 = 0.24;

pub fn add(room: &mut Room, palette: &Palette) {
    let (x, h) = (HALF, HEIGHT);
    let corners = [vec3(-x, 0., BACK), vec3(-x, 0., FRONT), vec3(x, 0., FRONT), vec3(x, 0., BACK)];
    // A texture's width is 1.6 m; planks run along x.
    room.put("floor", quad(corners, palette.floor, corners.map(|p| vec2(p.z, p.x) / 1.6)), Vec3::ZERO);
    let sides = [
        (
            "ceiling",
            palette.white,
            [vec3(-x, h, BACK), vec3(x, h, BACK), vec3(x, h, FRONT), vec3(-x, h, FRONT)],
        ),
        (
            "back wall",
            palette.accent,
            [vec3(-x, 0., BACK), vec3(x, 0., BACK), vec3(x, h, BACK), vec3(-x, h, BACK)],
        ),
        (
            "front wall",
            palette.white,
            [vec3(x, 0., FRONT), vec3(-x, 0., FRONT), vec3(-x, h, FRONT), vec3(x, h, FRONT)],
        ),
        (
            "right wall",
            palette.white,
            [vec3(x, 0., BACK), vec3(x, 0., FRONT), vec3(x, h, FRONT), vec3(x, h, BACK)],
        ),
    ];
    for (name, material, corners) in sides {
        let mut mesh = Mesh::default();
        mesh.add_polygon(&corners, material);
        room.put(name, mesh, Vec3::ZERO);
    }
    room.put("window wall", window_wall(palette.white), Vec3::ZERO);
    for (i, [near, far]) in WINDOWS.into_iter().enumerate() {
        window(room, palette, [near, far], 0.5 * i as f32);
    }
    skirting(room, palette);
    for (name, [from, to], waves, phase) in [
        ("back curtain", [-2.26, -1.87], 4, 30.0),
        ("middle curtain", [-0.33, 0.23], 6, 115.0),
        ("front curtain", [1.77, 2.2], 4, 60.0),
    ] {
        room.put(name, curtain([from, to], waves, phase, palette.curtain), Vec3::ZERO);
    }
    let rail = [-2.35, 2.3].map(|z| vec3(0.1 - HALF, 2.53, z));
    room.put("curtain rail", shapes::rod(rail[0], rail[1], 0.014, 12, palette.brass), Vec3::ZERO);
    for (i, at) in [-0.78, 0.02].into_iter().enumerate() {
        picture(room, palette, i, vec3(at, 1.62, BACK + 0.0005));
    }
}

fn quad(corners: [Vec3; 4], material: MaterialId, uvs: [Vec2; 4]) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_polygon(&corners, material);
    mesh.uvs = uvs.map(|uv| [uv; 2]).into();
    mesh
}

/// A grid without the two openings, so that no corner lies on another part's edge.
fn window_wall(material: MaterialId) -> Mesh {
    let [[a, b], [c, d]] = WINDOWS;
    let (columns, rows) = ([BACK, a, b, c, d, FRONT], [0.0, SILL, LINTEL, HEIGHT]);
    let mut mesh = Mesh::default();
    for (i, j) in (0..5).flat_map(|i| (0..3).map(move |j| (i, j))).filter(|&(i, j)| i % 2 == 0 || j != 1) {
        let corner = |z: usize, y: usize| vec3(-HALF, rows[y], columns[z]);
        mesh.add_polygon(&[corner(i + 1, j), corner(i, j), corner(i, j + 1), corner(i + 1, j + 1)], material);
    }
    mesh
}

/// Reveals, a pane that shines, its frame and a sill. The pane shows the half of the view that starts at `from`.
fn window(room: &mut Room, palette: &Palette, [near, far]: [f32; 2], from: f32) {
    let (inner, outer) = (-HALF, -HALF - DEPTH);
    let at = |x: f32, y: f32, z: f32| vec3(x, y, z);
    let mut reveals = Mesh::default();
    for side in [
        [at(outer, SILL, near), at(outer, SILL, far), at(inner, SILL, far), at(inner, SILL, near)],
        [at(inner, LINTEL, near), at(inner, LINTEL, far), at(outer, LINTEL, far), at(outer, LINTEL, near)],
        [at(inner, LINTEL, near), at(outer, LINTEL, near), at(outer, SILL, near), at(inner, SILL, near)],
        [at(inner, SILL, far), at(outer, SILL, far), at(outer, LINTEL, far), at(inner, LINTEL, far)],
    ] {
        reveals.add_polygon(&side, palette.white);
    }
    room.put("reveals", reveals, Vec3::ZERO);
    let pane = [at(outer, SILL, far), at(outer, SILL, near), at(outer, LINTEL, near), at(outer, LINTEL, far)];
    let view = [vec2(from, 1.0), vec2(from + 0.5, 1.0), vec2(from + 0.5, 0.0), vec2(from, 0.0)];
    room.put("daylight", quad(pane, palette.sky, view), Vec3::ZERO);

    let (wide, middle) = (0.05, (near + far) * 0.5);
    let bar =
        |y: [f32; 2], z: [f32; 2]| (vec3(outer + 0.03, y[0], z[0]), vec3(wide, y[1] - y[0], z[1] - z[0]));
    let (low, high) = (SILL + wide, LINTEL - wide);
    let cross = low + 0.66 * (high - low);
    let frame = [
        bar([SILL, low], [near, far]),
        bar([high, LINTEL], [near, far]),
        bar([low, high], [near, near + wide]),
        bar([low, high], [far - wide, far]),
        bar([low, high], [middle - 0.02, middle + 0.02]),
        bar([cross, cross + 0.04], [near + wide, middle - 0.02]),
        bar([cross, cross + 0.04], [middle + 0.02, far - wide]),
    ];
    room.put("window frame", boxes(&frame, palette.trim, none), Vec3::ZERO);
    let sill = [(vec3(-HALF, SILL - 0.03, near - 0.05), vec3(0.1, 0.03, far - near + 0.1))];
    room.put("sill", boxes(&sill, palette.trim, |_, normal| normal.x < -0.5), Vec3::ZERO);
}

/// Not below the windows, from where no light falls on its edge.
fn skirting(room: &mut Room, palette: &Palette) {
    let (high, thick, along) = (0.09, 0.016, FRONT - BACK - 0.016);
    let boards = [
        (vec3(-HALF, 0.0, BACK), vec3(2.0 * HALF, high, thick)),
        (vec3(HALF - thick, 0.0, BACK + thick), vec3(thick, high, along)),
    ];
    // What lies on the shell.
    let is_hidden = |middle: Vec3, normal: Vec3| {
        let outside = middle + normal * 1e-3;
        outside.y < 0.0 || outside.x.abs() > HALF || outside.z < BACK || outside.z > FRONT
    };
    room.put("skirting", boxes(&boards, palette.trim, is_hidden), Vec3::ZERO);
}

/// A solid sheet in waves before the left wall.
fn curtain([from, to]: [f32; 2], waves: u32, phase: f32, material: MaterialId) -> Mesh {
    const THICK: f32 = 0.012;
    const DEEP: f32 = 0.035;
    let (low, high, count) = (0.03, 2.5, waves * 8);
    let line: Vec<(Vec3, Vec3)> = (0..=count)
        .map(|i| {
            let share = i as f32 / count as f32;
            let (sin, cos) = sin_cos(360.0 * waves as f32 * share + phase);
            let slope = DEEP * cos * TAU * waves as f32 / (to - from);
            (
                vec3(0.1 - HALF + DEEP * sin, 0.0, from + (to - from) * share),
                vec3(1.0, 0.0, -slope).normalize(),
            )
        })
        .collect();
    let mut mesh = Mesh::default();
    let edge = |i: usize, side: f32| line[i].0 + line[i].1 * (THICK * 0.5 * side);
    let up = |p: Vec3, y: f32| p + Vec3::Y * y;
    for i in 0..line.len() - 1 {
        let ring = [edge(i, 1.0), edge(i + 1, 1.0), edge(i + 1, -1.0), edge(i, -1.0)];
        mesh.add_polygon(&[ring[3], ring[2], ring[1], ring[0]].map(|p| up(p, high)), material);
        mesh.add_polygon(&ring.map(|p| up(p, low)), material);
    }
    for (i, order) in [(0, [-1.0, 1.0]), (line.len() - 1, [1.0, -1.0])] {
        let [a, b] = order.map(|side| edge(i, side));
        mesh.add_polygon(&[up(b, low), up(a, low), up(a, high), up(b, high)], material);
    }
    mesh.uvs.clear();
    for side in [1.0, -1.0] {
        let first = mesh.positions.len() as u32;
        for (i, &(_, normal)) in line.iter().enumerate() {
            mesh.positions.extend([up(edge(i, side), low), up(edge(i, side), high)]);
            mesh.normals.extend([normal * side; 2]);
        }
        for i in 0..count {
            let a = first + 2 * i;
            let corners = if side > 0.0 { [a, a + 1, a + 3, a + 2] } else { [a, a + 2, a + 3, a + 1] };
            let [a, b, c, d] = corners;
            mesh.triangles.push(MeshTriangle { vertices: [a, b, c], material });
            mesh.triangles.push(MeshTriangle { vertices: [a, c, d], material });
        }
    }
    mesh
}

/// A picture in its frame on the back wall.
fn picture(room: &mut Room, palette: &Palette, index: usize, at: Vec3) {
    let (half, frame, deep) = (vec2(0.27, 0.36), 0.022, 0.025);
    let bar = |x: f32, y: f32, w: f32, h: f32| (vec3(x, y, 0.0), vec3(w, h, deep));
    let bars = [
        bar(-half.x - frame, -half.y - frame, 2.0 * (half.x + frame), frame),
        bar(-half.x - frame, half.y, 2.0 * (half.x + frame), frame),
        bar(-half.x - frame, -half.y, frame, 2.0 * half.y),
        bar(half.x, -half.y, frame, 2.0 * half.y),
    ];
    room.put("picture frame", boxes(&bars, palette.walnut, |_, normal| normal.z < -0.5), at);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, y)| vec3(half.x * x, half.y * y, 0.012));
    let uvs = [vec2(0.0, 1.0), vec2(1.0, 1.0), vec2(1.0, 0.0), vec2(0.0, 0.0)];
    room.put("picture", quad(corners, palette.pictures[index], uvs), at);
}
