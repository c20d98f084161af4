//! Bevy's lights in Girandole's terms.

use crate::units;
use bevy::light::{DirectionalLight, PointLight, RectLight, SpotLight};
use bevy::transform::components::GlobalTransform;
use girandole_core::glam::{DAffine3, DVec3, Vec3};
use girandole_core::scene::{MaterialId, Mesh, PunctualKind};
use std::f32::consts::FRAC_PI_2;

/// What Bevy narrows cones to, and widens them by.
const LEAST_ANGLE: f32 = 1e-4;

/// A light in place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Its shape.
    pub shape: Shape,
    /// Candela, lux or nits, as its shape has it.
    pub light: Vec3,
    /// World from light.
    pub place: DAffine3,
}

/// What emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A light without extent.
    Punctual(PunctualKind),
    /// [`rectangle`], with its extent in its place.
    Rectangle,
}

/// A point light.
pub fn point(light: &PointLight, place: &GlobalTransform) -> Source {
    let light = units::candela(light.intensity, light.color);
    Source { shape: Shape::Punctual(PunctualKind::Point), light, place: rigid(place) }
}

/// A spot light: both fall off from the inner to the outer angle in the same way.
pub fn spot(light: &SpotLight, place: &GlobalTransform) -> Source {
    let outer = light.outer_angle.clamp(LEAST_ANGLE, FRAC_PI_2);
    let inner = light.inner_angle.clamp(0.0, outer - 0.5 * LEAST_ANGLE);
    let shape = Shape::Punctual(PunctualKind::Spot { inner, outer });
    Source { shape, light: units::candela(light.intensity, light.color), place: rigid(place) }
}

/// A directional light.
pub fn directional(light: &DirectionalLight, place: &GlobalTransform) -> Source {
    let light = units::lux(light.illuminance, light.color);
    Source { shape: Shape::Punctual(PunctualKind::Directional), light, place: rigid(place) }
}

/// A light of one side of a rectangle.
pub fn rect(light: &RectLight, place: &GlobalTransform) -> Source {
    let place = units::affine(&place.affine());
    let extent = DVec3::new(f64::from(light.width), f64::from(light.height), 1.0);
    let axes = place.matrix3;
    let sides = [axes.x_axis.length() * extent.x, axes.y_axis.length() * extent.y].map(|side| side as f32);
    Source {
        shape: Shape::Rectangle,
        light: units::nits(light.intensity, light.color, sides),
        place: place * DAffine3::from_scale(extent),
    }
}

/// A square of side 1 about the origin that faces −Z.
pub fn rectangle(material: MaterialId) -> Mesh {
    let corners = [(-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, -0.5)].map(|(x, y)| Vec3::new(x, y, 0.0));
    let mut mesh = Mesh::default();
    mesh.add_polygon(&corners, material);
    mesh
}

/// Without scale.
fn rigid(place: &GlobalTransform) -> DAffine3 {
    let (_, rotation, translation) = place.to_scale_rotation_translation();
    let unscaled = bevy::math::Affine3A::from_rotation_translation(rotation, translation);
    units::affine(&unscaled)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::color::Color;
    use bevy::math::{Quat, Vec3 as BevyVec3};
    use bevy::transform::components::Transform;
    use std::f32::consts::PI;

    fn turned() -> GlobalTransform {
        let rotation = Quat::from_rotation_y(FRAC_PI_2);
        Transform { translation: BevyVec3::new(1.0, 2.0, 3.0), rotation, scale: BevyVec3::splat(2.0) }.into()
    }

    #[test]
    fn lights_shine_where_bevys_do() {
        let light = directional(&DirectionalLight { illuminance: 50.0, ..Default::default() }, &turned());
        assert!(light.light.abs_diff_eq(Vec3::splat(50.0), 1e-4));
        let forward = light.place.transform_vector3(DVec3::NEG_Z).as_vec3();
        let bevys = turned().forward().to_array();
        assert!(forward.abs_diff_eq(bevys.into(), 1e-5), "{forward} {bevys:?}");
        let lamp =
            point(&PointLight { intensity: 4.0 * PI, color: Color::WHITE, ..Default::default() }, &turned());
        assert!(lamp.place.translation.abs_diff_eq(DVec3::new(1.0, 2.0, 3.0), 1e-6));
        assert!(lamp.light.abs_diff_eq(Vec3::ONE, 1e-5));
    }

    #[test]
    fn cones_are_possible_whatever_their_angles() {
        for (inner, outer) in [(0.2, 0.5), (0.5, 0.5), (0.9, 0.3), (-1.0, 9.0)] {
            let light = SpotLight { inner_angle: inner, outer_angle: outer, ..Default::default() };
            let Shape::Punctual(PunctualKind::Spot { inner, outer }) = spot(&light, &turned()).shape else {
                panic!("it is a spot");
            };
            assert!(0.0 <= inner && inner < outer && outer <= FRAC_PI_2, "{inner} {outer}");
        }
    }

    #[test]
    fn a_rectangle_faces_minus_z_and_keeps_its_lumens() {
        let light = RectLight { width: 2.0, height: 0.5, intensity: 100.0, ..Default::default() };
        let source = rect(&light, &turned());
        let mesh = rectangle(MaterialId(0));
        let normal = source.place.transform_vector3(mesh.normals[0].as_dvec3());
        let forward = DVec3::from(turned().forward().to_array().map(f64::from));
        assert!(normal.normalize().dot(forward) > 0.999);
        let [a, b, c, _] = [0, 1, 2, 3].map(|i| source.place.transform_point3(mesh.positions[i].as_dvec3()));
        let area = (b - a).cross(c - b).length() as f32;
        assert!((source.light.x * PI * area - 100.0).abs() < 1e-3, "{area}");
    }
}
