//! glTF 2.0 import.
//!
//! 1. `document`: chunks, JSON, buffers; `compression`: what is decompressed when it is read.
//! 2. `material`, `material_extensions`, `texture`: all of the file's, in its order.
//! 3. `nodes`: the hierarchy of the default scene; a `mesh` is read when the first node shows it, so that instances
//!    share it.
//! 4. `deformation`: skins, once all their joints are there; `animation`.
//! 5. Walls and floors are marked as patches.
//!
//! Files come from anywhere, so nothing here trusts them: every index is looked up, every element checked, and memory is asked
//! for (`budget`) before it is taken. What is broken or unsupported is left out, and named by [`Scene::warn`], one sentence for
//! each kind (`omissions`). Errors are what is no glTF file, what has nothing that can be drawn, and what promises more than it
//! holds or than memory can.

mod accessor;
mod animation;
mod budget;
mod coats;
mod compression;
mod deformation;
mod document;
mod image_based_light;
mod instances;
mod ktx2;
mod lights;
mod material;
mod material_extensions;
mod mesh;
mod nodes;
mod omissions;
mod picture;
mod tangents;
mod texture;
mod vertex_alpha;

pub use animation::RESTING;
pub(super) use picture::decode_alone as decode_picture;
pub(super) use tangents::generate as generate_tangents;

use super::{Camera, MaterialId, NodeId, Scene, View};
use crate::slices::{complete, pause};
use crate::{Error, Result};
use document::Document;
use glam::Vec3;
use omissions::Omissions;
use std::collections::HashMap;
use std::path::Path;

/// The rest of a sentence that begins with the file and "is not usable".
type Parsed<T> = std::result::Result<T, String>;

/// Triangles that a scene may have, instances counted: what 32-bit ids and a few gigabytes of memory can take.
pub const MAX_TRIANGLES: usize = 50_000_000;
/// Vertices that a scene may have, instances counted.
pub const MAX_VERTICES: usize = 100_000_000;
/// Side of a texture, texels: what every WebGPU device can hold.
pub const MAX_TEXTURE_SIDE: u32 = 8192;
/// Texels of all textures together: one gigabyte.
pub const MAX_TEXELS: usize = 1 << 28;

/// Extensions that are read. Others are named in a warning.
const SUPPORTED_EXTENSIONS: [&str; 19] = [
    instances::NAME,
    nodes::VISIBILITY,
    compression::MESHOPT[0],
    compression::MESHOPT[1],
    compression::DRACO,
    image_based_light::NAME,
    material_extensions::CLEARCOAT,
    material_extensions::IOR,
    material_extensions::SHEEN,
    material_extensions::SPECULAR_GLOSSINESS,
    material_extensions::TRANSMISSION,
    material_extensions::UNLIT,
    texture::FORMATS[0],
    texture::FORMATS[1],
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_specular",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Loads the default scene of a `.glb` or `.gltf` file, with the buffers and images that lie beside it.
///
/// Lengths are metres, angles radians, emission W/(sr·m²), intensities W/sr (directional: W/m²). Objects are dynamic
/// if their node or one above it is animated or has `"extras": {"dynamic": true}`, or if they have a skin or morph targets.
/// Nothing is added: see [`Scene::load`](crate::scene::Scene::load) for a camera and light where the file has none.
///
/// # Errors
/// [`Error::Read`] if the file cannot be read; [`Error::Broken`] if it, or a file that it refers to, is not usable.
pub fn load_gltf(path: &Path) -> Result<Scene> {
    complete(load_gltf_in_slices(path))
}

/// The same with pauses.
pub(super) async fn load_gltf_in_slices(path: &Path) -> Result<Scene> {
    let bytes = crate::files::read(path)?;
    let base = path.parent().unwrap_or(Path::new(""));
    import(&bytes, Some(base)).await.map_err(|reason| Error::Broken { path: path.into(), reason })
}

/// Loads the default scene from the bytes of a `.glb` or `.gltf` file; `base` is the folder where the files lie that
/// it refers to. Otherwise like [`load_gltf`].
///
/// # Errors
/// [`Error::Broken`] if the data, or a file that it refers to, is not usable.
pub fn load_gltf_slice(bytes: &[u8], base: Option<&Path>) -> Result<Scene> {
    complete(import(bytes, base)).map_err(|reason| Error::Broken { path: "the glTF data".into(), reason })
}

/// What an import has found so far.
struct Importer<'d> {
    document: &'d Document<'d>,
    scene: Scene,
    /// Scene mesh of each glTF mesh that was read; `None` if nothing of it can be drawn.
    meshes: HashMap<usize, Option<usize>>,
    /// Scene texture by glTF texture and colour space; `None` for those that are left out.
    textures: HashMap<(usize, super::ColorSpace), Option<u32>>,
    /// Of textures of the scene.
    alphas: HashMap<u32, material::Alphas>,
    /// The material of primitives without one.
    default_material: Option<MaterialId>,
    /// Materials for vertices whose colours have an alpha.
    faded: HashMap<(MaterialId, vertex_alpha::Fading), MaterialId>,
    /// Their texture.
    ramp: Option<u32>,
    /// Scene node by glTF node.
    nodes: Vec<Option<NodeId>>,
    /// Objects, and the glTF skins that they have.
    skinned: Vec<(usize, usize)>,
    /// What is broken.
    omissions: Omissions,
    triangles: usize,
    vertices: usize,
    texels: usize,
}

async fn import(bytes: &[u8], base: Option<&Path>) -> Parsed<Scene> {
    let document = Document::parse(bytes, base)?;
    pause().await;
    let mut scene = read(document)?;
    pause().await;
    super::repair::mark_scene(&mut scene).map_err(|e| format!("it {e}"))?;
    Ok(scene)
}

/// The scene of a document.
fn read(document: Document) -> Parsed<Scene> {
    // Before the rest is read in vain.
    #[cfg(target_family = "wasm")]
    document.ask_for_pictures()?;
    let mut importer = Importer {
        document: &document,
        scene: Scene::default(),
        meshes: HashMap::new(),
        textures: HashMap::new(),
        alphas: HashMap::new(),
        default_material: None,
        faded: HashMap::new(),
        ramp: None,
        nodes: vec![None; document.root.nodes.len()],
        skinned: Vec::new(),
        omissions: Omissions::default(),
        triangles: 0,
        vertices: 0,
        texels: 0,
    };
    document.warnings.iter().for_each(|warning| importer.scene.warn(warning.clone()));
    importer.name_unsupported_extensions();
    importer.read_materials()?;
    importer.read_nodes()?;
    importer.read_skins()?;
    importer.read_animations()?;
    importer.read_image_based_light()?;
    importer.name_resting_clips();
    let Importer { mut scene, omissions, .. } = importer;
    if scene.objects.is_empty() {
        let mut reasons = omissions.sentences().chain(scene.warnings);
        let first = reasons.next().map(|reason| format!("; {}", document::shortened(&reason, 300)));
        let more = reasons.count();
        let more = if more > 0 { format!("; and {more} more") } else { String::new() };
        return Err(format!("it has no triangles that can be drawn{}{more}", first.unwrap_or_default()));
    }
    omissions.sentences().for_each(|sentence| scene.warn(sentence));
    let sees = |camera: &Camera| {
        let view = View::new(&scene, camera, 1.0);
        [view.forward, view.right, view.up].iter().all(|axis| axis.is_finite() && *axis != Vec3::ZERO)
    };
    let (cameras, blind): (Vec<Camera>, Vec<Camera>) = scene.cameras.iter().cloned().partition(sees);
    for camera in &blind {
        let name = match document::shorten(&camera.name) {
            name if name.is_empty() => "a camera".into(),
            name => format!("camera `{name}`"),
        };
        scene.warn(format!("{name} is left out: its node is scaled to nothing"));
    }
    scene.cameras = cameras;
    Ok(scene)
}

impl Importer<'_> {
    fn name_unsupported_extensions(&mut self) {
        let root = &self.document.root;
        for name in &root.extensions_required {
            if !SUPPORTED_EXTENSIONS.contains(&name.as_str()) {
                let name = document::shorten(name);
                self.scene.warn(format!(
                    "the file requires {name}, which is not supported: what can be drawn without it is"
                ));
            }
        }
        for name in &root.extensions_used {
            if !SUPPORTED_EXTENSIONS.contains(&name.as_str()) && !root.extensions_required.contains(name) {
                self.name_unsupported_extension(name);
            }
        }
    }

    /// Names an extension that was met, unless the file announced it and it was named then.
    fn meet_extension(&mut self, name: &str) {
        let root = &self.document.root;
        let announced = root.extensions_used.iter().chain(&root.extensions_required).any(|n| n == name);
        if !announced && !SUPPORTED_EXTENSIONS.contains(&name) {
            self.name_unsupported_extension(name);
        }
    }

    fn name_unsupported_extension(&mut self, name: &str) {
        self.scene.warn(format!("{} is not supported and left out", document::shorten(name)));
    }
}
