//! A clear sky with its sun.
//!
//! The sky is that of Hošek and Wilkie ("An Analytic Model for Full Spectral Sky-Dome Radiance", 2012). The sun is a black body of
//! 5778 K behind the atmosphere of Preetham et al. ("A Practical Analytic Model for Daylight", 1999, appendix A.1: molecules, aerosol
//! and ozone), seen by the observer that Wyman et al. fit ("Simple Analytic Approximations to the CIE XYZ Color Matching Functions",
//! 2013). The ground is grey and lit by both. All but the crate's cube root of the sun's elevation comes from `libm`.

use super::environment::pixel_direction;
use super::sun::Disc;
use super::{Environment, EnvironmentMap};
use crate::image::Image;
use crate::{Error, Result};
use glam::{DMat3, DVec2, DVec3, Vec3};
use hw_skymodel::rgb::{SkyParams, SkyState};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

/// Pixels of the map.
const SIZE: [u32; 2] = [512, 256];
/// Radius of the sun's disc, radians.
const SUN_RADIUS: f64 = 0.2665 * PI / 180.0;
/// Its solid angle, sr.
const SUN_SOLID_ANGLE: f64 = PI * SUN_RADIUS * SUN_RADIUS;
/// Places in the disc, squared, by which it is found how far it has risen.
const PROBES: u32 = 64;
/// What the ground reflects.
const GROUND: f32 = 0.2;

/// A clear sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// How high the sun stands, radians: 0 (on the horizon) to π/2.
    pub elevation: f32,
    /// Where it stands: clockwise from −Z as seen from above, radians.
    pub azimuth: f32,
    /// How hazy it is: 1 (pure air) to 10 (haze); clear days have 2 to 4.
    pub turbidity: f32,
}

impl Default for Sky {
    /// A clear morning, the sun to the left behind whoever looks towards −Z.
    fn default() -> Self {
        Self { elevation: 40.0_f32.to_radians(), azimuth: 225.0_f32.to_radians(), turbidity: 3.0 }
    }
}

impl Environment {
    /// A clear sky with its sun over grey ground, in units of 683 cd/m²: 1 W/(sr·m²) of light that the eye sees best. The sun is a
    /// disc of its true size before the map.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a parameter is out of range.
    pub fn sky(sky: &Sky) -> Result<Self> {
        let Sky { elevation, azimuth, turbidity } = *sky;
        let refuse = |what: String| Err(Error::Invalid(what));
        if !(0.0..=std::f32::consts::FRAC_PI_2).contains(&elevation) {
            return refuse(format!("a sun at {}° is not possible; choose 0 to 90", elevation.to_degrees()));
        }
        if !(1.0..=10.0).contains(&turbidity) {
            return refuse(format!("a turbidity of {turbidity} is not possible; choose 1 to 10"));
        }
        if !azimuth.is_finite() {
            return refuse("the sun's azimuth has to be a number".into());
        }
        let state = SkyState::new(&SkyParams { elevation, turbidity, albedo: [GROUND; 3] })
            .map_err(|e| Error::Invalid(e.to_string()))?;
        let (params, radiances) = state.raw();
        let dome = |direction: DVec3, sun: DVec3| {
            let of = |channel: usize| radiance(&params[9 * channel..], radiances[channel], direction, sun);
            DVec3::from_array([0, 1, 2].map(of)).max(DVec3::ZERO)
        };
        let (elevation, azimuth) = (f64::from(elevation), f64::from(azimuth));
        let level = libm::cos(elevation);
        let sun = DVec3::new(libm::sin(azimuth) * level, libm::sin(elevation), -libm::cos(azimuth) * level);
        let beam = sun_irradiance(elevation, f64::from(turbidity));

        let disc = Disc::new(sun.as_vec3(), SUN_RADIUS, (beam / SUN_SOLID_ANGLE).as_vec3());
        let width = PI / f64::from(SIZE[1]);
        let directions: Vec<DVec3> = (0..SIZE[0] * SIZE[1]).map(|i| pixel_direction(i, SIZE)).collect();
        let above: Vec<DVec3> =
            directions.iter().map(|&d| if d.y > 0.0 { dome(d, sun) } else { DVec3::ZERO }).collect();
        // What arrives on the ground: from the sky, and from as much of the sun as the horizon does not hide.
        let solid_angle = |d: &DVec3| libm::hypot(d.x, d.z) * width * (TAU / f64::from(SIZE[0]));
        let from_sky = above.iter().zip(&directions).map(|(&l, d)| l * (d.y * solid_angle(d))).sum::<DVec3>();
        let height = |i: u32| {
            let at = DVec2::new(f64::from(i % PROBES), f64::from(i / PROBES)) + 0.5;
            f64::from(disc.point(at / f64::from(PROBES)).y).max(0.0)
        };
        let risen = (0..PROBES * PROBES).map(height).sum::<f64>() / f64::from(PROBES * PROBES);
        let ground = (from_sky + beam * risen) * (f64::from(GROUND) / PI);
        let shown = |(&light, d): (&DVec3, &DVec3)| (if d.y > 0.0 { light } else { ground }).as_vec3();
        let pixels: Vec<Vec3> = above.iter().zip(&directions).map(shown).collect();
        let map = EnvironmentMap::of(Image { width: SIZE[0], height: SIZE[1], pixels }).with_disc(disc);
        Ok(Self { map: Arc::new(map), strength: 1.0, rotation: 0.0, visible: true })
    }
}

/// A channel of the sky's radiance: Hošek and Wilkie's equation 8.
fn radiance(params: &[f32], scale: f32, direction: DVec3, sun: DVec3) -> f64 {
    let p: [f64; 9] = std::array::from_fn(|i| f64::from(params[i]));
    let cos_theta = direction.y.max(0.0);
    let cos_gamma = direction.dot(sun).clamp(-1.0, 1.0);
    let gamma = libm::acos(cos_gamma);
    let mie = (1.0 + cos_gamma * cos_gamma) / libm::pow(1.0 + p[8] * p[8] - 2.0 * p[8] * cos_gamma, 1.5);
    let horizon = 1.0 + p[0] * libm::exp(p[1] / (cos_theta + 0.01));
    let rest = p[2]
        + p[3] * libm::exp(p[4] * gamma)
        + p[5] * cos_gamma * cos_gamma
        + p[6] * mie
        + p[7] * cos_theta.sqrt();
    f64::from(scale) * horizon * rest
}

/// What of the sun arrives on a surface that faces it, linear sRGB, W/m² of light that the eye sees best.
fn sun_irradiance(elevation: f64, turbidity: f64) -> DVec3 {
    let zenith = (FRAC_PI_2 - elevation).to_degrees();
    let air_mass = 1.0 / (libm::sin(elevation) + 0.15 * libm::pow(93.885 - zenith, -1.253));
    let aerosol = (0.04608 * turbidity - 0.04586).max(0.0);
    let mut xyz = DVec3::ZERO;
    for nanometres in (380..780).step_by(5).map(f64::from) {
        let micrometres = nanometres * 1e-3;
        let molecules = 0.008735 * libm::pow(micrometres, -4.08);
        let haze = aerosol * libm::pow(micrometres, -1.3);
        let depth = molecules + haze + 0.35 * ozone(nanometres);
        xyz += observer(nanometres) * (planck(micrometres) * libm::exp(-depth * air_mass) * 5e-3);
    }
    let to_srgb = DMat3::from_cols(
        DVec3::new(3.2406, -0.9689, 0.0557),
        DVec3::new(-1.5372, 1.8758, -0.2040),
        DVec3::new(-0.4986, 0.0415, 1.0570),
    );
    (to_srgb * xyz * SUN_SOLID_ANGLE).max(DVec3::ZERO)
}

/// Radiance of a black body of 5778 K, W/(sr·m²) for each micrometre.
fn planck(micrometres: f64) -> f64 {
    1.191_043e8 / (libm::pow(micrometres, 5.0) * (libm::exp(14_387.77 / (micrometres * 5778.0)) - 1.0))
}

/// How strongly ozone absorbs, 1/cm: the Chappuis band, roughly, as two bells.
fn ozone(nanometres: f64) -> f64 {
    let peak = |at: f64, width: f64| libm::exp(-0.5 * libm::pow((nanometres - at) / width, 2.0));
    0.125 * peak(602.0, 38.0) + 0.04 * peak(530.0, 28.0)
}

/// The CIE's observer of 1931, as Wyman et al. fit it (their equation 4).
fn observer(nanometres: f64) -> DVec3 {
    let lobe = |height: f64, at: f64, [below, above]: [f64; 2]| {
        let t = (nanometres - at) * if nanometres < at { below } else { above };
        height * libm::exp(-0.5 * t * t)
    };
    DVec3::new(
        lobe(0.362, 442.0, [0.0624, 0.0374])
            + lobe(1.056, 599.8, [0.0264, 0.0323])
            + lobe(-0.065, 501.1, [0.0490, 0.0382]),
        lobe(0.821, 568.8, [0.0213, 0.0247]) + lobe(0.286, 530.9, [0.0613, 0.0322]),
        lobe(1.217, 437.0, [0.0845, 0.0278]) + lobe(0.681, 459.0, [0.0385, 0.0725]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::luminance;
    use glam::DVec2;

    const LUX: f32 = 683.0;

    fn sky(elevation: f32, turbidity: f32) -> Environment {
        let sky = Sky { elevation: elevation.to_radians(), turbidity, ..Sky::default() };
        Environment::sky(&sky).expect("a sky")
    }

    /// Irradiance of level ground, from cells of the sky where `counts` says so.
    fn on_the_ground(environment: &Environment, counts: impl Fn(f32) -> bool) -> Vec3 {
        let of_cell = |cell: u32| {
            let direction = environment.cell_direction(cell, DVec2::splat(0.5));
            let radiance = environment.cell_radiance(cell);
            if counts(luminance(radiance)) { radiance * direction.y.max(0.0) } else { Vec3::ZERO }
        };
        (0..environment.cells()).map(of_cell).sum::<Vec3>() * environment.cell_solid_angle() as f32
    }

    #[test]
    fn skies_are_as_bright_as_those_that_are_measured() {
        // Clear skies of the Recommended Practice for the Calculation of Daylight Availability (IES 1984), klx.
        for elevation in [12.0_f32, 25.0, 40.0, 65.0] {
            let sine = elevation.to_radians().sin();
            let diffuse = 0.8 + 15.5 * sine.sqrt();
            let wanted = 127.5 * (-0.21 / sine).exp() * sine + diffuse;
            let environment = sky(elevation, 3.0);
            // The sun's cells are far brighter than any other.
            let all = luminance(on_the_ground(&environment, |_| true)) * LUX * 1e-3;
            let dome = luminance(on_the_ground(&environment, |l| l < 300.0)) * LUX * 1e-3;
            assert!(
                (all / wanted).ln().abs() < 0.2 && (dome / diffuse).ln().abs() < 0.3,
                "{elevation}: {all} for {wanted}, {dome} for {diffuse}"
            );
        }
    }

    #[test]
    fn the_sun_is_where_it_is_said_to_be_and_reddens_as_it_sets() {
        let mut redness = 0.0;
        for elevation in [70.0_f32, 30.0, 10.0, 3.0] {
            let environment = sky(elevation, 3.0);
            let brightest = (0..environment.cells())
                .max_by(|&a, &b| {
                    luminance(environment.cell_radiance(a))
                        .total_cmp(&luminance(environment.cell_radiance(b)))
                })
                .expect("cells");
            let direction = environment.cell_direction(brightest, DVec2::splat(0.5));
            let level = elevation.to_radians().cos() * std::f32::consts::FRAC_1_SQRT_2;
            let sun = Vec3::new(-level, elevation.to_radians().sin(), level);
            assert!(direction.angle_between(sun) < 0.03, "{elevation}: {direction} {sun}");
            let color = environment.cell_radiance(brightest);
            assert!(color.x / color.z > redness * 1.02, "{elevation}: {color}");
            redness = color.x / color.z;
            // Overhead it is blue.
            let zenith = environment.radiance(Vec3::Y);
            assert!(zenith.z > 1.5 * zenith.x, "{zenith}");
        }
    }

    #[test]
    fn the_ground_reflects_a_fifth_of_what_arrives() {
        let environment = sky(40.0, 3.0);
        let arrives = on_the_ground(&environment, |_| true);
        let ground = environment.radiance(Vec3::NEG_Y) * std::f32::consts::PI;
        assert!((ground / arrives - 0.2).abs().max_element() < 0.01, "{ground} of {arrives}");
    }

    #[test]
    fn what_is_no_sky_is_refused() {
        let default = Sky::default();
        for bad in [
            Sky { elevation: -0.1, ..default },
            Sky { elevation: 1.6, ..default },
            Sky { turbidity: 0.5, ..default },
            Sky { turbidity: f32::NAN, ..default },
            Sky { azimuth: f32::INFINITY, ..default },
        ] {
            assert!(Environment::sky(&bad).is_err(), "{bad:?}");
        }
    }
}
