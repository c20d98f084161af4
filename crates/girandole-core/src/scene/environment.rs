//! Light from all around, infinitely far away: a sky, or a picture of one.

mod means;
mod prefiltered;

pub use prefiltered::PrefilteredEnvironment;

use super::sun::{Disc, Sun, SunPoint};
use crate::image::Image;
use crate::{Error, Result};
use glam::{DVec2, DVec3, Quat, Vec2, Vec3};
use means::{Shares, means, shares};
use std::f32::consts::{PI, TAU};
use std::sync::{Arc, OnceLock};

/// Cells of an environment that light samples are taken from, across and up at most.
const MOST_CELLS: [u32; 2] = [256, 128];
/// The same of an environment without detail.
const LEAST_CELLS: [u32; 2] = [32, 16];

/// Places in a cell at which its mean is taken, for each pixel of the map along either axis.
const PROBES: u32 = 4;

/// Light that comes from infinitely far away, by direction.
///
/// Without rotation, a direction's place in the map is that of latitude and longitude: the middle of the map is towards −Z, its right edge +X a
/// quarter further, its top +Y.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Radiance by direction, before [`strength`](Self::strength).
    pub map: Arc<EnvironmentMap>,
    /// What the map is multiplied by.
    pub strength: f32,
    /// How far it is turned about +Y, counter-clockwise seen from above, radians.
    pub rotation: f32,
    /// Whether it is seen behind the scene; else there is nothing. It lights the scene either way.
    pub visible: bool,
}

/// A picture of all directions by latitude and longitude, and its mean in cells of equal solid angle, by which light is sampled.
#[derive(Clone, Debug)]
pub struct EnvironmentMap {
    image: Image,
    /// Cells around and from top to bottom.
    size: [u32; 2],
    /// Mean radiance of each cell, row by row from the top, W/(sr·m²).
    cells: Vec<Vec3>,
    /// What is sampled by itself, and the cells' means without it.
    sun: Option<(Sun, Vec<Vec3>)>,
    /// Made when somebody asks for it.
    prefiltered: OnceLock<PrefilteredEnvironment>,
}

impl PartialEq for EnvironmentMap {
    /// All else follows from the picture and the sun.
    fn eq(&self, other: &Self) -> bool {
        self.image == other.image && self.sun == other.sun
    }
}

impl EnvironmentMap {
    /// Radiance, W/(sr·m²): a picture twice as wide as high, or one pixel where it is the same from everywhere.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a pixel is negative or not finite, and for a picture of another shape.
    pub fn new(image: Image) -> Result<Self> {
        let refuse = |what: &str| Err(Error::Invalid(format!("the environment {what}")));
        if image.pixels.is_empty() || image.pixels.len() != image.width as usize * image.height as usize {
            return refuse("has no pixels; give a picture twice as wide as high");
        }
        if image.width != 2 * image.height && (image.width, image.height) != (1, 1) {
            let size = format!("is {} × {} pixels", image.width, image.height);
            return refuse(&format!("{size}; give a picture of all directions, twice as wide as high"));
        }
        if !image.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0) {
            return refuse("has pixels that are negative or not finite; mend the picture");
        }
        let sun = Sun::of(&image);
        let mut result = Self::of(image);
        result.sun = sun.map(|sun| {
            let sky = result.cells_without(&sun);
            (sun, sky)
        });
        Ok(result)
    }

    /// The same of pixels that are light, and no sun.
    pub(super) fn of(image: Image) -> Self {
        let sides = [image.width, image.height];
        let size = std::array::from_fn(|i| sides[i].next_power_of_two().clamp(LEAST_CELLS[i], MOST_CELLS[i]));
        let mut result = Self { image, size, cells: Vec::new(), sun: None, prefiltered: OnceLock::new() };
        let [rows, columns] = result.shares();
        result.cells = means(&result.image, &rows, &columns);
        result
    }

    /// What pixels' rows and columns have in the means of rows and columns of cells.
    fn shares(&self) -> [Vec<Shares>; 2] {
        let [width, height] = [self.image.width, self.image.height];
        let middles = |count: u32| (0..count).map(move |i| (f64::from(i) + 0.5) / f64::from(count));
        let columns = PROBES * width.div_ceil(self.size[0]);
        let column = |cell: u32| {
            let places = middles(columns).map(|x| (f64::from(cell) + x) / f64::from(self.size[0]));
            shares(places, width, true)
        };
        let row = |cell: u32| {
            // Rows of cells are of the same height in y: at the poles they hold more rows of the picture than at the equator.
            let y = |at: f64| 1.0 - 2.0 * (f64::from(cell) + at) / f64::from(self.size[1]);
            let polar = |at: f64| libm::acos(y(at).clamp(-1.0, 1.0)) / std::f64::consts::PI;
            let rows = ((polar(1.0) - polar(0.0)) * f64::from(height) - 1e-9).ceil().max(1.0) as u32;
            shares(middles(PROBES * rows).map(polar), height, false)
        };
        [(0..self.size[1]).map(row).collect(), (0..self.size[0]).map(column).collect()]
    }

    /// The cells' means without a sun.
    fn cells_without(&mut self, sun: &Sun) -> Vec<Vec3> {
        let whole = sun.take_from(&mut self.image);
        let [rows, columns] = self.shares();
        let is_bright = |row: &Shares| {
            let (first, last) = (row.first().map_or(0, |r| r.0), row.last().map_or(0, |r| r.0));
            let pixels = first * self.image.width..(last + 1) * self.image.width;
            let next = whole.partition_point(|(pixel, _)| *pixel < pixels.start);
            whole.get(next).is_some_and(|(pixel, _)| *pixel < pixels.end)
        };
        let mut cells = self.cells.clone();
        for (index, row) in rows.iter().enumerate().filter(|(_, row)| is_bright(row)) {
            let start = index * columns.len();
            let means = means(&self.image, std::slice::from_ref(row), &columns);
            cells[start..start + columns.len()].copy_from_slice(&means);
        }
        for (pixel, before) in whole {
            self.image.pixels[pixel as usize] = before;
        }
        cells
    }

    /// With a round sun before it.
    pub(super) fn with_disc(self, disc: Disc) -> Self {
        let sky = self.cells.clone();
        let mut result = self;
        let cell_solid_angle = 4.0 * PI / (result.size[0] * result.size[1]) as f32;
        for (direction, light) in disc.shares() {
            let cell = result.cell_at(direction) as usize;
            result.cells[cell] += light / cell_solid_angle;
        }
        result.sun = Some((Sun::Disc(disc), sky));
        result
    }

    /// The picture; a [disc](Self::disc) is before it.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// The sun, where it is finer than the picture.
    pub fn disc(&self) -> Option<Disc> {
        match self.sun {
            Some((Sun::Disc(disc), _)) => Some(disc),
            _ => None,
        }
    }

    /// The cell that a unit direction lies in.
    fn cell_at(&self, direction: Vec3) -> u32 {
        let [columns, rows] = self.size;
        let column = (place(direction).x * columns as f32) as u32;
        let row = ((1.0 - direction.y) * 0.5 * rows as f32) as u32;
        row.min(rows - 1) * columns + column.min(columns - 1)
    }

    /// Unit direction to a place in a cell.
    fn direction(&self, cell: u32, at: DVec2) -> Vec3 {
        let [columns, rows] = self.size;
        let longitude =
            std::f64::consts::TAU * ((f64::from(cell % columns) + at.x) / f64::from(columns) - 0.5);
        let y = 1.0 - 2.0 * (f64::from(cell / columns) + at.y) / f64::from(rows);
        let across = (1.0 - y * y).max(0.0).sqrt();
        DVec3::new(libm::sin(longitude) * across, y, -libm::cos(longitude) * across).as_vec3().normalize()
    }

    /// What lobes of all widths reflect of it, computed at the first call (a tenth of a second).
    pub fn prefiltered(&self) -> &PrefilteredEnvironment {
        self.prefiltered.get_or_init(|| PrefilteredEnvironment::new(&self.image, self.disc()))
    }
}

/// A picture of all directions at a place, bilinear; around it goes on at the other edge.
fn bilinear(image: &Image, place: Vec2) -> Vec3 {
    let Image { width, height, pixels } = image;
    let at = place * Vec2::new(*width as f32, *height as f32) - 0.5;
    let (low, f) = (at.floor(), at - at.floor());
    let pixel = |dx: i32, dy: i32| {
        let x = (low.x as i32 + dx).rem_euclid(*width as i32);
        let y = (low.y as i32 + dy).clamp(0, *height as i32 - 1);
        pixels[(y as u32 * width + x as u32) as usize]
    };
    let row = |dy| pixel(0, dy).lerp(pixel(1, dy), f.x);
    row(0).lerp(row(1), f.y)
}

/// Unit direction to the middle of a pixel of a map of this size, row by row from the top.
pub(super) fn pixel_direction(pixel: u32, [width, height]: [u32; 2]) -> DVec3 {
    use std::f64::consts::{PI, TAU};
    let [x, y] =
        [(pixel % width, width), (pixel / width, height)].map(|(n, of)| (f64::from(n) + 0.5) / f64::from(of));
    let (longitude, polar) = ((x - 0.5) * TAU, y * PI);
    let across = libm::sin(polar);
    DVec3::new(libm::sin(longitude) * across, libm::cos(polar), -libm::cos(longitude) * across)
}

/// Where a direction lies in a map: in [0, 1], from the left and from the top.
pub(super) fn place(direction: Vec3) -> Vec2 {
    let u = libm::atan2f(direction.x, -direction.z) / TAU + 0.5;
    Vec2::new(u - u.floor(), libm::acosf(direction.y.clamp(-1.0, 1.0)) / PI)
}

impl PartialEq for Environment {
    fn eq(&self, other: &Self) -> bool {
        let is_same = Arc::ptr_eq(&self.map, &other.map) || self.map == other.map;
        is_same
            && (self.strength, self.rotation, self.visible) == (other.strength, other.rotation, other.visible)
    }
}

impl Environment {
    /// By latitude and longitude, as [`EnvironmentMap::new`].
    ///
    /// # Errors
    /// As there.
    pub fn new(image: Image) -> Result<Self> {
        Ok(Self { map: Arc::new(EnvironmentMap::new(image)?), strength: 1.0, rotation: 0.0, visible: true })
    }

    /// The same radiance from everywhere, W/(sr·m²).
    ///
    /// # Errors
    /// As [`EnvironmentMap::new`].
    pub fn constant(radiance: Vec3) -> Result<Self> {
        Self::new(Image { width: 1, height: 1, pixels: vec![radiance] })
    }

    /// Radiance from a unit direction, W/(sr·m²): bilinear in the map, with the sun before it.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let direction = self.in_map(direction);
        let picture = bilinear(&self.map.image, place(direction));
        let before = self.map.disc().map_or(Vec3::ZERO, |disc| disc.radiance(direction));
        (picture + before) * self.strength
    }

    /// Mean radiance, W/(sr·m²), weighted by what a GGX lobe reflects about a unit direction, seen along the normal.
    pub fn reflected(&self, direction: Vec3, alpha: f32) -> Vec3 {
        self.map.prefiltered().at(place(self.in_map(direction)), alpha) * self.strength
    }

    /// Whether there is any light.
    pub fn shines(&self) -> bool {
        self.strength > 0.0 && self.map.cells.iter().any(|p| p.max_element() > 0.0)
    }

    /// How many cells there are, all of the same solid angle.
    pub fn cells(&self) -> u32 {
        self.map.cells.len() as u32
    }

    /// Solid angle of each cell, sr.
    pub fn cell_solid_angle(&self) -> f64 {
        4.0 * std::f64::consts::PI / f64::from(self.cells())
    }

    /// Mean radiance of a cell, W/(sr·m²).
    pub fn cell_radiance(&self, cell: u32) -> Vec3 {
        self.map.cells[cell as usize] * self.strength
    }

    /// The same but for what is the sun's.
    pub fn cell_radiance_beside_sun(&self, cell: u32) -> Vec3 {
        let cells = self.map.sun.as_ref().map_or(&self.map.cells, |(_, sky)| sky);
        cells[cell as usize] * self.strength
    }

    /// How many parts the sun has; 0 without one. The sun is what is far brighter than all else, and small.
    pub fn sun_parts(&self) -> u32 {
        self.map.sun.as_ref().map_or(0, |(sun, _)| sun.parts())
    }

    /// How bright a part of the sun is by luminance, W/m² of a surface that faces it.
    pub fn sun_weight(&self, part: u32) -> f64 {
        self.map.sun.as_ref().map_or(0.0, |(sun, _)| sun.weight(part)) * f64::from(self.strength)
    }

    /// A direction of a part of the sun, by a place from (0, 0) to (1, 1); none without a sun.
    pub fn sun_point(&self, part: u32, at: DVec2) -> Option<SunPoint> {
        let point = self.map.sun.as_ref()?.0.point(part, at);
        let direction = Quat::from_rotation_y(self.rotation) * point.direction;
        Some(SunPoint { direction, radiance: point.radiance * self.strength, ..point })
    }

    /// The density of a unit direction, sr⁻¹, where parts of the sun are chosen by weight, and places in them alike.
    pub fn sun_density(&self, direction: Vec3) -> f64 {
        self.map.sun.as_ref().map_or(0.0, |(sun, _)| sun.density(self.in_map(direction)))
    }

    /// Unit direction to a place in a cell, from (0, 0) to (1, 1): uniform in solid angle where places are.
    pub fn cell_direction(&self, cell: u32, at: DVec2) -> Vec3 {
        Quat::from_rotation_y(self.rotation) * self.map.direction(cell, at)
    }

    /// The cell that a unit direction lies in.
    pub fn cell_at(&self, direction: Vec3) -> u32 {
        self.map.cell_at(self.in_map(direction))
    }

    /// The cell that a unit direction lies in, and where in it, from (0, 0) to (1, 1): the inverse of
    /// [`cell_direction`](Self::cell_direction).
    pub(crate) fn cell_and_place(&self, direction: Vec3) -> (u32, DVec2) {
        let [columns, rows] = self.map.size;
        let in_map = self.in_map(direction);
        let at = Vec2::new(place(in_map).x * columns as f32, (1.0 - in_map.y) * 0.5 * rows as f32);
        (self.cell_at(direction), (at - at.floor()).as_dvec2())
    }

    /// A direction as the map has it.
    fn in_map(&self, direction: Vec3) -> Vec3 {
        Quat::from_rotation_y(-self.rotation) * direction
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{sequence, warp};

    /// Brighter towards +Y and +X, with a small sun.
    fn gradient() -> Environment {
        let (width, height) = (128, 64);
        let pixel = |i: u32| {
            let (x, y) = (i % width, i / width);
            let sun = if (70..73).contains(&x) && (20..22).contains(&y) { 500.0 } else { 0.0 };
            Vec3::new(1.0 - y as f32 / 64.0, x as f32 / 128.0, 0.25 + sun)
        };
        let pixels = (0..width * height).map(pixel).collect();
        Environment {
            rotation: 0.7,
            strength: 2.0,
            ..Environment::new(Image { width, height, pixels }).unwrap()
        }
    }

    fn directions() -> impl Iterator<Item = Vec3> {
        (0..40_000).map(|i| warp::sphere(Vec2::from_array([0, 1].map(|d| sequence::sample(i, d, 3)))))
    }

    #[test]
    fn directions_are_where_the_map_shows_them() {
        let mut map = Image::new(4, 2);
        map.pixels = (0..8).map(|i| Vec3::splat(i as f32)).collect();
        let environment = Environment::new(map).unwrap();
        // Middles of the map's pixels: above the horizon by 45°, and towards the corners of the sky.
        let up = std::f32::consts::FRAC_1_SQRT_2;
        for (x, z, wanted) in [(-0.5, 0.5, 0.0), (-0.5, -0.5, 1.0), (0.5, -0.5, 2.0), (0.5, 0.5, 3.0)] {
            let radiance = environment.radiance(Vec3::new(x, up, z).normalize());
            assert!((radiance - wanted).abs().max_element() < 1e-3, "{x} {z}: {radiance}");
            let below = environment.radiance(Vec3::new(x, -up, z).normalize());
            assert!((below - wanted - 4.0).abs().max_element() < 1e-3, "{x} {z}: {below}");
        }
        // Turned counter-clockwise by a quarter, what was towards −Z is towards −X.
        let turned = Environment { rotation: PI * 0.5, ..environment.clone() };
        let [before, after] = [Vec3::NEG_Z, Vec3::NEG_X].map(|d| (d + Vec3::Y).normalize());
        assert!(turned.radiance(after).abs_diff_eq(environment.radiance(before), 1e-3));
    }

    #[test]
    fn pixels_lie_where_they_are_shown() {
        let size = [16, 8];
        for pixel in 0..16 * 8 {
            let at = place(pixel_direction(pixel, size).as_vec3()) * Vec2::new(16.0, 8.0);
            let middle = Vec2::new((pixel % 16) as f32, (pixel / 16) as f32) + 0.5;
            assert!(at.abs_diff_eq(middle, 1e-3), "{pixel}: {at}");
        }
    }

    #[test]
    fn cells_hold_all_of_the_light_and_know_their_directions() {
        let environment = gradient();
        let in_cells =
            (0..environment.cells()).map(|i| environment.cell_radiance(i).as_dvec3()).sum::<DVec3>()
                * environment.cell_solid_angle();
        // By texels, whatever cells are.
        let mut sum = DVec3::ZERO;
        let steps = [1024, 512];
        for (i, j) in (0..steps[0]).flat_map(|i| (0..steps[1]).map(move |j| (i, j))) {
            let theta = std::f64::consts::PI * (f64::from(j) + 0.5) / f64::from(steps[1]);
            let phi = std::f64::consts::TAU * (f64::from(i) + 0.5) / f64::from(steps[0]);
            let direction = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
            sum += environment.radiance(direction.as_vec3()).as_dvec3() * theta.sin();
        }
        sum *= 2.0 * std::f64::consts::PI.powi(2) / f64::from(steps[0] * steps[1]);
        assert!(((in_cells - sum) / sum).abs().max_element() < 2e-3, "{in_cells} {sum}");
        let mut missed = 0;
        for (i, direction) in directions().enumerate() {
            let cell = environment.cell_at(direction);
            let at = [0, 1].map(|d| f64::from(sequence::sample(i as u32, d, 9)) * 0.98 + 0.01);
            let at = DVec2::from_array(at);
            let (found, place) = environment.cell_and_place(environment.cell_direction(cell, at));
            missed += usize::from(found != cell || place.distance(at) > 1e-2);
        }
        assert!(missed < 4, "{missed} directions lie in another cell");
    }

    #[test]
    fn what_is_no_light_is_refused() {
        for bad in [f32::NAN, f32::INFINITY, -1.0] {
            assert!(Environment::constant(Vec3::splat(bad)).is_err());
        }
        for [width, height] in [[0, 0], [4, 4], [1, 2], [6, 2]] {
            assert!(Environment::new(Image::new(width, height)).is_err(), "{width} × {height}");
        }
        assert!(Environment::new(Image::new(4, 2)).is_ok());
        assert!(!Environment::constant(Vec3::ZERO).unwrap().shines());
        let one = Environment::constant(Vec3::new(1.0, 2.0, 3.0)).unwrap();
        assert!(directions().all(|d| one.radiance(d) == Vec3::new(1.0, 2.0, 3.0)));
    }
}
