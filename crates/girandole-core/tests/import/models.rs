//! PLY and OBJ models.

use girandole_core::Error;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::scene::{MaterialId, Mesh, load_model_slice};

const PLY: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    element face 2\nproperty list uchar int vertex_indices\nend_header\n";

/// Two faces with a fold of 30° along the x axis, the second twice as large.
const POINTS: [[f32; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., -1.732_050_8, 1.]];
const FACES: [[i32; 3]; 2] = [[0, 1, 2], [1, 0, 3]];

pub fn ascii() -> String {
    let mut text = format!("ply\nformat ascii 1.0\n{PLY}");
    for [x, y, z] in POINTS {
        text += &format!("{x} {y} {z}\n");
    }
    for [a, b, c] in FACES {
        text += &format!("3 {a} {b} {c}\n");
    }
    text
}

pub fn binary(big: bool) -> Vec<u8> {
    let mut bytes =
        format!("ply\nformat binary_{}_endian 1.0\n{PLY}", if big { "big" } else { "little" }).into_bytes();
    let word = |bytes: &mut Vec<u8>, w: [u8; 4]| bytes.extend(if big { [w[3], w[2], w[1], w[0]] } else { w });
    for x in POINTS.as_flattened() {
        word(&mut bytes, x.to_le_bytes());
    }
    for face in FACES {
        bytes.push(3);
        for i in face {
            word(&mut bytes, i.to_le_bytes());
        }
    }
    bytes
}

fn ply(bytes: impl AsRef<[u8]>) -> Mesh {
    load_model_slice(bytes.as_ref(), "ply").expect("a model")
}

fn refused(bytes: &[u8], kind: &str, words: &str) {
    match load_model_slice(bytes, kind) {
        Err(Error::Broken { reason, .. }) => {
            assert!(reason.contains(words) && !reason.contains('\n'), "{reason}")
        }
        other => panic!("{words}: {other:?}"),
    }
}

#[test]
fn ascii_and_binary_are_the_same() {
    let mesh = ply(ascii());
    assert_eq!(mesh.positions, POINTS.map(Vec3::from));
    assert_eq!(mesh.triangles.iter().map(|t| t.vertices.map(|v| v as i32)).collect::<Vec<_>>(), FACES);
    for big in [false, true] {
        let other = ply(binary(big));
        assert_eq!((other.positions, other.normals), (mesh.positions.clone(), mesh.normals.clone()));
        assert_eq!(other.triangles, mesh.triangles);
    }
}

#[test]
fn generated_normals_are_weighted_by_angle() {
    let mesh = ply(ascii());
    // Vertex 0 has right angles of both faces; vertex 1 has 45° of the one and atan 2 of the other.
    let folded = Vec3::new(0.0, 0.5, 0.75_f32.sqrt());
    let is_near = |vertex: usize, wanted: Vec3| (mesh.normals[vertex] - wanted.normalize()).length() < 1e-6;
    assert!(is_near(0, Vec3::Z + folded), "{}", mesh.normals[0]);
    let weighted = folded * 2.0_f32.atan() + Vec3::Z * 1.0_f32.atan();
    assert!(is_near(1, weighted), "{}", mesh.normals[1]);
    assert!(is_near(2, Vec3::Z) && is_near(3, folded));
}

#[test]
fn quads_normals_and_texture_coordinates() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n\
        element face 1\nproperty list uchar uint vertex_index\nproperty uchar red\nend_header\n\
        0 0 0 0 0 2 0 0\n1 0 0 0 0 2 1 0\n1 1 0 0 0 2 1 1\n0 1 0 0 0 2 0 1\n4 0 1 2 3 255\n";
    let mesh = ply(text);
    assert_eq!(mesh.triangles.iter().map(|t| t.vertices).collect::<Vec<_>>(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.normals, [Vec3::Z; 4]);
    assert_eq!(mesh.uvs[2], [Vec2::new(1.0, 0.0); 2], "v points down here");
}

#[test]
fn objects_of_an_obj_are_merged() {
    let text = "# caf\u{e9}\nmtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no a\nf 1 2 3 4\no b\nf -1 -2 -3\nl 1 2\np 1\n";
    let latin1: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let mesh = load_model_slice(&latin1, "OBJ").expect("a model");
    assert_eq!((mesh.triangles.len(), mesh.uvs.len()), (3, 0));
    let front = |t: usize| {
        let [a, b, c] = mesh.triangles[t].vertices.map(|v| mesh.positions[v as usize]);
        (b - a).cross(c - a).normalize()
    };
    assert_eq!([front(0), front(1), front(2)], [Vec3::Z, Vec3::Z, Vec3::NEG_Z]);
    // As some programs save text: two bytes a character, of either order.
    let marked = format!("\u{feff}{text}");
    for order in [u16::to_le_bytes, u16::to_be_bytes] {
        let wide: Vec<u8> = marked.encode_utf16().flat_map(order).collect();
        let wide = load_model_slice(&wide, "OBJ").expect("a model");
        assert_eq!((wide.positions, wide.triangles.len()), (mesh.positions.clone(), 3));
    }
}

#[test]
fn broken_models_are_refused() {
    refused(b"", "ply", "it is empty");
    refused(b"", "obj", "it is empty");
    refused(b"glTF", "ply", "not a PLY file");
    refused(b"v 1 2 3\n", "obj", "no faces");
    refused(b"v 0 0 0\nf 1 2 3\n", "obj", "vertex 1 of 1");
    refused(b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "obj", "vertex 0 is at");
    let whole = binary(false);
    refused(&whole[..whole.len() - 1], "ply", "broken");
    let huge = ascii().replace("vertex 4", "vertex 4000000000");
    refused(huge.as_bytes(), "ply", "promises 4000000000");
    refused(ascii().replace("3 1 0 3", "3 1 0 9").as_bytes(), "ply", "vertex 9 of 4");
    refused(ascii().replace("3 1 0 3", "3 1 0 -3").as_bytes(), "ply", "vertex -3 of 4");
    let mut infinite = binary(false);
    let data = infinite.len() - 2 * 13 - 4 * 12;
    infinite[data + 12..data + 16].copy_from_slice(&f32::INFINITY.to_le_bytes());
    refused(&infinite, "ply", "vertex 1 is at");
    let nothing = "ply\nformat ascii 1.0\nelement ghost 4000000\nend_header\n";
    refused(nothing.as_bytes(), "ply", "ghost");
    assert!(matches!(load_model_slice(b"x", "stl"), Err(Error::Unknown { .. })));
}

#[test]
fn a_gltf_scene_is_one_model() {
    let mesh = load_model_slice(&crate::builder::some_of_everything().glb(), "glb").expect("a model");
    assert_eq!((mesh.triangles.len(), mesh.positions.len(), mesh.uvs.len()), (6, 12, 12));
    assert!(mesh.triangles.iter().all(|t| t.material == MaterialId(0)) && mesh.patches.is_empty());
    // The second instance is twice as large, one metre up, and mirrored.
    assert!(mesh.positions[4..8].contains(&Vec3::new(2.0, 3.0, 0.0)), "{:?}", mesh.positions);
    assert_eq!(mesh.normals[4..8], [Vec3::NEG_Z; 4]);
}
