//! Loads the scene that is named on the command line.

use anyhow::{Result, bail};
use girandole_core::Error;
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{Scene, load_model};
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
