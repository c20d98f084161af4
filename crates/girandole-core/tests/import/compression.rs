//! Compressed geometry beside its uncompressed twin.

use crate::builder::File;
use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType, MeshEncoder, PointAttribute,
};
use girandole_core::glam::Vec3;
use girandole_core::scene::{Mesh, Scene, load_gltf_slice};
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{
    IndexEncoding, VertexEncoding, encode_filter_oct, encode_index_buffer, encode_index_sequence,
    encode_vertex_buffer,
};
use serde_json::{Value, json};

/// How a file of one hilly square is compressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Compression {
    None,
    /// Vertices and triangles.
    Meshopt,
    /// The newer vertex format, octahedral normals and an index sequence.
    MeshoptFilters,
    /// Draco's two ways of connecting triangles, by speed.
    Draco(i32),
}

const SIDE: u32 = 12;

impl Compression {
    pub const ALL: [Self; 4] = [Self::Meshopt, Self::MeshoptFilters, Self::Draco(3), Self::Draco(10)];

    pub fn file(self) -> File {
        let mut file = File::new();
        let primitive = match self {
            Self::None => {
                let positions = file.floats(&positions().concat(), "VEC3");
                let normals = file.floats(&normals().concat(), "VEC3");
                let uvs = file.floats(&uvs().concat(), "VEC2");
                let indices: Vec<u16> = indices().iter().map(|&i| i as u16).collect();
                let indices = file.shorts(&indices, "SCALAR");
                json!({"attributes": {"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs}, "indices": indices})
            }
            Self::Meshopt | Self::MeshoptFilters => self.meshopt(&mut file),
            Self::Draco(speed) => draco(&mut file, speed),
        };
        let mesh = file.mesh(primitive);
        file.node(json!({"mesh": mesh}));
        file
    }

    fn meshopt(self, file: &mut File) -> Value {
        let mut workspace = Workspace::default();
        let is_new = self == Self::MeshoptFilters;
        let name = if is_new { "KHR_meshopt_compression" } else { "EXT_meshopt_compression" };
        file.json["extensionsRequired"] = json!([name]);
        file.json["extensionsUsed"] = json!([name]);
        let encoding = VertexEncoding::new(u8::from(is_new), 2).expect("an encoding");
        let bytes = |floats: Vec<f32>| floats.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let mut view =
            |file: &mut File, data: &[u8], count: usize, stride: usize, mode: &str, filter: &str| {
                let plain = match mode {
                    "ATTRIBUTES" => encode_vertex_buffer(data, count, stride, encoding, &mut workspace),
                    _ => {
                        let indices: Vec<u32> =
                            data.as_chunks::<4>().0.iter().map(|&b| u32::from_le_bytes(b)).collect();
                        if mode == "TRIANGLES" {
                            encode_index_buffer(&indices, IndexEncoding::DEFAULT, &mut workspace)
                        } else {
                            encode_index_sequence(&indices, IndexEncoding::DEFAULT, &mut workspace)
                        }
                    }
                };
                let index = file.view(&plain.expect("compressed"));
                let mut parent = file.json["bufferViews"][index].take();
                let mut extension = parent.clone();
                for (key, value) in [
                    ("count", json!(count)),
                    ("byteStride", json!(stride)),
                    ("mode", json!(mode)),
                    ("filter", json!(filter)),
                ] {
                    extension[key] = value;
                }
                // Its own buffer has no data.
                parent["buffer"] = json!(1);
                parent["byteOffset"] = json!(0);
                parent["byteLength"] = json!(count * stride);
                if mode == "ATTRIBUTES" {
                    parent["byteStride"] = json!(stride);
                }
                parent["extensions"] = json!({name: extension});
                file.json["bufferViews"][index] = parent;
                index
            };
        let count = positions().len();
        let position_view = view(file, &bytes(positions().concat()), count, 12, "ATTRIBUTES", "NONE");
        let uv_view = view(file, &bytes(uvs().concat()), count, 8, "ATTRIBUTES", "NONE");
        let (normals, normal_stride, normal_type) = if is_new {
            let four: Vec<f32> = normals().iter().flat_map(|n| [n[0], n[1], n[2], 0.0]).collect();
            (encode_filter_oct(count, 8, 16, &four, &mut Workspace::default()).expect("normals"), 8, 5122)
        } else {
            (bytes(normals().concat()), 12, 5126)
        };
        let filter = if is_new { "OCTAHEDRAL" } else { "NONE" };
        let normal_view = view(file, &normals, count, normal_stride, "ATTRIBUTES", filter);
        let index_bytes: Vec<u8> = indices().iter().flat_map(|i| i.to_le_bytes()).collect();
        let mode = if is_new { "INDICES" } else { "TRIANGLES" };
        let index_view = view(file, &index_bytes, indices().len(), 4, mode, "NONE");
        file.push("buffers", json!({"byteLength": 1 << 16, "extensions": {name: {"fallback": true}}}));
        let mut accessor = |view: usize, component: u32, count: usize, kind: &str| {
            file.push(
                "accessors",
                json!({"bufferView": view, "componentType": component, "count": count, "type": kind,
                    "normalized": component == 5122}),
            )
        };
        json!({
            "attributes": {
                "POSITION": accessor(position_view, 5126, count, "VEC3"),
                "NORMAL": accessor(normal_view, normal_type, count, "VEC3"),
                "TEXCOORD_0": accessor(uv_view, 5126, count, "VEC2"),
            },
            "indices": accessor(index_view, 5125, indices().len(), "SCALAR"),
        })
    }
}

fn draco(file: &mut File, speed: i32) -> Value {
    let name = "KHR_draco_mesh_compression";
    file.json["extensionsRequired"] = json!([name]);
    file.json["extensionsUsed"] = json!([name]);
    let mut mesh = draco_core::Mesh::new();
    let mut add = |kind, components: u8, data: Vec<f32>| {
        let mut attribute = PointAttribute::new();
        attribute.init(kind, components, DataType::Float32, false, data.len() / usize::from(components));
        for (i, value) in data.iter().enumerate() {
            attribute.buffer_mut().write(4 * i, &value.to_le_bytes());
        }
        mesh.add_attribute(attribute)
    };
    let ids = [
        add(GeometryAttributeType::Position, 3, positions().concat()),
        add(GeometryAttributeType::Normal, 3, normals().concat()),
        add(GeometryAttributeType::TexCoord, 2, uvs().concat()),
    ];
    let triangles = indices();
    mesh.set_num_faces(triangles.len() / 3);
    for (face, corners) in triangles.as_chunks::<3>().0.iter().enumerate() {
        mesh.set_face(FaceIndex(face as u32), corners.map(Into::into));
    }
    let unique = ids.map(|id| mesh.attribute(id).unique_id());
    let mut options = EncoderOptions::new();
    options.set_global_int("encoding_speed", speed);
    options.set_global_int("decoding_speed", speed);
    for (id, bits) in ids.into_iter().zip([14, 10, 12]) {
        options.set_attribute_int(id, "quantization_bits", bits);
    }
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut buffer = EncoderBuffer::new();
    encoder.encode(&options, &mut buffer).expect("compressed");
    let view = file.view(buffer.data());
    let count = positions().len();
    let mut accessor = |component: u32, count: usize, kind: &str| {
        file.push("accessors", json!({"componentType": component, "count": count, "type": kind}))
    };
    json!({
        "attributes": {
            "POSITION": accessor(5126, count, "VEC3"),
            "NORMAL": accessor(5126, count, "VEC3"),
            "TEXCOORD_0": accessor(5126, count, "VEC2"),
        },
        "indices": accessor(5125, triangles.len(), "SCALAR"),
        "extensions": {name: {"bufferView": view, "attributes": {"POSITION": unique[0], "NORMAL": unique[1], "TEXCOORD_0": unique[2]}}},
    })
}

fn grid() -> impl Iterator<Item = [f32; 2]> {
    (0..SIDE * SIDE).map(|i| [i % SIDE, i / SIDE].map(|n| n as f32 / (SIDE - 1) as f32))
}

fn positions() -> Vec<[f32; 3]> {
    grid().map(|[x, y]| [x, y, 0.1 * (6.0 * x).sin() * (5.0 * y).cos()]).collect()
}

fn normals() -> Vec<[f32; 3]> {
    let normal = |[x, y]: [f32; 2]| {
        let [sx, cx, sy, cy] = [(6.0 * x).sin(), (6.0 * x).cos(), (5.0 * y).sin(), (5.0 * y).cos()];
        Vec3::new(-0.6 * cx * cy, 0.5 * sx * sy, 1.0).normalize().to_array()
    };
    grid().map(normal).collect()
}

fn uvs() -> Vec<[f32; 2]> {
    grid().map(|[x, y]| [x, 1.0 - y]).collect()
}

fn indices() -> Vec<u32> {
    let cells = (0..(SIDE - 1) * (SIDE - 1)).map(|i| i % (SIDE - 1) + i / (SIDE - 1) * SIDE);
    cells.flat_map(|a| [a, a + 1, a + SIDE, a + 1, a + SIDE + 1, a + SIDE]).collect()
}

fn load(compression: Compression) -> Scene {
    let scene = load_gltf_slice(&compression.file().glb(), None).expect("a scene");
    assert!(scene.warnings.is_empty(), "{compression:?}: {:?}", scene.warnings);
    scene
}

/// Position, normal and texture coordinates of all corners, in an order that does not depend on the file's.
fn corners(mesh: &Mesh) -> Vec<[f32; 8]> {
    let corner = |v: u32| {
        let (p, n, t) = (mesh.positions[v as usize], mesh.normals[v as usize], mesh.uvs[v as usize][0]);
        [p.x, p.y, p.z, n.x, n.y, n.z, t.x, t.y]
    };
    let mut triangles: Vec<[[f32; 8]; 3]> = mesh.triangles.iter().map(|t| t.vertices.map(corner)).collect();
    let cell = |corner: &[f32; 8]| [1, 0].map(|i| (corner[i] * (SIDE - 1) as f32).round() as i32);
    for triangle in &mut triangles {
        let first = (0..3).min_by_key(|&i| cell(&triangle[i])).unwrap_or(0);
        triangle.rotate_left(first);
    }
    triangles.sort_by_key(|t| t.map(|corner| cell(&corner)));
    triangles.concat()
}

#[test]
fn compressed_geometry_is_its_twin() {
    let plain = load(Compression::None);
    let wanted = corners(&plain.meshes[0]);
    assert_eq!(wanted.len(), indices().len());
    for compression in Compression::ALL {
        let scene = load(compression);
        let found = corners(&scene.meshes[0]);
        assert_eq!(found.len(), wanted.len(), "{compression:?}");
        // Half a step of what was quantised: positions, normals, texture coordinates.
        let [position, normal, uv] = match compression {
            Compression::None | Compression::Meshopt => [0.0; 3],
            Compression::MeshoptFilters => [0.0, 1e-4, 0.0],
            Compression::Draco(_) => [1e-4, 4e-3, 3e-4],
        };
        for (found, wanted) in found.iter().zip(&wanted) {
            for i in 0..8 {
                let most = if i < 3 {
                    position
                } else if i < 6 {
                    normal
                } else {
                    uv
                };
                let difference = (found[i] - wanted[i]).abs();
                assert!(difference <= most, "{compression:?}: {found:?} for {wanted:?}");
            }
        }
    }
}

#[test]
fn what_cannot_be_decompressed_is_refused() {
    let refusal = |file: &File| load_gltf_slice(&file.glb(), None).expect_err("refused").to_string();
    let mut file = Compression::Meshopt.file();
    let extension = &mut file.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"];
    extension["count"] = json!(1 << 27);
    let sentence = refusal(&file);
    assert!(sentence.contains("buffer view 0") && sentence.contains("export"), "{sentence}");
    for (key, value) in [
        ("mode", json!("OTHER")),
        ("filter", json!("OTHER")),
        ("byteLength", json!(1 << 30)),
        ("buffer", json!(9)),
        ("count", json!(7)),
    ] {
        let mut file = Compression::Meshopt.file();
        file.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][key] = value;
        let sentence = refusal(&file);
        assert!(sentence.contains("buffer view 0"), "{sentence}");
    }
    let mut file = Compression::Draco(3).file();
    file.bin[40..80].fill(0x55);
    let sentence = refusal(&file);
    assert!(sentence.contains("compressed primitive") && sentence.contains("export"), "{sentence}");
    let mut file = Compression::Draco(3).file();
    let primitive = &mut file.json["meshes"][0]["primitives"][0];
    primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = json!(77);
    assert!(refusal(&file).contains("part of its compressed primitive"));
}

#[test]
fn data_that_lies_beside_the_compressed_is_used() {
    let mut file = Compression::None.file();
    file.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}});
    let scene = load_gltf_slice(&file.glb(), None).expect("a scene");
    assert_eq!(corners(&scene.meshes[0]), corners(&load(Compression::None).meshes[0]));
}
