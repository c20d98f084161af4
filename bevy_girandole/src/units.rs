//! Bevy's units and numbers in Girandole's terms. Girandole counts in watts and Bevy in lumens; both only ever scale, so one watt is
//! taken for one lumen, and a candela for a watt per steradian.

use bevy::color::{Color, ColorToComponents, LinearRgba};
use bevy::math::{Affine2, Affine3A, Mat4};
use girandole::glam;
use std::f32::consts::PI;

/// Intensity of a point light or a spot light of so many lumens, candela: Bevy spreads them over the whole sphere for both.
pub fn candela(lumens: f32, color: Color) -> glam::Vec3 {
    rgb(color.to_linear()) * light(lumens / (4.0 * PI))
}

/// Illuminance of a directional light, lux.
pub fn lux(illuminance: f32, color: Color) -> glam::Vec3 {
    rgb(color.to_linear()) * light(illuminance)
}

/// Luminance of a rectangle that emits so many lumens from one side, nits. A rectangle without area emits nothing.
pub fn nits(lumens: f32, color: Color, [width, height]: [f32; 2]) -> glam::Vec3 {
    rgb(color.to_linear()) * light(lumens / (PI * width * height))
}

/// Luminance of an emissive material, nits. Bevy multiplies `emissive` by the camera's exposure only as far as its weight says; what it
/// shows unexposed has to shine the brighter the less the camera exposes.
pub fn emission(emissive: LinearRgba, exposure_weight: f32, exposure: f32) -> glam::Vec3 {
    let weight = exposure_weight.clamp(0.0, 1.0);
    rgb(emissive) * light((1.0 - weight) / exposure + weight)
}

/// The camera's exposure in stops: radiance is multiplied by two to this power.
pub fn stops(exposure: f32) -> f32 {
    exposure.max(f32::MIN_POSITIVE).log2()
}

/// A factor of light: what is no number or below zero is dark.
fn light(value: f32) -> f32 {
    if value.is_finite() { value.max(0.0) } else { 0.0 }
}

/// Linear RGB; colours outside the gamut are moved to its edge.
pub fn rgb(color: LinearRgba) -> glam::Vec3 {
    glam::Vec3::from(color.to_f32_array_no_alpha().map(light))
}

/// A map of space.
pub fn affine(affine: &Affine3A) -> glam::DAffine3 {
    glam::DAffine3::from_cols_array(&affine.to_cols_array().map(f64::from))
}

/// A map of texture coordinates.
pub fn affine2(affine: &Affine2) -> glam::Affine2 {
    glam::Affine2::from_cols_array(&affine.to_cols_array())
}

/// A projection.
pub fn matrix(matrix: &Mat4) -> glam::Mat4 {
    glam::Mat4::from_cols_array(&matrix.to_cols_array())
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::camera::Exposure;
    use bevy::math::{Quat, Vec3};
    use bevy::transform::components::Transform;

    #[test]
    fn a_point_light_spreads_its_lumens_over_the_sphere() {
        let intensity = candela(4.0 * PI * 100.0, Color::linear_rgb(1.0, 0.5, 0.0));
        assert!(intensity.abs_diff_eq(glam::vec3(100.0, 50.0, 0.0), 1e-4), "{intensity}");
    }

    #[test]
    fn a_rectangle_gives_back_its_lumens() {
        let luminance = nits(600.0, Color::WHITE, [2.0, 0.5]);
        // A Lambertian emitter's flux is π × luminance × area.
        assert!((luminance.x * PI * 2.0 * 0.5 - 600.0).abs() < 1e-3, "{luminance}");
        assert_eq!(nits(600.0, Color::WHITE, [0.0, 1.0]), glam::Vec3::ZERO);
    }

    #[test]
    fn emission_looks_as_it_does_in_bevy() {
        let exposure = Exposure::default().exposure();
        let emissive = LinearRgba::rgb(2.0, 1.0, 0.5);
        for weight in [0.0, 0.25, 1.0] {
            let seen = emission(emissive, weight, exposure) * exposure;
            // The shader's mix(1, exposure, weight).
            let bevys = rgb(emissive) * (1.0 - weight + weight * exposure);
            assert!(seen.abs_diff_eq(bevys, 1e-5), "{weight}: {seen} {bevys}");
        }
    }

    #[test]
    fn exposure_in_stops_scales_as_bevys_does() {
        let exposure = Exposure { ev100: 7.0 }.exposure();
        assert!((stops(exposure).exp2() / exposure - 1.0).abs() < 1e-5);
        assert!(stops(0.0).is_finite());
    }

    #[test]
    fn transforms_put_points_where_bevy_puts_them() {
        let transform = Transform {
            translation: Vec3::new(1.0, -2.0, 3.0),
            rotation: Quat::from_euler(bevy::math::EulerRot::XYZ, 0.3, -1.1, 2.0),
            scale: Vec3::new(2.0, 0.5, -1.5),
        };
        let point = Vec3::new(0.4, 0.7, -0.9);
        let theirs = transform.transform_point(point);
        let ours = affine(&transform.compute_affine()).transform_point3(glam::dvec3(0.4, 0.7, -0.9));
        assert!(ours.abs_diff_eq(glam::Vec3::from(theirs.to_array()).as_dvec3(), 1e-5), "{ours} {theirs}");
    }

    #[test]
    fn light_that_is_no_number_is_dark() {
        assert_eq!(lux(f32::NAN, Color::WHITE), glam::Vec3::ZERO);
        assert_eq!(lux(-1.0, Color::WHITE), glam::Vec3::ZERO);
    }
}
