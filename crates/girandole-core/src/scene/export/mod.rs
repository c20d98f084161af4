//! glTF 2.0 export: a scene as it stands, as one `.glb` file.
//!
//! | module | what it writes |
//! |---|---|
//! | `buffers` | numbers and pictures, into the binary part |
//! | `materials`, `textures` | all materials, with the textures that they use |
//! | `meshes` | triangles in their order, one primitive for each run of a material |
//! | `nodes` | the hierarchy, and what hangs on it: objects, cameras, lights, skins |
//! | `animations` | channels of nodes and morph weights |
//!
//! What [`load_gltf`](super::load_gltf) makes of the file is the same scene, and has the same picture, but for what
//! [`Exported::left_out`] names. Numbers are written as they are: 32-bit floats, PNG textures.

mod animations;
mod buffers;
mod materials;
mod meshes;
mod nodes;
mod textures;

use super::Scene;
use crate::{Error, Result};
use buffers::Buffers;
use gltf::json;
use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};

/// A scene as a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// The bytes of a `.glb` file.
    pub bytes: Vec<u8>,
    /// What glTF has no place for, or not exactly: one sentence each.
    pub left_out: Vec<String>,
}

/// What was written so far.
struct Exporter<'s> {
    scene: &'s Scene,
    root: json::Root,
    buffers: Buffers,
    extensions: BTreeSet<&'static str>,
    left_out: Vec<String>,
    /// glTF textures by texture of the scene and how its bytes are to be read.
    textures: HashMap<(u32, super::ColorSpace), json::Index<json::Texture>>,
    /// glTF meshes by mesh of the scene.
    meshes: HashMap<usize, json::Index<json::Mesh>>,
    lights: Vec<json::extensions::scene::khr_lights_punctual::Light>,
}

impl Scene {
    /// The scene as it stands as a `.glb` file. Objects that were removed are not written; animations are, and what they drive is
    /// where it is now.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a mesh refers to what does not exist, nothing can be drawn, or there are more than four gigabytes.
    pub fn export_glb(&self) -> Result<Exported> {
        for (_, object) in self.placed_objects() {
            self.meshes[object.mesh].check(self.materials.len())?;
        }
        let mut exporter = Exporter {
            scene: self,
            root: json::Root::default(),
            buffers: Buffers::default(),
            extensions: BTreeSet::new(),
            left_out: Vec::new(),
            textures: HashMap::new(),
            meshes: HashMap::new(),
            lights: Vec::new(),
        };
        exporter.write_materials()?;
        exporter.write_nodes()?;
        exporter.write_animations();
        if self.environment.is_some() {
            exporter.leave_out("what is all around: glTF has no place for it".into());
        }
        exporter.finish()
    }
}

impl Exporter<'_> {
    /// Names something that is not written, once.
    fn leave_out(&mut self, sentence: String) {
        if !self.left_out.contains(&sentence) {
            self.left_out.push(sentence);
        }
    }

    fn finish(self) -> Result<Exported> {
        let Self { mut root, buffers, extensions, left_out, lights, .. } = self;
        if root.meshes.is_empty() {
            return Err(Error::Invalid("the scene has no triangles to write".into()));
        }
        root.asset.generator = Some(format!("Girandole {}", env!("CARGO_PKG_VERSION")));
        root.extensions_used = extensions.into_iter().map(str::to_owned).collect();
        if !lights.is_empty() {
            let lights = json::extensions::root::KhrLightsPunctual { lights };
            let extensions =
                json::extensions::root::Root { khr_lights_punctual: Some(lights), ..Default::default() };
            root.extensions = Some(extensions);
        }
        let bin = buffers.finish(&mut root);
        let broken =
            |error: &dyn std::fmt::Display| Error::Invalid(format!("the scene cannot be written: {error}"));
        let text = json::serialize::to_vec(&root).map_err(|error| broken(&error))?;
        // Lengths are numbers of 32 bits.
        if u32::try_from(bin.len() + text.len() + 64).is_err() {
            return Err(Error::Invalid(
                "the scene has more than four gigabytes, which a .glb cannot hold; take parts away".into(),
            ));
        }
        let header = gltf::binary::Header { magic: *b"glTF", version: 2, length: 0 };
        let glb = gltf::Glb { header, json: Cow::Owned(text), bin: Some(Cow::Owned(bin)) };
        let bytes = glb.to_vec().map_err(|error| broken(&error))?;
        Ok(Exported { bytes, left_out })
    }
}

/// A name, if there is one.
fn named(name: &str) -> Option<String> {
    (!name.is_empty()).then(|| name.to_owned())
}

#[cfg(test)]
mod tests;
