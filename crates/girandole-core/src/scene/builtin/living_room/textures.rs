//! Textures by formulas: sRGB from 0 to 1 by texel, from the top left.

use super::chance;
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{PI, TAU};

fn sin(x: f32) -> f32 {
    libm::sin(f64::from(x)) as f32
}

/// Smooth noise from 0 to 1 with a detail for each unit.
fn noise(at: Vec2, seed: u32) -> f32 {
    let low = at.floor();
    let f = at - low;
    let f = f * f * (3.0 - 2.0 * f);
    let corner = |x: f32, y: f32| chance((low.x + x) as i32 as u32, (low.y + y) as i32 as u32, seed);
    let row = |y: f32| corner(0.0, y) + (corner(1.0, y) - corner(0.0, y)) * f.x;
    row(0.0) + (row(1.0) - row(0.0)) * f.y
}

/// Eight planks side by side, 1.6 m each way on 512 texels, with two joints each.
pub fn planks(x: f32, y: f32) -> Vec3 {
    let across = x / 64.0;
    let (plank, u) = (across.floor(), across.fract());
    let along = (y / 512.0 + chance(plank as u32, 1, 1)).fract() * 2.0;
    let (half, v) = (along.floor(), along.fract());
    let board = plank * 2.0 + half;
    let tone = chance(board as u32, 2, 2);
    let at = vec2(x + board * 131.0, y + board * 57.0);
    let grain = 0.55 * noise(at / vec2(5.0, 64.0), 1) + 0.45 * noise(at / vec2(2.0, 28.0), 2);
    let rings = 0.5 + 0.5 * sin(14.0 * u + 6.0 * noise(at / vec2(40.0, 90.0), 3));
    let mut shade = 0.8 + 0.22 * tone + 0.16 * (grain - 0.5) - 0.05 * rings;
    let is_joint = u.min(1.0 - u) * 0.2 < 0.0022 || v.min(1.0 - v) * 0.8 < 0.002;
    if is_joint {
        shade *= 0.55;
    }
    vec3(0.72 + 0.03 * tone, 0.52 + 0.015 * tone, 0.34) * shade
}

/// What is seen from the windows: a pale sky over hills.
pub fn sky(x: f32, y: f32) -> Vec3 {
    let (u, v) = (x / 128.0, y / 128.0);
    if v > 0.8 + 0.04 * sin(4.0 * u + 2.5) + 0.03 * sin(11.0 * u + 1.0) {
        return vec3(0.36, 0.5, 0.32);
    }
    if v > 0.7 + 0.05 * sin(5.0 * u + 1.0) + 0.025 * sin(13.0 * u) {
        return vec3(0.55, 0.66, 0.6);
    }
    vec3(0.52, 0.7, 0.95).lerp(vec3(1.0, 0.96, 0.9), (v / 0.62).min(1.0))
}

/// A woven rug of 192 × 128 texels: a lattice within a border.
pub fn rug(x: f32, y: f32) -> Vec3 {
    let (cream, blue, clay) = (vec3(0.84, 0.8, 0.72), vec3(0.36, 0.44, 0.5), vec3(0.66, 0.42, 0.32));
    let border = x.min(191.0 - x).min(y).min(127.0 - y);
    let (a, b) = ((x - 95.5) / 13.0, (y - 63.5) / 9.0);
    // 0 on the lattice's lines, 1 in the middle between two.
    let [p, q] = [a + b, a - b].map(|t| (t.rem_euclid(2.0) - 1.0).abs());
    let color = if (5.0..8.0).contains(&border) || border > 13.0 && p.min(q) < 0.1 {
        blue
    } else if border == 10.0 || border > 13.0 && p.min(q) > 0.78 {
        clay
    } else {
        cream
    };
    color * if (x + y) % 2.0 == 0.0 { 0.93 } else { 1.0 }
}

/// Whether a place in a picture of 96 × 128 texels is in its white margin.
fn is_margin(u: f32, v: f32) -> bool {
    !(0.07..=0.93).contains(&u) || !(0.055..=0.945).contains(&v)
}

/// Whether it is in a disc.
fn is_in(u: f32, v: f32, [x, y, radius]: [f32; 3]) -> bool {
    vec2((u - x) * 0.75, v - y).length() < radius
}

/// A picture of the sun over the sea.
pub fn sun(x: f32, y: f32) -> Vec3 {
    let (u, v) = (x / 96.0, y / 128.0);
    if is_margin(u, v) {
        vec3(0.95, 0.94, 0.91)
    } else if v > 0.76 + 0.06 * sin(5.0 * u + 2.0) {
        vec3(0.16, 0.26, 0.33)
    } else if v > 0.62 + 0.05 * sin(6.0 * u) {
        vec3(0.26, 0.42, 0.46)
    } else if is_in(u, v, [0.5, 0.36, 0.167]) {
        vec3(0.86, 0.42, 0.22)
    } else {
        vec3(0.93, 0.89, 0.82)
    }
}

/// A picture of three discs and a line.
pub fn discs(x: f32, y: f32) -> Vec3 {
    let (u, v) = (x / 96.0, y / 128.0);
    if is_margin(u, v) {
        vec3(0.95, 0.94, 0.91)
    } else if (v - 0.5 - 0.25 * (u - 0.5)).abs() < 0.008 {
        vec3(0.15, 0.15, 0.17)
    } else if is_in(u, v, [0.36, 0.7, 0.098]) {
        vec3(0.7, 0.3, 0.22)
    } else if is_in(u, v, [0.62, 0.58, 0.15]) {
        vec3(0.85, 0.62, 0.25)
    } else if is_in(u, v, [0.42, 0.4, 0.195]) {
        vec3(0.2, 0.36, 0.42)
    } else {
        vec3(0.94, 0.91, 0.85)
    }
}

/// How much a paper lantern shines from top to bottom: its ribs are darker.
pub fn ribs(_: f32, y: f32) -> Vec3 {
    let rib = if y % 9.0 == 0.0 { 0.72 } else { 1.0 };
    Vec3::splat((0.8 + 0.2 * sin(PI * y / 127.0)) * rib)
}

/// How much a lamp shade shines from top to bottom: most before the bulb.
pub fn glow(_: f32, y: f32) -> Vec3 {
    let wave = sin(TAU * 0.5 * (0.15 + 0.85 * y / 63.0));
    Vec3::splat(0.62 + 0.38 * wave * wave)
}
