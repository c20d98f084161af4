//! The sun of an environment: what is far brighter than all else and small. Light samples and paths take it by itself.
//!
//! 1. A sky's sun is a [disc](Disc), finer than the pixels of its map.
//! 2. In a picture, pixels count that are [`THRESHOLD`] times as bright as all directions in the mean, and at least [`CORE`] of the
//!    brightest. Of those that touch each other, the group with the most light is the sun, if it takes up no more than
//!    [`MOST_SOLID_ANGLE`] and has no less than [`LEAST_SHARE`] of all light. What its pixels have above the threshold is the sun's;
//!    the rest stays with the sky.
//!
//! The sun has parts: the disc as a whole, or what each pixel adds to the bilinear map, a hat that is two pixels wide.
//!
//! Worked example: a picture 512 pixels wide with 6 pixels of 2500 W/(sr·m²) in a sky of 0.8: the mean over all directions is
//! 0.7, so that pixels above 45 count; the 6 pixels are 9·10⁻⁴ sr, and have a fifth of the light.

use super::environment::{pixel_direction, place};
use crate::image::{Image, luminance};
use crate::math::warp;
use crate::parallel;
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// How much brighter than all directions in the mean a picture's sun is at least.
const THRESHOLD: f64 = 64.0;
/// Of its brightest pixel's luminance, how much a pixel of it has at least.
const CORE: f64 = 1.0 / 16.0;
/// How large it is at most, sr: a disc of 5°.
const MOST_SOLID_ANGLE: f64 = 6e-3;
/// How much of all light it has at least.
const LEAST_SHARE: f64 = 0.04;

/// Places in a disc, squared, by which it is shared among cells.
const PROBES: u32 = 32;

/// A round sun, of the same radiance everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Unit, to its middle.
    pub direction: Vec3,
    /// Its edge's distance from the middle on the unit sphere, in a straight line.
    pub chord: f32,
    /// W/(sr·m²); below the horizon nothing is seen of it.
    pub radiance: Vec3,
}

/// A direction of the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunPoint {
    /// Unit, from the scene.
    pub direction: Vec3,
    /// W/(sr·m²).
    pub radiance: Vec3,
    /// Of the part that it was chosen from, sr: if it all was of that radiance.
    pub solid_angle: f64,
}

/// Pixels of a map, across and from top to bottom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MapSize([u32; 2]);

/// A sun, as the map has it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Sun {
    Disc(Disc),
    /// What pixels of a map of this size have more than the sky: by pixel, ascending; and how bright they are together.
    Pixels {
        size: MapSize,
        pixels: Vec<(u32, Vec3)>,
        weight: f64,
    },
}

impl Disc {
    /// About a unit direction, with an angle in radians from the middle to the edge.
    pub(super) fn new(direction: Vec3, radius: f64, radiance: Vec3) -> Self {
        Self { direction, chord: (2.0 * libm::sin(0.5 * radius)) as f32, radiance }
    }

    /// sr.
    pub(super) fn solid_angle(&self) -> f64 {
        PI * f64::from(self.chord).powi(2)
    }

    /// Unit direction to a place in it, uniform in solid angle where places in the unit square are.
    pub(super) fn point(&self, at: DVec2) -> Vec3 {
        // Lambert's azimuthal projection of the sphere keeps areas.
        let disc = warp::disc(at.as_vec2()) * self.chord;
        let r2 = disc.length_squared();
        let (x, y) = warp::frame(self.direction);
        let across = disc * (1.0 - 0.25 * r2).sqrt();
        (x * across.x + y * across.y + self.direction * (1.0 - 0.5 * r2)).normalize()
    }

    /// Directions all over it, and how bright the part about each of them is, W/m² of a surface that faces it.
    pub(super) fn shares(&self) -> impl Iterator<Item = (Vec3, Vec3)> {
        let count = PROBES * PROBES;
        let each = (self.solid_angle() / f64::from(count)) as f32;
        (0..count).map(move |probe| {
            let at = DVec2::new(f64::from(probe % PROBES), f64::from(probe / PROBES)) + 0.5;
            let direction = self.point(at / f64::from(PROBES));
            (direction, self.radiance(direction) * each)
        })
    }

    /// Radiance from a unit direction, W/(sr·m²).
    pub(super) fn radiance(&self, direction: Vec3) -> Vec3 {
        let is_in_it = direction.distance_squared(self.direction) <= self.chord * self.chord;
        if is_in_it && direction.y > 0.0 { self.radiance } else { Vec3::ZERO }
    }
}

impl Sun {
    /// Of a picture.
    pub fn of(image: &Image) -> Option<Self> {
        let size = MapSize([image.width, image.height]);
        let width = image.width as usize;
        let rows: Vec<u32> = (0..image.height).collect();
        let row_of = |row: u32| &image.pixels[row as usize * width..][..width];
        let light_of = |pixel: &Vec3| f64::from(luminance(*pixel));
        let solid_angles: Vec<f64> = rows.iter().map(|&row| size.solid_angle(row * image.width)).collect();
        let solid_angle = |pixel: u32| solid_angles[(pixel / image.width) as usize];
        let sums = parallel::map(&rows, |&row| {
            let start = (0.0, 0.0_f64);
            let (sum, most) =
                row_of(row).iter().map(light_of).fold(start, |(sum, most), l| (sum + l, most.max(l)));
            (sum * solid_angles[row as usize], most)
        });
        let all: f64 = sums.iter().map(|(sum, _)| sum).sum();
        let brightest = sums.iter().fold(0.0_f64, |most, (_, light)| most.max(*light));
        let rest = THRESHOLD * all / (4.0 * PI);
        let threshold = rest.max(CORE * brightest);
        let is_above = |pixel: &Vec3| light_of(pixel) > threshold;
        let bright = parallel::map(&rows, |&row| row_of(row).iter().map(is_above).collect::<Vec<bool>>());
        let mut is_bright = bright.concat();
        let sum = |group: &[u32], f: &dyn Fn(u32) -> f64| group.iter().map(|&pixel| f(pixel)).sum::<f64>();
        let light = |pixel: u32| (light_of(&image.pixels[pixel as usize]) - rest) * solid_angle(pixel);
        let mut groups = Vec::new();
        for pixel in 0..is_bright.len() as u32 {
            if is_bright[pixel as usize] {
                groups.push(size.connected(pixel, &mut is_bright));
            }
        }
        let mut sun = groups.into_iter().max_by(|a, b| sum(a, &light).total_cmp(&sum(b, &light)))?;
        if sum(&sun, &solid_angle) > MOST_SOLID_ANGLE || sum(&sun, &light) < LEAST_SHARE * all {
            return None;
        }
        sun.sort_unstable();
        let above = |&pixel: &u32| {
            let radiance = image.pixels[pixel as usize];
            (pixel, (radiance.as_dvec3() * (1.0 - rest / light_of(&radiance))).as_vec3())
        };
        Some(Self::Pixels { size, pixels: sun.iter().map(above).collect(), weight: sum(&sun, &light) })
    }

    /// Takes it from its picture; what the pixels were before, ascending.
    pub fn take_from(&self, image: &mut Image) -> Vec<(u32, Vec3)> {
        let Self::Pixels { pixels, .. } = self else { return Vec::new() };
        let take = |&(pixel, above): &(u32, Vec3)| {
            let left = &mut image.pixels[pixel as usize];
            (pixel, std::mem::replace(left, (*left - above).max(Vec3::ZERO)))
        };
        pixels.iter().map(take).collect()
    }

    pub fn parts(&self) -> u32 {
        match self {
            Self::Disc(_) => 1,
            Self::Pixels { pixels, .. } => pixels.len() as u32,
        }
    }

    /// How bright a part is by luminance, W/m² of a surface that faces it.
    pub fn weight(&self, part: u32) -> f64 {
        match self {
            Self::Disc(disc) => f64::from(luminance(disc.radiance)) * disc.solid_angle(),
            Self::Pixels { size, pixels, .. } => {
                let (pixel, above) = pixels[part as usize];
                f64::from(luminance(above)) * size.solid_angle(pixel)
            }
        }
    }

    /// A direction of a part, by a place in the unit square.
    pub fn point(&self, part: u32, at: DVec2) -> SunPoint {
        match self {
            Self::Disc(disc) => {
                let direction = disc.point(at);
                SunPoint { direction, radiance: disc.radiance(direction), solid_angle: disc.solid_angle() }
            }
            Self::Pixels { size, pixels, .. } => {
                let (pixel, radiance) = pixels[part as usize];
                let (direction, solid_angle) = size.point_of_hat(pixel, at);
                SunPoint { direction, radiance, solid_angle }
            }
        }
    }

    /// The density of a direction, sr⁻¹, where parts are chosen by their weights, and then uniform points of them.
    pub fn density(&self, direction: Vec3) -> f64 {
        match self {
            Self::Disc(disc) => {
                let is_in_it = direction.distance_squared(disc.direction) <= disc.chord * disc.chord;
                f64::from(u8::from(is_in_it)) / disc.solid_angle()
            }
            Self::Pixels { size, pixels, weight: all } => {
                let weight = |pixel: u32| {
                    let part = pixels.binary_search_by_key(&pixel, |(pixel, _)| *pixel);
                    part.map_or(0.0, |part| self.weight(part as u32))
                };
                size.bilinear(direction, weight) / (all * size.solid_angle_at(direction))
            }
        }
    }
}

impl MapSize {
    /// Solid angle of a pixel's rows and columns at its middle, sr.
    fn solid_angle(self, pixel: u32) -> f64 {
        let direction = pixel_direction(pixel, self.0);
        TAU / f64::from(self.0[0]) * (PI / f64::from(self.0[1])) * libm::hypot(direction.x, direction.z)
    }

    /// Of a pixel that would lie about this direction, sr.
    fn solid_angle_at(self, direction: Vec3) -> f64 {
        let across = libm::hypot(f64::from(direction.x), f64::from(direction.z));
        TAU / f64::from(self.0[0]) * (PI / f64::from(self.0[1])) * across.max(1e-9)
    }

    /// What pixels have, bilinear about a unit direction.
    fn bilinear(self, direction: Vec3, of: impl Fn(u32) -> f64) -> f64 {
        let [width, height] = self.0;
        let at = place(direction).as_dvec2() * DVec2::new(f64::from(width), f64::from(height)) - 0.5;
        let (low, f) = (at.floor(), at - at.floor());
        let pixel = |dx: i32, dy: i32| {
            let x = (low.x as i32 + dx).rem_euclid(width as i32);
            let y = (low.y as i32 + dy).clamp(0, height as i32 - 1);
            of(y as u32 * width + x as u32)
        };
        let row = |dy| pixel(0, dy) * (1.0 - f.x) + pixel(1, dy) * f.x;
        row(0) * (1.0 - f.y) + row(1) * f.y
    }

    /// All pixels of those that count which touch this one, around the map's edge too. They no longer count.
    fn connected(self, pixel: u32, counts: &mut [bool]) -> Vec<u32> {
        let [width, height] = self.0.map(i64::from);
        let (mut group, mut done) = (vec![pixel], 0);
        counts[pixel as usize] = false;
        while let Some(&pixel) = group.get(done) {
            let (x, y) = (i64::from(pixel) % width, i64::from(pixel) / width);
            for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
                let beside = (y + dy) * width + (x + dx).rem_euclid(width);
                if (0..height).contains(&(y + dy)) && std::mem::take(&mut counts[beside as usize]) {
                    group.push(beside as u32);
                }
            }
            done += 1;
        }
        group
    }

    /// A direction distributed in the map as a pixel's share of the bilinear picture, and the solid angle of a pixel there.
    fn point_of_hat(self, pixel: u32, at: DVec2) -> (Vec3, f64) {
        // The inverse of a hat's cumulative distribution.
        let offset =
            |s: f64| if s < 0.5 { (2.0 * s).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * s).max(0.0).sqrt() };
        let [width, height] = self.0.map(f64::from);
        let x = (f64::from(pixel % self.0[0]) + 0.5 + offset(at.x)) / width;
        // At the poles the picture goes on with its last row.
        let y = (f64::from(pixel / self.0[0]) + 0.5 + offset(at.y)) / height;
        let y = if y < 0.0 {
            -y
        } else if y > 1.0 {
            2.0 - y
        } else {
            y
        };
        let (longitude, polar) = ((x - 0.5) * TAU, y * PI);
        let across = libm::sin(polar);
        let direction =
            DVec3::new(libm::sin(longitude) * across, libm::cos(polar), -libm::cos(longitude) * across);
        let direction = direction.as_vec3().normalize();
        (direction, TAU / width * (PI / height) * across)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Environment, EnvironmentMap, Sky};
    use super::*;
    use crate::math::sequence;

    fn at(i: u32) -> DVec2 {
        DVec2::from_array([0, 1].map(|d| f64::from(sequence::sample(i, d, 5))))
    }

    /// A sky of 0.8 with pixels of this radiance, a picture of 256 × 128.
    fn picture(pixels: &[[u32; 2]], radiance: f32) -> Image {
        let mut image = Image { width: 256, height: 128, pixels: vec![Vec3::splat(0.8); 256 * 128] };
        for [x, y] in pixels {
            image.pixels[(y * 256 + x) as usize] = Vec3::new(1.0, 0.9, 0.7) * radiance;
        }
        image
    }

    fn parts(image: Image) -> u32 {
        Environment::new(image).expect("an environment").sun_parts()
    }

    #[test]
    fn what_is_far_brighter_than_all_else_and_small_is_the_sun() {
        assert_eq!(parts(picture(&[[30, 40], [31, 40], [31, 41]], 3000.0)), 3);
        // Around the edge of the map, and cornerwise.
        assert_eq!(parts(picture(&[[0, 40], [255, 41]], 3000.0)), 2);
        // Of two, the one with more light.
        assert_eq!(parts(picture(&[[10, 50], [90, 30], [91, 30]], 3000.0)), 2);
        // No suns: nothing bright, too little of it, a lamp as wide as a hand, a studio.
        assert_eq!(parts(picture(&[], 0.0)), 0);
        assert_eq!(parts(picture(&[[30, 40]], 60.0)), 0);
        let wide: Vec<[u32; 2]> = (0..12).flat_map(|x| (0..12).map(move |y| [40 + x, 50 + y])).collect();
        assert_eq!(parts(picture(&wide, 3000.0)), 0);
        assert_eq!(Environment::studio(Vec3::NEG_Z).sun_parts(), 0);
        assert_eq!(Environment::constant(Vec3::ONE).expect("an environment").sun_parts(), 0);
        // A black sky around it changes nothing.
        let mut alone = picture(&[[30, 40]], 1.0);
        alone.pixels.iter_mut().filter(|p| p.x < 0.9).for_each(|p| *p = Vec3::ZERO);
        assert_eq!(parts(alone), 1);
    }

    #[test]
    fn a_picture_and_its_sun_are_the_picture() {
        let image = picture(&[[30, 40], [31, 40], [31, 41]], 3000.0);
        let environment =
            Environment { rotation: 0.6, strength: 2.0, ..Environment::new(image.clone()).expect("one") };
        let sun = Sun::of(&image).expect("a sun");
        let mut without = image.clone();
        sun.take_from(&mut without);
        let sky = Environment { map: EnvironmentMap::of(without).into(), ..environment.clone() };
        // By cells: with and without.
        let each = environment.cell_solid_angle();
        let in_cells: DVec3 = (0..environment.cells())
            .map(|i| {
                (environment.cell_radiance(i) - environment.cell_radiance_beside_sun(i)).as_dvec3() * each
            })
            .sum();
        let in_parts: f64 = (0..environment.sun_parts()).map(|part| environment.sun_weight(part)).sum();
        let in_cells = f64::from(luminance(in_cells.as_vec3()));
        assert!((in_cells / in_parts - 1.0).abs() < 5e-3, "{in_cells} {in_parts}");
        // What directions show of it, by their density, is all of it: in the mean over parts that are chosen by weight.
        let (mut sum, count) = (0.0, 1 << 14);
        for i in 0..count {
            let mut chosen = f64::from(sequence::sample(i, 2, 5)) * in_parts;
            let mut part = 0;
            while part + 1 < environment.sun_parts() && chosen >= environment.sun_weight(part) {
                chosen -= environment.sun_weight(part);
                part += 1;
            }
            let point = environment.sun_point(part, at(i)).expect("a sun");
            let shown = environment.radiance(point.direction) - sky.radiance(point.direction);
            let density = environment.sun_density(point.direction);
            let error = f64::from(luminance(shown)) / density / in_parts;
            assert!((error - 1.0).abs() < 0.05, "{error}");
            sum += error / f64::from(count);
        }
        assert!((sum - 1.0).abs() < 5e-3, "{sum}");
        // Negative control: elsewhere it has no density.
        assert_eq!(environment.sun_density(Vec3::NEG_Y), 0.0);
    }

    #[test]
    fn a_disc_is_covered_evenly_and_ends_at_the_horizon() {
        let radius = 0.2665_f64.to_radians();
        for elevation in [0.0_f32, 5.0, 90.0] {
            let sky = Sky { elevation: elevation.to_radians(), ..Sky::default() };
            let environment = Environment { rotation: 1.1, ..Environment::sky(&sky).expect("a sky") };
            let disc = environment.map.disc().expect("a disc");
            assert!((disc.solid_angle() / (PI * radius * radius) - 1.0).abs() < 1e-4);
            let (mut squares, mut lit, count) = (0.0, 0, 4096);
            for i in 0..count {
                let SunPoint { direction, radiance, .. } = environment.sun_point(0, at(i)).expect("a sun");
                let middle = glam::Quat::from_rotation_y(1.1) * disc.direction;
                squares += f64::from(direction.distance_squared(middle)) / f64::from(count);
                lit += u32::from(radiance.x > 0.0);
                let shown = environment.radiance(direction);
                // But for rounding at the rim.
                if direction.distance(middle) < 0.99 * disc.chord && direction.y.abs() > 1e-5 {
                    assert_eq!(shown.x > 0.5 * disc.radiance.x, radiance.x > 0.0, "{direction}");
                    assert!(environment.sun_density(direction) * disc.solid_angle() > 0.999);
                }
            }
            // The mean square of a disc's radii is half of the largest.
            assert!((squares / (0.5 * radius * radius) - 1.0).abs() < 0.01, "{squares}");
            let expected = if elevation == 0.0 { 0.5 } else { 1.0 };
            assert!((f64::from(lit) / f64::from(count) - expected).abs() < 0.02, "{elevation}: {lit}");
        }
    }

    #[test]
    fn the_sun_of_a_sky_is_in_its_cells() {
        for elevation in [0.0_f32, 3.0, 40.0, 89.9] {
            let sky = Sky { elevation: elevation.to_radians(), ..Sky::default() };
            let environment = Environment::sky(&sky).expect("a sky");
            let each = environment.cell_solid_angle();
            let more = |cell| environment.cell_radiance(cell) - environment.cell_radiance_beside_sun(cell);
            let in_cells =
                (0..environment.cells()).map(|cell| f64::from(luminance(more(cell)))).sum::<f64>() * each;
            let risen = if elevation == 0.0 { 0.5 } else { 1.0 };
            let expected = environment.sun_weight(0) * risen;
            assert!((in_cells / expected - 1.0).abs() < 0.03, "{elevation}: {in_cells} for {expected}");
        }
    }
}
