//! Four rooms with what is hard to light in rooms that people have: sun through blinds, mouldings that are put
//! together as modellers do, grooves, many lamps far away.

use super::rooms::Room;
use super::{MovingObject, shapes};
use crate::Result;
use crate::scene::{
    Environment, Material, MaterialId, Mesh, PunctualKind, PunctualLight, Scene, Sky, Transform,
};
use glam::{Quat, Vec3, vec3};

const WHITE: Vec3 = Vec3::new(0.74, 0.73, 0.7);
const WOOD: Vec3 = Vec3::new(0.5, 0.34, 0.21);
const GREY: Vec3 = Vec3::new(0.5, 0.5, 0.5);
const RED: Vec3 = Vec3::new(0.62, 0.08, 0.06);
const BLUE: Vec3 = Vec3::new(0.08, 0.14, 0.62);
const GREEN: Vec3 = Vec3::new(0.1, 0.45, 0.1);
const WARM: Vec3 = Vec3::new(1.0, 0.93, 0.82);

/// Boxes with all six faces, as modellers leave them, each by its lowest corner and size.
fn add_boxes(room: &mut Room, name: &str, color: Vec3, boxes: &[(Vec3, Vec3)]) {
    let material = room.diffuse(color);
    let mut mesh = Mesh::default();
    for &(low, size) in boxes {
        mesh.add_box(low, low + size, material);
    }
    room.add(name, mesh, Vec3::ZERO);
}

/// Where the window of `blinds` is in height and along its wall, and how thick the wall is.
const WINDOW_HEIGHT: [f32; 2] = [0.8, 2.1];
const WINDOW_ALONG: [f32; 2] = [-0.2, 1.4];
const WALL: f32 = 0.2;
/// Width and thickness of a slat, and how far apart they are.
const SLAT: [f32; 2] = [0.05, 0.0025];
const PITCH: f32 = 0.044;
/// Degrees by which the inner edges of slats are lower.
const TILT: f32 = 10.0;

/// A room that the sun reaches through the slats of a blind.
pub(super) fn blinds(object: MovingObject) -> Result<Scene> {
    let mut room = Room::new("blinds", 1.6, 2.5, 2.2, [WHITE; 4]);
    let white = room.diffuse(WHITE);
    let wall =
        room.scene.objects.iter().position(|o| o.name == "left wall").map(|i| room.scene.objects[i].mesh);
    if let Some(mesh) = wall {
        let name = std::mem::take(&mut room.scene.meshes[mesh].name);
        room.scene.meshes[mesh] = Mesh { name, ..window_wall(&room, white) };
    }
    let reveals = reveals(&room, white);
    room.add("reveals", reveals, Vec3::ZERO);
    let blind = blind(&room, white);
    room.add("blind", blind, Vec3::ZERO);
    room.boxes("chest", WOOD, vec3(0.75, 0.0, -0.5), 0.0, &[(vec3(-0.3, 0.0, -0.35), vec3(0.6, 0.4, 0.7))]);
    let red = room.diffuse(RED);
    room.add("ball", shapes::sphere(0.14, 32, 16, red), vec3(0.75, 0.541, -0.3));
    let sky = Sky { elevation: 24.0_f32.to_radians(), azimuth: 250.0_f32.to_radians(), turbidity: 3.0 };
    // Exposed for the room.
    room.scene.environment = Some(Environment { strength: 0.2, ..Environment::sky(&sky)? });
    let path = [
        vec3(0.1, 0.5, 0.6),
        vec3(0.3, 0.8, 1.0),
        vec3(-0.3, 0.9, 1.3),
        vec3(-0.8, 0.7, 0.7),
        vec3(-0.9, 0.6, -0.1),
        vec3(-0.7, 0.4, -0.7),
        vec3(-0.3, 0.3, -0.3),
    ];
    room.moving(object, vec3(-0.1, 0.001, 0.2), 20.0, 0.4, path)?;
    room.camera("blinds", vec3(-1.1, 1.5, 1.9), vec3(0.75, 0.45, -0.75), 58.0);
    room.camera("window", vec3(1.35, 1.3, -0.6), vec3(-1.6, 1.2, 0.55), 60.0);
    Ok(room.scene)
}

/// The left wall of a room around its window.
fn window_wall(room: &Room, material: MaterialId) -> Mesh {
    let ([near, far], [low, high]) = (WINDOW_ALONG, WINDOW_HEIGHT);
    let (columns, rows) = ([-room.half.z, near, far, room.half.z], [0.0, low, high, room.height]);
    let mut mesh = Mesh::default();
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).filter(|&place| place != (1, 1)) {
        let corner = |z: usize, y: usize| vec3(-room.half.x, rows[y], columns[z]);
        mesh.add_polygon(&[corner(i + 1, j), corner(i, j), corner(i, j + 1), corner(i + 1, j + 1)], material);
    }
    mesh
}

/// What is seen of the wall's thickness in its window.
fn reveals(room: &Room, material: MaterialId) -> Mesh {
    let ([near, far], [low, high]) = (WINDOW_ALONG, WINDOW_HEIGHT);
    let (inner, outer) = (-room.half.x, -room.half.x - WALL);
    let mut mesh = Mesh::default();
    for side in [
        [vec3(outer, low, near), vec3(outer, low, far), vec3(inner, low, far), vec3(inner, low, near)],
        [vec3(inner, high, near), vec3(inner, high, far), vec3(outer, high, far), vec3(outer, high, near)],
        [vec3(inner, high, near), vec3(outer, high, near), vec3(outer, low, near), vec3(inner, low, near)],
        [vec3(inner, low, far), vec3(outer, low, far), vec3(outer, high, far), vec3(inner, high, far)],
    ] {
        mesh.add_polygon(&side, material);
    }
    mesh
}

/// Slats between a head rail and a bottom rail, in the middle of the wall's thickness.
fn blind(room: &Room, material: MaterialId) -> Mesh {
    let ([near, far], [low, high]) = (WINDOW_ALONG, WINDOW_HEIGHT);
    let (x, from, length) = (-room.half.x - 0.5 * WALL, near + 0.005, far - near - 0.01);
    let rail = 0.04;
    let mut mesh = Mesh::default();
    mesh.add_box(vec3(x - 0.025, high - rail, from), vec3(x + 0.025, high - 0.002, from + length), material);
    let count = ((high - low - 2.0 * rail) / PITCH).floor();
    let last = high - rail - count * PITCH;
    for i in 1..=count as u32 {
        let middle = vec3(x, high - rail - i as f32 * PITCH + 0.5 * PITCH, from);
        add_slat(&mut mesh, middle, length, material);
    }
    mesh.add_box(vec3(x - 0.025, low + 0.005, from), vec3(x + 0.025, last, from + length), material);
    mesh
}

/// A slat along +Z from the middle of its end.
fn add_slat(mesh: &mut Mesh, middle: Vec3, length: f32, material: MaterialId) {
    let half = f64::from(-TILT).to_radians() * 0.5;
    let turned = Quat::from_xyzw(0.0, 0.0, libm::sin(half) as f32, libm::cos(half) as f32);
    let size = vec3(SLAT[0], SLAT[1], 0.0) * 0.5;
    let mut straight = Mesh::default();
    straight.add_box(-size, size + Vec3::Z * length, material);
    for patch in &straight.patches {
        let corners = patch.outline.iter().map(|&v| middle + turned * straight.positions[v as usize]);
        mesh.add_polygon(&corners.collect::<Vec<_>>(), material);
    }
}

/// Height and depth of the moulding's three steps from the bottom, out of the wall.
const STEPS: [[f32; 2]; 3] = [[0.05, 0.03], [0.04, 0.06], [0.06, 0.1]];
const MILLIMETRE: f32 = 0.001;

/// A room with a stepped moulding under its ceiling and picture frames. Pieces meet as modellers make them: butted,
/// overlapping, with a gap, in one plane with others, without thickness.
pub(super) fn moulding(object: MovingObject) -> Result<Scene> {
    let mut room = Room::new("moulding", 2.2, 2.7, 1.9, [WHITE, WHITE, GREEN, WHITE]);
    let (x, z, top) = (room.half.x, room.half.z, room.height);
    // Bottom and depth of each step.
    let mut bottom = top - STEPS.iter().map(|step| step[0]).sum::<f32>();
    for (i, [height, depth]) in STEPS.into_iter().enumerate() {
        let step = |low: Vec3, along: Vec3, inward: Vec3| {
            let size = along + inward.abs() * depth + Vec3::Y * height;
            (low + inward.min(Vec3::ZERO) * depth + Vec3::Y * bottom, size)
        };
        // Along the back wall in two pieces that overlap by a millimetre, and its first again in the same place.
        let (left, right) = (vec3(-x, 0.0, -z), vec3(-MILLIMETRE, 0.0, -z));
        let back = step(left, Vec3::X * x, Vec3::Z);
        let pieces = [back, back, step(right, Vec3::X * (x + MILLIMETRE), Vec3::Z)];
        add_boxes(&mut room, &format!("back moulding {}", i + 1), WHITE, &pieces);
        // Along the left wall into the back one's end, along the right one a tenth of a millimetre before it.
        add_boxes(
            &mut room,
            &format!("left moulding {}", i + 1),
            WHITE,
            &[step(vec3(-x, 0.0, -z), Vec3::Z * 2.0 * z, Vec3::X)],
        );
        let gap = depth + 0.1 * MILLIMETRE;
        add_boxes(
            &mut room,
            &format!("right moulding {}", i + 1),
            WHITE,
            &[step(vec3(x, 0.0, gap - z), Vec3::Z * (2.0 * z - gap), Vec3::NEG_X)],
        );
        // Along the front wall butted against both.
        add_boxes(
            &mut room,
            &format!("front moulding {}", i + 1),
            WHITE,
            &[step(vec3(depth - x, 0.0, z), Vec3::X * 2.0 * (x - depth), Vec3::NEG_Z)],
        );
        bottom += height;
    }
    picture_frames(&mut room);
    uplights(&mut room);
    room.light("light", [0.6, 0.1], [0.7, 0.7], WARM * 12.0);
    room.boxes(
        "sideboard",
        WOOD,
        vec3(0.2, 0.0, -1.65),
        0.0,
        &[(vec3(-0.8, 0.0, -0.22), vec3(1.6, 0.7, 0.44))],
    );
    let path = [
        vec3(0.6, 0.4, 0.6),
        vec3(1.1, 0.7, 0.2),
        vec3(0.7, 1.0, -0.6),
        vec3(-0.4, 1.1, -0.7),
        vec3(-1.1, 0.9, -0.2),
        vec3(-1.0, 0.6, 0.5),
        vec3(-0.4, 0.4, 0.7),
    ];
    room.moving(object, vec3(0.1, 0.001, 0.4), 20.0, 0.4, path)?;
    room.camera("moulding", vec3(1.45, 1.4, 1.7), vec3(-0.75, 1.9, -1.7), 58.0);
    room.camera("corner", vec3(-0.85, 2.15, -0.65), vec3(-2.1, 2.55, -1.85), 45.0);
    room.camera("frames", vec3(0.65, 1.5, 0.6), vec3(-0.2, 1.6, -1.9), 55.0);
    Ok(room.scene)
}

/// Four pictures in the back wall's middle: sheets without thickness, a centimetre before the wall, in frames of four
/// bars, whose back lies in the wall's plane.
fn picture_frames(room: &mut Room) {
    let (z, wide, deep) = (-room.half.z, 0.04, 0.025);
    for (i, color) in [RED, BLUE, GREY, WOOD].into_iter().enumerate() {
        let (low, size) = (vec3(-1.5 + 0.75 * i as f32, 1.35, z), vec3(0.55, 0.7, deep));
        let inner = low + vec3(wide, wide, 0.0);
        let (across, up) = (size.x - 2.0 * wide, size.y - 2.0 * wide);
        // Bars that butt, overlap, leave a gap; every other frame's mitres are such that all four bars overlap.
        let bars = match i % 2 {
            0 => [
                (low, vec3(size.x, wide, deep)),
                (low + Vec3::Y * (size.y - wide), vec3(size.x, wide, deep)),
                (low + Vec3::Y * wide, vec3(wide, up, deep)),
                (
                    low + vec3(size.x - wide, wide + 0.1 * MILLIMETRE, 0.0),
                    vec3(wide, up - 0.2 * MILLIMETRE, deep),
                ),
            ],
            _ => [
                (low, vec3(size.x, wide, deep)),
                (low + Vec3::Y * (size.y - wide), vec3(size.x, wide, deep)),
                (low, vec3(wide, size.y, deep)),
                (low + Vec3::X * (size.x - wide), vec3(wide, size.y, deep)),
            ],
        };
        add_boxes(room, &format!("frame {}", i + 1), WOOD, &bars);
        let at = inner + Vec3::Z * 0.01;
        let corners = [at, at + Vec3::X * across, at + vec3(across, up, 0.0), at + Vec3::Y * up];
        let material = room.diffuse(color);
        let mut sheet = Mesh::default();
        sheet.add_polygon(&corners, material);
        let [a, b, c, d] = corners;
        sheet.add_polygon(&[d, c, b, a], material);
        room.add(&format!("picture {}", i + 1), sheet, Vec3::ZERO);
    }
}

/// Lamps on the left wall, a hand's breadth below the moulding, that shine up: an open trough each, with its light in it.
fn uplights(room: &mut Room) {
    let light = room.scene.add_material(Material::emitter("uplight", WARM * 25.0));
    for (i, z) in [-0.9, 0.5].into_iter().enumerate() {
        let low = vec3(-room.half.x, 2.3, z - 0.2);
        let wall = 0.01;
        let (deep, long) = (0.1, 0.4);
        add_boxes(
            room,
            &format!("trough {}", i + 1),
            GREY,
            &[
                (low, vec3(deep, wall, long)),
                (low + vec3(deep - wall, wall, 0.0), vec3(wall, 0.05, long)),
                (low + vec3(0.0, wall, 0.0), vec3(deep - wall, 0.05, wall)),
                (low + vec3(0.0, wall, long - wall), vec3(deep - wall, 0.05, wall)),
            ],
        );
        let at = low + vec3(0.0, 0.04, wall);
        let (out, along) = (Vec3::X * (deep - wall), Vec3::Z * (long - 2.0 * wall));
        let mut face = Mesh::default();
        face.add_polygon(&[at, at + along, at + along + out, at + out], light);
        room.add(&format!("uplight {}", i + 1), face, Vec3::ZERO);
    }
}

/// Gaps about the drawers of `shelf`, and width and depth of its grooves.
const DRAWER_GAP: f32 = 0.003;
const GROOVE: [f32; 2] = [0.006, 0.005];

/// A shelf of grooved boards above drawers with narrow gaps, lit by lamps.
pub(super) fn shelf(object: MovingObject) -> Result<Scene> {
    let mut room = Room::new("shelf", 1.8, 2.5, 1.7, [WHITE, BLUE, WHITE, WHITE]);
    let z = -room.half.z;
    let (low, width, deep) = (vec3(-1.0, 0.0, z), 2.0, 0.4);
    let (board, height, base) = (0.025, 1.9, 0.85);
    let mut boards = vec![
        (low, vec3(board, height, deep)),
        (low + Vec3::X * (width - board), vec3(board, height, deep)),
        (low + vec3(board, base, 0.0), vec3(width - 2.0 * board, board, deep)),
    ];
    for y in [1.2, 1.54, height - board] {
        boards.push((low + vec3(board, y, 0.0), vec3(width - 2.0 * board, board, 0.75 * deep)));
    }
    add_boxes(&mut room, "boards", WOOD, &boards);
    grooved_back(
        &mut room,
        low + vec3(board, base + board, 0.0),
        width - 2.0 * board,
        height - base - 2.0 * board,
    );
    drawers(&mut room, low + vec3(board, 0.0, 0.0), vec3(width - 2.0 * board, base, deep));
    furnish(&mut room, low + Vec3::X * board);
    let path = [
        vec3(0.6, 0.5, 0.3),
        vec3(0.9, 0.8, -0.2),
        vec3(0.5, 1.0, -0.6),
        vec3(-0.3, 1.0, -0.7),
        vec3(-0.9, 0.8, -0.4),
        vec3(-0.9, 0.5, 0.1),
        vec3(-0.4, 0.3, 0.4),
    ];
    room.moving(object, vec3(0.1, 0.001, 0.2), 20.0, 0.4, path)?;
    room.camera("shelf", vec3(0.75, 1.45, 1.4), vec3(-0.1, 0.95, -1.4), 60.0);
    room.camera("drawers", vec3(-0.9, 1.1, 0.1), vec3(-0.2, 0.5, -1.35), 45.0);
    Ok(room.scene)
}

/// A back of upright boards with grooves between them.
fn grooved_back(room: &mut Room, low: Vec3, width: f32, height: f32) {
    let count = 15;
    let pitch = width / count as f32;
    let mut boxes = vec![(low, vec3(width, height, 0.01))];
    for i in 0..count {
        let at = low + vec3(pitch * i as f32 + 0.5 * GROOVE[0], 0.0, 0.01);
        boxes.push((at, vec3(pitch - GROOVE[0], height, GROOVE[1])));
    }
    add_boxes(room, "back", WHITE, &boxes);
}

/// Three rows of four drawers before a dark carcass, with knobs.
fn drawers(room: &mut Room, low: Vec3, size: Vec3) {
    let (front, plinth) = (0.02, 0.06);
    add_boxes(room, "carcass", WOOD, &[(low, size - Vec3::Z * front)]);
    let grey = room.diffuse(GREY);
    let knob = shapes::sphere(0.014, 16, 8, grey);
    let cell = vec3(size.x / 4.0, (size.y - plinth) / 3.0, 0.0);
    for (row, column) in (0..3).flat_map(|row| (0..4).map(move |column| (row, column))) {
        let at = low + vec3(column as f32, row as f32, 0.0) * cell + vec3(0.0, plinth, size.z - front);
        let gap = Vec3::splat(0.5 * DRAWER_GAP).with_z(0.0);
        let extent = vec3(cell.x - DRAWER_GAP, cell.y - DRAWER_GAP, front);
        let name = format!("drawer {}", row * 4 + column + 1);
        add_boxes(room, &name, WHITE, &[(at + gap, extent)]);
        let middle = at + 0.5 * cell + Vec3::Z * (front + 0.016);
        room.add(&format!("knob of {name}"), knob.clone(), middle);
    }
}

/// A lamp on the shelf, one under the ceiling, a strip under a board, and what stands on the boards.
fn furnish(room: &mut Room, low: Vec3) {
    room.light("light", [0.5, 0.5], [0.5, 0.5], WARM * 14.0);
    let glow = room.scene.add_material(Material::emitter("glow", WARM * 18.0));
    room.add("lamp", shapes::sphere(0.06, 24, 12, glow), low + vec3(0.3, 1.1, 0.25));
    room.boxes(
        "lamp foot",
        GREY,
        low + vec3(0.3, 0.8751, 0.25),
        0.0,
        &[(vec3(-0.03, 0.0, -0.03), vec3(0.06, 0.16, 0.06))],
    );
    let mut strip = Mesh::default();
    let (at, along, across) = (low + vec3(0.2, 1.535, 0.2), Vec3::X * 1.5, Vec3::Z * 0.02);
    strip.add_polygon(&[at, at + along, at + along + across, at + across], glow);
    room.add("strip", strip, Vec3::ZERO);
    for i in 0..9 {
        let (wide, tall) = (0.03 + 0.006 * (i % 3) as f32, 0.2 + 0.02 * (i % 4) as f32);
        let color = [RED, GREEN, BLUE, GREY][i % 4];
        let at = low + vec3(1.0 + 0.055 * i as f32, 1.2251, 0.16);
        room.boxes(
            &format!("book {}", i + 1),
            color,
            at,
            0.0,
            &[(vec3(0.0, 0.0, -0.07), vec3(wide, tall, 0.14))],
        );
    }
    let white = room.diffuse(WHITE);
    room.add("bowl", shapes::cylinder(0.1, 0.08, 32, white), low + vec3(1.4, 0.8751, 0.2));
}

/// Lamps of `hall` across and along, and how high the rims of their shades hang.
const LAMPS: [u32; 2] = [10, 10];
const RIM: f32 = 1.25;

/// A hall with a hundred lamps that hang from its ceiling, a point of light in each shade.
pub(super) fn hall(object: MovingObject) -> Result<Scene> {
    let mut room = Room::new("hall", 10.0, 5.0, 15.0, [WHITE; 4]);
    for (i, z) in [-10.5, -4.5, 1.5, 7.5].into_iter().enumerate() {
        for (j, x) in [-5.0, 5.0].into_iter().enumerate() {
            let shaft = vec3(0.5, room.height, 0.5);
            let name = format!("pillar {}", 2 * i + j + 1);
            room.boxes(&name, WHITE, vec3(x, 0.0, z), 0.0, &[(vec3(-0.25, 0.0, -0.25), shaft)]);
        }
    }
    for (i, (x, z, length)) in [(-8.0, -6.0, 4.0), (8.0, 0.0, 4.0), (-7.0, 6.0, 5.0)].into_iter().enumerate()
    {
        let size = vec3(length, 1.8, 0.1);
        room.boxes(
            &format!("partition {}", i + 1),
            WOOD,
            vec3(x, 0.0, z),
            0.0,
            &[(vec3(-0.5 * length, 0.0, -0.05), size)],
        );
    }
    let enamel = room.diffuse(GREY);
    // From its inside by the rim to its outside.
    let outline = [
        [0.0, 0.076],
        [0.03, 0.076],
        [0.03, 0.076],
        [0.196, 0.0],
        [0.196, 0.0],
        [0.2, 0.0],
        [0.2, 0.0],
        [0.03, 0.08],
        [0.03, 0.08],
        [0.0, 0.08],
    ];
    let shade = shapes::revolved(&outline, 24, enamel);
    let cord = shapes::rod(Vec3::Y * 0.08, Vec3::Y * (room.height - RIM), 0.006, 5, enamel);
    let mut pendant = shade;
    shapes::append(&mut pendant, &cord, Vec3::ZERO, Quat::IDENTITY);
    let [across, along] = LAMPS;
    for (i, j) in (0..along).flat_map(|i| (0..across).map(move |j| (i, j))) {
        let place = vec3(-9.0 + 2.0 * j as f32, RIM, 12.2 - 2.9 * i as f32);
        let name = format!("lamp {}", i * across + j + 1);
        room.add(&name, pendant.clone(), place);
        let node = room.scene.add_node(&name, Transform::translation(place));
        room.scene.lights.push(PunctualLight {
            name,
            node,
            kind: PunctualKind::Point,
            intensity: WARM * 6.0,
        });
    }
    let path = [
        vec3(0.6, 0.3, 8.0),
        vec3(1.2, 0.4, 7.0),
        vec3(0.8, 0.5, 6.0),
        vec3(-0.4, 0.5, 6.0),
        vec3(-1.4, 0.4, 7.0),
        vec3(-1.0, 0.3, 8.0),
        vec3(-0.4, 0.2, 8.6),
    ];
    room.moving(object, vec3(0.2, 0.001, 8.5), 20.0, 0.5, path)?;
    room.camera("hall", vec3(1.2, 1.7, 14.6), vec3(-0.6, 1.1, 0.0), 55.0);
    room.camera("across", vec3(9.4, 2.6, 3.2), vec3(-4.0, 0.6, -2.0), 60.0);
    Ok(room.scene)
}
