//! Scenes: what there is to light, and where it comes from.
//!
//! A [`Scene`] holds nodes (a transform hierarchy), meshes with marked planar [`Patch`]es, skins, materials, textures,
//! cameras, punctual lights and animations. [`Geometry`] is the same scene flattened to world space: that is what
//! rays, light samples and the renderer work on.
//!
//! A scene is *built* through its public fields and *opened* by [`Scene::open`] or by its first change. From then on
//! its [frame of reference](FrameOfReference) is fixed, and it changes by [`Scene::set_transform`] and its like, which
//! are collected as [`SceneChanges`]:
//!
//! ```
//! use girandole_core::glam::vec3;
//! use girandole_core::scene::{Geometry, Transform, builtin};
//!
//! let mut scene = builtin::build("table", builtin::MovingObject::Torus)?;
//! let before = Geometry::new(&scene);
//! let (torus, object) = scene.placed_objects().find(|(_, object)| object.dynamic).unwrap();
//! let node = object.node;
//! scene.set_transform(node, Transform::translation(vec3(0.0, 1.5, 0.0)))?;
//! let changes = scene.take_changes();
//! assert_eq!(changes.moved, [torus]);
//! assert!(before.belongs_to(&scene).is_err());
//! assert_eq!(before.origin, Geometry::new(&scene).origin);
//! # Ok::<(), girandole_core::Error>(())
//! ```

mod added_light;
mod authoring;
pub mod builtin;
mod camera;
mod changes;
mod clips;
mod coincident;
mod defaults;
mod deformation;
#[cfg(feature = "import")]
mod edits;
mod environment;
#[cfg(feature = "import")]
mod export;
mod fingerprint;
mod frame_of_reference;
mod geometry;
#[cfg(feature = "import")]
pub mod gltf;
mod ground;
mod hierarchy;
mod ids;
mod light_places;
#[cfg(feature = "import")]
mod load;
mod material;
mod mesh;
#[cfg(feature = "import")]
mod models;
mod motion;
mod patches;
#[cfg(feature = "import")]
mod repair;
mod sky;
#[cfg(feature = "import")]
mod step;
mod studio;
mod sun;
mod units;
mod up;
mod view;
mod viewpoint;

pub use authoring::Shades;
pub use camera::{Camera, ClipPlanes, Projection};
pub use changes::SceneChanges;
pub use deformation::{Joint, JointWeight, MorphTarget, Skin};
#[cfg(feature = "import")]
pub use edits::{Edit, Edits, NamedIndex, ReadModel, Shape};
pub use environment::{Environment, EnvironmentMap, PrefilteredEnvironment};
#[cfg(feature = "import")]
pub use export::Exported;
pub use fingerprint::Fingerprint;
pub use frame_of_reference::FrameOfReference;
pub use geometry::{Geometry, ObjectRange, Triangle, WorldPatch};
#[cfg(feature = "import")]
pub use gltf::{load_gltf, load_gltf_slice};
pub use ids::{LightId, MaterialId, NodeId, ObjectId};
#[cfg(feature = "import")]
pub use load::LoadOptions;
pub use material::{ColorSpace, Filter, Material, NormalTexture, Texture, TextureRef, Wrap};
pub use mesh::{Mesh, MeshTriangle, Patch};
#[cfg(feature = "import")]
pub use models::{load_model, load_model_slice};
pub use motion::{Animation, Channel, Interpolation, Keyframes, Transform};
pub use patches::mark_patches;
pub use sky::Sky;
#[cfg(feature = "import")]
pub use step::{Snapshot, Step};
pub use studio::DefaultLight;
pub use sun::{Disc, SunPoint};
pub use units::HARDLY_METRES;
pub use up::{LIKELY_Z_UP, UpAxis};
pub use view::{ClipDepth, LocalView, View};
pub use viewpoint::{FieldOfView, Viewpoint};

use crate::{Error, Result};
use glam::Vec3;

/// A scene of more metres than this is a mistake, and its squares would leave the range of single precision.
const MAX_EXTENT: f64 = 1e15;

/// Nobody reads more warnings.
const MOST_WARNINGS: usize = 200;

/// Index that means "none" where ids are plain `u32`.
pub const NONE: u32 = u32::MAX;

/// A transform in the hierarchy. Parents come before their children in [`Scene::nodes`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Node {
    /// The name, as in the file; may be empty.
    pub name: String,
    /// The parent node; `None` for a root.
    pub parent: Option<NodeId>,
    /// Parent from node.
    pub local: Transform,
    /// How much each morph target of a mesh on the node counts; those that are missing do not.
    pub morph_weights: Vec<f32>,
    /// Whether the objects on it are marked to be lit by [precomputed transfer](crate::transfer): a wish, which whoever renders the
    /// scene may follow.
    pub transfer: bool,
}

/// A mesh placed in the scene. Its index in [`Scene::objects`] is its stable identity, see [`ObjectId`].
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// The name, as in the file; may be empty.
    pub name: String,
    /// The node that it is on.
    pub node: NodeId,
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Index into [`Scene::skins`] of what bends the mesh. Then `node` does not move it.
    pub skin: Option<usize>,
    /// Whether it may move; what is moved is dynamic from then on. It gets room to do so in the scene's [`FrameOfReference`], the hierarchy of receivers does
    /// not depend on where it is, and [`LightSettings::walk_dynamic`](crate::lights::LightSettings::walk_dynamic)
    /// decides whether it reflects and intercepts indirect light.
    pub dynamic: bool,
    /// Whether [`Scene::remove_object`] took it away: its slot stays, empty, so that no id is used twice.
    pub removed: bool,
}

/// What a punctual light emits (`KHR_lights_punctual`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualKind {
    /// Equal intensity in all directions.
    Point,
    /// A cone about the node's −Z; angles in radians, `0 ≤ inner < outer ≤ π/2`.
    Spot {
        /// Half-angle within which the intensity is full.
        inner: f32,
        /// Half-angle at which it reaches zero.
        outer: f32,
    },
    /// Parallel light along the node's −Z; `intensity` is the irradiance on a plane facing it, in W/m².
    Directional,
}

/// A light without extent.
#[derive(Clone, Debug, PartialEq)]
pub struct PunctualLight {
    /// The name, as in the file; may be empty.
    pub name: String,
    /// The node that it is on.
    pub node: NodeId,
    /// Its shape.
    pub kind: PunctualKind,
    /// Radiant intensity, W/sr (directional: W/m²), linear RGB.
    pub intensity: Vec3,
}

/// Everything that is to be lit, and what lights it.
///
/// Its fields are public for building. Once it is [open](Scene::open), or anything was derived from it, change it by
/// its methods, or call [`Scene::touch`] afterwards: what is derived is refused by [`Scene::generation`] alone.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// The name: of the built-in scene, or of the file.
    pub name: String,
    /// The transform hierarchy, in any order.
    pub nodes: Vec<Node>,
    /// Triangle meshes in object space.
    pub meshes: Vec<Mesh>,
    /// Joints that bend meshes.
    pub skins: Vec<Skin>,
    /// Meshes placed in the scene.
    pub objects: Vec<Object>,
    /// Surface materials.
    pub materials: Vec<Material>,
    /// Texture images.
    pub textures: Vec<Texture>,
    /// Lights without extent; area lights are meshes whose material emits.
    pub lights: Vec<PunctualLight>,
    /// Light from infinitely far away, if there is any.
    pub environment: Option<Environment>,
    /// Cameras; never empty after [`Scene::ensure_camera`].
    pub cameras: Vec<Camera>,
    /// Animations of nodes and morph weights; [`Scene::set_time`] plays those that [`Scene::choose_clip`] has play.
    pub animations: Vec<Animation>,
    /// What the source asked for and is not supported: one sentence each, already logged.
    pub warnings: Vec<String>,
    record: changes::Record,
    clips: clips::Clips,
}

impl Scene {
    /// Adds a root node.
    pub fn add_node(&mut self, name: &str, local: Transform) -> NodeId {
        self.nodes.push(Node { name: name.into(), local, ..Node::default() });
        (self.nodes.len() - 1).into()
    }

    /// Adds a mesh on a root node of its own. For building; in an open scene
    /// [`Scene::insert_object`] does so, and this counts as a change of everything.
    pub fn add_object(&mut self, name: &str, mesh: Mesh, local: Transform) -> ObjectId {
        let node = self.add_node(name, local);
        self.meshes.push(mesh);
        self.objects.push(Object {
            name: name.into(),
            node,
            mesh: self.meshes.len() - 1,
            skin: None,
            dynamic: false,
            removed: false,
        });
        if self.is_open() {
            self.touch();
        }
        (self.objects.len() - 1).into()
    }

    /// Adds a material.
    pub fn add_material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        let id = (self.materials.len() - 1).into();
        self.material_changed(id);
        id
    }

    /// The objects that are there.
    pub fn placed_objects(&self) -> impl Iterator<Item = (ObjectId, &Object)> {
        (0..).map(ObjectId).zip(&self.objects).filter(|(_, o)| !o.removed)
    }

    /// The camera with this name, or at this index.
    ///
    /// # Errors
    /// [`Error::Unknown`] with the cameras that exist.
    pub fn camera(&self, name_or_index: &str) -> Result<&Camera> {
        self.cameras
            .iter()
            .find(|c| c.name == name_or_index)
            .or_else(|| name_or_index.parse::<usize>().ok().and_then(|i| self.cameras.get(i)))
            .ok_or_else(|| Error::Unknown {
                kind: "camera",
                name: name_or_index.into(),
                known: self
                    .cameras
                    .iter()
                    .enumerate()
                    .map(|(i, c)| format!("{i} ({})", c.name))
                    .collect::<Vec<_>>()
                    .join(", "),
            })
    }

    /// Records something the source asks for that is not supported, once; of a great many, the first.
    pub fn warn(&mut self, sentence: String) {
        let sentence = match self.warnings.len() {
            0..MOST_WARNINGS => sentence,
            MOST_WARNINGS => "there is more to warn of, which is left out".into(),
            _ => return,
        };
        if !self.warnings.contains(&sentence) {
            tracing::warn!("{sentence}");
            self.warnings.push(sentence);
        }
    }
}

#[cfg(test)]
mod tests;
