//! Scenes from files of any supported kind.

use super::{DefaultLight, Environment, Material, Scene, Transform, gltf, model_file, repair};
use crate::{Error, Result};
use std::path::Path;

impl Scene {
    /// Loads a `.glb`, `.gltf`, `.ply` or `.obj` file: a scene, or a single model of white clay. The scene is named
    /// after the file; it gets a camera if it has none ([`Scene::ensure_camera`]), and light if it has none or little
    /// ([`Scene::ensure_light`]).
    ///
    /// # Errors
    /// [`Error::Unknown`] for other kinds of files; [`Error::Read`] or [`Error::Broken`] if the file, or one that it
    /// refers to, is not usable.
    pub fn load(path: &Path) -> Result<Self> {
        Self::load_with(path, None, DefaultLight::Auto)
    }

    /// The same with an environment, which takes the place of the file's own, if there is one, or with another choice of light.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn load_with(path: &Path, environment: Option<Environment>, light: DefaultLight) -> Result<Self> {
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
        let has_environment = environment.is_some();
        scene.environment = environment.or(scene.environment);
        scene.ensure_camera();
        match light {
            DefaultLight::Auto if !has_environment => scene.ensure_light(),
            DefaultLight::Studio => scene.add_studio(),
            DefaultLight::Auto | DefaultLight::None => {}
        }
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
