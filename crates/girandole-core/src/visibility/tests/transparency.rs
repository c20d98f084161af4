//! What light passes blocks nothing.

use super::*;
use crate::scene::Material;
use crate::scene::builtin::{self, MovingObject, shapes};

/// The room `table` with a pane over its floor, a ball, and a pane that moves: of glass or not.
fn scene(transparent: bool) -> Scene {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("it is built in");
    let glass = scene.add_material(Material {
        blended: transparent,
        alpha: if transparent { 0.3 } else { 1.0 },
        double_sided: true,
        ..Material::default()
    });
    let pane = [vec3(-1.5, 0.4, -0.5), vec3(-1.5, 0.4, 1.5), vec3(1.5, 0.4, 1.5), vec3(1.5, 0.4, -0.5)];
    add(&mut scene, polygon(&pane, glass));
    scene.add_object("ball", shapes::sphere(0.4, 12, 8, glass), Transform::translation(vec3(1.2, 1.5, 0.5)));
    let moving = scene.add_object("pane", polygon(&pane, glass), Transform::translation(vec3(0.0, 1.0, 0.0)));
    scene.objects[moving].dynamic = true;
    scene
}

#[test]
fn transparent_surfaces_do_not_block() {
    let shares = [true, false].map(|transparent| {
        let scene = scene(transparent);
        let geometry = Geometry::new(&scene);
        let lights = sampled(&scene, &geometry, 60).samples().to_vec();
        let database = build(&scene, &geometry, lights.clone());
        let mut numbers = Numbers(7);
        check_receivers(&geometry, &database, &mut numbers);
        let verdict = verify(&scene, &geometry, &lights, &database, 6000, &mut numbers);
        assert_eq!(verdict.wrong, 0, "{transparent}: {verdict:?}");
        // Whatever lies between, it is none of these.
        let first = scene.objects.len() as u32 - 3;
        let tracer = SceneTracer::new(&scene, &geometry);
        let mut numbers = Numbers(3);
        let mut blocked = 0;
        for _ in 0..2000 {
            let from = numbers.vector() * vec3(1.4, 0.1, 0.9) + vec3(0.0, 0.2, 0.5);
            let to = lights[numbers.below(lights.len())].position;
            let occluder = tracer.occluder(from, NONE, to, NONE, NONE);
            let object = occluder.map(|t| geometry.triangles[t as usize].object);
            blocked += usize::from(object.is_some_and(|object| object >= first));
        }
        assert_eq!(blocked == 0, transparent, "{blocked}");
        database.counts().area_shares
    });
    let full = State::Full as usize;
    assert!(shares[0][full] < 0.8 * shares[1][full], "{shares:?}");
}
