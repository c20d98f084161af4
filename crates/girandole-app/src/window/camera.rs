//! Where the window looks from: a camera of the scene, or wherever one walked from there.

use girandole_core::glam::{DVec3, Quat, Vec3};
use girandole_core::scene::{Scene, View, Viewpoint};

/// How close to straight up or down one can look: sine of the angle.
const STEEPEST: f32 = 0.995;

/// How far the written target of a walk is from the eye, metres.
const TARGET: f64 = 1.0;

/// Where one looks from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Eye {
    /// One of the scene's cameras, wherever it moves.
    Camera(usize),
    /// Elsewhere, by numbers: whoever writes them down has the same view again.
    Free(Viewpoint),
}

impl Eye {
    /// Where one comes to see this; `None` for what cannot be seen.
    pub fn free(view: &View) -> Option<Self> {
        let viewpoint = Viewpoint::from_view(view, TARGET);
        viewpoint.view(1.0).ok().map(|_| Self::Free(viewpoint))
    }

    /// The view of a picture with this width / height. The height of what is seen does not depend on it.
    pub fn view(&self, scene: &Scene, aspect: f32) -> View {
        let of_camera = |index: usize| View::new(scene, &scene.cameras[index], aspect);
        match *self {
            Self::Camera(index) => of_camera(index),
            Self::Free(viewpoint) => viewpoint.view(aspect).unwrap_or_else(|_| of_camera(0)),
        }
    }
}

/// Looks elsewhere from the same place: angles in radians, to the right about the vertical, and up.
pub fn turned(view: &View, right: f32, up: f32) -> View {
    let View { forward, .. } = rotated(view, turn(view, right, up));
    let up = if forward.y.abs() > STEEPEST { 0.0 } else { up };
    rotated(view, turn(view, right, up))
}

/// Goes round a point, which stays where it is in the picture; angles as for [`turned`].
pub fn orbited(view: &View, pivot: DVec3, right: f32, up: f32) -> View {
    let turned = turned(view, right, up);
    // Where the pivot is, as the eye sees it, stays.
    let to = (pivot - view.eye).as_vec3();
    let seen = Vec3::new(to.dot(view.right), to.dot(view.up), to.dot(view.forward));
    let now = turned.right * seen.x + turned.up * seen.y + turned.forward * seen.z;
    View { eye: pivot - now.as_dvec3(), ..turned }
}

/// Moves without turning: metres to the right, up and ahead of the picture.
pub fn moved(view: &View, by: Vec3) -> View {
    let shift = view.right * by.x + view.up * by.y + view.forward * by.z;
    View { eye: view.eye + shift.as_dvec3(), ..*view }
}

fn turn(view: &View, right: f32, up: f32) -> Quat {
    Quat::from_rotation_y(-right) * Quat::from_axis_angle(view.right, up)
}

fn rotated(view: &View, rotation: Quat) -> View {
    let forward = (rotation * view.forward).normalize();
    let right = (rotation * view.right).reject_from_normalized(forward).normalize();
    View { right, up: right.cross(forward), forward, ..*view }
}

#[cfg(test)]
mod tests {
    use super::*;
    use girandole_core::glam::Vec2;
    use girandole_core::scene::builtin::{self, MovingObject};

    fn pillars() -> (Scene, View) {
        let scene = builtin::build("pillars", MovingObject::None).unwrap();
        let view = Eye::Camera(0).view(&scene, 1.5);
        (scene, view)
    }

    fn is_right_handed(view: &View) -> bool {
        view.right.cross(view.up).abs_diff_eq(-view.forward, 1e-5)
            && [view.right, view.up, view.forward].iter().all(|a| a.is_normalized())
    }

    #[test]
    fn a_camera_of_the_scene_is_seen_as_it_is_rendered() {
        let (scene, view) = pillars();
        assert_eq!(view, View::new(&scene, &scene.cameras[0], 1.5));
        let free = Eye::free(&view).unwrap();
        let same = free.view(&scene, 1.5);
        assert_eq!((same.eye, same.half_extent), (view.eye, view.half_extent));
        assert!(same.forward.abs_diff_eq(view.forward, 1e-6) && same.up.abs_diff_eq(view.up, 1e-6));
        let wide = free.view(&scene, 3.0);
        assert_eq!(wide.half_extent, Vec2::new(3.0, 1.0) * view.half_extent.y);
        assert_eq!(Eye::free(&View { eye: DVec3::NAN, ..view }), None);
    }

    #[test]
    fn turning_there_and_back_changes_nothing_and_never_tips_over() {
        let (_, view) = pillars();
        let there = turned(&view, 0.3, 0.1);
        assert!(is_right_handed(&there) && !there.forward.abs_diff_eq(view.forward, 0.1));
        assert_eq!(there.eye, view.eye);
        let back = turned(&turned(&there, 0.0, -0.1), -0.3, 0.0);
        assert!(back.forward.abs_diff_eq(view.forward, 1e-5) && back.right.abs_diff_eq(view.right, 1e-5));
        let steep = (0..100).fold(view, |view, _| turned(&view, 0.01, 0.1));
        assert!(is_right_handed(&steep) && steep.up.y > 0.0 && steep.forward.y > 0.9, "{steep:?}");
    }

    #[test]
    fn orbiting_keeps_the_pivot_in_its_place() {
        let (_, view) = pillars();
        let pivot = moved(&view, Vec3::new(0.4, -0.2, 3.0)).eye;
        let around = orbited(&view, pivot, 0.7, 0.2);
        let place = |view: &View| view.relative_to(pivot).project(Vec3::ZERO);
        let ((before, near), (after, far)) = (place(&view), place(&around));
        assert!(before.abs_diff_eq(after, 1e-4) && (near - far).abs() < 1e-4);
        assert!(around.eye.distance(view.eye) > 1.0 && is_right_handed(&around));
    }
}
