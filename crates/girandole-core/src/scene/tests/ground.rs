use super::*;

/// Boxes by their corners in a studio.
fn in_studio(boxes: &[(Vec3, Vec3)]) -> Scene {
    let mut scene = Scene::default();
    let material = scene.add_material(Material::default());
    for &(low, high) in boxes {
        scene.add_object("box", shapes::cuboid(low, high, material), Transform::IDENTITY);
    }
    scene.ensure_camera();
    scene.add_studio();
    scene
}

#[test]
fn models_stand_on_a_ground_that_ends_nowhere() {
    let mut scene = in_studio(&[(vec3(2.0, 5.0, -1.0), vec3(4.0, 8.0, 1.0))]);
    assert!(scene.add_ground());
    let ground = scene.objects.last().expect("an object");
    let place = scene.world_from_node(ground.node).translation;
    assert!((place - DVec3::new(3.0, 5.0, 0.0)).length() < 1e-2 && place.y < 5.0, "{place}");
    let mesh = &scene.meshes[ground.mesh];
    assert!(mesh.normals.iter().all(|n| *n == Vec3::Y));
    let radius = mesh.positions[0].length();
    assert!((radius - 4.0 * f32::sqrt(17.0) / 2.0).abs() < 1e-3, "{radius}");
    // Its radiance in the light of the dome is that of the dome below the horizon.
    let environment = scene.environment.as_ref().expect("a studio");
    let image = environment.map.image();
    let half = (image.width * image.height / 2) as usize;
    let below = image.pixels[half];
    assert!(image.pixels[half..].iter().all(|p| *p == below));
    let cell = |i: usize| {
        let polar = [0, 1].map(|edge| {
            std::f64::consts::PI * (i as u32 / image.width + edge) as f64 / f64::from(image.height)
        });
        // The cosine over the row's solid angle.
        (polar[1].sin().powi(2) - polar[0].sin().powi(2)) * std::f64::consts::PI / f64::from(image.width)
    };
    let irradiance: f64 = (0..half).map(|i| f64::from(image.pixels[i].x) * cell(i)).sum();
    let reflectance = scene.materials[mesh.triangles[0].material].base_color.x;
    let radiance = f64::from(reflectance) * irradiance / std::f64::consts::PI;
    assert!((radiance / f64::from(below.x) - 1.0).abs() < 0.01, "{radiance} instead of {below}");
    assert!((0.1..0.9).contains(&reflectance), "{reflectance}");
    // Once is enough: now there is a floor.
    assert!(!scene.add_ground());
}

#[test]
fn floors_and_rooms_get_no_ground() {
    let thing = (vec3(-1.0, 0.0, -1.0), vec3(1.0, 2.0, 1.0));
    let slab = (vec3(-5.0, -0.1, -5.0), vec3(5.0, 0.0, 5.0));
    assert!(!in_studio(&[thing, slab]).add_ground(), "a floor");
    assert!(!in_studio(&[slab]).add_ground(), "nothing but a floor");
    // The control: what is as large, but above the things.
    let roof = (vec3(-5.0, 3.0, -5.0), vec3(5.0, 3.1, 5.0));
    assert!(in_studio(&[thing, roof]).add_ground());
    let mut room = builtin::build("table", builtin::MovingObject::None).expect("it is built in");
    room.add_studio();
    assert!(!room.add_ground(), "a room");
    let mut nothing = Scene { environment: Some(Environment::studio(Vec3::NEG_Z)), ..Default::default() };
    assert!(!nothing.add_ground());
    let mut alone = in_studio(&[thing]);
    alone.environment = None;
    assert!(!alone.add_ground(), "no studio");
}
