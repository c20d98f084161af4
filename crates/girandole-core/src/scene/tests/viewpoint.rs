//! Viewpoints: the views of cameras, and numbers that no view has.

use super::*;
use glam::DVec3;

const VIEWPOINT: Viewpoint = Viewpoint {
    eye: DVec3::new(1.0, 2.0, 3.0),
    target: DVec3::new(-1.0, 1.0, 0.5),
    up: DVec3::Y,
    field: FieldOfView::Perspective { degrees: 50.0 },
    clip: ClipPlanes::NONE,
};

#[test]
fn a_camera_s_viewpoint_has_its_view() {
    for name in builtin::NAMES {
        let scene = builtin::build(name, builtin::MovingObject::None).expect("it is built in");
        let parallel =
            Camera { projection: Projection::Orthographic { ymag: 1.7 }, ..scene.cameras[0].clone() };
        for camera in scene.cameras.iter().chain([&parallel]) {
            let expected = View::new(&scene, camera, 1.5);
            for distance in [0.1, 1.0, 30.0] {
                let view = Viewpoint::of(&scene, camera, distance).view(1.5).expect("a view");
                assert_eq!((view.eye, view.orthographic), (expected.eye, expected.orthographic));
                let difference = (view.right - expected.right).abs().max_element()
                    + (view.up - expected.up).abs().max_element()
                    + (view.forward - expected.forward).abs().max_element()
                    + (view.half_extent / expected.half_extent - 1.0).abs().max_element();
                assert!(difference < 1e-6, "{name}: {difference}");
            }
            let turned = Viewpoint { up: DVec3::X, ..Viewpoint::of(&scene, camera, 1.0) };
            assert!(turned.view(1.5).map_or(true, |view| view.up.distance(expected.up) > 0.1), "the control");
        }
    }
}

#[test]
fn axes_are_orthonormal_and_up_is_up() {
    for up in [DVec3::Y, DVec3::new(0.3, 1e3, -2.0), DVec3::NEG_Y, DVec3::X * 1e-9] {
        let view = Viewpoint { up, ..VIEWPOINT }.view(2.0).expect("a view");
        let axes = glam::Mat3::from_cols(view.right, view.up, -view.forward);
        assert!((axes.transpose() * axes).abs_diff_eq(glam::Mat3::IDENTITY, 1e-6));
        assert!(axes.determinant() > 0.0 && view.up.dot(up.as_vec3()) > 0.0);
        assert_eq!(view.half_extent.x, 2.0 * view.half_extent.y);
    }
}

#[test]
fn the_same_numbers_are_the_same_view() {
    let view = VIEWPOINT.view(1.25).expect("a view");
    assert_eq!(view, VIEWPOINT.view(1.25).expect("a view"));
    let moved = Viewpoint { eye: VIEWPOINT.eye + DVec3::X * 1e-15, ..VIEWPOINT };
    assert_ne!(view, moved.view(1.25).expect("a view"), "the control");
    // The target is in the middle, however far away it is.
    let (at, distance) = view.relative_to(DVec3::ONE).project((VIEWPOINT.target - DVec3::ONE).as_vec3());
    assert!(at.length() < 1e-6 && (distance - VIEWPOINT.eye.distance(VIEWPOINT.target) as f32).abs() < 1e-6);
}

#[test]
fn numbers_without_a_view_are_refused() {
    let field = |field| Viewpoint { field, ..VIEWPOINT };
    let degrees = |degrees| field(FieldOfView::Perspective { degrees });
    let height = |height| field(FieldOfView::Orthographic { height });
    for wrong in [
        Viewpoint { eye: VIEWPOINT.target, ..VIEWPOINT },
        Viewpoint { eye: DVec3::new(f64::NAN, 0.0, 0.0), ..VIEWPOINT },
        Viewpoint { target: DVec3::new(0.0, f64::INFINITY, 0.0), ..VIEWPOINT },
        Viewpoint { target: DVec3::new(0.0, 1e16, 0.0), ..VIEWPOINT },
        Viewpoint { up: DVec3::ZERO, ..VIEWPOINT },
        Viewpoint { up: DVec3::NAN, ..VIEWPOINT },
        Viewpoint { up: VIEWPOINT.target - VIEWPOINT.eye, ..VIEWPOINT },
        Viewpoint { up: VIEWPOINT.eye - VIEWPOINT.target, ..VIEWPOINT },
        degrees(0.0),
        degrees(180.0),
        degrees(-30.0),
        degrees(f64::NAN),
        degrees(1e-300),
        height(0.0),
        height(-1.0),
        height(f64::INFINITY),
    ] {
        let said = wrong.view(1.0).expect_err("no view").to_string();
        assert!(said.starts_with("this view cannot be shown: "), "{said}");
    }
    assert!(degrees(179.0).view(1.0).is_ok() && height(0.01).view(1.0).is_ok());
}
