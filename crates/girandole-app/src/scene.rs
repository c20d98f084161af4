//! Loads the scene that is named on the command line, and finds the view of it.

use crate::args::SceneArgs;
use anyhow::{Context, Result, bail};
use girandole_core::Error;
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{Edits, Scene, View, load_model};
use std::path::Path;

const OBJECTS: &str = "none, torus, teapot, or a .ply, .obj, .glb or .gltf file";

/// A built-in room with its moving object, or a glTF file.
pub fn load(name: &str, object: Option<&str>) -> Result<Scene> {
    let mut scene = if extension(name).is_some_and(|e| ["glb", "gltf"].contains(&e.as_str())) {
        if object.is_some() {
            bail!("--object belongs to the built-in rooms; leave it out for {name}");
        }
        Scene::load(Path::new(name))?
    } else if builtin::NAMES.contains(&name) {
        builtin::build(name, object.map_or_else(|| Ok(builtin::default_object(name)), moving_object)?)?
    } else {
        let known = format!("{}, or a .glb or .gltf file", builtin::NAMES.join(", "));
        return Err(Error::Unknown { kind: "scene", name: name.into(), known }.into());
    };
    scene.ensure_camera();
    Ok(scene)
}

/// The same, with what a file says was changed in it.
pub fn load_edited(name: &str, object: Option<&str>, edits: Option<&Path>) -> Result<(Scene, Edits)> {
    let mut scene = load(name, object)?;
    let Some(file) = edits else { return Ok((scene, Edits::default())) };
    let mut edits = Edits::load(file)?;
    edits.place_models(file.parent().unwrap_or(Path::new("")));
    edits
        .apply(&mut scene, &load_model)
        .with_context(|| format!("{} cannot be applied to {name}", file.display()))?;
    Ok((scene, edits))
}

/// The view that is asked for, else that of a camera of the scene, the first if none is named.
pub fn view(scene: &Scene, seen: &SceneArgs, camera: Option<&str>, size: [u32; 2]) -> Result<View> {
    let aspect = size[0] as f32 / size[1] as f32;
    match seen.view {
        Some(view) => Ok(view.0.view(aspect)?),
        None => Ok(View::new(scene, scene.camera(camera.unwrap_or("0"))?, aspect)),
    }
}

fn moving_object(name: &str) -> Result<MovingObject> {
    Ok(match name {
        "none" => MovingObject::None,
        "torus" => MovingObject::Torus,
        "teapot" => MovingObject::Teapot,
        _ if extension(name).is_some_and(|e| ["ply", "obj", "glb", "gltf"].contains(&e.as_str())) => {
            MovingObject::Model(Box::new(load_model(Path::new(name))?))
        }
        _ => {
            let known = OBJECTS.into();
            return Err(Error::Unknown { kind: "object", name: name.into(), known }.into());
        }
    })
}

fn extension(name: &str) -> Option<String> {
    Some(Path::new(name).extension()?.to_str()?.to_ascii_lowercase())
}
