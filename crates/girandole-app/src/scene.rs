//! Loads the scene that is named on the command line, and finds the view of it.

use crate::advice;
use crate::args::{BackgroundArg, EnvironmentArg, LightArg, LoadArgs, SceneArgs};
#[cfg(not(target_arch = "wasm32"))]
use crate::output::Progress;
use anyhow::{Context, Result, bail};
use girandole_core::Error;
use girandole_core::glam::Vec3;
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{Edits, Environment, LoadOptions, Scene, Sky, UpAxis, View, load_model};
use girandole_core::slices::complete;
use girandole_reference::image_file;
use std::path::Path;

const OBJECTS: &str = "none, torus, teapot, balloon, or a .ply, .obj, .glb or .gltf file";

/// Scenes from files.
const FILES: [&str; 4] = ["glb", "gltf", "obj", "ply"];

/// A built-in room with its moving object, or a file.
pub fn load(name: &str, object: Option<&str>, load: &LoadArgs) -> Result<Scene> {
    complete(load_in_slices(name, object, load))
}

/// The same with pauses.
async fn load_in_slices(name: &str, object: Option<&str>, load: &LoadArgs) -> Result<Scene> {
    let (environment, notes) = environment(load)?;
    let mut scene = if extension(name).is_some_and(|e| FILES.contains(&e.as_str())) {
        if object.is_some() {
            bail!("--object belongs to the built-in rooms; leave it out for {name}");
        }
        // What is to be put before something else brings no ground of its own.
        let ground = load.background == BackgroundArg::Environment;
        let (light, up) = (load.light.into(), load.up.map(Into::into));
        let options = LoadOptions { environment, light, up, scale: load.scale, ground };
        let mut scene = Scene::load_in_slices(Path::new(name), options).await?;
        scene.warnings.iter_mut().for_each(advice::add_to_warning);
        scene
    } else if builtin::NAMES.contains(&name) {
        if load.scale.is_some() {
            bail!("--scale belongs to files; leave it out for {name}");
        }
        let object = match object {
            Some(object) => moving_object(object, load.up.map(Into::into))?,
            None if load.up.is_some() => bail!("--up belongs to files; leave it out for {name}"),
            None => builtin::default_object(name),
        };
        let mut scene = builtin::build(name, object)?;
        scene.environment = environment.or(scene.environment);
        if load.light == LightArg::Studio {
            scene.add_studio();
        }
        scene
    } else {
        let known = format!("{}, or a .glb, .gltf, .obj or .ply file", builtin::NAMES.join(", "));
        return Err(Error::Unknown { kind: "scene", name: name.into(), known }.into());
    };
    scene.ensure_camera();
    notes.into_iter().for_each(|note| scene.warn(note));
    if let Some(clip) = &load.clip {
        let clip = scene.find_clip(clip)?;
        scene.choose_clip(Some(clip))?;
    }
    if let Some(environment) = &mut scene.environment {
        environment.visible = load.background == BackgroundArg::Environment;
    }
    Ok(scene)
}

/// The same, with what a file says was changed in it.
pub fn load_edited(name: &str, object: Option<&str>, seen: &SceneArgs) -> Result<(Scene, Edits)> {
    complete(load_edited_in_slices(name, object, seen))
}

/// The same with pauses.
pub async fn load_edited_in_slices(
    name: &str,
    object: Option<&str>,
    seen: &SceneArgs,
) -> Result<(Scene, Edits)> {
    let mut scene = load_in_slices(name, object, &seen.load).await?;
    let Some(file) = seen.edits.as_deref() else { return Ok((scene, Edits::default())) };
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

/// What is all around, if anything is, and what there is to say of it.
pub fn environment(args: &LoadArgs) -> Result<(Option<Environment>, Vec<String>)> {
    let mut notes = Vec::new();
    let environment = match &args.environment {
        None => return Ok((None, notes)),
        Some(EnvironmentArg::Color(radiance)) => Environment::constant(Vec3::from_array(*radiance))?,
        Some(EnvironmentArg::Sky([elevation, azimuth, turbidity])) => Environment::sky(&Sky {
            elevation: elevation.to_radians(),
            azimuth: azimuth.to_radians(),
            turbidity: *turbidity,
        })?,
        Some(EnvironmentArg::File(path)) => {
            let progress = progress(path);
            let (image, said) = image_file::read_environment(path, &progress)?;
            notes = said;
            Environment::new(image).with_context(|| path.display().to_string())?
        }
    };
    let strength = args.environment_strength.unwrap_or(1.0);
    let rotation = args.environment_rotation.unwrap_or(0.0).to_radians();
    let visible = args.background == BackgroundArg::Environment;
    Ok((Some(Environment { strength, rotation, visible, ..environment }), notes))
}

/// Shows how far reading a file is. Then it is gone through once more, for what is sampled and for what is reflected.
#[cfg(not(target_arch = "wasm32"))]
fn progress(path: &Path) -> impl Fn(f32) + use<> {
    let bar = Progress::bar(&format!("{}", path.file_name().unwrap_or_default().display()));
    move |done| bar.set(done * 0.8)
}

#[cfg(target_arch = "wasm32")]
fn progress(_: &Path) -> impl Fn(f32) + use<> {
    |_| ()
}

fn moving_object(name: &str, up: Option<UpAxis>) -> Result<MovingObject> {
    if extension(name).is_some_and(|e| FILES.contains(&e.as_str())) {
        let mut mesh = load_model(Path::new(name))?;
        mesh.turn_up(up.unwrap_or_default());
        return Ok(MovingObject::Model(Box::new(mesh)));
    }
    if up.is_some() {
        bail!("--up belongs to files; leave it out for the object {name}");
    }
    Ok(match name {
        "none" => MovingObject::None,
        "torus" => MovingObject::Torus,
        "teapot" => MovingObject::Teapot,
        "balloon" => MovingObject::Balloon,
        _ => {
            let known = OBJECTS.into();
            return Err(Error::Unknown { kind: "object", name: name.into(), known }.into());
        }
    })
}

fn extension(name: &str) -> Option<String> {
    Some(Path::new(name).extension()?.to_str()?.to_ascii_lowercase())
}
