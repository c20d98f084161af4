//! Scenes from files of any supported kind.

use super::{DefaultLight, Environment, Geometry, Scene, UpAxis, gltf, models};
use crate::slices::{complete, pause};
use crate::{Error, Result};
use std::path::Path;
use std::sync::Arc;

/// How a scene is loaded.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// Takes the place of the file's own environment, if there is one; with [`DefaultLight::Auto`] nothing else is added then.
    pub environment: Option<Environment>,
    /// What else lights it.
    pub light: DefaultLight,
    /// The axis that points up in the file. Where it is none, +Y; and models that seem to lie on their side are named
    /// in a warning.
    pub up: Option<UpAxis>,
    /// What all lengths are multiplied by ([`Scene::scale`]). Where it is none, lengths that are hardly metres are named in a
    /// warning.
    pub scale: Option<f64>,
    /// Whether what is put into a studio stands on a ground, if it has no floor ([`Scene::add_ground`]); it does by default.
    pub ground: bool,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { environment: None, light: DefaultLight::default(), up: None, scale: None, ground: true }
    }
}

impl Scene {
    /// Loads a `.glb`, `.gltf`, `.ply` or `.obj` file: a scene, or a single model. Models are of the materials that
    /// MTL files beside them tell of and of their vertices' colours, else of white clay. The scene is named after the
    /// file; it gets a camera if it has none ([`Scene::ensure_camera`]), and light if it has none or little
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
        complete(Self::load_in_slices(path, options))
    }

    /// The same for whoever has something else to do meanwhile: the future pauses between [slices](crate::slices) of work.
    ///
    /// # Errors
    /// As [`Scene::load_with`].
    pub async fn load_in_slices(path: &Path, options: LoadOptions) -> Result<Self> {
        let kind = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        let mut scene = match kind.as_str() {
            "glb" | "gltf" => gltf::load_gltf_in_slices(path).await?,
            "ply" | "obj" => models::load_scene(path)?,
            _ => {
                return Err(Error::Unknown {
                    kind: "scene file type",
                    name: path.display().to_string(),
                    known: ".glb, .gltf, .ply, .obj".into(),
                });
            }
        };
        pause().await;
        scene.name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        match options.up {
            Some(up) => scene.turn_up(up),
            None if matches!(kind.as_str(), "ply" | "obj") => scene.doubt_up(),
            None => {}
        }
        pause().await;
        if let Some(factor) = options.scale {
            scene.scale(factor)?;
        }
        let geometry = Geometry::in_slices(&scene).await;
        pause().await;
        if options.scale.is_none() {
            scene.doubt_units(&geometry);
        }
        scene.doubt_clip_planes(&geometry);
        let has_environment = options.environment.is_some();
        scene.environment = options.environment.or(scene.environment);
        pause().await;
        scene.ensure_camera_in(&geometry);
        pause().await;
        let without = scene.environment.as_ref().map(|environment| environment.map.clone());
        match options.light {
            DefaultLight::Auto if !has_environment => scene.ensure_light_in_slices(geometry).await,
            DefaultLight::Studio => scene.add_studio(),
            DefaultLight::Auto | DefaultLight::None => {}
        }
        let is_added = |map: &Arc<_>| without.is_none_or(|without| !Arc::ptr_eq(map, &without));
        let is_in_studio =
            scene.environment.as_ref().map(|environment| &environment.map).is_some_and(is_added);
        if options.ground && is_in_studio && scene.add_ground() {
            let said = scene.warnings.last_mut().filter(|warning| warning.ends_with("a studio lights it"));
            said.into_iter().for_each(|warning| warning.push_str(", and it stands on a ground"));
        }
        Ok(scene)
    }
}
