//! Faces of OBJ and PLY files: how they are cut, and which of their edges are sharp.

use girandole_core::glam::{DVec3, Quat, Vec2, Vec3};
use girandole_core::scene::{
    DefaultLight, FieldOfView, Geometry, LoadOptions, Mesh, Scene, Viewpoint, load_model, load_model_slice,
};
use girandole_core::trace::SceneTracer;
use proptest::prelude::*;
use std::path::PathBuf;

/// A small file.
pub fn case(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests/import/cases", name].iter().collect()
}

/// A scene of a file alone, without added light and what stands under it.
fn load(name: &str) -> Scene {
    let options = LoadOptions { light: DefaultLight::None, ..LoadOptions::default() };
    Scene::load_with(&case(name), options).expect("a scene")
}

pub fn obj(text: &str) -> Mesh {
    load_model_slice(text.as_bytes(), "obj").expect("a model")
}

/// Twice the area of each triangle, along its front.
fn spans(mesh: &Mesh) -> Vec<Vec3> {
    let span = |t: [u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        (b - a).cross(c - a)
    };
    mesh.triangles.iter().map(|t| span(t.vertices)).collect()
}

/// The area of all triangles, where they all face one way.
fn area(mesh: &Mesh, front: Vec3) -> f32 {
    let spans = spans(mesh);
    assert!(spans.iter().all(|s| s.dot(front) >= 0.0), "{spans:?}");
    spans.iter().map(|s| 0.5 * s.length()).sum()
}

/// Pixels of a picture that a camera sees a surface in.
fn covered(scene: &Scene, [width, height]: [u32; 2]) -> usize {
    let geometry = Geometry::new(scene);
    let tracer = SceneTracer::new(scene, &geometry);
    let viewpoint = Viewpoint {
        eye: DVec3::new(2.0, 1.5, 5.0),
        target: DVec3::new(2.0, 1.5, 0.0),
        up: DVec3::Y,
        field: FieldOfView::Perspective { degrees: 45.0 },
        clip: Default::default(),
    };
    let view = viewpoint.view(width as f32 / height as f32).expect("a view").relative_to(geometry.origin);
    let pixels = (0..width * height).map(|i| Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5));
    pixels
        .filter(|&at| {
            let (origin, direction) = view.pixel_ray(at, [width, height]);
            tracer.closest_visible(origin, direction).is_some()
        })
        .count()
}

#[test]
fn a_door_stays_open() {
    for name in ["door_wall.obj", "door_wall.ply", "door_wall_triangles.obj"] {
        let scene = load(name);
        assert_eq!(covered(&scene, [256, 192]), 21_532, "{name}");
        assert!((area(&scene.meshes[0], Vec3::Z) - 9.9).abs() < 1e-5, "{name}");
    }
    // The control: walled up.
    let text = std::fs::read_to_string(case("door_wall.obj")).expect("a file");
    let walled = text.replace("f 1 2 3 4 5 6 7 8", "f 1 6 7 8");
    assert!((area(&obj(&walled), Vec3::Z) - 12.0).abs() < 1e-5);
    assert!((area(&load_model(&case("L_floor.obj")).expect("a model"), Vec3::Y) - 27.0).abs() < 1e-5);
}

#[test]
fn polygons_that_touch_themselves_are_cut() {
    // A frame about a window: its outline and the hole are joined by an edge that is gone along twice.
    let frame =
        "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nf 1 2 3 4 1 5 6 7 8 5\n";
    assert!((area(&obj(frame), Vec3::Z) - 12.0).abs() < 1e-5);
    // Vertices twice, and on straight edges, also first.
    let square =
        "v 1 0 0\nv 2 0 0\nv 2 0 0\nv 2 2 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nv 1 0 0\nf 1 2 3 4 5 6 7 8\n";
    let mesh = obj(square);
    assert!((area(&mesh, Vec3::Z) - 4.0).abs() < 1e-5);
    assert!(spans(&mesh).iter().all(|s| s.length() > 0.0), "none without area");
    // A quad with its reflex corner in each place.
    for turn in 0..4 {
        let corners = ["0 0 0", "4 0 0", "1 1 0", "0 4 0"];
        let vertices: String = (0..4).map(|i| format!("v {}\n", corners[(i + turn) % 4])).collect();
        let mesh = obj(&(vertices + "f 1 2 3 4\n"));
        assert!((area(&mesh, Vec3::Z) - 4.0).abs() < 1e-5 && mesh.triangles.len() == 2, "{turn}");
    }
    // Without area, or crossing itself: anything, but no panic and no other vertices.
    for face in ["f 1 2 1 2", "f 1 1 1 1 1", "f 1 3 2 4", "f 1 2 3 4 2 1 4 3"] {
        let mesh = obj(&format!("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n{face}\n"));
        assert!(mesh.positions.iter().all(|p| p.is_finite()), "{face}");
    }
    // A quad that is not planar is two triangles, as it always was.
    let bent = obj("v 0 0 0\nv 1 0 .2\nv 1 1 0\nv 0 1 .2\nf 1 2 3 4\n");
    assert_eq!(bent.triangles.iter().map(|t| t.vertices).collect::<Vec<_>>(), [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn polygons_of_very_many_corners_are_refused_unless_they_are_easy() {
    let comb = |teeth: u32| {
        let mut text = String::new();
        for i in 0..teeth {
            text += &format!("v {} 0 0\nv {} {} 0\n", i * 2, i * 2 + 1, if i + 1 < teeth { 1 } else { 9 });
        }
        text += &format!(
            "v 0 9 0\nf {}\n",
            (1..=teeth * 2 + 1).map(|i| i.to_string()).collect::<Vec<_>>().join(" ")
        );
        text
    };
    assert_eq!(obj(&comb(2000)).triangles.len(), 3999);
    let refused = load_model_slice(comb(6000).as_bytes(), "obj").unwrap_err().to_string();
    assert!(refused.contains("a face of 12001 corners"), "{refused}");
    // Teeth that the first corner sees all of.
    let teeth: String = (0..20_000).rev().map(|i| format!("v {i} {} 0\n", i % 2)).collect();
    let face: String = (1..=20_001).map(|i| format!(" {i}")).collect();
    assert_eq!(obj(&format!("v 10000 -1e8 0\n{teeth}f{face}\n")).triangles.len(), 19_999);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Any polygon about a point, some of its corners doubled or on its edges, however it is turned and wherever it
    /// begins.
    #[test]
    fn area_is_kept(
        radii in prop::collection::vec((0.2_f32..3.0, 0..4), 3..40),
        turn in prop::array::uniform3(-3.0_f32..3.0),
        first in 0_usize..40,
    ) {
        let count = radii.len() as f32;
        let at = |i: usize, radius: f32| {
            let angle = i as f32 / count * std::f32::consts::TAU;
            Vec3::new(angle.cos() * radius, angle.sin() * radius, 0.0)
        };
        let mut corners = Vec::new();
        for (i, &(radius, kind)) in radii.iter().enumerate() {
            let (here, next) = (at(i, radius), at(i + 1, radii[(i + 1) % radii.len()].0));
            corners.push(here);
            match kind {
                0 => corners.push(here),
                1 => corners.push((here + next) * 0.5),
                _ => {}
            }
        }
        let first = first % corners.len();
        corners.rotate_left(first);
        let flat: f32 = (0..corners.len())
            .map(|i| corners[i].cross(corners[(i + 1) % corners.len()]).z * 0.5)
            .sum();
        let rotation = Quat::from_scaled_axis(Vec3::from(turn));
        let vertices: String = corners
            .iter()
            .map(|&c| rotation * c)
            .map(|p| format!("v {} {} {}\n", p.x, p.y, p.z))
            .collect();
        let face: String = (1..=corners.len()).map(|i| format!(" {i}")).collect();
        let mesh = obj(&format!("{vertices}f{face}\n"));
        let front = rotation * Vec3::Z;
        let found: f32 = spans(&mesh).iter().map(|s| 0.5 * s.dot(front)).sum();
        let unsigned: f32 = spans(&mesh).iter().map(|s| 0.5 * s.length()).sum();
        prop_assert!((found - flat).abs() < 1e-4 * flat && (unsigned - flat).abs() < 1e-3 * flat,
            "{found} {unsigned} {flat}");
    }
}

/// How far vertex normals are from those of their triangles at most, degrees.
fn most_smoothed(mesh: &Mesh) -> f32 {
    let mut most: f32 = 0.0;
    for (triangle, span) in mesh.triangles.iter().zip(spans(mesh)) {
        for v in triangle.vertices {
            most = most.max(mesh.normals[v as usize].angle_between(span));
        }
    }
    most.to_degrees()
}

#[test]
fn walls_have_hard_edges() {
    let wanted = load("house_vn.obj");
    for name in ["house_no_s.obj", "house_s_off.obj", "house_groups.obj"] {
        let scene = load(name);
        let (mesh, wanted) = (&scene.meshes[0], &wanted.meshes[0]);
        assert_eq!((mesh.patches.len(), mesh.positions.len()), (6, 24), "{name}");
        assert_eq!((&mesh.positions, &mesh.triangles), (&wanted.positions, &wanted.triangles), "{name}");
        for (a, b) in mesh.normals.iter().zip(&wanted.normals) {
            assert!(a.abs_diff_eq(*b, 1e-6), "{name}: {a} {b}");
        }
    }
    // All roofs and gables of a house are flat too: edges of 53° and 74°.
    let house = load_model(&case("house_zup.obj")).expect("a model");
    assert!(most_smoothed(&house) < 0.1, "{}", most_smoothed(&house));
}

#[test]
fn smoothing_groups_decide_where_a_file_has_them() {
    let text = std::fs::read_to_string(case("house_no_s.obj")).expect("a file");
    let smooth = obj(&format!("s 7\n{text}"));
    assert_eq!(smooth.positions.len(), 8);
    assert!((most_smoothed(&smooth) - 54.7).abs() < 0.1, "{}", most_smoothed(&smooth));
    // `s` holds until the next one, also over groups and objects.
    let halves = obj(&text.replace("f 5 6 7 8", "s 0\ng roof\nf 5 6 7 8").replace("# wall", "s 1"));
    assert_eq!(halves.triangles.len(), 12);
    assert_eq!(halves.positions.len(), 24, "one smooth face has no neighbours in its group");
}

/// Two large squares with a fold between them.
fn fold(degrees: f32, more: &str) -> Mesh {
    let (sin, cos) = degrees.to_radians().sin_cos();
    obj(&format!(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv {} 0 {}\nv {} 1 {}\n{more}",
        1.0 + cos,
        -sin,
        1.0 + cos,
        -sin
    )
    .replace("FACES", "f 1 2 3 4\nf 2 5 6 3\n"))
}

#[test]
fn folds_are_sharp_beyond_an_angle() {
    for (degrees, is_smooth) in
        [(1.0, true), (20.0, true), (34.0, true), (36.0, false), (90.0, false), (170.0, false)]
    {
        let mesh = fold(degrees, "FACES");
        assert_eq!(mesh.positions.len() == 6, is_smooth, "{degrees}");
        assert_eq!(most_smoothed(&mesh) > 0.4, is_smooth, "{degrees}");
    }
    // Faces turned the other way are not smooth with their neighbours; those of a group are smooth at any angle.
    assert_eq!(fold(0.0, "f 1 2 3 4\nf 3 6 5 2\n").positions.len(), 8);
    assert_eq!(fold(90.0, "s 1\nFACES").positions.len(), 6);
    // Normals of the file count for the corners that have them.
    let mixed = fold(90.0, "vn 0 0 1\nvn 0 0 0\nf 1//1 2//1 3 4//2\nf 2 5 6 3\n");
    assert!(mixed.normals.iter().filter(|n| n.abs_diff_eq(Vec3::Z, 1e-6)).count() >= 4);
}

#[test]
fn round_things_stay_smooth() {
    let (across, up) = (24, 12);
    let mut text = String::new();
    for j in 0..=up {
        let polar = j as f32 / up as f32 * std::f32::consts::PI;
        // All vertices at a pole are in the same place.
        let radius = if j == 0 || j == up { 0.0 } else { polar.sin() };
        for i in 0..across {
            let around = i as f32 / across as f32 * std::f32::consts::TAU;
            text += &format!("v {} {} {}\n", radius * around.cos(), polar.cos(), -radius * around.sin());
        }
    }
    for j in 0..up {
        for i in 0..across {
            let at = |i: i32, j: i32| j * across + i % across + 1;
            text += &format!("f {} {} {} {}\n", at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
        }
    }
    let mesh = obj(&text);
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        assert!(p.angle_between(*n).to_degrees() < 4.0, "{p} {n}");
    }
    // Small faces of a large model are those of something round up to 60°.
    let far = "v 900 0 0\nv 901 900 0\nv 901 0 900\nf 7 8 9\n";
    for (degrees, is_smooth) in [(50.0, true), (58.0, true), (62.0, false)] {
        let mesh = fold(degrees, &format!("{far}FACES"));
        assert_eq!(mesh.positions.len() == 9, is_smooth, "{degrees}");
    }
}
