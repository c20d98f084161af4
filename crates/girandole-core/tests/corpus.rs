//! Loads files that are not part of the repository: each must give a scene or an error sentence.
//!
//! - Debian's `assimp-testmodels`, or any folders named in `GIRANDOLE_MODELS` (separated like `PATH`).
//! - The scenes with independent ground truth, in the folder named in `GIRANDOLE_TRUTH`.
//!
//! What is absent is reported as ignored.

use girandole_core::scene::{Geometry, Scene, load_model};
use libtest_mimic::{Arguments, Failed, Trial};
use std::path::{Path, PathBuf};

const DEBIAN: &str = "/usr/share/assimp/models";

fn main() {
    let arguments = Arguments::from_args();
    let mut trials = Vec::new();
    let mut folders: Vec<PathBuf> =
        std::env::var_os("GIRANDOLE_MODELS").map(|v| std::env::split_paths(&v).collect()).unwrap_or_default();
    folders.push(DEBIAN.into());
    for folder in folders {
        let mut files = Vec::new();
        find(&folder, &mut files);
        files.sort();
        if files.is_empty() {
            trials.push(
                Trial::test(format!("models::{}", folder.display()), || Err("absent".into()))
                    .with_ignored_flag(true),
            );
        }
        for file in files {
            trials.push(Trial::test(format!("models::{}", file.display()), move || load(&file)));
        }
    }
    let truth = std::env::var_os("GIRANDOLE_TRUTH").map(PathBuf::from);
    for (name, check) in
        [("cornell", cornell as fn(&Scene) -> Result<(), Failed>), ("table", table), ("punctual", punctual)]
    {
        let path = truth.as_ref().map(|t| t.join(name).join("scene.glb"));
        let absent = !path.as_ref().is_some_and(|p| p.is_file());
        let trial = Trial::test(format!("truth::{name}"), move || {
            let path = path.ok_or("GIRANDOLE_TRUTH is not set")?;
            check(&Scene::load(&path).map_err(|e| e.to_string())?)
        });
        trials.push(trial.with_ignored_flag(absent));
    }
    libtest_mimic::run(&arguments, trials).exit();
}

fn find(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            find(&path, files);
        } else if path
            .extension()
            .is_some_and(|e| ["gltf", "glb", "ply", "obj"].iter().any(|k| e.eq_ignore_ascii_case(k)))
        {
            files.push(path);
        }
    }
}

/// A scene in order, or one sentence that names the file.
fn load(path: &Path) -> Result<(), Failed> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply") || e.eq_ignore_ascii_case("obj")) {
        match load_model(path) {
            Ok(mesh) if mesh.triangles.is_empty() => return Err("an empty mesh".into()),
            Ok(_) => {}
            Err(error) => return sentence(path, &error.to_string()),
        }
    }
    let scene = match Scene::load(path) {
        Ok(scene) => scene,
        Err(error) => return sentence(path, &error.to_string()),
    };
    println!(
        "{}: {} objects, {} triangles, {} patches; {:?}",
        path.display(),
        scene.objects.len(),
        scene.meshes.iter().map(|m| m.triangles.len()).sum::<usize>(),
        scene.meshes.iter().map(|m| m.patches.len()).sum::<usize>(),
        scene.warnings
    );
    for mesh in &scene.meshes {
        let count = mesh.positions.len();
        let lengths = [mesh.normals.len(), mesh.uvs.len().max(count), mesh.tangents.len().max(count)];
        if lengths != [count; 3] || mesh.triangles.iter().any(|t| t.material.index() >= scene.materials.len())
        {
            return Err("vertex arrays of different lengths, or materials that do not exist".into());
        }
        if mesh.normals.iter().any(|n| !n.is_finite()) {
            return Err("normals that are not finite".into());
        }
    }
    if scene.cameras.is_empty() || Geometry::new(&scene).triangles.is_empty() {
        return Err("nothing to see".into());
    }
    Ok(())
}

fn sentence(path: &Path, error: &str) -> Result<(), Failed> {
    println!("{error}");
    if error.contains(&path.display().to_string()) && error.len() < 600 && !error.contains('\n') {
        Ok(())
    } else {
        Err(format!("not one sentence with the file's name: {error}").into())
    }
}

fn patches(scene: &Scene) -> usize {
    scene.meshes.iter().map(|m| m.patches.len()).sum()
}

/// All 19 rectangles, the light among them.
fn cornell(scene: &Scene) -> Result<(), Failed> {
    let triangles: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
    let warned = scene.warnings.join("; ");
    if (patches(scene), triangles, warned.as_str()) == (19, 38, "") {
        Ok(())
    } else {
        Err(format!("{} patches of {triangles} triangles; {warned}", patches(scene)).into())
    }
}

fn table(scene: &Scene) -> Result<(), Failed> {
    for object in &scene.objects {
        let mesh = &scene.meshes[object.mesh];
        println!(
            "{} {} triangles, {} patches, dynamic {}",
            object.name,
            mesh.triangles.len(),
            mesh.patches.len(),
            object.dynamic
        );
    }
    if patches(scene) == 0 || !scene.warnings.is_empty() {
        return Err("no patches".into());
    }
    Ok(())
}

fn punctual(scene: &Scene) -> Result<(), Failed> {
    println!("{:?}", scene.lights);
    if scene.lights.is_empty() || !scene.warnings.is_empty() {
        return Err("no lights".into());
    }
    table(scene)
}
