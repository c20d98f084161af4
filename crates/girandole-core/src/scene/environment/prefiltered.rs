//! An environment as smooth and rough surfaces reflect it: convolved with GGX lobes beforehand (Kautz et al. 2000), for the view
//! along the normal, where the lobe is round (Karis 2013, "Real Shading in Unreal Engine 4").
//!
//! Each map is half as wide and high as the one before, and its lobe twice as wide. A lobe has a long tail, and a sun is brighter than its sky
//! by orders of magnitude, so no direction may be left out: each texel sums all of the sphere, by cells that are the coarser the
//! farther they lie from the lobe's peak.
//!
//! Worked example: at α = 0.025 (roughness 0.16) the sun of a clear sky still adds a third to what is reflected 20° beside it.

use super::means::{Shares, means, shares};
use super::{bilinear, place};
use crate::image::Image;
use crate::parallel;
use crate::scene::Disc;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Texels of the sharpest map, which is the environment itself.
const SIZE: [u32; 2] = [512, 256];
const FIRST_ALPHA: f32 = PrefilteredEnvironment::FIRST_ALPHA;
/// How many maps there are. The last one has an α of 0.4: of wider lobes light samples show nearly all.
const LEVELS: usize = COARSEST + 1;
/// The level of the coarsest cells.
const COARSEST: usize = 5;
/// Largest extent of a cell, as a share of its distance from the lobe's peak.
const CELL: f32 = 0.3;

/// Maps by latitude and longitude of what lobes reflect of an environment, from the sharpest to the widest.
#[derive(Clone, Debug)]
pub struct PrefilteredEnvironment {
    levels: Vec<Image>,
}

impl PrefilteredEnvironment {
    /// GGX α of the second map; it doubles from map to map.
    pub const FIRST_ALPHA: f32 = 0.025;

    /// Of a picture by latitude and longitude, and a sun before it. One that is the same all over has one map of one pixel.
    pub(super) fn new(image: &Image, disc: Option<Disc>) -> Self {
        if disc.is_none() && image.pixels.iter().all(|pixel| *pixel == image.pixels[0]) {
            return Self { levels: vec![Image { width: 1, height: 1, pixels: vec![image.pixels[0]] }] };
        }
        let cells = Cells::of(image, disc);
        let filtered = |level: usize| {
            let alpha = Self::FIRST_ALPHA * (1 << (level - 1)) as f32;
            cells.filtered(&cells.levels[level].directions, alpha)
        };
        let sharpest = Image { width: SIZE[0], height: SIZE[1], pixels: cells.levels[0].radiance.clone() };
        Self { levels: std::iter::once(sharpest).chain((1..LEVELS).map(filtered)).collect() }
    }

    /// The maps, each half as wide and high as the one before.
    pub fn levels(&self) -> &[Image] {
        &self.levels
    }

    /// Mean radiance, weighted by a lobe of this GGX α about a place of the map. Mirrored in `shaders/lib/reflected_environment.wgsl`.
    pub(super) fn at(&self, place: Vec2, alpha: f32) -> Vec3 {
        let (level, share) = level_of(alpha, self.levels.len());
        let sharp = bilinear(&self.levels[level], place);
        match self.levels.get(level + 1) {
            Some(blurred) => sharp.lerp(bilinear(blurred, place), share),
            None => sharp,
        }
    }
}

/// The map with the widest lobe that is no wider than this, and the share of the next one: tails of lobes grow with α², and so does
/// the share.
fn level_of(alpha: f32, levels: usize) -> (usize, f32) {
    let (mut level, mut low, mut high) = (0, 0.0, FIRST_ALPHA);
    while level + 1 < levels && alpha >= high {
        (level, low, high) = (level + 1, high, 2.0 * high);
    }
    (level, ((alpha * alpha - low * low) / (high * high - low * low)).clamp(0.0, 1.0))
}

/// A GGX lobe, its reflection and the cosine, seen along the normal; `cosine` is that of the angle between both and the light.
fn lobe(cosine: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    // Of the half vector.
    let (sin2, cos2) = (0.5 * (1.0 - cosine), 0.5 * (1.0 + cosine));
    let d = sin2 + a2 * cos2;
    let smith = cosine + (cosine * cosine * (1.0 - a2) + a2).sqrt();
    a2 / (d * d) * cosine / smith
}

/// Sines and cosines of the middles of a map's rows and columns.
struct Directions {
    rows: Vec<(f32, f32)>,
    columns: Vec<(f32, f32)>,
}

impl Directions {
    fn new([width, height]: [u32; 2]) -> Self {
        let sine_cosine = |angle: f32| libm::sincosf(angle);
        let row = |j: u32| sine_cosine((j as f32 + 0.5) / height as f32 * PI);
        let column = |i: u32| sine_cosine(((i as f32 + 0.5) / width as f32 - 0.5) * 2.0 * PI);
        Self { rows: (0..height).map(row).collect(), columns: (0..width).map(column).collect() }
    }

    fn at(&self, column: usize, row: usize) -> Vec3 {
        let ((sin, cos), (x, z)) = (self.rows[row], self.columns[column]);
        Vec3::new(x * sin, cos, -z * sin)
    }
}

/// The environment in cells of one size.
struct Level {
    directions: Directions,
    /// Mean radiance of each cell, row by row.
    radiance: Vec<Vec3>,
    /// Solid angle of the cells of each row, in any unit.
    solid_angles: Vec<f32>,
}

/// The environment in cells of many sizes, four of each in one of the next.
struct Cells {
    levels: Vec<Level>,
}

impl Cells {
    fn of(image: &Image, disc: Option<Disc>) -> Self {
        let [width, height] = SIZE;
        // A bilinear picture's mean over each cell.
        let probes = 2 * image.width.div_ceil(width);
        let along = |cells: u32, pixels: u32, is_around: bool| -> Vec<Shares> {
            let places = |cell: u32| {
                let middle = move |i: u32| (f64::from(i) + 0.5) / f64::from(probes);
                (0..probes).map(move |i| (f64::from(cell) + middle(i)) / f64::from(cells))
            };
            (0..cells).map(|cell| shares(places(cell), pixels, is_around)).collect()
        };
        let mut radiance =
            means(image, &along(height, image.height, false), &along(width, image.width, true));
        for (direction, light) in disc.iter().flat_map(Disc::shares) {
            let [column, row] =
                (place(direction) * Vec2::new(width as f32, height as f32)).as_uvec2().to_array();
            let [column, row] = [column.min(width - 1), row.min(height - 1)];
            let edge = |row: u32| libm::cosf(row as f32 / height as f32 * PI);
            let solid_angle = 2.0 * PI / width as f32 * (edge(row) - edge(row + 1));
            radiance[(row * width + column) as usize] += light / solid_angle;
        }
        let mut levels = vec![Level::new(SIZE, radiance)];
        while levels.len() <= COARSEST {
            let merged = levels[levels.len() - 1].merged();
            levels.push(merged);
        }
        Self { levels }
    }

    /// The map with these directions for a lobe.
    fn filtered(&self, directions: &Directions, alpha: f32) -> Image {
        let [width, height] = [directions.columns.len(), directions.rows.len()];
        let row = |j: u32| {
            let mut open = Vec::new();
            (0..width)
                .map(|i| self.mean_about(directions.at(i, j as usize), alpha, &mut open))
                .collect::<Vec<_>>()
        };
        let pixels = in_rows(height as u32, row);
        Image { width: width as u32, height: height as u32, pixels }
    }

    /// Mean radiance weighted by the lobe about a direction. `open` is scratch memory.
    fn mean_about(&self, about: Vec3, alpha: f32, open: &mut Vec<(usize, usize, usize)>) -> Vec3 {
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        let coarsest = &self.levels[COARSEST].directions;
        for row in 0..coarsest.rows.len() {
            open.extend((0..coarsest.columns.len()).map(|column| (COARSEST, column, row)));
        }
        while let Some((index, column, row)) = open.pop() {
            let level = &self.levels[index];
            let cosine = about.dot(level.directions.at(column, row));
            let extent = PI / level.directions.rows.len() as f32;
            // The distance is more than the chord.
            let reach = CELL * ((2.0 * (1.0 - cosine).max(0.0)).sqrt() + 2.0 * alpha);
            if index > 0 && extent > reach {
                let [i, j] = [2 * column, 2 * row];
                open.extend([(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|(i, j)| (index - 1, i, j)));
            } else if cosine > 0.0 {
                let weight = lobe(cosine, alpha) * level.solid_angles[row];
                sum += level.radiance[row * level.directions.columns.len() + column] * weight;
                weights += weight;
            }
        }
        sum / weights
    }
}

impl Level {
    fn new(size: [u32; 2], radiance: Vec<Vec3>) -> Self {
        let directions = Directions::new(size);
        // Rows are of the same angle, and lie the denser the nearer they are to the poles.
        let solid_angles = directions.rows.iter().map(|(sin, _)| sin / (size[0] * size[1]) as f32).collect();
        Self { directions, radiance, solid_angles }
    }

    /// Four cells in one.
    fn merged(&self) -> Self {
        let columns = self.directions.columns.len();
        let size = [columns / 2, self.directions.rows.len() / 2];
        let mean = |cell: usize| {
            let [i, j] = [2 * (cell % size[0]), 2 * (cell / size[0])];
            let [upper, lower] = [j, j + 1].map(|j| {
                let pair = self.radiance[j * columns + i] + self.radiance[j * columns + i + 1];
                (pair * 0.5 * self.solid_angles[j], self.solid_angles[j])
            });
            (upper.0 + lower.0) / (upper.1 + lower.1)
        };
        let radiance = (0..size[0] * size[1]).map(mean).collect();
        Self::new(size.map(|n| n as u32), radiance)
    }
}

/// What each row has, on all cores.
fn in_rows<T: Clone + Send>(count: u32, row: impl Fn(u32) -> Vec<T> + Sync + Send) -> Vec<T> {
    parallel::map(&(0..count).collect::<Vec<u32>>(), |&y| row(y)).concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::specular_brdf;
    use crate::math::{sequence, warp};
    use crate::scene::Environment;

    /// A dim sky with a small sun, brighter on one side.
    fn sunny() -> Environment {
        let pixel = |i: u32| {
            let (x, y) = (i % 512, i / 512);
            let is_sun = (150..152).contains(&x) && (70..72).contains(&y);
            let sky = Vec3::new(0.5, 0.8, 1.5) * (1.0 - y as f32 / 300.0) * (1.0 + x as f32 / 512.0);
            if is_sun { Vec3::new(2500.0, 2200.0, 1800.0) } else { sky }
        };
        let image = Image { width: 512, height: 256, pixels: (0..512 * 256).map(pixel).collect() };
        Environment { rotation: 0.7, strength: 2.0, ..Environment::new(image).unwrap() }
    }

    /// What a mirror-like plate under the environment shows, seen along its normal, by all pixels of the map.
    fn exact(environment: &Environment, normal: Vec3, alpha: f32) -> Vec3 {
        let size = [1024, 512];
        let directions = Directions::new(size);
        let (mut sum, mut weights) = (glam::DVec3::ZERO, 0.0);
        for (i, j) in (0..size[1] as usize).flat_map(|j| (0..size[0] as usize).map(move |i| (i, j))) {
            let direction = directions.at(i, j);
            let cosine = normal.dot(direction);
            if cosine > 0.0 {
                let brdf = specular_brdf(normal, normal, direction, Vec3::ONE, 1.0, alpha).x;
                let weight = f64::from(brdf * cosine * directions.rows[j].0);
                sum += environment.radiance(direction).as_dvec3() * weight;
                weights += weight;
            }
        }
        (sum / weights).as_vec3()
    }

    #[test]
    fn maps_show_what_lobes_reflect() {
        let environment = sunny();
        // At the maps' own lobes; beside, near and far from the sun.
        for alpha in [0.05, 0.1, 0.2, 0.4] {
            for i in 0..6 {
                let normal = warp::sphere(Vec2::from_array([0, 1].map(|d| sequence::sample(i, d, 3))));
                let (found, expected) =
                    (environment.reflected(normal, alpha), exact(&environment, normal, alpha));
                let error = ((found - expected) / expected).abs().max_element();
                // The widest lobes have coarse maps, which count for little (see `resolved_share`).
                assert!(
                    error < if alpha < 0.3 { 0.08 } else { 0.2 },
                    "α {alpha}, {normal}: {found} for {expected}"
                );
                // The control: another lobe is not it.
                let other = exact(&environment, normal, 2.5 * alpha);
                assert!(
                    alpha > 0.3 || ((found - other) / other).abs().max_element() > 1.5 * error,
                    "{other}"
                );
            }
        }
    }

    #[test]
    fn all_maps_have_the_light_of_the_environment() {
        let environment = sunny();
        let levels = environment.map.prefiltered().levels();
        assert_eq!(levels.len(), LEVELS);
        let mean = |image: &Image| {
            let directions = Directions::new([image.width, image.height]);
            let sine = |i: usize| directions.rows[i / image.width as usize].0;
            let sum: Vec3 = image.pixels.iter().enumerate().map(|(i, p)| *p * sine(i)).sum();
            sum / (0..image.pixels.len()).map(sine).sum::<f32>()
        };
        let expected = mean(environment.map.image());
        for image in levels {
            let found = mean(image);
            assert!(((found - expected) / expected).abs().max_element() < 0.03, "{found} for {expected}");
        }
        // What does not change, from one map to the next, is its light alone: the sun spreads.
        let brightest = |i: usize| levels[i].pixels.iter().map(|p| p.x).fold(0.0, f32::max);
        assert!((1..LEVELS).all(|i| brightest(i) < 0.9 * brightest(i - 1)));
    }

    #[test]
    fn what_is_the_same_all_over_stays_so() {
        let environment = Environment::constant(Vec3::new(1.0, 2.0, 3.0)).unwrap();
        for alpha in [0.002, 0.1, 1.0] {
            assert_eq!(environment.reflected(Vec3::new(0.6, 0.0, 0.8), alpha), Vec3::new(1.0, 2.0, 3.0));
        }
        assert_eq!(environment.map.prefiltered().levels().len(), 1);
    }

    #[test]
    fn lobes_are_those_of_the_brdf() {
        for alpha in [0.01, 0.2, 1.0] {
            let at = |cosine: f32| {
                let light = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
                specular_brdf(Vec3::Z, Vec3::Z, light, Vec3::ONE, 1.0, alpha).x * cosine / lobe(cosine, alpha)
            };
            assert!([0.2, 0.5, 0.9].iter().all(|&c| (at(c) / at(0.99) - 1.0).abs() < 1e-3), "α {alpha}");
        }
    }

    #[test]
    fn levels_follow_the_lobes() {
        assert_eq!(level_of(0.0, LEVELS), (0, 0.0));
        assert_eq!(level_of(FIRST_ALPHA, LEVELS), (1, 0.0));
        assert_eq!(level_of(4.0 * FIRST_ALPHA, LEVELS), (3, 0.0));
        assert_eq!(level_of(1.0, LEVELS).0, LEVELS - 1);
        let (level, share) = level_of(1.5 * FIRST_ALPHA, LEVELS);
        assert!(level == 1 && (share - 1.25 / 3.0).abs() < 1e-5);
    }
}
