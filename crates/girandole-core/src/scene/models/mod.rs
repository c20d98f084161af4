//! Models from PLY and OBJ files, and single meshes from glTF files too.
//!
//! 1. `text`, `obj`, `ply`: what the file says, as [`Polygons`] with the names of materials.
//! 2. `polygons`: faces are cut into triangles; `smoothing`: normals that are missing; `assemble`: a mesh of them.
//! 3. `mtl`, `materials`: what the mesh is made of, in a scene.
//!
//! What is broken is an error; what is merely not read is named once in a warning and left out.

mod assemble;
mod materials;
mod mtl;
mod obj;
mod ply;
mod polygons;
mod smoothing;
mod tangents;
mod text;

use super::gltf::{load_gltf, load_gltf_slice};
use super::{Geometry, Material, MaterialId, Mesh, MeshTriangle, NONE, Scene, Transform, repair};
use crate::{Error, Result};
use glam::Vec3;
use materials::{Materials, clay};
use polygons::Polygons;
use std::path::Path;

/// The rest of a sentence that begins with the file and "is not usable".
type Parsed<T> = std::result::Result<T, String>;

/// What a file says.
#[derive(Default)]
struct Model {
    polygons: Polygons,
    /// Names of the materials that its faces refer to.
    materials: Vec<String>,
    /// What follows each `mtllib`.
    libraries: Vec<String>,
    /// The picture that it is covered by.
    texture: Option<String>,
    /// What was left out.
    warnings: Vec<String>,
}

/// Loads one mesh (all its parts merged, material index 0) from a `.ply`, `.obj`, `.glb` or `.gltf` file, in the
/// file's unit, which should be metres. Normals that the file lacks are means of the adjoining faces, weighted by
/// angle, but for edges that stay sharp: in OBJ files those between smoothing groups, else those of more than 60°, or
/// of 35° between planes of some size. Faces that are listed twice are kept once. No patches are marked; colours of
/// vertices are read, materials are not, which a logged warning says.
///
/// # Errors
/// [`Error::Unknown`] for other kinds of files; [`Error::Read`] or [`Error::Broken`] if the file is not usable.
pub fn load_model(path: &Path) -> Result<Mesh> {
    let kind = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let mut mesh = match Kind::new(kind, || path.display().to_string())? {
        Kind::Gltf => merge(&load_gltf(path)?),
        kind => {
            let bytes = crate::files::read(path)?;
            kind.mesh(&bytes).map_err(|reason| Error::Broken { path: path.into(), reason })?
        }
    };
    mesh.name = stem(path);
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
        kind => kind.mesh(bytes).map_err(|reason| Error::Broken { path: "the model data".into(), reason }),
    }
}

/// The scene that is a PLY or OBJ file: one object of the materials that it names (those of MTL files, and pictures,
/// lie beside it), else of white clay.
pub(super) fn load_scene(path: &Path) -> Result<Scene> {
    let broken = |reason| Error::Broken { path: path.into(), reason };
    let kind = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let kind = Kind::new(kind, || path.display().to_string())?;
    let model = kind.read(&crate::files::read(path)?).map_err(broken)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut scene = scene(model, Some(folder)).map_err(broken)?;
    scene.name = stem(path);
    scene.objects[0].name = scene.name.clone();
    scene.nodes[0].name = scene.name.clone();
    scene.meshes[0].name = scene.name.clone();
    Ok(scene)
}

fn stem(path: &Path) -> String {
    path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
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

    fn read(&self, bytes: &[u8]) -> Parsed<Model> {
        if bytes.is_empty() {
            return Err("it is empty; fetch or export it again".into());
        }
        if matches!(self, Self::Obj) { obj::read(bytes) } else { ply::read(bytes) }
    }

    fn mesh(&self, bytes: &[u8]) -> Parsed<Mesh> {
        let model = self.read(bytes)?;
        model.warnings.iter().for_each(|warning| tracing::warn!("{warning}"));
        if !model.materials.is_empty() || model.texture.is_some() {
            tracing::warn!(
                "the materials of a model that is put into a scene are left out: it is of one material"
            );
        }
        let mut mesh = model.polygons.mesh()?;
        mesh.triangles.iter_mut().for_each(|triangle| triangle.material = MaterialId(0));
        Ok(mesh)
    }
}

/// One object, with its materials and patches.
fn scene(model: Model, folder: Option<&Path>) -> Parsed<Scene> {
    let mut scene = Scene::default();
    model.warnings.into_iter().for_each(|warning| scene.warn(warning));
    let mut mesh = model.polygons.mesh()?;
    let mut materials = Materials::new(&mut scene, folder);
    materials.add_libraries(&model.materials, &model.libraries);
    if mesh.triangles.iter().any(|triangle| triangle.material == MaterialId(NONE)) {
        match &model.texture {
            Some(picture) => materials.add_textured(picture),
            None => {
                let white = if mesh.colors.is_empty() { clay().base_color } else { Vec3::ONE };
                scene.add_material(Material { base_color: white, ..clay() });
            }
        }
        let last = (scene.materials.len() - 1).into();
        for triangle in mesh.triangles.iter_mut().filter(|triangle| triangle.material == MaterialId(NONE)) {
            triangle.material = last;
        }
    }
    for material in &mut scene.materials {
        material.vertex_colors = !mesh.colors.is_empty();
    }
    tangents::add(&mut mesh, &scene.materials);
    scene.add_object("", mesh, Transform::IDENTITY);
    repair::mark_scene(&mut scene).map_err(|e| format!("it {e}"))?;
    Ok(scene)
}

/// At most 60 characters of what a file says, none of which the terminal would obey.
fn named(text: &str) -> String {
    const MOST: usize = 60;
    let mut short: String = text.chars().take(MOST).map(|c| if c.is_control() { '·' } else { c }).collect();
    if text.chars().nth(MOST).is_some() {
        short.push('…');
    }
    short
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
            .map(|t| MeshTriangle { vertices: t.vertices, material: MaterialId(0) })
            .collect(),
        ..Mesh::default()
    }
}
