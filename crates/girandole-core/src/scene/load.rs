//! Scenes from files of any supported kind.

use super::{Environment, Material, Scene, Transform, gltf, model_file, repair};
use crate::{Error, Result};
use std::path::Path;

impl Scene {
    /// Loads a `.glb`, `.gltf`, `.ply` or `.obj` file: a scene, or a single model of white clay. The scene is named
    /// after the file; it gets a camera if it has none ([`Scene::ensure_camera`]), and a light if nothing in it
    /// shines ([`Scene::ensure_light`]).
    ///
    /// # Errors
    /// [`Error::Unknown`] for other kinds of files; [`Error::Read`] or [`Error::Broken`] if the file, or one that it
    /// refers to, is not usable.
    pub fn load(path: &Path) -> Result<Self> {
        Self::load_with_environment(path, None)
    }

    /// The same with an environment, which takes the place of the file's own, if there is one: then nothing else needs to shine.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn load_with_environment(path: &Path, environment: Option<Environment>) -> Result<Self> {
        let kind = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        let mut scene = match kind.as_str() {
            "glb" | "gltf" => gltf::load_gltf(path)?,
            "ply" | "obj" => Self::from_model(path)?,
            _ => {
                return Err(Error::Unknown {
                    kind: "scene file type",
                    name: path.display().to_string(),
                    known: ".glb, .gltf, .ply, .obj".into(),
                });
            }
        };
        scene.name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        scene.environment = environment.or(scene.environment);
        scene.ensure_camera();
        scene.ensure_light();
        Ok(scene)
    }

    fn from_model(path: &Path) -> Result<Self> {
        let mesh = model_file::load_model(path)?;
        let mut scene = Self::default();
        scene.add_material(Material { name: "clay".into(), ..Material::default() });
        scene.add_object(&mesh.name.clone(), mesh, Transform::IDENTITY);
        repair::mark_scene(&mut scene)
            .map_err(|e| Error::Broken { path: path.into(), reason: format!("it {e}") })?;
        Ok(scene)
    }
}
