//! The camera and the light of scenes that have none.

use girandole_core::glam::{Vec2, Vec3};
use girandole_core::scene::{
    Camera, Geometry, LocalView, Material, Mesh, NONE, Projection, PunctualKind, Scene, Transform, View,
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
fn an_empty_scene_gets_both() {
    let mut scene = Scene::default();
    scene.ensure_camera();
    scene.ensure_light();
    assert_eq!((scene.cameras.len(), scene.objects.len()), (1, 1));
}

#[test]
fn an_open_scene_is_lit_by_a_soft_box_out_of_sight() {
    let cameras = [
        None,
        Some(Transform::looking_at(Vec3::new(100.0, 50.0, 0.0), Vec3::new(100.0, 50.0, -20.0))),
        Some(Transform::looking_at(Vec3::new(100.0, 45.0, -20.1), Vec3::new(100.0, 50.0, -20.0))),
        Some(Transform::looking_at(Vec3::new(100.0, 80.0, -20.1), Vec3::new(100.0, 50.0, -20.0))),
    ];
    for (i, camera) in cameras.into_iter().enumerate() {
        let mut scene = block(false);
        if let Some(place) = camera {
            let node = scene.add_node("eye", place);
            let projection = Projection::Perspective { yfov: 0.8 };
            scene.cameras.push(Camera { name: "eye".into(), node, projection });
        }
        let bounds = Geometry::new(&scene).bounds;
        scene.ensure_camera();
        scene.ensure_light();
        assert_eq!(scene.warnings, ["`block` has no light: it is lit by a default one"]);
        let (geometry, view) = view(&scene, 16.0 / 9.0);
        let patch = geometry.patches.last().expect("the light");
        // Relative to the block alone, whose centre stayed where it was.
        let center = (bounds.0 + bounds.1) * 0.5;
        let shift = (geometry.origin - girandole_core::glam::DVec3::new(100.0, 50.25, -20.0)).as_vec3();
        let outline: Vec<Vec3> = patch.outline.iter().map(|p| *p + shift).collect();
        let radius = (bounds.1 - bounds.0).length() * 0.5;
        let is_visible = |view: &LocalView| {
            let faces = (view.eye - patch.outline[0]).dot(patch.normal) >= 0.0;
            let is_in_view = |i: usize| {
                let (u, v) = ((i % 21) as f32 / 20.0, (i / 21) as f32 / 20.0);
                let [a, b, _, d] = [0, 1, 2, 3].map(|k| patch.outline[k]);
                sees(view, a + (b - a) * u + (d - a) * v)
            };
            faces && (0..441).any(is_in_view)
        };
        assert!(!is_visible(&view), "{view:?} sees {:?}", patch.outline);
        // Negative control: a camera in front of the light sees it.
        let eye = (patch.outline[0] + patch.outline[2]) * 0.5 + patch.normal * radius;
        let right = patch.normal.any_orthonormal_vector();
        let forward = -patch.normal;
        assert!(is_visible(&LocalView { eye, forward, right, up: right.cross(forward), ..view }));
        // Irradiance at the centre of a surface that faces the light, by quadrature.
        let material = &scene.materials[geometry.triangles[patch.triangles.start as usize].material as usize];
        let [a, b, _, d] = [0, 1, 2, 3].map(|k| outline[k]);
        let area = (b - a).length() * (d - a).length();
        let facing = ((a + outline[2]) * 0.5 - center).normalize();
        assert!(facing.y > 0.3 || i == 2, "from above, unless a camera looks up from below");
        let mut irradiance = 0.0;
        for i in 0..400 {
            let (u, v) = (((i % 20) as f32 + 0.5) / 20.0, ((i / 20) as f32 + 0.5) / 20.0);
            let to = a + (b - a) * u + (d - a) * v - center;
            assert!(to.length() > radius, "outside of the scene");
            let distance2 = to.length_squared();
            let direction = to / distance2.sqrt();
            irradiance +=
                material.emission.x * facing.dot(direction) * -patch.normal.dot(direction) / distance2 * area
                    / 400.0;
        }
        assert!((irradiance - 3.0).abs() < 0.3, "{irradiance} W/m²");
    }
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
    punctual.lights.push(girandole_core::scene::PunctualLight {
        name: "bulb".into(),
        node: 0,
        kind: PunctualKind::Point,
        intensity: Vec3::X,
    });
    for mut scene in [emitting, punctual] {
        let before = (scene.lights.len(), scene.objects.len());
        scene.ensure_light();
        assert_eq!((scene.lights.len(), scene.objects.len()), before);
        assert!(scene.warnings.is_empty());
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
                material: 0,
            });
        }
        let mut scene = Scene::default();
        scene.add_material(Material::default());
        scene.add_object("dust", mesh, Transform::IDENTITY);
        scene.ensure_camera();
        let (geometry, view) = view(&scene, 1.0);
        assert!(corners(&geometry).iter().all(|&c| sees(&view, c)), "{scale}: {view:?}");
        scene.ensure_light();
        assert_eq!(scene.objects.len(), 2, "{scale}");
    }
}
