//! Light that is added reaches what is seen, whatever is in the way of the usual one.

use girandole_core::glam::{Vec2, Vec3};
use girandole_core::scene::{
    Camera, ClipPlanes, Geometry, Material, MaterialId, Mesh, NONE, Projection, Scene, Transform, View,
};
use girandole_core::trace::SceneTracer;

fn cuboid(low: Vec3, high: Vec3, material: MaterialId) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_box(low, high, material);
    mesh
}

/// The same seen from inside.
fn turned(mut mesh: Mesh) -> Mesh {
    mesh.triangles.iter_mut().for_each(|triangle| triangle.vertices.swap(1, 2));
    mesh.patches.iter_mut().for_each(|patch| patch.outline.reverse());
    mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    mesh
}

fn look(scene: &mut Scene, eye: Vec3, target: Vec3, projection: Projection) {
    let node = scene.add_node("eye", Transform::looking_at(eye, target));
    scene.cameras.push(Camera { name: "eye".into(), node, projection, clip: ClipPlanes::NONE });
}

const PERSPECTIVE: Projection = Projection::Perspective { yfov: 1.0 };

/// A room of 8 m × 3 m × 6 m that is seen from a corner; its walls face inwards, or outwards.
fn room(inwards: bool, double_sided: bool) -> Scene {
    let mut scene = Scene::default();
    scene.name = "room".into();
    let material = scene.add_material(Material { double_sided, ..Material::default() });
    let walls = cuboid(Vec3::new(-4.0, 0.0, -3.0), Vec3::new(4.0, 3.0, 3.0), material);
    scene.add_object("walls", if inwards { turned(walls) } else { walls }, Transform::IDENTITY);
    look(&mut scene, Vec3::new(3.5, 1.6, 2.6), Vec3::new(-1.0, 1.0, -1.0), PERSPECTIVE);
    scene
}

/// The share of what the first camera sees, and what reflects, that the last lamp shines on.
fn share_lit(scene: &Scene) -> f32 {
    let geometry = Geometry::new(scene);
    let tracer = SceneTracer::new(scene, &geometry);
    let Some(lamp) = scene.lights.last() else { return 0.0 };
    let lamp = (scene.world_from_node(lamp.node).translation - geometry.origin).as_vec3();
    let view = View::new(scene, &scene.cameras[0], 4.0 / 3.0).relative_to(geometry.origin);
    let (mut seen, mut lit) = (0, 0);
    for i in 0..400 {
        let ndc = Vec2::new((i % 20) as f32 / 10.0 - 0.95, (i / 20) as f32 / 10.0 - 0.95);
        let (origin, direction) = view.ray(ndc);
        let Some(hit) = tracer.closest_visible(origin, direction) else { continue };
        let surface = geometry.surface(scene, hit.triangle, hit.barycentric, -direction.normalize());
        if surface.albedo == Vec3::ZERO {
            continue;
        }
        let from = tracer.offset_ray_origin(surface.position, surface.geometric_normal);
        seen += 1;
        let faces = (lamp - from).dot(surface.geometric_normal) > 0.0;
        lit += i32::from(faces && !tracer.occluded(from, hit.triangle, lamp, NONE));
    }
    lit as f32 / seen as f32
}

#[test]
fn a_lamp_in_a_shade_goes_elsewhere() {
    let mut plain = room(true, false);
    plain.ensure_light();
    assert_eq!(plain.warnings, ["`room` has no light: a lamp under the ceiling lights it"]);
    assert!(share_lit(&plain) > 0.9);
    // A shade about the place of that lamp, open towards the floor.
    let mut scene = room(true, false);
    let mut shade = cuboid(Vec3::new(-0.1, 2.0, -0.1), Vec3::new(0.1, 2.9, 0.1), MaterialId(0));
    let is_low = |v: &u32| shade.positions[*v as usize].y < 2.1;
    let bottom = shade.patches.iter().position(|patch| patch.outline.iter().all(is_low)).expect("a bottom");
    let triangles = shade.patches[bottom].triangles.clone();
    shade.triangles.drain(triangles.start as usize..triangles.end as usize);
    shade.patches.clear();
    scene.add_object("shade", shade, Transform::IDENTITY);
    let mut usual = scene.clone();
    usual.lights.push(plain.lights[0].clone());
    usual.lights[0].node = usual.add_node("", Transform::translation(Vec3::new(0.0, 2.75, 0.0)));
    assert!(share_lit(&usual) < 0.2, "the control: {}", share_lit(&usual));
    scene.ensure_light();
    assert!(
        scene.lights.len() == 1 && share_lit(&scene) > 0.6,
        "{}: {:?}",
        share_lit(&scene),
        scene.warnings
    );
    assert!(scene.warnings[0].starts_with("`room` has no light: a lamp "), "{:?}", scene.warnings);
}

#[test]
fn under_a_dome_a_lamp_lights() {
    for (size, projection) in [
        (1.0, PERSPECTIVE),
        (1.0, Projection::Orthographic { ymag: 3.0 }),
        (1e-3, PERSPECTIVE),
        (1e4, PERSPECTIVE),
    ] {
        let mut scene = Scene::default();
        scene.name = "dome".into();
        let grey = scene.add_material(Material::default());
        let sky = scene.add_material(Material { unlit: true, double_sided: true, ..Material::default() });
        scene.add_object(
            "house",
            cuboid(Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 2.0, 2.0), grey),
            Transform::IDENTITY,
        );
        scene.add_object("sky", cuboid(Vec3::splat(-50.0), Vec3::splat(50.0), sky), Transform::IDENTITY);
        look(&mut scene, Vec3::new(4.0, 4.0, 8.0), Vec3::Y, projection);
        scene.scale(size).expect("a scale");
        scene.ensure_light();
        assert!(scene.lights.len() == 1 && share_lit(&scene) > 0.6, "{size}: {:?}", scene.warnings);
        assert!(scene.warnings[0].starts_with("`dome` has no light: a lamp "), "{:?}", scene.warnings);
        // The control: without the sky it is a studio.
        scene.objects[1].removed = true;
        scene.lights.clear();
        scene.ensure_light();
        assert!(scene.lights.is_empty() && scene.environment.is_some());
    }
}

#[test]
fn turned_normals_are_named() {
    // Walls with two sides and a panel that faces the ceiling.
    let mut scene = room(false, true);
    let lamp = scene.add_material(Material::emitter("panel", Vec3::splat(20.0)));
    let mut panel = Mesh::default();
    let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(x, z)| Vec3::new(x, 2.9995, z));
    panel.add_polygon(&corners, lamp);
    scene.add_object("panel", panel, Transform::IDENTITY);
    assert!(Geometry::new(&scene).normal(12).y > 0.9);
    let mut right = scene.clone();
    scene.ensure_light();
    assert!(
        scene.warnings[0].contains(", as what emits turns its back to it: a lamp "),
        "{:?}",
        scene.warnings
    );
    assert!(share_lit(&scene) > 0.6, "{}", share_lit(&scene));
    // The control: the panel's front.
    right.materials[lamp].double_sided = true;
    right.ensure_light();
    assert!(right.warnings.is_empty() && right.lights.is_empty(), "{:?}", right.warnings);
}

#[test]
fn what_shows_its_backs_alone_is_shown_from_both_sides() {
    let mut scene = room(false, false);
    scene.ensure_light();
    assert!(scene.warnings[0].contains("turn its normals around"), "{:?}", scene.warnings);
    assert!(scene.materials[0].double_sided && share_lit(&scene) > 0.6, "{}", share_lit(&scene));
    // The control: a chair in front of the camera is enough to see something.
    let mut scene = room(false, false);
    let chair = cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(0.0, 1.0, 0.0), MaterialId(0));
    scene.add_object("chair", chair, Transform::IDENTITY);
    scene.ensure_light();
    assert!(
        !scene.materials[0].double_sided && !scene.warnings[0].contains("normals"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn what_is_unlit_needs_no_light() {
    let mut scene = room(true, false);
    scene.materials[0].unlit = true;
    scene.ensure_light();
    assert!(scene.warnings.is_empty() && scene.lights.is_empty() && scene.environment.is_none());
    scene.add_material(Material::default());
    scene.add_object("ball", cuboid(Vec3::ZERO, Vec3::ONE, MaterialId(1)), Transform::IDENTITY);
    scene.ensure_light();
    assert!(!scene.warnings.is_empty(), "the control");
}
#[test]
fn a_lit_room_stays_black_from_outside() {
    // Its walls have two sides, and it has a lamp.
    let lit = |eye: Vec3, near: f32| {
        let mut scene = room(true, true);
        let lamp = scene.add_material(Material::emitter("panel", Vec3::splat(20.0)));
        let mut panel = Mesh::default();
        let corners = [(-0.8, -0.8), (0.8, -0.8), (0.8, 0.8), (-0.8, 0.8)];
        panel.add_polygon(&corners.map(|(x, z)| Vec3::new(x, 2.9, z)), lamp);
        scene.add_object("panel", panel, Transform::IDENTITY);
        scene.cameras.clear();
        look(&mut scene, eye, Vec3::Y, PERSPECTIVE);
        scene.cameras[0].clip.near = near;
        scene.ensure_light();
        assert!(scene.lights.is_empty() && scene.environment.is_none(), "{:?}", scene.warnings);
        scene.warnings
    };
    let outside = lit(Vec3::new(0.0, 1.5, 6.0), 0.01);
    assert!(outside.len() == 1 && outside[0].ends_with("outside of the room that it lights"), "{outside:?}");
    // Cut open, or from inside, it is lit.
    assert_eq!(lit(Vec3::new(0.0, 1.5, 6.0), 3.2).len(), 0);
    assert_eq!(lit(Vec3::new(0.0, 1.5, 2.0), 0.01).len(), 0);
}
