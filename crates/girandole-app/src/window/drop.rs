//! Files that are dropped on the window; in browsers they are bytes.

#[cfg(any(test, target_arch = "wasm32"))]
use anyhow::{Context, Result, bail};
#[cfg(any(test, target_arch = "wasm32"))]
use girandole_core::scene::{Mesh, Scene, load_gltf_slice, load_model_slice};
use std::path::Path;

/// Whether a file can only be an object.
pub fn is_model(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply") || e.eq_ignore_ascii_case("obj"))
}

/// An object from a file's bytes.
#[cfg(any(test, target_arch = "wasm32"))]
pub fn model(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let kind = path.extension().unwrap_or_default().to_string_lossy();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    load_model_slice(bytes, &kind).with_context(|| format!("{name} cannot be added"))
}

/// A scene from a file's bytes. Files that it refers to lie beside it, where there is a folder.
#[cfg(any(test, target_arch = "wasm32"))]
pub fn scene(path: &Path, bytes: &[u8]) -> Result<Scene> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    if extension != "glb" && extension != "gltf" {
        bail!("{name} cannot be shown: drop a .glb or .gltf scene, or a .ply or .obj model");
    }
    let mut scene = load_gltf_slice(bytes, path.parent().filter(|folder| folder.is_absolute()))?;
    scene.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    scene.ensure_camera();
    scene.ensure_light();
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dropped_bytes_become_a_scene_with_a_camera_and_a_light() {
        let triangle = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[0,0,0]}],
            "bufferViews":[{"buffer":0,"byteLength":36}],
            "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
        let scene = scene(Path::new("/folder/triangle.GLTF"), triangle.as_bytes()).unwrap();
        assert_eq!((scene.name.as_str(), scene.cameras.len()), ("triangle", 1));
        assert!(scene.environment.is_some(), "a studio");
    }

    #[test]
    fn other_files_are_refused_by_name() {
        let refused = scene(Path::new("/folder/notes.txt"), b"").unwrap_err().to_string();
        assert!(refused.contains("notes.txt") && refused.contains(".glb"), "{refused}");
        assert!(scene(Path::new("/folder/broken.glb"), b"glTF").is_err());
    }

    #[test]
    fn dropped_bytes_become_an_object() {
        let bytes = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let path = Path::new("/folder/triangle.OBJ");
        assert!(is_model(path) && !is_model(Path::new("/folder/room.glb")));
        assert_eq!(model(path, bytes).unwrap().triangles.len(), 1);
        let refused = crate::sentence(&model(path, b"").unwrap_err());
        assert!(refused.contains("triangle.OBJ") && refused.contains("empty"), "{refused}");
    }
}
