//! Where rays start and end: the same whatever large thing is outside, however far away all is, and where lights lie on surfaces.

use crate::common::{Stage, look, trace};
use girandole_core::glam::{Quat, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::{
    Geometry, Material, MaterialId, Mesh, PunctualKind, Scene, Transform, View, builtin::shapes,
};
use girandole_core::trace::{SceneTracer, ray_offset_distance};
use girandole_core::visibility::{VisibilityDatabase, VisibilitySettings};
use girandole_reference::{OracleSettings, PathSettings, oracle, oracle_with_states};

const SIZE: u32 = 48;

fn cuboid(low: Vec3, high: Vec3, material: MaterialId) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_box(low, high, material);
    mesh
}

/// A closed room of 4 m × 2.6 m × 5 m with a box, a ball and no light. Its walls have two sides or that to the room.
fn room(double_sided: bool) -> Stage {
    let mut stage = Stage::default();
    let of_walls = Material { double_sided, ..Material::diffuse("walls", Vec3::new(0.75, 0.73, 0.7)) };
    let walls = stage.material(of_walls);
    let blue = stage.material(Material::diffuse("blue", Vec3::new(0.2, 0.35, 0.6)));
    stage.room(Vec3::new(-2.0, 0.0, -2.5), Vec3::new(2.0, 2.6, 2.5), walls);
    stage.mesh(cuboid(Vec3::new(-1.2, 0.0, -1.6), Vec3::new(-0.3, 0.75, -0.7), blue));
    let ball = Transform::translation(Vec3::new(0.9, 0.45, -0.8));
    stage.scene.add_object("ball", shapes::sphere(0.45, 24, 12, blue), ball);
    stage
}

/// With a panel of 0.8 m at this height, that faces down.
fn with_panel(mut stage: Stage, height: f32) -> Stage {
    let lamp = stage.material(Material::emitter("lamp", Vec3::new(20.0, 18.0, 16.0)));
    stage.quad(Vec3::new(-0.4, height, -0.4), Vec3::X * 0.8, Vec3::Z * 0.8, lamp);
    stage
}

/// On a plain of so many metres.
fn on_plain(mut stage: Stage, half: f32, tilt: f32) -> Stage {
    let grass = stage.material(Material::diffuse("grass", Vec3::new(0.3, 0.4, 0.2)));
    let side = Quat::from_rotation_z(tilt) * Vec3::X * (2.0 * half);
    let corner = Vec3::Y * -3.0 - side * 0.4 - Vec3::Z * half;
    stage.quad(corner, Vec3::Z * (2.0 * half), side, grass);
    stage
}

fn view() -> View {
    look(Vec3::new(0.2, 1.5, 2.3), Vec3::new(0.0, 1.0, -1.0), 0.7)
}

fn by_samples(scene: &Scene, view: &View) -> Image {
    let geometry = Geometry::new(scene);
    let settings = LightSettings { count: 60, ..LightSettings::default() };
    let lights = LightSet::sample(scene, &geometry, &settings).expect("lights");
    let tracer = SceneTracer::new(scene, &geometry);
    let settings = OracleSettings::default();
    let traced = oracle(&tracer, &lights, view, [SIZE; 2], &settings, &|_| ());
    // What visibility determination says is what rays find.
    let database = VisibilityDatabase::build(scene, &geometry, &lights, &VisibilitySettings::default());
    let database = database.expect("a database");
    let known = oracle_with_states(&tracer, &lights, &database, view, [SIZE; 2], &settings, &|_| ());
    let error = difference(&known, &traced);
    assert!(error < 1e-6, "states differ from rays: {error}");
    traced
}

fn by_paths(scene: &Scene, view: &View) -> Image {
    let settings = PathSettings { paths: 64, bounces: Some(3), seed: 1 };
    trace(scene, &Geometry::new(scene), view, SIZE, settings).mean
}

/// Sum of squared differences, as a share of that of the second picture.
fn difference(a: &Image, b: &Image) -> f32 {
    let squares: f32 = b.pixels.iter().map(|b| b.length_squared()).sum();
    let differences = a.pixels.iter().zip(&b.pixels).map(|(a, b)| (*a - *b).length_squared());
    differences.sum::<f32>() / squares.max(f32::MIN_POSITIVE)
}

/// The same but for the pixel that differs most: an edge that goes through its centre may lie on either side.
fn difference_but_for_one(a: &Image, b: &Image) -> f32 {
    let error = |&i: &usize| (a.pixels[i] - b.pixels[i]).length_squared();
    let most = (0..a.pixels.len()).max_by(|i, j| error(i).total_cmp(&error(j))).unwrap_or_default();
    let [mut a, mut b] = [a.clone(), b.clone()];
    (a.pixels[most], b.pixels[most]) = (Vec3::ZERO, Vec3::ZERO);
    difference(&a, &b)
}

/// Asserts that two scenes look alike, by samples and by paths, and that another one does not.
fn assert_alike(
    what: &str,
    [found, expected, other]: [&Scene; 3],
    difference: fn(&Image, &Image) -> f32,
    most: [f32; 2],
) {
    for (picture, most) in [by_samples, by_paths].into_iter().zip(most) {
        let [found, expected, other] = [found, expected, other].map(|scene| picture(scene, &view()));
        let error = difference(&found, &expected);
        assert!(error < most, "{what}: {error}");
        let control = difference(&other, &expected);
        assert!(control > 4.0 * most, "{what}: the control, {control}");
    }
}

#[test]
fn a_room_is_no_other_for_a_plain_outside() {
    let plain = with_panel(room(false), 2.58);
    let dim = with_panel(room(false), 2.4);
    for (half, tilt) in [(2e3, 0.0), (4.5e3, 0.3), (1e4, 0.0)] {
        let stage = on_plain(with_panel(room(false), 2.58), half, tilt);
        let scenes = [&stage.scene, &plain.scene, &dim.scene];
        assert_alike(&format!("{half} m"), scenes, difference, [1e-3, 0.01]);
        let geometry = stage.geometry();
        let corner = (Vec3::new(2.0, 0.0, 2.5).as_dvec3() - geometry.origin).as_vec3();
        let offset = ray_offset_distance(&geometry, corner);
        assert!(offset < 2e-7 * half && offset >= 4.0 * f32::EPSILON * corner.length(), "{half} m: {offset}");
        assert!(geometry.diagonal() * 1e-5 > 0.03, "the control: a share of what there is");
    }
    // A stray box, and a thing that may move far.
    let mut stray = with_panel(room(false), 2.58);
    let far = Transform::translation(Vec3::new(3e3, 0.0, 0.0));
    let moved = stray.scene.add_object("stray", cuboid(Vec3::splat(-1.0), Vec3::ONE, MaterialId(0)), far);
    stray.scene.objects[moved].dynamic = true;
    assert_alike("a stray box", [&stray.scene, &plain.scene, &dim.scene], difference, [1e-3, 0.01]);
}

#[test]
fn a_room_is_the_same_far_away_and_at_any_size() {
    let stage = with_panel(room(false), 2.58);
    let expected = by_samples(&stage.scene, &view());
    for far in [5e3, 1e5] {
        let mut scene = stage.scene.clone();
        let shift = Vec3::new(far, 0.1 * far, -far);
        let root = scene.add_node("site", Transform::translation(shift));
        (0..root.index()).for_each(|node| scene.nodes[node].parent = Some(root));
        let view = View { eye: view().eye + shift.as_dvec3(), ..view() };
        let error = difference(&by_samples(&scene, &view), &expected);
        assert!(error < 1e-3, "{far} m away: {error}");
    }
    for size in [2e-4, 1e3] {
        let mut scene = stage.scene.clone();
        scene.scale(size).expect("a scale");
        let view = View { eye: view().eye * size, ..view() };
        let error = difference(&by_samples(&scene, &view), &expected);
        assert!(error < 1e-3, "× {size}: {error}");
    }
    // The control: it is not the picture of nothing.
    assert!(difference(&by_samples(&with_panel(room(false), 2.4).scene, &view()), &expected) > 4e-3);
}

/// With a punctual light, as it is or shifted.
fn with_light(double_sided: bool, kind: PunctualKind, at: Vec3, towards: Vec3) -> Stage {
    let mut stage = room(double_sided);
    stage.punctual(kind, Vec3::splat(5.0), at, towards);
    stage
}

#[test]
fn lights_on_surfaces_light_like_those_beside_them() {
    let point = PunctualKind::Point;
    let spot = PunctualKind::Spot { inner: 0.5, outer: 0.9 };
    let below = Vec3::new(0.2, 0.0, -1.0);
    let (in_ceiling, in_wall) = (Vec3::new(0.3, 2.6, 0.2), Vec3::new(2.0, 1.5, -0.5));
    let (in_edge, in_corner) = (Vec3::new(0.5, 2.6, -2.5), Vec3::new(-2.0, 2.6, -2.5));
    for double_sided in [false, true] {
        for (what, kind, at, inside) in [
            ("a point in a ceiling", point, in_ceiling, Vec3::NEG_Y),
            ("a point in a wall", point, in_wall, Vec3::NEG_X),
            ("a point in an edge", point, in_edge, Vec3::new(0.0, -1.0, 1.0)),
            ("a point in a corner, on a vertex", point, in_corner, Vec3::new(1.0, -1.0, 1.0)),
            ("a spot in a ceiling", spot, in_ceiling, Vec3::NEG_Y),
        ] {
            let light = |at: Vec3| with_light(double_sided, kind, at, below).scene;
            // Paths hardly find the spot above a light: what it reflects is their noise.
            let (on, beside) = (light(at), light(at + inside * 1e-3));
            let outside = light(at - inside * 0.2);
            let [on, beside, outside] = [on, beside, outside].map(|scene| by_samples(&scene, &view()));
            let error = difference(&on, &beside);
            assert!(error < 0.01, "{what}, {double_sided}: {error}");
            assert!(difference(&outside, &beside) > 0.9, "{what}: the control");
            let speckles = |image: &Image| image.pixels.iter().filter(|p| p.max_element() <= 0.0).count();
            assert!(speckles(&on) <= speckles(&beside), "{what}: {}", speckles(&on));
            if double_sided {
                continue;
            }
            let [on, beside] = [at, at + inside * 1e-3].map(|at| by_paths(&light(at), &view()));
            let energy = on.mean().x / beside.mean().x;
            assert!((energy - 1.0).abs() < 0.03, "{what}, {double_sided}: paths, {energy}");
        }
    }
}

#[test]
fn a_panel_in_the_plane_of_a_ceiling_is_seen_and_lights() {
    for (height, double_sided) in [(2.6, false), (2.6, true)] {
        let on = with_panel(room(double_sided), height);
        let below = with_panel(room(double_sided), height - 1e-4);
        let above = with_panel(room(double_sided), height + 0.01);
        let scenes = [&on.scene, &below.scene, &above.scene];
        assert_alike("a panel", scenes, difference_but_for_one, [1e-3, 1e-3]);
    }
    // Flush with a wall that is turned, far from the origin.
    let turned = |height: f32| {
        let mut stage = with_panel(room(false), height);
        let place = Transform::rigid(
            Quat::from_euler(girandole_core::glam::EulerRot::XYZ, 0.4, 0.7, 0.2),
            Vec3::new(30.0, -7.0, 12.0),
        );
        let root = stage.scene.add_node("turned", place);
        (0..root.index()).for_each(|node| stage.scene.nodes[node].parent = Some(root));
        stage.scene
    };
    let view = {
        let mut scene = turned(2.6);
        let node =
            scene.add_node("eye", Transform::looking_at(Vec3::new(0.2, 1.5, 2.3), Vec3::new(0.0, 2.0, -1.0)));
        scene.nodes[node].parent = Some((node.index() - 1).into());
        let place = scene.world_from_node(node);
        let axis = |v: Vec3| place.transform_vector3(v.as_dvec3()).as_vec3();
        View {
            eye: place.translation,
            right: axis(Vec3::X),
            up: axis(Vec3::Y),
            forward: axis(Vec3::NEG_Z),
            ..view()
        }
    };
    let [on, below, above] = [2.6, 2.5999, 2.61].map(|height| by_samples(&turned(height), &view));
    let [error, control] = [&on, &above].map(|picture| difference_but_for_one(picture, &below));
    assert!(error < 1e-3 && control > 0.5, "turned: {error}, {control}");
}
