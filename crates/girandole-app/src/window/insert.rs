//! Objects that are put in front of the camera.

use super::camera::moved;
use super::selection::Selected;
use super::session::Session;
use super::tools::Tools;
use girandole_core::glam::{Quat, Vec3};
use girandole_core::scene::{Edit, Mesh, ReadModel, Shape, Transform, UpAxis};

/// How far in front of the camera an object is put, and its largest extent, in the scene's size.
const DISTANCE: f32 = 0.25;
const SIZE: f32 = 0.08;

/// Puts an object there, as large as suits the scene, and picks it. Files have the axis up that was said of the
/// scene's own.
pub fn insert(session: &mut Session, tools: &mut Tools, name: &str, shape: Shape, read_model: &ReadModel) {
    let before = session.scene.objects.len();
    let mesh = match shape.mesh(read_model) {
        Ok(mesh) => mesh,
        Err(error) => return session.notice = Some(crate::sentence(&error.into())),
    };
    let view = session.view(tools.picture_size);
    let size = session.scene.frame_of_reference().scale;
    let place = moved(&view, Vec3::Z * size * DISTANCE).eye.as_vec3();
    let up = session.source.load.up.filter(|_| matches!(shape, Shape::File(_)));
    let transform = fitted(&mesh, up.map(Into::into).unwrap_or_default(), place, size * SIZE);
    let edit = Edit::InsertObject { name: name.into(), shape, material: None, transform, dynamic: true };
    session.edit_with(edit, &|_| Ok(mesh.clone()));
    session.end_step();
    if session.scene.objects.len() > before {
        tools.select(Some(Selected::Object(before.into())));
    }
}

/// Puts a mesh's middle at a place, with an axis up, and makes its largest extent so many metres.
fn fitted(mesh: &Mesh, up: UpAxis, place: Vec3, extent: f32) -> Transform {
    let first = mesh.positions.first().copied().unwrap_or_default();
    let bounds = mesh.positions.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p)));
    let largest = (bounds.1 - bounds.0).max_element();
    let scale = if largest > 0.0 { extent / largest } else { 1.0 };
    let translation = place - up.turned(bounds.0 + bounds.1) * (0.5 * scale);
    let rotation = Quat::from_mat3(&up.rotation().as_mat3());
    Transform::Parts { translation, rotation, scale: Vec3::splat(scale) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use girandole_core::scene::MaterialId;
    use girandole_core::scene::builtin::shapes;

    #[test]
    fn objects_of_any_unit_are_as_large_and_where_they_should_be() {
        let mut mesh = shapes::thesis_torus(MaterialId(0));
        let of_millimetres = mesh.positions.iter().map(|p| (*p + Vec3::new(3.0, 0.0, -1.0)) * 1000.0);
        mesh.positions = of_millimetres.collect();
        let place = Vec3::new(1.0, 2.0, 3.0);
        for up in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
            let world = fitted(&mesh, up, place, 0.5).affine();
            let (low, high) = mesh
                .positions
                .iter()
                .map(|p| world.transform_point3(p.as_dvec3()).as_vec3())
                .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
            assert!(((low + high) * 0.5).abs_diff_eq(place, 1e-4), "{low} {high}");
            assert!(((high - low).max_element() - 0.5).abs() < 1e-4, "{low} {high}");
            let turned = world.transform_vector3(axis_of(up).as_dvec3()).normalize();
            assert!(turned.as_vec3().abs_diff_eq(Vec3::Y, 1e-5), "{turned}");
        }
    }

    fn axis_of(up: UpAxis) -> Vec3 {
        match up {
            UpAxis::X => Vec3::X,
            UpAxis::Y => Vec3::Y,
            UpAxis::Z => Vec3::Z,
        }
    }
}
