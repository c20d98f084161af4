//! The camera and the light of scenes that have none.

use girandole_core::glam::{DVec2, Vec2, Vec3};
use girandole_core::scene::{
    Camera, Environment, Geometry, LocalView, Material, MaterialId, Mesh, NONE, Projection, PunctualKind,
    Scene, Transform, View,
};
use girandole_core::trace::SceneTracer;

fn block(double_sided: bool) -> Scene {
    let mut scene = Scene::default();
    scene.name = "block".into();
    let material = scene.add_material(Material { double_sided, ..Material::default() });
    let mut mesh = Mesh::default();
    mesh.add_box(Vec3::new(-1.0, 0.0, -3.0), Vec3::new(1.0, 0.5, 3.0), material);
    scene.add_object("block", mesh, Transform::translation(Vec3::new(100.0, 50.0, -20.0)));
    scene
}

/// A room with a pillar in the middle.
fn room() -> Scene {
    let mut scene = Scene::default();
    scene.name = "room".into();
    let material = scene.add_material(Material::default());
    let mut shell = Mesh::default();
    shell.add_box(Vec3::new(-4.0, 0.0, -3.0), Vec3::new(4.0, 3.0, 3.0), material);
    for triangle in &mut shell.triangles {
        triangle.vertices.swap(1, 2);
    }
    for patch in &mut shell.patches {
        patch.outline.reverse();
    }
    for normal in &mut shell.normals {
        *normal = -*normal;
    }
    scene.add_object("shell", shell, Transform::IDENTITY);
    let mut pillar = Mesh::default();
    pillar.add_box(Vec3::new(-0.3, 0.0, -0.3), Vec3::new(0.3, 2.9, 0.3), material);
    scene.add_object("pillar", pillar, Transform::IDENTITY);
    scene
}

fn view(scene: &Scene, aspect: f32) -> (Geometry, LocalView) {
    let geometry = Geometry::new(scene);
    let view = View::new(scene, &scene.cameras[0], aspect).relative_to(geometry.origin);
    (geometry, view)
}

/// Normalised device coordinates, if the point lies in front.
fn project(view: &LocalView, point: Vec3) -> Option<Vec2> {
    let to = point - view.eye;
    let depth = to.dot(view.forward);
    (depth > 0.0).then(|| Vec2::new(to.dot(view.right), to.dot(view.up)) / (view.half_extent * depth))
}

fn sees(view: &LocalView, point: Vec3) -> bool {
    project(view, point).is_some_and(|p| p.abs().max_element() < 1.0)
}

fn corners(geometry: &Geometry) -> [Vec3; 8] {
    let (min, max) = geometry.bounds;
    std::array::from_fn(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
        Vec3::new(pick(0), pick(1), pick(2))
    })
}

#[test]
fn an_open_scene_is_seen_whole() {
    for double_sided in [false, true] {
        let mut scene = block(double_sided);
        scene.ensure_camera();
        let (geometry, view) = view(&scene, 1.0);
        assert!(corners(&geometry).iter().all(|&c| sees(&view, c)), "{view:?}");
        let nearer = LocalView { eye: view.eye + view.forward * view.eye.length() * 0.6, ..view };
        assert!(!corners(&geometry).iter().all(|&c| sees(&nearer, c)), "from nearer it would not be");
        let once = scene.cameras.clone();
        scene.ensure_camera();
        assert_eq!(scene.cameras, once, "a camera that is there stays");
    }
}

#[test]
fn a_closed_room_is_seen_from_inside() {
    let mut scene = room();
    scene.ensure_camera();
    let (geometry, view) = view(&scene, 4.0 / 3.0);
    let (min, max) = geometry.bounds;
    assert!(view.eye.cmpgt(min).all() && view.eye.cmplt(max).all(), "{view:?}");
    let tracer = SceneTracer::new(&scene, &geometry);
    let mut nearest = f32::INFINITY;
    for i in 0..400 {
        let ndc = Vec2::new((i % 20) as f32 / 9.5 - 1.0, (i / 20) as f32 / 9.5 - 1.0);
        let (origin, direction) = view.ray(ndc);
        let direction = direction.normalize();
        let hit = tracer.closest_hit(origin, direction, f32::INFINITY, NONE).expect("a wall");
        assert!(geometry.normal(hit.triangle).dot(direction) < 0.0, "only fronts are seen");
        nearest = nearest.min(hit.t);
    }
    assert!(nearest > 0.3, "nothing hides the room: {nearest}");
}

#[test]
fn a_glazed_room_is_a_room() {
    let mut scene = room();
    scene.ensure_camera();
    let whole = scene.cameras.clone();
    let eye = |scene: &Scene| view(scene, 1.0).1.eye;
    let seen = eye(&scene);
    for material in &mut scene.materials {
        (material.blended, material.alpha) = (true, 0.2);
    }
    scene.cameras.clear();
    scene.ensure_camera();
    assert_eq!((scene.cameras.len(), eye(&scene)), (whole.len(), seen));
}

#[test]
fn an_empty_scene_gets_both() {
    let mut scene = Scene::default();
    scene.ensure_camera();
    scene.ensure_light();
    assert!(scene.cameras.len() == 1 && scene.environment.is_some());
}

/// Irradiance of a surface from the environment alone, by quadrature.
fn irradiance(environment: &Environment, normal: Vec3) -> f32 {
    let of_cell = |cell: u32| {
        let direction = environment.cell_direction(cell, DVec2::splat(0.5));
        environment.cell_radiance(cell).x * direction.dot(normal).max(0.0)
    };
    (0..environment.cells()).map(of_cell).sum::<f32>() * environment.cell_solid_angle() as f32
}

#[test]
fn an_open_scene_is_lit_by_a_studio_set_up_for_its_camera() {
    let center = Vec3::new(100.0, 50.0, -20.0);
    let eyes = [None, Some(Vec3::new(0.0, 1.0, 20.0)), Some(Vec3::new(-20.0, 5.0, 3.0))];
    for eye in eyes {
        let mut scene = block(false);
        if let Some(eye) = eye {
            let node = scene.add_node("eye", Transform::looking_at(center + eye, center));
            let projection = Projection::Perspective { yfov: 0.8 };
            scene.cameras.push(Camera { name: "eye".into(), node, projection, clip: Default::default() });
        }
        scene.ensure_camera();
        scene.ensure_light();
        assert_eq!(scene.warnings, ["`block` has no light: a studio lights it"]);
        let (_, view) = view(&scene, 16.0 / 9.0);
        let studio = scene.environment.as_ref().expect("a studio");
        // From the left above the camera comes most of the light, from behind what is seen the least.
        let level = Vec3::new(view.forward.x, 0.0, view.forward.z).normalize();
        let right = level.cross(Vec3::Y);
        let key = irradiance(studio, (Vec3::Y * 0.7 - right * 0.55 - level * 0.45).normalize());
        assert!((key - 3.0).abs() < 0.4, "{key} W/m²");
        let [left, right, away] = [-right, right, level].map(|normal| irradiance(studio, normal));
        assert!(left > 1.3 * right && right > 1.1 * away && away > 0.2 * key, "{left} {right} {away}");
    }
}

#[test]
fn light_that_hardly_reaches_what_is_seen_is_no_lighting() {
    // A visor that glows to one side of a helmet, and the same as a floor lamp of the whole scene.
    for (glow, is_enough) in [(Vec3::new(0.02, 0.02, 0.0), false), (Vec3::new(3.0, 3.0, 0.0), true)] {
        let mut scene = block(false);
        let material = scene.add_material(Material::emitter("visor", Vec3::ONE));
        let mut visor = Mesh::default();
        let Vec3 { x, y, .. } = glow;
        visor.add_polygon(&[(-x, -y), (x, -y), (x, y), (-x, y)].map(|(x, y)| Vec3::new(x, y, 0.0)), material);
        // Before one end of the block, or before all that is seen.
        let from = if is_enough { Vec3::new(8.0, 8.0, 10.0) } else { Vec3::new(0.0, 0.25, -3.05) };
        let center = Vec3::new(100.0, 50.0, -20.0);
        let towards = if is_enough { center } else { center + from + Vec3::Z };
        let away = 2.0 * (center + from) - towards;
        scene.add_object("visor", visor, Transform::looking_at(center + from, away));
        let node = scene.add_node("eye", Transform::looking_at(center + Vec3::new(5.0, 4.0, 7.0), center));
        scene.cameras.push(Camera {
            name: "eye".into(),
            node,
            projection: Projection::Perspective { yfov: 0.8 },
            clip: Default::default(),
        });
        scene.ensure_light();
        assert_eq!(scene.environment.is_none(), is_enough, "{:?}", scene.warnings);
        assert_eq!(scene.warnings.is_empty(), is_enough);
        assert!(is_enough || scene.warnings[0].contains("% of what is seen: a studio lights it"));
    }
}

#[test]
fn hollow_objects_are_seen_from_outside() {
    // A shell with a wall that has two sides, as a shader ball or a cake.
    let mut scene = Scene::default();
    let material = scene.add_material(Material::default());
    let mut outer = Mesh::default();
    outer.add_box(Vec3::splat(-1.0), Vec3::splat(1.0), material);
    scene.add_object("outer", outer, Transform::IDENTITY);
    let mut inner = Mesh::default();
    inner.add_box(Vec3::splat(-0.9), Vec3::splat(0.9), material);
    inner.triangles.iter_mut().for_each(|t| t.vertices.swap(1, 2));
    inner.patches.clear();
    inner.normals.iter_mut().for_each(|n| *n = -*n);
    let inner_only = inner.clone();
    scene.add_object("inner", inner, Transform::IDENTITY);
    scene.ensure_camera();
    let eye = |scene: &Scene| view(scene, 1.0).1.eye;
    assert!(eye(&scene).length() > 2.0, "{}", eye(&scene));
    scene.ensure_light();
    assert!(scene.environment.is_some() && scene.lights.is_empty());
    // The control: without its outside it is a room.
    let mut room = Scene::default();
    room.add_material(Material::default());
    room.add_object("inner", inner_only, Transform::IDENTITY);
    room.ensure_camera();
    assert!(eye(&room).length() < 1.3, "{}", eye(&room));
}

#[test]
fn flat_things_are_seen_from_above() {
    let mut scene = Scene::default();
    let material = scene.add_material(Material::default());
    let mut mesh = Mesh::default();
    mesh.add_box(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 0.1, 1.0), material);
    scene.add_object("coin", mesh, Transform::IDENTITY);
    scene.ensure_camera();
    let (geometry, view) = view(&scene, 1.0);
    assert!(view.forward.y < -0.6, "{}", view.forward);
    assert!(corners(&geometry).iter().all(|&c| sees(&view, c)));
}

#[test]
fn a_room_is_lit_under_its_ceiling() {
    let mut scene = room();
    scene.ensure_camera();
    scene.ensure_light();
    assert_eq!((scene.warnings.len(), scene.objects.len(), scene.lights.len()), (1, 2, 1));
    let light = &scene.lights[0];
    let place = scene.world_from_node(light.node).translation.as_vec3();
    assert!(place.y > 2.4 && place.y < 3.0 && place.x.abs() < 2.5 && place.z.abs() < 2.0, "{place}");
    assert_eq!(light.kind, PunctualKind::Point);
    assert!(light.intensity.x > 0.5 && light.intensity.x < 50.0, "{}", light.intensity);
}

#[test]
fn light_that_is_there_is_enough() {
    let mut emitting = block(false);
    emitting.materials[0].emission = Vec3::X;
    let mut punctual = block(false);
    let node = punctual.add_node("bulb", Transform::translation(Vec3::new(105.0, 58.0, -10.0)));
    punctual.lights.push(girandole_core::scene::PunctualLight {
        name: "bulb".into(),
        node,
        kind: PunctualKind::Point,
        intensity: Vec3::X,
    });
    for mut scene in [emitting, punctual] {
        let before = (scene.lights.len(), scene.objects.len());
        scene.ensure_camera();
        scene.ensure_light();
        assert_eq!((scene.lights.len(), scene.objects.len()), before);
        assert!(scene.warnings.is_empty() && scene.environment.is_none());
    }
    // A material that nothing uses does not shine.
    let mut unused = block(false);
    unused.add_material(Material::emitter("lamp", Vec3::ONE));
    unused.ensure_light();
    assert_eq!(unused.warnings.len(), 1);
}

#[test]
fn scenes_of_any_size_are_framed_and_lit() {
    // Some thousand crooked triangles, from a microscope's to a planet's size.
    for scale in [1e-5_f32, 1e-2, 1.0, 1e3, 1e7] {
        let mut mesh = Mesh::default();
        for i in 0..3000_u32 {
            let noise = |k: u32| {
                (i.wrapping_mul(2_654_435_761).wrapping_add(k.wrapping_mul(0x9e37_79b9)) >> 8) as f32
                    / 16_777_216.0
            };
            let at = Vec3::new(noise(1), noise(2), noise(3));
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(
                [at, at + Vec3::X * 0.05 * noise(4), at + Vec3::Y * 0.05 * noise(5)].map(|p| p * scale),
            );
            mesh.normals.extend([Vec3::Z; 3]);
            mesh.triangles.push(girandole_core::scene::MeshTriangle {
                vertices: [first, first + 1, first + 2],
                material: MaterialId(0),
            });
        }
        let mut scene = Scene::default();
        scene.add_material(Material::default());
        scene.add_object("dust", mesh, Transform::IDENTITY);
        scene.ensure_camera();
        let (geometry, view) = view(&scene, 1.0);
        assert!(corners(&geometry).iter().all(|&c| sees(&view, c)), "{scale}: {view:?}");
        scene.ensure_light();
        assert!(scene.environment.is_some(), "{scale}");
    }
}
