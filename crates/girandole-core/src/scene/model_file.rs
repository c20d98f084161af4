//! Single meshes from PLY, OBJ and glTF files.

use super::Mesh;
use std::path::Path;

/// Loads one mesh (all its parts merged, material index 0) from a `.ply`, `.obj`, `.glb` or `.gltf` file.
///
/// # Errors
/// A sentence that says what is wrong with the file.
pub fn load_model(path: &Path) -> crate::Result<Mesh> {
    let _ = path;
    todo!("models")
}
