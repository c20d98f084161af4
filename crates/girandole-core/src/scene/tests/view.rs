//! Views: the same rays as ever, any projection, parts of a picture.

use super::*;
use glam::camera::{lh::proj::directx as lh, rh::proj::directx as rh};
use glam::{DAffine3, DQuat, Mat4, Vec2, Vec4};

fn cameras() -> Vec<(Scene, Camera)> {
    let mut scenes = Vec::new();
    for name in builtin::NAMES {
        let scene = builtin::build(name, builtin::MovingObject::None).expect("it is built in");
        let mut cameras = scene.cameras.clone();
        let parallel = Projection::Orthographic { ymag: 1.7 };
        cameras.push(Camera { projection: parallel, ..cameras[0].clone() });
        scenes.extend(cameras.into_iter().map(|c| (scene.clone(), c)));
    }
    scenes
}

/// Rays as they were when views were relative to the geometry from the start.
fn ray_as_before(scene: &Scene, origin: DVec3, camera: &Camera, aspect: f32, ndc: Vec2) -> (Vec3, Vec3) {
    let affine = scene.world_from_node(camera.node);
    let axis = |v: DVec3| affine.transform_vector3(v).normalize_or_zero().as_vec3();
    let (y, orthographic) = match camera.projection {
        Projection::Perspective { yfov } => (libm::tanf(yfov * 0.5), false),
        Projection::Orthographic { ymag } => (ymag, true),
    };
    let half_extent = Vec2::new(y * aspect, y);
    let eye = (affine.translation - origin).as_vec3();
    let offset = axis(DVec3::X) * (ndc.x * half_extent.x) + axis(DVec3::Y) * (ndc.y * half_extent.y);
    let forward = axis(DVec3::NEG_Z);
    if orthographic { (eye + offset, forward) } else { (eye, forward + offset) }
}

fn bits((a, b): (Vec3, Vec3)) -> [u32; 6] {
    [a.x, a.y, a.z, b.x, b.y, b.z].map(f32::to_bits)
}

#[test]
fn rays_are_what_they_were() {
    for (scene, camera) in cameras() {
        let origin = Geometry::new(&scene).origin;
        let size = [37, 23];
        let aspect = size[0] as f32 / size[1] as f32;
        let view = View::new(&scene, &camera, aspect).relative_to(origin);
        for i in 0..size[0] * size[1] {
            let at = Vec2::new((i % size[0]) as f32, (i / size[0]) as f32) + 0.5;
            let uv = at / Vec2::new(size[0] as f32, size[1] as f32);
            let ndc = Vec2::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
            let expected = ray_as_before(&scene, origin, &camera, aspect, ndc);
            assert_eq!(bits(view.pixel_ray(at, size)), bits(expected));
            assert_ne!(bits(view.pixel_ray(at + 0.5, size)), bits(expected), "the control");
        }
    }
}

#[test]
fn parts_of_a_picture_have_its_rays() {
    for (scene, camera) in cameras() {
        let whole = View::new(&scene, &camera, 2.0);
        let (size, half) = ([64_u32, 32_u32], [32_u32, 16_u32]);
        for (column, row) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let from = [column as f32 * 0.5, row as f32 * 0.5];
            let part = whole.part(from, from.map(|x| x + 0.5));
            let rays = |view: &View, at: Vec2, size| bits(view.relative_to(DVec3::ONE).pixel_ray(at, size));
            for (x, y) in (0..half[1]).flat_map(|y| (0..half[0]).map(move |x| (x, y))) {
                let at = Vec2::new(x as f32, y as f32) + 0.5;
                let shift = Vec2::new((column * half[0]) as f32, (row * half[1]) as f32);
                assert_eq!(rays(&part, at, half), rays(&whole, at + shift, size));
                assert_ne!(rays(&part, at + 1.0, half), rays(&whole, at + shift, size), "the control");
            }
            // A quarter of a quarter is a sixteenth.
            let sixteenth = part.part([0.5, 0.0], [1.0, 0.5]);
            let at = Vec2::new(3.5, 2.5);
            let shift = Vec2::new((column * half[0] + 16) as f32, (row * half[1]) as f32);
            assert_eq!(rays(&sixteenth, at, [16, 8]), rays(&whole, at + shift, size));
        }
    }
}

/// Off-axis, from the distances of the picture's edges at a distance of 1: left, right, bottom, top.
fn frustum([l, r, b, t]: [f32; 4], depth: [f32; 2]) -> Mat4 {
    Mat4::from_cols(
        Vec4::new(2.0 / (r - l), 0.0, 0.0, 0.0),
        Vec4::new(0.0, 2.0 / (t - b), 0.0, 0.0),
        Vec4::new((r + l) / (r - l), (t + b) / (t - b), depth[0], -1.0),
        Vec4::new(0.0, 0.0, depth[1], 0.0),
    )
}

fn jittered(by: Vec2, projection: Mat4) -> Mat4 {
    Mat4::from_translation(by.extend(0.0)) * projection
}

/// Projections that look along −Z, with the distances of their near and far planes.
fn projections() -> Vec<(Mat4, Option<f32>, Option<f32>)> {
    let turned = Mat4::from_scale(vec3(-1.0, -1.0, 1.0));
    vec![
        (rh::perspective(0.9, 1.5, 0.1, 80.0), Some(0.1), Some(80.0)),
        (rh::perspective_infinite(0.9, 1.5, 0.3), Some(0.3), None),
        (rh::perspective_infinite_reverse(0.9, 1.5, 0.05), Some(0.05), None),
        (rh::perspective(0.9, 1.5, 80.0, 0.1), Some(0.1), Some(80.0)),
        (frustum([-0.2, 0.9, 0.1, 0.4], [0.0, 0.01]), Some(0.01), None),
        (jittered(Vec2::new(0.003, -0.002), rh::perspective(0.9, 1.5, 0.1, 80.0)), Some(0.1), Some(80.0)),
        (rh::perspective(0.9, 1.5, 0.1, 80.0) * 7.0, Some(0.1), Some(80.0)),
        (turned * rh::perspective(0.9, 1.5, 0.1, 80.0), Some(0.1), Some(80.0)),
        (rh::orthographic(-1.0, 3.0, -0.5, 2.0, 0.2, 60.0), Some(0.2), Some(60.0)),
        (rh::orthographic(-1.0, 3.0, -0.5, 2.0, 60.0, 0.2), Some(0.2), Some(60.0)),
        (
            jittered(Vec2::new(0.01, 0.02), rh::orthographic(-2.0, 2.0, -2.0, 2.0, 0.2, 60.0)),
            Some(0.2),
            Some(60.0),
        ),
    ]
}

fn place_in_world() -> DAffine3 {
    let turn = DQuat::from_euler(glam::EulerRot::YXZ, 0.7, -0.4, 0.2);
    DAffine3::from_rotation_translation(turn, DVec3::new(1e6, -300.0, 12.5)).inverse()
}

#[test]
fn any_projection_shows_what_its_matrix_says() {
    let view_from_world = place_in_world();
    let cases = projections().into_iter().map(|(m, near, far)| (view_from_world, m, near, far));
    // View space that looks along +Z, and one that starts behind the eye.
    let half_turn = DAffine3::from_rotation_y(std::f64::consts::PI);
    let others = [
        (
            half_turn * view_from_world,
            Mat4::from_scale(vec3(-1.0, 1.0, 1.0)) * lh::perspective(0.9, 1.5, 0.1, 80.0),
        ),
        (
            DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0)) * view_from_world,
            lh::perspective(0.9, 1.5, 0.1, 80.0),
        ),
    ];
    let others = others.into_iter().map(|(v, m)| (v, m, Some(0.1), Some(80.0)));
    for (index, (view_from_world, clip_from_view, near, far)) in cases.chain(others).enumerate() {
        let view = View::from_matrices(view_from_world, clip_from_view).expect("it is possible");
        let close = |a: Option<f32>, b: Option<f32>| match (a, b) {
            (Some(a), Some(b)) => (a / b - 1.0).abs() < 1e-3,
            _ => a == b,
        };
        assert!(
            close(view.near(), near) && close(view.far(), far),
            "{index}: {:?} {:?}",
            view.near(),
            view.far()
        );
        let local = view.relative_to(view.eye);
        let mut off = 0;
        for i in 0..27 {
            let ndc = Vec2::new((i % 3) as f32 - 1.0, (i / 3 % 3) as f32 - 1.0) * 0.9;
            let distance = [0.5, 3.0, 40.0][i / 9];
            let (from, along) = local.ray(ndc);
            let point = from + along * distance;
            let clip = clip_from_view.as_dmat4()
                * view_from_world.transform_point3(view.eye + point.as_dvec3()).extend(1.0);
            let shown = (clip / clip.w).as_vec4();
            assert!((Vec2::new(shown.x, shown.y) - ndc).length() < 2e-5, "{index}: {shown} for {ndc}");
            assert!(clip.w > 0.0);
            let (at, depth) = local.project(point);
            assert!(
                (at - ndc).length() < 2e-5 && (depth / distance - 1.0).abs() < 1e-5,
                "{index}: {at} {depth}"
            );
            let clip_depth = view.clip_depth(depth).expect("it has a depth");
            assert!((clip_depth - shown.z).abs() < 2e-6, "{index}: {clip_depth} for {shown}");
            off += usize::from((view.clip_depth(depth * 1.01).expect("the same") - shown.z).abs() > 2e-6);
        }
        assert!(off > 10, "the control: {index}");
    }
    // A plane behind the eye moves it back.
    let behind = rh::orthographic(-1.0, 1.0, -1.0, 1.0, -5.0, 5.0);
    let view = View::from_matrices(DAffine3::IDENTITY, behind).expect("it is possible");
    assert_eq!((view.eye.z.round(), view.clip_depth(5.0)), (5.0, Some(0.5)));
}

#[test]
fn matrices_of_a_camera_are_that_camera() {
    for (scene, camera) in cameras() {
        let expected = View::new(&scene, &camera, 1.5);
        let projection = match camera.projection {
            Projection::Perspective { yfov } => rh::perspective_infinite_reverse(yfov, 1.5, 0.01),
            Projection::Orthographic { ymag } => {
                rh::orthographic(-ymag * 1.5, ymag * 1.5, -ymag, ymag, 0.0, 10.0)
            }
        };
        let found =
            View::from_matrices(scene.world_from_node(camera.node).inverse(), projection).expect("a view");
        assert!(found.eye.distance(expected.eye) < 1e-9);
        for (a, b) in
            [(found.right, expected.right), (found.up, expected.up), (found.forward, expected.forward)]
        {
            assert!((a - b).length() < 1e-6, "{found:?} {expected:?}");
        }
        assert!((found.half_extent / expected.half_extent - 1.0).abs().max_element() < 1e-6);
        assert!(found.center.length() < 1e-6 && found.orthographic == expected.orthographic);
    }
}

#[test]
fn what_cannot_be_shown_is_refused() {
    let world = place_in_world();
    let usual = rh::perspective(0.9, 1.5, 0.1, 80.0);
    let refused = |view: DAffine3, projection: Mat4, about: &str| {
        let sentence = View::from_matrices(view, projection).expect_err(about).to_string();
        assert!(sentence.contains(about) && !sentence.contains('\n'), "{sentence}");
    };
    let mut holes = usual;
    holes.x_axis.x = f32::NAN;
    refused(world, holes, "finite");
    refused(DAffine3::from_translation(DVec3::NAN), usual, "finite");
    refused(DAffine3::from_scale(DVec3::splat(2.0)) * world, usual, "not a rotation");
    let sheared = DAffine3::from_mat3(glam::DMat3::from_cols(DVec3::X, DVec3::new(0.1, 1.0, 0.0), DVec3::Z));
    refused(sheared, usual, "not a rotation");
    refused(world, usual * Mat4::from_rotation_y(0.1), "skewed");
    refused(world, Mat4::from_rotation_z(0.1) * usual, "skewed");
    let mut oblique = usual;
    oblique.x_axis.z = 0.2;
    refused(world, oblique, "skewed");
    let mut leaning = rh::orthographic(-1.0, 1.0, -1.0, 1.0, 0.1, 9.0);
    leaning.z_axis.x = 0.3;
    refused(world, leaning, "skewed");
    refused(world, Mat4::ZERO, "skewed");
    refused(world, Mat4::from_scale(vec3(-1.0, 1.0, 1.0)) * usual, "mirrored");
    refused(DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)) * world, usual, "mirrored");
    refused(world, Mat4::from_scale(vec3(0.0, 1.0, 1.0)) * usual, "width");
    refused(world, Mat4::from_scale(vec3(1.0, 1.0, 0.0)) * usual, "near plane");
    refused(world, Mat4::from_scale(vec3(1.0, 1.0, 0.0)) * leaning_free(), "depth");
    // The control.
    assert!(View::from_matrices(world, usual).is_ok());
}

fn leaning_free() -> Mat4 {
    rh::orthographic(-1.0, 1.0, -1.0, 1.0, 0.1, 9.0)
}
