//! Rooms with mouldings, shelves, drawers and frames at random, whose parts meet as modellers let them: no pixel is an outlier.

use crate::common::Stage;
use girandole_core::glam::{Quat, Vec2, Vec3, vec3};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSet, LightSettings};
use girandole_core::scene::{Camera, Material, MaterialId, Mesh, Projection, Transform, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::metrics::{CompareOptions, compare};
use girandole_reference::{OracleSettings, PathSettings, oracle, path_trace};

const SIZE: [u32; 2] = [96, 72];
const ROOMS: u64 = 50;

/// Numbers of one room (SplitMix64, Steele et al. 2014).
struct Random(u64);

impl Random {
    fn between(&mut self, low: f32, high: f32) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * ((z ^ z >> 31) >> 40) as f32 / (1 << 24) as f32
    }

    fn below(&mut self, count: u32) -> u32 {
        (self.between(0.0, count as f32) as u32).min(count - 1)
    }

    /// How far a part reaches into the next one, m: it ends there, overlaps or leaves a gap.
    fn overlap(&mut self) -> f32 {
        [0.0, 1e-3, -1e-4][self.below(3) as usize]
    }
}

/// Boxes of one object, by corners.
fn boxes(stage: &mut Stage, material: MaterialId, at: Transform, boxes: &[(Vec3, Vec3)]) {
    let mut mesh = Mesh::default();
    for &(low, high) in boxes {
        mesh.add_box(low, high, material);
    }
    stage.scene.add_object("", mesh, at);
}

/// Where things stand along a wall: −z is into the wall.
fn beside_wall(half: Vec3, wall: u32, along: f32, up: f32) -> Transform {
    let turn = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2 * wall as f32);
    let depth = if wall.is_multiple_of(2) { half.z } else { half.x };
    Transform::rigid(turn, turn * vec3(along, up, -depth))
}

fn moulding(stage: &mut Stage, random: &mut Random, half: Vec3, height: f32, material: MaterialId) {
    let (step, count, into) = (random.between(0.01, 0.05), 2 + random.below(3), random.overlap());
    for wall in 0..4u32 {
        let length = if wall.is_multiple_of(2) { half.x } else { half.z };
        let steps: Vec<(Vec3, Vec3)> = (0..count)
            .map(|i| {
                let [deep, low] = [(i + 1) as f32, (count - i) as f32].map(|n| n * step);
                (vec3(-length - into, -low, -into), vec3(length + into, -low + step + into, deep))
            })
            .collect();
        boxes(stage, material, beside_wall(half, wall, 0.0, height), &steps);
    }
}

fn shelf(random: &mut Random) -> Vec<(Vec3, Vec3)> {
    let (width, deep, high) = (random.between(0.3, 0.8), random.between(0.2, 0.4), random.between(1.0, 2.0));
    let (thick, into) = (random.between(0.01, 0.03), random.overlap());
    let mut parts = vec![
        (vec3(-width, 0.0, into.max(0.0)), vec3(-width + thick, high, deep)),
        (vec3(width - thick, 0.0, into.max(0.0)), vec3(width, high, deep)),
    ];
    let count = 3 + random.below(4);
    for i in 0..=count {
        let y = (high - thick) * i as f32 / count as f32;
        let end = width - thick + into;
        parts.push((vec3(-end, y, 0.005), vec3(end, y + thick, deep)));
    }
    parts
}

fn drawers(random: &mut Random) -> Vec<(Vec3, Vec3)> {
    let (width, deep, gap) =
        (random.between(0.3, 0.6), random.between(0.35, 0.5), random.between(0.002, 0.008));
    let (count, tall) = (2 + random.below(3), random.between(0.18, 0.3));
    let high = count as f32 * tall + gap;
    let mut parts = vec![(vec3(-width, 0.0, 0.01), vec3(width, high + 0.02, deep))];
    for i in 0..count {
        let y = i as f32 * tall + gap;
        parts.push((vec3(-width + gap, y, deep), vec3(width - gap, y + tall - gap, deep + 0.02)));
    }
    parts.push((vec3(-width - 0.02, high + 0.02, 0.0), vec3(width + 0.02, high + 0.05, deep + 0.03)));
    parts
}

fn frame(random: &mut Random) -> Vec<(Vec3, Vec3)> {
    let (x, y) = (random.between(0.2, 0.6), random.between(0.2, 0.5));
    let (wide, deep, into) = (random.between(0.02, 0.06), random.between(0.01, 0.05), random.overlap());
    vec![
        (vec3(-x, -y, 0.0), vec3(x, y, 0.004)),
        (vec3(-x - wide, -y - wide, -into), vec3(-x, y + wide, deep)),
        (vec3(x, -y - wide, -into), vec3(x + wide, y + wide, deep)),
        (vec3(-x - into, y, 0.0), vec3(x + into, y + wide, deep)),
        (vec3(-x - into, -y - wide, 0.0), vec3(x + into, -y, deep)),
    ]
}

fn room(seed: u64) -> Stage {
    let mut random = Random(seed);
    let mut stage = Stage::default();
    let half = vec3(random.between(1.5, 3.5), 0.0, random.between(1.5, 3.5));
    let height = random.between(2.4, 3.3);
    let mut matte = |stage: &mut Stage, low: f32, high: f32| {
        let colour = Vec3::from_array([0; 3].map(|_| random.between(low, high)));
        stage.material(Material::diffuse("matte", colour))
    };
    let [walls, white, wood, dark] =
        [[0.4, 0.8], [0.7, 0.8], [0.2, 0.6], [0.05, 0.3]].map(|[low, high]| matte(&mut stage, low, high));
    stage.room(-half, half.with_y(height), walls);
    moulding(&mut stage, &mut random, half, height, white);
    for wall in 0..4u32 {
        let length = if wall.is_multiple_of(2) { half.x } else { half.z } - 0.9;
        let along = random.between(-length, length);
        let (parts, material) = match random.below(3) {
            0 => (shelf(&mut random), wood),
            1 => (drawers(&mut random), wood),
            _ => (shelf(&mut random), dark),
        };
        boxes(&mut stage, material, beside_wall(half, wall, along, 0.0), &parts);
        let up = random.between(1.5, height - 0.8);
        boxes(&mut stage, dark, beside_wall(half, wall, -along, up), &frame(&mut random));
    }
    for _ in 0..1 + random.below(4) {
        let light = stage.material(Material::emitter("light", Vec3::splat(random.between(4.0, 20.0))));
        let side = [random.between(0.05, 0.5), random.between(0.05, 0.5)];
        let mut face = |corner: Vec3, u: Vec3, v: Vec3| stage.quad(corner, u, v, light);
        let x = random.between(-half.x + 0.3, half.x - 0.8);
        let z = random.between(-half.z + 0.3, half.z - 0.8);
        match random.below(3) {
            // Below the ceiling, upwards near the moulding, in a wall.
            0 => face(vec3(x, height - 0.02, z), Vec3::X * side[0], Vec3::Z * side[1]),
            1 => {
                let (y, z) = (height - random.between(0.2, 0.5), 0.05 - half.z);
                face(vec3(x, y, z), Vec3::Z * 0.1, Vec3::X * side[1]);
            }
            _ => {
                let y = random.between(1.0, height - 0.7);
                face(vec3(x, y, 0.01 - half.z), Vec3::X * side[0], Vec3::Y * side[1]);
            }
        }
    }
    let eye = vec3(half.x - 0.5, random.between(1.2, 2.0), half.z - 0.5);
    let target = vec3(random.between(-half.x, 0.0), random.between(0.5, height), -half.z);
    let node = stage.scene.add_node("camera", Transform::looking_at(eye, target));
    stage.scene.cameras.push(Camera {
        name: "camera".into(),
        node,
        projection: Projection::Perspective { yfov: 1.1 },
        clip: Default::default(),
    });
    stage
}

/// Pixels that show no emitter and are five times as bright as the middle one of those about them.
fn are_suspicious(stage: &Stage, tracer: &SceneTracer, view: &View, image: &Image) -> bool {
    let view = view.relative_to(tracer.geometry().origin);
    (0..image.pixels.len()).any(|i| {
        let [x, y] = [i as u32 % SIZE[0], i as u32 / SIZE[0]];
        let about = |at: u32, end: u32| at.saturating_sub(2)..(at + 3).min(end);
        let mut near: Vec<f32> = about(y, SIZE[1])
            .flat_map(|y| about(x, SIZE[0]).map(move |x| (y * SIZE[0] + x) as usize))
            .map(|i| image.pixels[i].max_element())
            .collect();
        near.sort_by(f32::total_cmp);
        let (origin, direction) = view.pixel_ray(Vec2::new(x as f32, y as f32) + 0.5, SIZE);
        image.pixels[i].max_element() > 5.0 * near[near.len() / 2] + 0.1
            && tracer.closest_visible(origin, direction).is_some_and(|hit| {
                let material = tracer.geometry().triangles[hit.triangle as usize].material;
                !stage.scene.materials[material].emits()
            })
    })
}

/// Outliers of a room's picture; the truth is asked only where something looks like one.
fn outliers(seed: u64, count: u32, clamp: Clamp) -> usize {
    let stage = room(seed);
    let geometry = stage.geometry();
    let tracer = SceneTracer::new(&stage.scene, &geometry);
    let view = View::new(&stage.scene, &stage.scene.cameras[0], SIZE[0] as f32 / SIZE[1] as f32);
    let lights = LightSettings { count, bounces: 4, seed: seed as u32, ..LightSettings::default() };
    let set = LightSet::sample_for(&stage.scene, &geometry, &lights, &[view]).expect("light");
    let settings = OracleSettings { clamp, ..OracleSettings::default() };
    let picture = oracle(&tracer, &set, &view, SIZE, &settings, &|_| {});
    if !are_suspicious(&stage, &tracer, &view, &picture) {
        return 0;
    }
    let settings = PathSettings { paths: 64, bounces: Some(4), seed: 1 };
    let truth = path_trace(&tracer, &view, SIZE, &settings, &|_| {}).mean;
    compare(&truth, &picture, &CompareOptions::default()).expect("comparable").outliers
}

#[test]
fn no_pixel_is_an_outlier() {
    let rooms = (0..ROOMS).map(|seed| (seed, 300)).chain((0..ROOMS).step_by(10).map(|seed| (seed, 1024)));
    let found: Vec<_> = rooms.filter(|&(seed, count)| outliers(seed, count, Clamp::Own) > 0).collect();
    assert!(found.is_empty(), "rooms and samples with outliers: {found:?}");
    let control = (0..5).filter(|&seed| outliers(seed, 300, Clamp::Off) > 0).count();
    assert!(control > 2, "negative control: points of light leave outliers in {control} of 5 rooms");
}
