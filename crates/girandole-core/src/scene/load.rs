//! Scenes from files of any supported kind.

use super::{DefaultLight, Environment, Material, Scene, Transform, gltf, model_file, repair};
use crate::{Error, Result};
use std::path::Path;

/// How a scene is loaded.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Takes the place of the file's own environment, if there is one; with [`DefaultLight::Auto`] nothing else is added then.
    pub environment: Option<Environment>,
    /// What else lights it.
    pub light: DefaultLight,
    /// What all lengths are multiplied by ([`Scene::scale`]). Where it is none, lengths that are hardly metres are named in a
    /// warning.
    pub scale: Option<f64>,
}

impl Scene {
    /// Loads a `.glb`, `.gltf`, `.ply` or `.obj` file: a scene, or a single model of white clay. The scene is named
    /// after the file; it gets a camera if it has none ([`Scene::ensure_camera`]), and light if it has none or little
    /// ([`Scene::ensure_light`]).
    ///
    /// # Errors
    /// [`Error::Unknown`] for other kinds of files; [`Error::Read`] or [`Error::Broken`] if the file, or one that it
    /// refers to, is not usable.
    pub fn load(path: &Path) -> Result<Self> {
        Self::load_with(path, LoadOptions::default())
    }

    /// The same with other light, or in other units.
    ///
    /// # Errors
    /// As [`Scene::load`]; [`Error::Invalid`] for a scale that is none.
    pub fn load_with(path: &Path, options: LoadOptions) -> Result<Self> {
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
        match options.scale {
            Some(factor) => scene.scale(factor)?,
            None => scene.doubt_units(),
        }
        let has_environment = options.environment.is_some();
        scene.environment = options.environment.or(scene.environment);
        scene.ensure_camera();
        match options.light {
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
