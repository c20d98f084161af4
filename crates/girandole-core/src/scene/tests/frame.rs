//! The frame of reference: what it was where nothing is an outlier, and none the worse for outliers.

use super::*;
use crate::trace::ray_offset_distance;

/// Origin, bounds and diagonal of all positions.
fn of_all_positions(scene: &Scene) -> FrameOfReference {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for object in &scene.objects {
        let affine = scene.world_from_node(object.node);
        for p in &scene.meshes[object.mesh].positions {
            let p = affine.transform_point3(p.as_dvec3());
            if p.is_finite() {
                low = low.min(p);
                high = high.max(p);
            }
        }
    }
    let origin = (low + high) * 0.5;
    let bounds = ((low - origin).as_vec3(), (high - origin).as_vec3());
    let scale = (bounds.1 - bounds.0).length();
    FrameOfReference { origin, bounds, scale, surface_extent: scale, detail: scale }
}

fn bits(frame: &FrameOfReference) -> ([u64; 3], [u32; 7]) {
    let [a, b, c] = frame.bounds.0.to_array();
    let [d, e, f] = frame.bounds.1.to_array();
    (frame.origin.to_array().map(f64::to_bits), [a, b, c, d, e, f, frame.scale].map(f32::to_bits))
}

#[test]
fn scenes_without_outliers_are_as_large_as_their_bounds() {
    let mut scenes = Vec::new();
    for name in builtin::NAMES {
        for object in
            [builtin::MovingObject::None, builtin::MovingObject::Torus, builtin::MovingObject::Teapot]
        {
            scenes.push(builtin::build(name, object).expect("it is built in"));
        }
    }
    #[cfg(feature = "import")]
    for name in ["cornell", "table", "punctual"] {
        let truth =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../girandole-reference/tests/truth");
        scenes.push(Scene::load(&truth.join(name).join("scene.glb")).expect("the scene loads"));
    }
    // A house on a plane of 10 km; two houses 10 km apart; a ball under a dome.
    let white = Material::default();
    for parts in [
        vec![(vec3(1e4, 1.0, 1e4), Vec3::ZERO), (Vec3::splat(10.0), vec3(0.0, 5.0, 0.0))],
        vec![(Vec3::splat(10.0), Vec3::ZERO), (Vec3::splat(10.0), vec3(1e4, 0.0, 0.0))],
        vec![(Vec3::splat(1.0), Vec3::ZERO), (Vec3::splat(5e3), Vec3::ZERO)],
    ] {
        let mut scene = Scene::default();
        let material = scene.add_material(white.clone());
        for (size, at) in parts {
            scene.add_object(
                "",
                shapes::cuboid(size * -0.5, size * 0.5, material),
                Transform::translation(at),
            );
        }
        scenes.push(scene);
    }
    for scene in &scenes {
        let (found, expected) = (FrameOfReference::of(scene), of_all_positions(scene));
        assert_eq!(bits(&found), bits(&expected), "{}: {found:?} {expected:?}", scene.name);
        let geometry = Geometry::new(scene);
        assert_eq!(bits(&geometry.frame_of_reference()), bits(&expected));
        assert_eq!(geometry.extent().to_bits(), geometry.diagonal().to_bits());
        assert_eq!(geometry.radius().to_bits(), (geometry.diagonal() * 0.5).to_bits());
        assert_eq!(geometry.main_bounds(), geometry.bounds, "{}", scene.name);
    }
    assert_eq!(FrameOfReference::of(&Scene::default()), FrameOfReference::default());
}

#[test]
fn outliers_change_neither_origin_nor_scale() {
    let plain = builtin::build("table", builtin::MovingObject::Teapot).expect("it is built in");
    let expected = FrameOfReference::of(&plain);
    // A box beside a room is none, to the bit, from four times the room's size on.
    for x in [20.0, 50.0, 100.0, 1e6] {
        let mut scene = plain.clone();
        let cuboid = shapes::cuboid(Vec3::splat(-0.2), Vec3::splat(0.2), MaterialId(0));
        scene.add_object("", cuboid, Transform::translation(vec3(x, 0.5, 0.0)));
        let frame = FrameOfReference::of(&scene);
        let same = (frame.origin, frame.scale) == (expected.origin, expected.scale);
        assert_eq!(same, x > 4.0 * expected.scale, "{x} {frame:?}");
    }
    let far = vec3(6e3, 2e3, -8e3);
    type Outlier = fn(&mut Scene, Vec3);
    let outliers: [(&str, Outlier); 5] = [
        ("a vertex of no triangle", |scene, far| scene.meshes[0].positions.push(far)),
        ("a vertex of the teapot", |scene, far| {
            let mesh = scene.objects.last().expect("an object").mesh;
            scene.meshes[mesh].positions[100] = far;
        }),
        ("a corner of a wall", |scene, far| scene.meshes[0].positions[0] = far),
        ("a tiny ball", |scene, far| {
            scene.add_object("", shapes::sphere(0.01, 8, 6, MaterialId(0)), Transform::translation(far));
        }),
        ("balls ever farther away", |scene, far| {
            for i in 0..5 {
                let at = far * 10_f32.powi(i);
                scene.add_object("", shapes::sphere(0.3, 8, 6, MaterialId(0)), Transform::translation(at));
            }
        }),
    ];
    for (what, add) in outliers {
        let mut scene = plain.clone();
        add(&mut scene, far);
        let frame = FrameOfReference::of(&scene);
        let spread = of_all_positions(&scene);
        assert!(spread.scale > 500.0 * expected.scale, "the control: {what}");
        assert!((frame.scale / expected.scale - 1.0).abs() < 0.05, "{what}: {frame:?}");
        assert!(
            frame.origin.distance(expected.origin) < 0.05 * f64::from(expected.scale),
            "{what}: {frame:?}"
        );
        assert!(frame.extent() > spread.scale * 0.999_999, "{what}: {frame:?}");
        let geometry = Geometry::new(&scene);
        let within = |p: &Vec3| p.cmpge(geometry.bounds.0).all() && p.cmple(geometry.bounds.1).all();
        assert!(geometry.positions.iter().all(within), "{what}");
        assert!(geometry.positions.iter().all(|p| p.length() <= geometry.radius() * 1.000_001), "{what}");
        let (low, high) = geometry.main_bounds();
        assert!(((high - low).length() / expected.scale - 1.0).abs() < 0.05, "{what}");
        assert!(ray_offset_distance(&geometry, Vec3::ZERO) < 1.06e-5 * expected.scale, "{what}");
    }
}

#[test]
fn surfaces_of_a_building_are_as_large_as_those_of_a_room() {
    let surface_extent = |scene: &Scene| FrameOfReference::of(scene).surface_extent;
    // Rooms in a row, with furniture, a stray vertex and a moving ball.
    let rooms = |count: u8| {
        let mut scene = Scene::default();
        let material = scene.add_material(Material::default());
        for i in 0..count {
            let at = Transform::translation(vec3(7.0 * f32::from(i), 0.0, 0.0));
            let walls = shapes::cuboid(Vec3::ZERO, vec3(6.0, 3.0, 5.0), material);
            scene.add_object("", walls, at);
            for j in 0..40 {
                let low = vec3(0.1 * j as f32, 0.0, 1.0);
                scene.add_object("", shapes::cuboid(low, low + 0.3, material), at);
            }
        }
        let ball = scene.add_object("", shapes::sphere(0.5, 24, 16, material), Transform::IDENTITY);
        scene.objects[ball].dynamic = true;
        scene.meshes[0].positions.push(vec3(1e5, 0.0, 0.0));
        scene
    };
    let one = surface_extent(&rooms(1));
    assert!((5.0..8.0).contains(&one), "{one}");
    assert_eq!(surface_extent(&rooms(20)), one);
    assert!(FrameOfReference::of(&rooms(20)).scale > 10.0 * one, "the control");
    // Of a mesh alone it is the mesh's own; half a room of furniture does count.
    let mut ball = Scene::default();
    let material = ball.add_material(Material::default());
    ball.add_object("", shapes::sphere(0.5, 24, 16, material), Transform::IDENTITY);
    assert!((surface_extent(&ball) - 3_f32.sqrt()).abs() < 0.02);
    let mut full = rooms(1);
    full.objects[0].removed = true;
    assert!(surface_extent(&full) < 0.6);
}

#[test]
fn what_moves_has_room_where_nothing_else_is() {
    let mut scene = room();
    let closed = FrameOfReference::of(&scene);
    assert_eq!(bits(&closed), bits(&of_all_positions(&scene)), "within the room it needs none");
    scene.nodes[scene.objects[1].node].local = Transform::translation(vec3(0.0, 3.0, 0.0));
    let open = FrameOfReference::of(&scene);
    let tight = of_all_positions(&scene);
    assert_eq!((open.origin, open.scale), (tight.origin, tight.scale));
    assert_eq!(Geometry::new(&scene).main_bounds(), tight.bounds);
    let room = 0.4 * 3_f32.sqrt();
    assert!((open.bounds.1.y - tight.bounds.1.y - room).abs() < 1e-5, "{open:?} {tight:?}");
    scene.objects[1].dynamic = false;
    assert_eq!(bits(&FrameOfReference::of(&scene)), bits(&tight), "the control: what stands still has none");
}

#[test]
fn small_distances_do_not_follow_what_is_large() {
    // A room with furniture; the same on a plain, with a terrain of one mesh, and as one of a hundred.
    let room = |at: Vec3| {
        let mut scene = Scene::default();
        let material = scene.add_material(Material::default());
        let at = Transform::translation(at);
        scene.add_object("", shapes::cuboid(Vec3::ZERO, vec3(6.0, 3.0, 5.0), material), at);
        scene.add_object("", shapes::cuboid(vec3(1.0, 0.0, 1.0), vec3(1.8, 0.8, 2.0), material), at);
        scene.add_object("", shapes::sphere(0.3, 24, 16, material), at);
        scene
    };
    let detail = |scene: &Scene| FrameOfReference::of(scene).detail;
    let alone = room(Vec3::ZERO);
    let expected = detail(&alone);
    assert!((3.0..30.0).contains(&expected), "{expected}");
    let mut plain = alone.clone();
    plain.add_object(
        "",
        shapes::cuboid(vec3(-4e3, -1.0, -4e3), vec3(4e3, -0.5, 4e3), MaterialId(0)),
        Transform::IDENTITY,
    );
    let mut terrain = alone.clone();
    terrain.add_object(
        "",
        shapes::sphere(4e3, 96, 64, MaterialId(0)),
        Transform::translation(vec3(0.0, -4e3, 0.0)),
    );
    let mut town = alone.clone();
    for i in 1..100 {
        let other = room(Vec3::ZERO);
        for (object, mesh) in other.objects.iter().zip(&other.meshes) {
            let place = Transform::translation(vec3((i % 10) as f32 * 300.0, 0.0, (i / 10) as f32 * 300.0));
            town.add_object(&object.name, mesh.clone(), place);
        }
    }
    for (what, scene) in [("a plain", plain), ("a terrain", terrain), ("a town", town)] {
        let found = detail(&scene);
        assert!((0.3..3.0).contains(&(found / expected)), "{what}: {found} for {expected}");
        assert!(FrameOfReference::of(&scene).scale > 100.0 * expected, "{what}: the control");
        let geometry = Geometry::new(&scene);
        assert!(ray_offset_distance(&geometry, Vec3::ZERO) < 3e-6 * expected, "{what}");
    }
    // It is as small as all is.
    let mut small = alone;
    small.scale(1e-3).expect("a scale");
    let ratio = detail(&small) / expected;
    assert!((0.5e-3..2e-3).contains(&ratio), "{ratio}");
}
