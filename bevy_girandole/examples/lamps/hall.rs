//! The hall.

use crate::options::Options;
use bevy::prelude::*;
use std::f32::consts::TAU;

pub const EYE: [f32; 3] = [0.0, 2.6, 8.6];
pub const TARGET: [f32; 3] = [0.0, 1.0, 0.0];
/// Vertical angle of view, radians.
pub const FOV: f32 = 0.85;
pub const EV100: f32 = 7.0;
/// Lumens of all lamps together.
const LUMENS: f32 = 120_000.0;
/// Farther than that nothing is: Bevy's lamps end at a range, Girandole's do not.
const RANGE: f32 = 1000.0;

/// The circle that a cube goes.
#[derive(Component)]
pub struct Way {
    center: Vec3,
    radius: f32,
    phase: f32,
}

pub fn build(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    options: Res<Options>,
) {
    let mut paint = |r, g, b, roughness| {
        materials.add(StandardMaterial {
            base_color: Color::linear_rgb(r, g, b),
            perceptual_roughness: roughness,
            reflectance: 0.3,
            ..default()
        })
    };
    let stone = paint(0.6, 0.57, 0.52, 0.9);
    let floor = paint(0.45, 0.42, 0.4, 0.85);
    let [red, blue] = [paint(0.65, 0.12, 0.08, 0.9), paint(0.08, 0.16, 0.6, 0.9)];
    let mut add = |size: Vec3, center: Vec3, material: &Handle<StandardMaterial>| {
        commands
            .spawn((
                Mesh3d(meshes.add(Cuboid::from_size(size))),
                MeshMaterial3d(material.clone()),
                Transform::from_translation(center),
            ))
            .id()
    };
    add(vec3(14.0, 0.2, 14.0), vec3(0.0, -0.1, 0.0), &floor);
    add(vec3(14.0, 0.2, 14.0), vec3(0.0, 4.1, 0.0), &stone);
    add(vec3(14.0, 4.0, 0.2), vec3(0.0, 2.0, -7.0), &stone);
    add(vec3(0.2, 4.0, 14.0), vec3(-7.0, 2.0, 0.0), &red);
    add(vec3(0.2, 4.0, 14.0), vec3(7.0, 2.0, 0.0), &blue);
    for i in 0..9 {
        let place = vec3((i % 3) as f32 * 3.6 - 3.6, 0.0, (i / 3) as f32 * 3.4 - 4.6);
        add(vec3(0.45, 4.0, 0.45), place + Vec3::Y * 2.0, &stone);
        add(vec3(0.8, 0.3, 0.8), place + Vec3::Y * 0.15, &stone);
    }
    let cubes = [(red, 1.9, 0.0), (blue, 3.3, 0.5)].map(|(material, radius, phase)| {
        let way = Way { center: vec3(0.0, 0.75, 1.2), radius, phase };
        (add(Vec3::splat(0.9), way.center, &material), way)
    });
    for (cube, way) in cubes {
        commands.entity(cube).insert(way);
    }
    let across = (options.lamps as f32).sqrt().ceil().max(1.0) as u32;
    for i in 0..options.lamps {
        let place = |at: u32| ((at as f32 + 0.5) / across as f32 - 0.5) * 12.4;
        let hue = 360.0 * (i as f32 * 0.618).fract();
        commands.spawn((
            PointLight {
                color: Color::hsl(hue, 0.55, 0.75),
                intensity: LUMENS / options.lamps as f32,
                range: RANGE,
                shadow_maps_enabled: true,
                ..default()
            },
            Transform::from_xyz(place(i % across), 3.2 + 0.4 * (i as f32 * 0.37).fract(), place(i / across)),
        ));
    }
}

/// Puts the cubes where they are after so many seconds.
pub fn move_cubes(seconds: f32, cubes: &mut Query<(&Way, &mut Transform)>) {
    for (way, mut transform) in cubes {
        let angle = TAU * (seconds / 8.0 + way.phase);
        let at = way.center + Vec3::new(angle.sin(), 0.0, angle.cos()) * way.radius;
        *transform = Transform::from_translation(at).with_rotation(Quat::from_rotation_y(angle));
    }
}
