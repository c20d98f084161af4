//! What stands, lies and hangs in the room.

use super::{
    BACK, HALF, HEIGHT, Palette, RUG, Room, SIDEBOARD, TABLE, about_y, boxes, chance, none, shapes, sin_cos,
    tilted,
};
use crate::scene::builtin::teapot;
use crate::scene::{MaterialId, Mesh, MeshTriangle};
use glam::{Quat, Vec2, Vec3, vec2, vec3};

pub fn add(room: &mut Room, palette: &Palette) {
    rug(room, palette, vec3(-0.35, 0.0, 0.15));
    sofa(room, palette, vec3(-0.35, 0.0, -1.82));
    low_table(room, palette, vec3(-0.3, 0.0, 0.1));
    floor_lamp(room, palette, vec3(1.25, 0.0, -1.95));
    lantern(room, palette, vec3(-0.35, 2.08, 0.1));
    pouf(room, palette, vec3(-1.75, 0.0, 1.05));
    plant(room, palette, vec3(-2.35, 0.0, -1.85));
    sideboard(room, palette, vec3(2.25, 0.0, -2.14));
}

/// Points on an arc of an ellipse from one angle to another, in degrees.
fn arc(
    center: [f32; 2],
    radii: [f32; 2],
    [from, to]: [f32; 2],
    steps: u32,
) -> impl Iterator<Item = [f32; 2]> {
    (0..=steps).map(move |i| {
        let (sin, cos) = sin_cos(from + (to - from) * i as f32 / steps as f32);
        [center[0] + radii[0] * cos, center[1] + radii[1] * sin]
    })
}

/// Meshes as one, each where it belongs.
fn together(parts: impl IntoIterator<Item = (Mesh, Vec3, Quat)>) -> Mesh {
    let mut mesh = Mesh::default();
    for (part, at, turned) in parts {
        shapes::append(&mut mesh, &part, at, turned);
    }
    mesh
}

fn rug(room: &mut Room, palette: &Palette, at: Vec3) {
    let half = vec2(1.25, 0.85);
    let low = vec3(-half.x, 0.0005, -half.y);
    let edge = [(low, vec3(2.0 * half.x, RUG - low.y, 2.0 * half.y))];
    room.put("rug edge", boxes(&edge, palette.rug_edge, |_, normal| normal.y.abs() > 0.5), at);
    let mut top = Mesh::default();
    let corners =
        [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(x, z)| vec3(half.x * x, RUG, half.y * z));
    top.add_polygon(&corners, palette.rug);
    room.put("rug", top, at);
}

fn sofa(room: &mut Room, palette: &Palette, at: Vec3) {
    let cloth = palette.cream;
    let soft = |x: f32, y: f32, z: f32, radius: f32| shapes::rounded_box(vec3(x, y, z), radius, 3, cloth);
    let still = Quat::IDENTITY;
    let body = together([
        (soft(2.2, 0.26, 0.86, 0.05), vec3(0.0, 0.14, 0.0), still),
        (soft(0.2, 0.44, 0.86, 0.07), vec3(-1.1, 0.16, 0.0), still),
        (soft(0.2, 0.44, 0.86, 0.07), vec3(1.1, 0.16, 0.0), still),
        (soft(2.2, 0.62, 0.2, 0.07), vec3(0.0, 0.16, -0.38), still),
    ]);
    room.put("sofa", body, at);
    let cushions = [-0.49, 0.49].into_iter().flat_map(|x| {
        [
            (soft(0.965, 0.17, 0.68, 0.06), vec3(x, 0.385, 0.1), still),
            (soft(0.95, 0.44, 0.17, 0.075), vec3(x, 0.535, -0.205), tilted(-12.0, 0.0)),
        ]
    });
    room.put("sofa cushions", together(cushions), at);
    let legs = [(-1.05, -0.36), (-1.05, 0.36), (1.05, -0.36), (1.05, 0.36)];
    let legs =
        legs.map(|(x, z)| (shapes::cylinder(0.022, 0.145, 12, palette.walnut), vec3(x, 0.0, z), still));
    room.put("sofa legs", together(legs), at);
    for (name, size, material, shift, yaw) in [
        ("teal pillow", vec3(0.44, 0.15, 0.44), palette.teal, vec3(-0.74, 0.6, 0.16), 22.0),
        ("mustard pillow", vec3(0.4, 0.14, 0.4), palette.mustard, vec3(0.7, 0.6, 0.15), -14.0),
    ] {
        room.put_turned(name, shapes::pillow(size, 8, material), at + shift, tilted(66.0, yaw));
    }
}

fn low_table(room: &mut Room, palette: &Palette, at: Vec3) {
    let mut outline = vec![[0.0, 0.38], [0.43, 0.38]];
    outline.extend(arc([0.43, 0.39625], [0.016, 0.01625], [-90.0, 90.0], 6).skip(1));
    outline.push([0.0, TABLE]);
    let top = shapes::revolved(&outline, 48, palette.walnut);
    let legs = [30.0, 150.0, 270.0].map(|angle| {
        let (sin, cos) = sin_cos(angle);
        let at = |radius: f32, y: f32| vec3(radius * cos, y, radius * sin);
        (shapes::rod(at(0.34, RUG), at(0.22, 0.385), 0.019, 12, palette.walnut), Vec3::ZERO, Quat::IDENTITY)
    });
    room.put("low table", together([(top, Vec3::ZERO, Quat::IDENTITY)].into_iter().chain(legs)), at);
    let pile = [
        (1, vec3(0.24, 0.034, 0.17), 8.0),
        (4, vec3(0.21, 0.028, 0.15), -14.0),
        (5, vec3(0.18, 0.024, 0.13), 5.0),
    ];
    pile_of_books(room, palette, at + vec3(0.2, TABLE, -0.19), &pile);
    let scale = 0.26;
    let mut pot = teapot(6, palette.porcelain);
    pot.positions.iter_mut().for_each(|p| *p *= scale);
    room.put_turned("teapot", pot, at + vec3(-0.2, TABLE + 0.0005, -0.06), about_y(35.0));
    let mut cup = vec![[0.0, 0.0], [0.022, 0.0], [0.025, 0.004]];
    cup.extend(arc([0.0, 0.062], [0.042, 0.058], [-60.0, 0.0], 6));
    cup.extend([[0.041, 0.066], [0.038, 0.064]]);
    cup.extend(arc([0.0, 0.062], [0.037, 0.052], [-5.0, -70.0], 6));
    cup.push([0.0, 0.011]);
    room.put("cup", shapes::revolved(&cup, 28, palette.glass), at + vec3(-0.02, TABLE + 0.0005, -0.24));
}

fn pile_of_books(room: &mut Room, palette: &Palette, at: Vec3, pile: &[(usize, Vec3, f32)]) {
    let mut y = 0.0005;
    for &(color, size, yaw) in pile {
        let low = vec3(-size.x * 0.5, 0.0, -size.z * 0.5);
        let book = boxes(&[(low, size)], palette.books[color], none);
        room.put_turned("book", book, at + Vec3::Y * y, about_y(yaw));
        y += size.y + 0.0005;
    }
}

fn floor_lamp(room: &mut Room, palette: &Palette, at: Vec3) {
    let mut stand = vec![[0.0, 0.0005], [0.15, 0.0005]];
    stand.extend(arc([0.15, 0.011], [0.006, 0.0105], [-90.0, 90.0], 4).skip(1));
    stand.extend([[0.02, 0.026], [0.012, 0.034], [0.012, 1.42], [0.0, 1.42]]);
    room.put("lamp stand", shapes::revolved(&stand, 32, palette.brass), at);
    let [bottom, top] = [1.22, 1.56];
    let shade = shapes::revolved(&[[0.2, bottom], [0.13, top]], 40, palette.shade);
    room.put("lamp shade", by_height(shade, bottom, top), at);
}

/// With texture coordinates by height: v is 1 at the bottom and 0 at the top.
fn by_height(mut mesh: Mesh, bottom: f32, top: f32) -> Mesh {
    mesh.uvs = mesh.positions.iter().map(|p| [vec2(0.5, (top - p.y) / (top - bottom)); 2]).collect();
    mesh
}

fn lantern(room: &mut Room, palette: &Palette, at: Vec3) {
    let outline: Vec<[f32; 2]> = arc([0.0, 0.0], [0.23, 0.215], [-90.0, 90.0], 22).collect();
    let closed = outline.iter().enumerate().map(|(i, &[r, y])| [if i % 22 == 0 { 0.0 } else { r }, y]);
    let paper = shapes::revolved(&closed.collect::<Vec<_>>(), 32, palette.paper);
    room.put("lantern", by_height(paper, -0.215, 0.215), at);
    let cord = [at + Vec3::Y * 0.213, vec3(at.x, HEIGHT, at.z)];
    room.put("cord", shapes::rod(cord[0], cord[1], 0.004, 6, palette.black), Vec3::ZERO);
}

fn pouf(room: &mut Room, palette: &Palette, at: Vec3) {
    let mut outline = vec![[0.0, 0.0005], [0.22, 0.0005]];
    outline.extend(arc([0.22, 0.19], [0.07, 0.17], [-75.0, 75.0], 10));
    outline.extend([[0.2, 0.375], [0.0, 0.385]]);
    room.put("pouf", shapes::revolved(&outline, 40, palette.mustard), at);
}

fn plant(room: &mut Room, palette: &Palette, at: Vec3) {
    let pot = [
        [0.0, 0.0005],
        [0.14, 0.0005],
        [0.15, 0.008],
        [0.19, 0.34],
        [0.19, 0.36],
        [0.175, 0.36],
        [0.17, 0.33],
        [0.0, 0.33],
    ];
    room.put("plant pot", shapes::revolved(&pot, 32, palette.porcelain), at);
    let (mut stems, mut leaves) = (Mesh::default(), Mesh::default());
    for k in 0..22_u32 {
        let share = k as f32 / 22.0;
        // The golden angle.
        let (sin, cos) = sin_cos(137.508 * k as f32);
        let out = vec3(cos, 0.0, sin);
        let tilt = 0.12 + 0.75 * share;
        let height = (1.55 - 0.75 * share + 0.1 * chance(k, 7, 1)) * 0.72;
        let base = at + Vec3::Y * 0.33;
        let tip = within(base + out * (tilt * 0.62) + Vec3::Y * height, vec2(0.2, 0.16));
        let bend = base + (tip - base) * vec3(0.35, 0.6, 0.35);
        for (from, to, radius) in [(base, bend, 0.006), (bend, tip, 0.005)] {
            shapes::append(
                &mut stems,
                &shapes::rod(from, to, radius, 5, palette.leaf),
                Vec3::ZERO,
                Quat::IDENTITY,
            );
        }
        let along = (out + Vec3::Y * (0.25 - 0.9 * tilt)).normalize();
        let size = vec2(0.3 + 0.08 * chance(k, 7, 2), 0.1 + 0.03 * chance(k, 7, 3));
        shapes::append(&mut leaves, &leaf(tip, along, size, palette.leaf), Vec3::ZERO, Quat::IDENTITY);
    }
    room.put("stems", stems, Vec3::ZERO);
    room.put("leaves", leaves, Vec3::ZERO);
}

/// The place, so far from the left and the back wall at least.
fn within(p: Vec3, margin: Vec2) -> Vec3 {
    vec3(p.x.max(margin.x - HALF), p.y, p.z.max(BACK + margin.y))
}

/// A leaf from its stem along a direction, hanging: length and half its width in metres. Its top is its front.
fn leaf(stem: Vec3, along: Vec3, size: Vec2, material: MaterialId) -> Mesh {
    const STEPS: u32 = 6;
    let side = Vec3::Y.cross(along).normalize();
    let up = along.cross(side);
    let mut mesh = Mesh::default();
    for i in 0..=STEPS {
        let t = i as f32 / STEPS as f32;
        let width = if i == STEPS { 0.0 } else { libm::powf(sin_cos(180.0 * (t * 0.93 + 0.07)).0, 0.8) };
        for across in [-1.0, 0.0, 1.0_f32] {
            // Folded along the middle.
            let lift = 0.018 * width * across.abs();
            let p = stem + along * (size.x * t) + side * (size.y * width * across) + up * lift;
            mesh.positions.push(within(p - Vec3::Y * (0.1 * t * t), vec2(0.14, 0.02)));
            mesh.normals.push((up - side * (0.35 * across) + along * (0.3 * t)).normalize());
        }
    }
    for (i, j) in (0..STEPS).flat_map(|i| (0..2).map(move |j| (i, j))) {
        let a = i * 3 + j;
        if i + 1 < STEPS {
            mesh.triangles.push(MeshTriangle { vertices: [a, a + 3, a + 4], material });
        }
        mesh.triangles.push(MeshTriangle { vertices: [a, a + 4, a + 1], material });
    }
    mesh
}

fn sideboard(room: &mut Room, palette: &Palette, at: Vec3) {
    let board = |low: [f32; 3], size: [f32; 3]| (Vec3::from(low), Vec3::from(size));
    let mut parts = vec![
        board([-0.7, 0.12, -0.22], [1.4, 0.03, 0.44]),
        board([-0.7, 0.6, -0.22], [1.4, 0.03, 0.44]),
        board([-0.7, 0.15, -0.22], [0.03, 0.45, 0.44]),
        board([0.67, 0.15, -0.22], [0.03, 0.45, 0.44]),
        board([-0.67, 0.15, -0.22], [1.34, 0.45, 0.02]),
        board([-0.015, 0.15, -0.2], [0.03, 0.45, 0.4]),
    ];
    for (x, z) in [(-0.64, -0.18), (-0.64, 0.14), (0.6, -0.18), (0.6, 0.14)] {
        parts.push(board([x, 0.0, z], [0.04, 0.12, 0.04]));
    }
    room.put(
        "sideboard",
        boxes(&parts, palette.walnut, |middle, normal| middle.y < 1e-3 && normal.y < 0.0),
        at,
    );
    for (half, from) in [-0.66, 0.02].into_iter().enumerate() {
        let mut x: f32 = from;
        for i in 0.. {
            let share = |what: u32| chance(half as u32, i, 20 + what);
            let size = vec3(0.022 + 0.026 * share(0), 0.26 + 0.12 * share(1), 0.22 + 0.06 * share(2));
            if x + size.x > from + 0.58 {
                break;
            }
            let low = vec3(x, 0.1505, 0.18 - size.z);
            let color = palette.books[(share(3) * 6.99) as usize];
            room.put("book", boxes(&[(low, size)], color, none), at);
            x += size.x + 0.0015;
        }
    }
    let top = at + Vec3::Y * SIDEBOARD;
    let vase = [
        [0.0, 0.0],
        [0.055, 0.0],
        [0.065, 0.008],
        [0.085, 0.05],
        [0.098, 0.1],
        [0.095, 0.15],
        [0.07, 0.2],
        [0.042, 0.235],
        [0.036, 0.26],
        [0.043, 0.285],
        [0.038, 0.287],
        [0.03, 0.26],
        [0.03, 0.24],
        [0.0, 0.23],
    ];
    room.put("vase", shapes::revolved(&vase, 32, palette.porcelain), top - Vec3::X * 0.4);
    pile_of_books(
        room,
        palette,
        top + Vec3::X * 0.28,
        &[(3, vec3(0.26, 0.035, 0.19), 4.0), (0, vec3(0.23, 0.03, 0.17), -8.0)],
    );
    let ball = shapes::sphere(0.07, 24, 12, palette.brass);
    room.put("ball", ball, top + vec3(0.28, 0.0665 + 0.0705, 0.0));
}
