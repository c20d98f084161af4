//! Single meshes from PLY, OBJ and glTF files.

use super::gltf::{MAX_TRIANGLES, load_gltf, load_gltf_slice};
use super::repair::{drop_duplicates, smooth_normals};
use super::{Geometry, Mesh, MeshTriangle, Scene};
use crate::{Error, Result};
use glam::{Vec2, Vec3};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};
use std::borrow::Cow;
use std::io::Cursor;
use std::path::Path;

/// The rest of a sentence that begins with the file and "is not usable".
type Parsed<T> = std::result::Result<T, String>;

/// Loads one mesh (all its parts merged, material index 0) from a `.ply`, `.obj`, `.glb` or `.gltf` file, in the
/// file's unit, which should be metres. Normals that the file lacks are smooth: means of the adjoining faces, weighted
/// by angle. Faces that are listed twice are kept once. No patches are marked; materials and colours are not read.
///
/// # Errors
/// [`Error::Unknown`] for other kinds of files; [`Error::Read`] or [`Error::Broken`] if the file is not usable.
pub fn load_model(path: &Path) -> Result<Mesh> {
    let kind = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let mut mesh = match Kind::new(kind, || path.display().to_string())? {
        Kind::Gltf => merge(&load_gltf(path)?),
        kind => {
            let bytes = crate::files::read(path)?;
            kind.read(&bytes).map_err(|reason| Error::Broken { path: path.into(), reason })?
        }
    };
    mesh.name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(mesh)
}

/// Loads one mesh from the bytes of a file; `kind` is what its name would end with: `ply`, `obj`, `glb` or `gltf`.
/// Otherwise like [`load_model`].
///
/// # Errors
/// [`Error::Unknown`] for other kinds; [`Error::Broken`] if the data is not usable.
pub fn load_model_slice(bytes: &[u8], kind: &str) -> Result<Mesh> {
    match Kind::new(kind, || kind.into())? {
        Kind::Gltf => Ok(merge(&load_gltf_slice(bytes, None)?)),
        kind => kind.read(bytes).map_err(|reason| Error::Broken { path: "the model data".into(), reason }),
    }
}

enum Kind {
    Gltf,
    Ply,
    Obj,
}

impl Kind {
    fn new(extension: &str, name: impl Fn() -> String) -> Result<Self> {
        match extension.to_ascii_lowercase().as_str() {
            "glb" | "gltf" => Ok(Self::Gltf),
            "ply" => Ok(Self::Ply),
            "obj" => Ok(Self::Obj),
            _ => Err(Error::Unknown {
                kind: "model file type",
                name: name(),
                known: ".ply, .obj, .glb, .gltf".into(),
            }),
        }
    }

    fn read(&self, bytes: &[u8]) -> Parsed<Mesh> {
        if bytes.is_empty() {
            return Err("it is empty; fetch or export it again".into());
        }
        if matches!(self, Self::Obj) { obj(bytes) } else { ply(bytes) }
    }
}

/// All objects of a scene in world space.
fn merge(scene: &Scene) -> Mesh {
    let geometry = Geometry::new(scene);
    let textured = scene.meshes.iter().any(|m| !m.uvs.is_empty());
    Mesh {
        name: scene.name.clone(),
        positions: geometry.positions.iter().map(|p| (p.as_dvec3() + geometry.origin).as_vec3()).collect(),
        normals: geometry.normals,
        uvs: if textured { geometry.uvs } else { Vec::new() },
        triangles: geometry
            .triangles
            .iter()
            .map(|t| MeshTriangle { vertices: t.vertices, material: 0 })
            .collect(),
        ..Mesh::default()
    }
}

/// Checks what was read and adds the normals that are missing.
fn finish(
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<[Vec2; 2]>,
    triangles: Vec<[u32; 3]>,
) -> Parsed<Mesh> {
    if triangles.is_empty() {
        return Err("it has no faces".into());
    }
    if let Some(bad) = positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("its vertex {bad} is at {}; export it again", positions[bad]));
    }
    if let Some(bad) = triangles.iter().flatten().find(|&&v| v as usize >= positions.len()) {
        return Err(format!("a face has vertex {bad} of {}; export it again", positions.len()));
    }
    let mut normals: Vec<Vec3> = normals.iter().map(|n| n.as_dvec3().normalize_or_zero().as_vec3()).collect();
    normals.resize(positions.len(), Vec3::ZERO);
    if normals.contains(&Vec3::ZERO) {
        let smooth = smooth_normals(&positions, triangles.iter().copied());
        for (normal, smooth) in normals.iter_mut().zip(smooth) {
            if *normal == Vec3::ZERO {
                *normal = smooth;
            }
        }
    }
    let has_uvs = uvs.len() == positions.len() && uvs.iter().all(|uv| uv[0].abs().max_element() < 1e9);
    let mut mesh = Mesh {
        positions,
        normals,
        uvs: if has_uvs { uvs } else { Vec::new() },
        triangles: triangles.into_iter().map(|vertices| MeshTriangle { vertices, material: 0 }).collect(),
        ..Mesh::default()
    };
    drop_duplicates(&mut mesh);
    Ok(mesh)
}

/// A vertex or face of a PLY file.
#[derive(Default)]
struct Element {
    position: [f64; 3],
    normal: [f64; 3],
    uv: Option<[f64; 2]>,
    corners: Vec<i64>,
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if matches!(name, "vertex_indices" | "vertex_index") {
            self.corners = match property {
                Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
                Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
                Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
                Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
                Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
                Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
                _ => return PropertyAccessResult::UnsupportedType,
            };
            return PropertyAccessResult::Set;
        }
        let value = match property {
            Property::Char(x) => f64::from(x),
            Property::UChar(x) => f64::from(x),
            Property::Short(x) => f64::from(x),
            Property::UShort(x) => f64::from(x),
            Property::Int(x) => f64::from(x),
            Property::UInt(x) => f64::from(x),
            Property::Float(x) => f64::from(x),
            Property::Double(x) => x,
            _ => return PropertyAccessResult::Ignored,
        };
        match name {
            "x" => self.position[0] = value,
            "y" => self.position[1] = value,
            "z" => self.position[2] = value,
            "nx" => self.normal[0] = value,
            "ny" => self.normal[1] = value,
            "nz" => self.normal[2] = value,
            "u" | "s" | "texture_u" => self.uv.get_or_insert_default()[0] = value,
            "v" | "t" | "texture_v" => self.uv.get_or_insert_default()[1] = value,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

/// A PLY file, ASCII or binary.
fn ply(bytes: &[u8]) -> Parsed<Mesh> {
    let broken = |e: &dyn std::fmt::Display| {
        let message: String = e.to_string().lines().next().unwrap_or_default().chars().take(120).collect();
        format!("it is not a PLY file or broken ({message}); fetch or export it again")
    };
    let parser = Parser::<Element>::new();
    let mut reader = Reader::new(Cursor::new(bytes));
    let header = parser.read_header(&mut reader).map_err(|e| broken(&e))?;
    for (name, element) in &header.elements {
        // Each element takes a byte at least: no count can make the parser take more memory than the file deserves.
        if element.count > bytes.len() || (element.count > 0 && element.properties.is_empty()) {
            return Err(format!(
                "it promises {} of element `{name}` and is too short for them",
                element.count
            ));
        }
    }
    let mut payload = parser.read_payload(&mut reader, &header).map_err(|e| broken(&e))?;
    let vertices = payload.swap_remove("vertex").unwrap_or_default();
    let faces = payload.swap_remove("face").unwrap_or_default();
    let has_uvs = vertices.iter().any(|v| v.uv.is_some());
    let narrow = |v: [f64; 3]| Vec3::from(v.map(|x| x as f32));
    let mut triangles = Vec::new();
    for face in &faces {
        for pair in face.corners.get(1..).unwrap_or_default().windows(2) {
            if triangles.len() == MAX_TRIANGLES {
                return Err(format!("it has more than {MAX_TRIANGLES} triangles; simplify it"));
            }
            let corner = |index: i64| {
                u32::try_from(index)
                    .map_err(|_| format!("a face has vertex {index} of {}; export it again", vertices.len()))
            };
            triangles.push([corner(face.corners[0])?, corner(pair[0])?, corner(pair[1])?]);
        }
    }
    let uvs = vertices.iter().map(|v| {
        let [u, v] = v.uv.unwrap_or_default();
        // Modelling programs count v upwards.
        [Vec2::new(u as f32, 1.0 - v as f32); 2]
    });
    finish(
        vertices.iter().map(|v| narrow(v.position)).collect(),
        vertices.iter().map(|v| narrow(v.normal)).collect(),
        if has_uvs { uvs.collect() } else { Vec::new() },
        triangles,
    )
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Cow<'static, str> {
    let units: Vec<u16> = bytes.as_chunks().0.iter().map(|&pair| unit(pair)).collect();
    String::from_utf16_lossy(&units).into()
}

/// A Wavefront OBJ file.
fn obj(bytes: &[u8]) -> Parsed<Mesh> {
    let options =
        tobj::LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };
    // Only names can hold anything but ASCII, and they do not matter.
    let text = match bytes {
        [0xff, 0xfe, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => utf16(rest, u16::from_be_bytes),
        _ => String::from_utf8_lossy(bytes),
    };
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(text.as_bytes()), &options, |_| {
        Err(tobj::LoadError::OpenFileFailed)
    })
    .map_err(|e| format!("it is not an OBJ file or broken ({e}); fetch or export it again"))?;
    let (mut positions, mut normals, mut uvs, mut triangles) = (vec![], vec![], vec![], vec![]);
    let mut has_uvs = false;
    let triples = |list: &[f32]| -> Vec<Vec3> { list.chunks_exact(3).map(Vec3::from_slice).collect() };
    for model in models {
        let mesh = model.mesh;
        let first = positions.len();
        positions.extend(triples(&mesh.positions));
        let count = positions.len();
        // Faces without normals or coordinates beside others with leave these lists too short to say whose they are.
        if mesh.normals.len() == mesh.positions.len() {
            normals.extend(triples(&mesh.normals));
        }
        normals.resize(count, Vec3::ZERO);
        if mesh.texcoords.len() / 2 == count - first {
            // Modelling programs count v upwards.
            uvs.extend(mesh.texcoords.chunks_exact(2).map(|uv| [Vec2::new(uv[0], 1.0 - uv[1]); 2]));
            has_uvs = true;
        }
        uvs.resize(count, [Vec2::ZERO; 2]);
        if triangles.len() + mesh.indices.len() / 3 > MAX_TRIANGLES {
            return Err(format!("it has more than {MAX_TRIANGLES} triangles; simplify it"));
        }
        for corners in mesh.indices.chunks_exact(3) {
            triangles.push([corners[0], corners[1], corners[2]].map(|v| v + first as u32));
        }
    }
    finish(positions, normals, if has_uvs { uvs } else { Vec::new() }, triangles)
}
