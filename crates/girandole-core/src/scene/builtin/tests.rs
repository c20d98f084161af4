use super::*;
use crate::scene::{Geometry, MaterialId, NONE};
use crate::trace::SceneTracer;
use glam::{DVec3, Vec3};

/// Signed volume by the divergence theorem: positive when triangles face outwards.
fn volume(mesh: &Mesh) -> f64 {
    mesh.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.vertices.map(|v| mesh.positions[v as usize].as_dvec3());
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

/// How often each undirected edge occurs, as (with its direction, against it), by position.
fn is_closed(mesh: &Mesh) -> bool {
    let mut edges = std::collections::BTreeMap::new();
    let key = |v: u32| mesh.positions[v as usize].to_array().map(|c| (c + 0.0).to_bits());
    for t in &mesh.triangles {
        for i in 0..3 {
            let (a, b) = (key(t.vertices[i]), key(t.vertices[(i + 1) % 3]));
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
        }
    }
    edges.values().all(|&n| n == 0)
}

fn normals_agree(mesh: &Mesh, cosine: f64) -> bool {
    mesh.triangles.iter().all(|t| {
        let [a, b, c] = t.vertices.map(|v| mesh.positions[v as usize].as_dvec3());
        let n = (b - a).cross(c - a).normalize();
        t.vertices.iter().all(|&v| mesh.normals[v as usize].as_dvec3().dot(n) > cosine)
    })
}

#[test]
fn shapes_are_closed_face_outwards_and_have_their_volume() {
    let pi = std::f64::consts::PI;
    let cases = [
        (shapes::cuboid(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0), MaterialId(0)), 6.0, 0.0),
        (shapes::torus(2.0, 0.5, 200, 100, MaterialId(0)), 2.0 * pi * pi * 2.0 * 0.25, 0.002),
        (shapes::sphere(1.0, 200, 100, MaterialId(0)), 4.0 / 3.0 * pi, 0.002),
        (shapes::cylinder(0.5, 2.0, 200, MaterialId(0)), 0.5 * pi, 0.002),
        (
            shapes::rod(Vec3::X, Vec3::new(1.0, -1.0, 2.0), 0.5, 200, MaterialId(0)),
            0.25 * pi * f64::sqrt(5.0),
            0.002,
        ),
        // A cone on a drum.
        (
            shapes::revolved(
                &[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 2.0], [1.0, 2.0], [0.0, 3.0]],
                200,
                MaterialId(0),
            ),
            7.0 / 3.0 * pi,
            0.002,
        ),
        (
            shapes::rounded_box(Vec3::new(1.0, 2.0, 3.0), 0.4, 40, MaterialId(0)),
            0.528 + 0.8 * 3.32 + 0.16 * 3.6 * pi + 0.064 * 4.0 / 3.0 * pi,
            0.01,
        ),
    ];
    for (mesh, expected, tolerance) in cases {
        let v = volume(&mesh);
        assert!((v / expected - 1.0).abs() <= tolerance + 1e-6, "{}: {v} against {expected}", mesh.name);
        assert!(is_closed(&mesh), "{}", mesh.name);
        assert!(normals_agree(&mesh, 0.99), "{}", mesh.name);
        // Negative controls: turned inside out, and with a hole.
        let mut broken = mesh.clone();
        broken.triangles.iter_mut().for_each(|t| t.vertices.swap(1, 2));
        assert!(volume(&broken) < 0.0 && !normals_agree(&broken, 0.99));
        broken.triangles.pop();
        assert!(!is_closed(&broken));
    }
}

#[test]
fn the_torus_has_820_vertices_and_the_teapot_about_as_many_as_newells() {
    let torus = shapes::thesis_torus(MaterialId(0));
    assert_eq!(torus.positions.len(), 820);
    assert!(is_closed(&torus) && normals_agree(&torus, 0.9) && volume(&torus) > 0.0);
    let pot = teapot(6, MaterialId(0));
    assert_eq!(pot.positions.len(), 1178);
    let low = pot.positions.iter().copied().reduce(Vec3::min).unwrap();
    let high = pot.positions.iter().copied().reduce(Vec3::max).unwrap();
    assert!(low.y.abs() < 1e-6 && ((high - low).max_element() - 1.0).abs() < 1e-6);
    assert!(volume(&pot) > 0.05, "{}", volume(&pot));
    assert!(pot.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
    // Vertex normals point to where the triangles face (the knob's and the lip's sharp turns aside).
    let facing = |mesh: &Mesh| {
        mesh.triangles
            .iter()
            .filter(|t| {
                let [a, b, c] = t.vertices.map(|v| mesh.positions[v as usize].as_dvec3());
                let mean: DVec3 = t.vertices.iter().map(|&v| mesh.normals[v as usize].as_dvec3()).sum();
                (b - a).cross(c - a).dot(mean) < 0.0
            })
            .count()
    };
    assert_eq!(facing(&pot), 0);
}

#[test]
fn every_room_is_closed_lit_and_seen_from_inside() {
    for name in NAMES {
        let mut scene = build(name, default_object(name)).unwrap();
        assert_eq!(scene.name, name);
        if scene.environment.is_some() {
            // Closed but for a window, in which a pane is put.
            let mut pane = Mesh::default();
            let [low, high] = [Vec3::new(-1.8, 0.0, -2.2), Vec3::new(-1.8, 2.5, 2.2)];
            pane.add_polygon(&[low, low.with_y(high.y), high, high.with_y(low.y)], MaterialId(0));
            scene.add_object("pane", pane, crate::scene::Transform::IDENTITY);
        }
        let geometry = Geometry::new(&scene);
        assert_eq!(geometry.dropped, 0);
        assert_eq!(scene.cameras[0].name, name);
        assert!(scene.cameras.len() >= 2);
        let shines = scene.materials.iter().any(crate::scene::Material::emits);
        assert!(shines || !scene.lights.is_empty() || scene.environment.is_some(), "{name}");
        for camera in &scene.cameras {
            let eye = (scene.world_from_node(camera.node).translation - geometry.origin).as_vec3();
            assert!(geometry.encloses(&scene, eye), "{name}: {} is in a wall or sees outside", camera.name);
            // Nothing is within 0.05 m.
            let tracer = SceneTracer::new(&scene, &geometry);
            for axis in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
                assert_eq!(tracer.closest_hit(eye, axis, 0.05, NONE), None, "{name}: {}", camera.name);
            }
        }
        // Negative control: without its ceiling a room is not closed.
        let mut open = scene.clone();
        open.objects.retain(|o| o.name != "ceiling");
        let geometry = Geometry::new(&open);
        let eye = (open.world_from_node(open.cameras[0].node).translation - geometry.origin).as_vec3();
        assert!(!geometry.encloses(&open, eye), "{name}");
    }
}

#[test]
fn the_sun_comes_between_the_slats_in_whole_stripes() {
    let sunlit = |scene: &Scene| -> Vec<bool> {
        let geometry = Geometry::new(scene);
        let tracer = SceneTracer::new(scene, &geometry);
        let sun = scene.environment.as_ref().and_then(|e| e.map.disc()).expect("a sun").direction;
        let is_lit = |at: Vec3| !tracer.occluded(at, NONE, at + sun * 20.0, NONE);
        // A line on the floor away from the window, every millimetre; slats are across it.
        let along = Vec3::new(-sun.x, 0.0, -sun.z).normalize();
        let start = Vec3::new(0.15, 1e-3, 0.2) - geometry.origin.as_vec3();
        (0..800).map(|i| is_lit(start + along * (1e-3 * i as f32))).collect()
    };
    let edges = |lit: &[bool]| lit.windows(2).filter(|w| w[0] != w[1]).count();
    let scene = build("blinds", MovingObject::None).unwrap();
    let lit = sunlit(&scene);
    let share = lit.iter().filter(|lit| **lit).count() as f64 / lit.len() as f64;
    assert!((0.2..0.8).contains(&share), "{share} of the floor is lit");
    // A slat every 4.4 cm is a stripe every 9.9 on the floor, by the sun at 24°.
    assert!((14..=18).contains(&edges(&lit)), "{} edges", edges(&lit));
    // The control: without the blind all is lit.
    let mut open = scene.clone();
    open.objects.retain(|o| o.name != "blind");
    assert!(sunlit(&open).iter().all(|lit| *lit));
}

#[test]
fn moving_objects_are_dynamic_and_stand_where_they_should() {
    let model = shapes::sphere(7.0, 12, 8, MaterialId(5));
    for name in EXPERIMENTS {
        let none = build(name, MovingObject::None).unwrap();
        assert!(none.objects.iter().all(|o| !o.dynamic));
        for object in
            [MovingObject::Torus, MovingObject::Teapot, MovingObject::Model(Box::new(model.clone()))]
        {
            let scene = build(name, object).unwrap();
            let dynamic: Vec<usize> =
                (0..scene.objects.len()).filter(|&i| scene.objects[i].dynamic).collect();
            assert_eq!(dynamic.len(), 1);
            assert_eq!(scene.objects.len(), none.objects.len() + 1);
            let geometry = Geometry::new(&scene);
            let range = geometry.objects[dynamic[0]].clone();
            let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for p in &geometry.positions[range.vertices.start as usize..range.vertices.end as usize] {
                low = low.min(*p);
                high = high.max(*p);
            }
            assert!((high - low).max_element() < 0.81 && (high - low).max_element() > 0.4);
            // It stands on something, without touching it.
            let tracer = SceneTracer::new(&scene, &geometry);
            let center = (low + high) * 0.5;
            let foot = Vec3::new(center.x, low.y + 1e-4, center.z);
            let hit = tracer.closest_hit_where(foot, Vec3::NEG_Y, 0.01, |t, _| !range.triangles.contains(&t));
            assert!(hit.is_some(), "{name}: {}", scene.objects[dynamic[0]].name);
        }
    }
}

#[test]
fn an_unknown_room_lists_those_that_exist() {
    let error = build("kitchen", MovingObject::None).unwrap_err().to_string();
    assert!(NAMES.iter().all(|n| error.contains(n)), "{error}");
    let empty = build("table", MovingObject::Model(Box::default())).unwrap_err().to_string();
    assert!(empty.contains("extent"), "{empty}");
}

#[test]
fn the_living_room_is_moderate_and_what_moves_in_it_starts_on_the_table() {
    let none = build("living-room", MovingObject::None).unwrap();
    let count = Geometry::new(&none).triangles.len();
    assert!((10_000..30_000).contains(&count), "{count} triangles");
    assert!(none.objects.iter().all(|o| !o.dynamic) && none.duration() == 0.0);
    for object in [MovingObject::Balloon, MovingObject::Torus, MovingObject::Teapot] {
        let scene = build("living-room", object).unwrap();
        let index = scene.objects.iter().position(|o| o.dynamic).expect("something moves");
        assert_eq!((scene.objects.len(), scene.duration()), (none.objects.len() + 1, 8.0));
        let geometry = Geometry::new(&scene);
        let range = geometry.objects[index].clone();
        let points = &geometry.positions[range.vertices.start as usize..range.vertices.end as usize];
        let lowest = points.iter().copied().min_by(|a, b| a.y.total_cmp(&b.y)).expect("points");
        let tracer = SceneTracer::new(&scene, &geometry);
        let from = lowest + Vec3::Y * 1e-4;
        let hit = tracer.closest_hit_where(from, Vec3::NEG_Y, 0.01, |t, _| !range.triangles.contains(&t));
        assert!(hit.is_some(), "{} floats", scene.objects[index].name);
    }
    // Solids are closed and face outwards.
    for object in &none.objects {
        let mesh = &none.meshes[object.mesh];
        let is_open = [
            "wall",
            "floor",
            "ceiling",
            "reveals",
            "daylight",
            "picture",
            "rug",
            "skirting",
            "sill",
            "leaves",
            "shade",
            "sideboard",
            "teapot",
            "window frame",
        ];
        if !is_open.iter().any(|part| object.name.contains(part)) {
            assert!(is_closed(mesh), "{} has holes", object.name);
            assert!(volume(mesh) > 0.0, "{} is inside out", object.name);
        }
    }
}
