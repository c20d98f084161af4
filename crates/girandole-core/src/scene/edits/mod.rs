//! Edits: what was changed in a scene by hand, written down so that it can be done again.
//!
//! 1. Each [`Edit`] is one call of the scene's own methods ([`Scene::set_transform`] and its like), and names what it
//!    changes by index *and* name, so that edits of another scene are noticed.
//! 2. [`Edits::record`] makes an edit and writes it down. Of a series about the same thing, such as a drag, the first and
//!    the last one are kept, and those by which the scene left its bounds: the scene's bits depend on these alone.
//! 3. [`Edits::to_json`] writes them, [`Edits::from_json`] and [`Edits::load`] read them, without loss.
//! 4. [`Edits::apply`] makes them again, in order.
//!
//! ```
//! use girandole_core::glam::vec3;
//! use girandole_core::scene::{Edit, Edits, NamedIndex, Transform, builtin, load_model};
//!
//! let room = || builtin::build("table", builtin::MovingObject::Torus);
//! let (mut edits, mut scene) = (Edits::default(), room()?);
//! let torus = scene.objects.iter().find(|o| o.dynamic).unwrap().node;
//! let node = NamedIndex::node(&scene, torus);
//! for height in [1.2, 1.3, 1.4] {
//!     let transform = Transform::translation(vec3(0.0, height, 0.0));
//!     edits.record(Edit::SetTransform { node: node.clone(), transform }, &mut scene, &load_model)?;
//! }
//! assert_eq!(edits.0.len(), 2);
//!
//! let mut again = room()?;
//! Edits::from_json(&edits.to_json()?)?.apply(&mut again, &load_model)?;
//! assert_eq!(again.nodes[torus].local, scene.nodes[torus].local);
//! # Ok::<(), girandole_core::Error>(())
//! ```

mod format;

use super::builtin::{shapes, teapot};
use super::{
    LightId, MAX_EXTENT, Material, MaterialId, Mesh, NodeId, ObjectId, PunctualKind, Scene, Shades,
    Transform, Viewpoint,
};
use crate::{Error, Result};
use format::{KindFormat, ShadesFormat, TransformFormat, ViewpointFormat};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Edits of a scene, in the order in which they are made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Edits(pub Vec<Edit>);

/// A change of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Edit {
    /// [`Scene::set_transform`].
    SetTransform {
        /// What moves, with what is below it.
        node: NamedIndex,
        /// Parent from node.
        #[serde(with = "TransformFormat")]
        transform: Transform,
    },
    /// [`Scene::set_emission`].
    SetEmission {
        /// What shines.
        material: NamedIndex,
        /// W/(sr·m²).
        emission: Vec3,
    },
    /// [`Scene::set_intensity`].
    SetIntensity {
        /// The punctual light.
        light: NamedIndex,
        /// W/sr (directional: W/m²).
        intensity: Vec3,
    },
    /// [`Scene::set_shades`].
    SetShades {
        /// What reflects.
        material: NamedIndex,
        /// Its factors.
        #[serde(with = "ShadesFormat")]
        shades: Shades,
    },
    /// [`Scene::set_cone`].
    SetCone {
        /// The spot.
        light: NamedIndex,
        /// Half-angle of full intensity, radians.
        inner: f32,
        /// Half-angle at which it reaches zero, radians.
        outer: f32,
    },
    /// [`Scene::set_camera`].
    SetCamera {
        /// Of the camera, and of its node where it is new.
        name: String,
        /// Where one looks from.
        #[serde(with = "ViewpointFormat")]
        viewpoint: Viewpoint,
    },
    /// [`Scene::insert_light`].
    InsertLight {
        /// Of the light and its node.
        name: String,
        /// Its shape.
        #[serde(with = "KindFormat")]
        kind: PunctualKind,
        /// W/sr (directional: W/m²).
        intensity: Vec3,
        /// World from light, which shines along its −Z.
        #[serde(default, with = "TransformFormat")]
        transform: Transform,
    },
    /// [`Scene::remove_light`].
    RemoveLight {
        /// What goes.
        light: NamedIndex,
    },
    /// [`Scene::insert_object`].
    InsertObject {
        /// Of the object and its node.
        name: String,
        /// Its mesh.
        shape: Shape,
        /// What it is made of; `None`: a new material of its own, white and matt, which has its name.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        material: Option<NamedIndex>,
        /// World from object.
        #[serde(default, with = "TransformFormat")]
        transform: Transform,
        /// See [`Object::dynamic`](super::Object::dynamic).
        #[serde(default)]
        dynamic: bool,
    },
    /// [`Scene::duplicate_object`].
    DuplicateObject {
        /// What is copied.
        object: NamedIndex,
        /// Of the copy and its node.
        name: String,
        /// Parent from the copy's node.
        #[serde(default, with = "TransformFormat")]
        transform: Transform,
    },
    /// [`Scene::remove_object`].
    RemoveObject {
        /// What goes.
        object: NamedIndex,
    },
    /// [`Scene::set_time`].
    SetTime {
        /// The moment of the scene's animations.
        seconds: f64,
    },
}

/// What an inserted object looks like.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// [`shapes::thesis_torus`].
    Torus,
    /// The [`teapot`] with 6 segments a patch edge.
    Teapot,
    /// [`shapes::panel`].
    Panel,
    /// A model from a file.
    File(PathBuf),
}

impl Shape {
    /// Its mesh, of material 0.
    ///
    /// # Errors
    /// Those of reading its file.
    pub fn mesh(&self, read_model: &ReadModel) -> Result<Mesh> {
        match self {
            Self::Torus => Ok(shapes::thesis_torus(MaterialId(0))),
            Self::Teapot => Ok(teapot(6, MaterialId(0))),
            Self::Panel => Ok(shapes::panel(MaterialId(0))),
            Self::File(path) => read_model(path),
        }
    }
}

/// Reads the model of an inserted object; most often [`load_model`](super::load_model), with the folder that paths are
/// relative to in front.
pub type ReadModel<'a> = dyn Fn(&Path) -> Result<Mesh> + 'a;

/// Something in a scene: its index in the scene's list, and the name that it has there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedIndex {
    /// The index.
    pub index: usize,
    /// The name; may be empty.
    pub name: String,
}

impl NamedIndex {
    fn new<T>(index: usize, list: &[T], name: impl Fn(&T) -> &str) -> Self {
        Self { index, name: list.get(index).map(name).unwrap_or_default().into() }
    }

    /// A node of the scene.
    pub fn node(scene: &Scene, node: NodeId) -> Self {
        Self::new(node.index(), &scene.nodes, |node| &node.name)
    }

    /// A material of the scene.
    pub fn material(scene: &Scene, material: MaterialId) -> Self {
        Self::new(material.index(), &scene.materials, |material| &material.name)
    }

    /// A punctual light of the scene.
    pub fn light(scene: &Scene, light: LightId) -> Self {
        Self::new(light.index(), &scene.lights, |light| &light.name)
    }

    /// An object of the scene.
    pub fn object(scene: &Scene, object: ObjectId) -> Self {
        Self::new(object.index(), &scene.objects, |object| &object.name)
    }

    /// The index, where the scene has the same name there.
    fn find<T, Id: From<usize>>(&self, kind: &str, list: &[T], name: impl Fn(&T) -> &str) -> Result<Id> {
        let Self { index, name: expected } = self;
        let Some(found) = list.get(*index) else {
            let sentence = format!("there is no {kind} {index} `{expected}`; the scene has {}", list.len());
            return Err(Error::Invalid(sentence));
        };
        if name(found) != expected {
            return Err(Error::Invalid(format!(
                "{kind} {index} is called `{}` and not `{expected}`; these edits belong to another scene",
                name(found)
            )));
        }
        Ok((*index).into())
    }
}

impl Edit {
    /// Makes the edit; one that is refused leaves the scene as it was.
    ///
    /// # Errors
    /// Those of the scene's method, of reading a model, and [`Error::Invalid`] where something in the scene has another
    /// name.
    pub fn apply(&self, scene: &mut Scene, read_model: &ReadModel) -> Result<()> {
        match self {
            Self::SetTransform { node, transform } => {
                scene.set_transform(node.find("node", &scene.nodes, |n| &n.name)?, *transform)
            }
            Self::SetEmission { material, emission } => {
                scene.set_emission(find_material(material, scene)?, *emission)
            }
            Self::SetIntensity { light, intensity } => {
                scene.set_intensity(find_light(light, scene)?, *intensity)
            }
            Self::SetShades { material, shades } => {
                scene.set_shades(find_material(material, scene)?, *shades)
            }
            Self::SetCone { light, inner, outer } => {
                scene.set_cone(find_light(light, scene)?, *inner, *outer)
            }
            Self::SetCamera { name, viewpoint } => scene.set_camera(name, viewpoint).map(|_| ()),
            Self::InsertLight { name, kind, intensity, transform } => {
                scene.insert_light(name, *kind, *intensity, *transform).map(|_| ())
            }
            Self::RemoveLight { light } => scene.remove_light(find_light(light, scene)?),
            Self::InsertObject { name, shape, material, transform, dynamic } => {
                let mesh = shape.mesh(read_model)?;
                let mesh = with_material(mesh, name, material.as_ref(), transform, scene)?;
                scene.insert_object(name, mesh, *transform, *dynamic).map(|_| ())
            }
            Self::DuplicateObject { object, name, transform } => {
                scene.duplicate_object(find_object(object, scene)?, name, *transform).map(|_| ())
            }
            Self::RemoveObject { object } => scene.remove_object(find_object(object, scene)?),
            Self::SetTime { seconds } => scene.set_time(*seconds),
        }
    }

    /// Whether it sets what another edit sets, so that the later one counts.
    pub fn overrides(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::SetTransform { node: a, .. }, Self::SetTransform { node: b, .. })
            | (Self::SetEmission { material: a, .. }, Self::SetEmission { material: b, .. })
            | (Self::SetShades { material: a, .. }, Self::SetShades { material: b, .. })
            | (Self::SetCone { light: a, .. }, Self::SetCone { light: b, .. })
            | (Self::SetIntensity { light: a, .. }, Self::SetIntensity { light: b, .. }) => a == b,
            (Self::SetCamera { name: a, .. }, Self::SetCamera { name: b, .. }) => a == b,
            (Self::SetTime { .. }, Self::SetTime { .. }) => true,
            _ => false,
        }
    }

    /// Whether something would be put where it is, by which nothing becomes dynamic.
    fn moves_nothing(&self, scene: &Scene) -> bool {
        let Self::SetTransform { node, transform } = self else { return false };
        scene.nodes.get(node.index).is_some_and(|node| node.local == *transform)
    }
}

fn find_object(object: &NamedIndex, scene: &Scene) -> Result<ObjectId> {
    object.find("object", &scene.objects, |o| &o.name)
}

fn find_light(light: &NamedIndex, scene: &Scene) -> Result<LightId> {
    light.find("light", &scene.lights, |l| &l.name)
}

fn find_material(material: &NamedIndex, scene: &Scene) -> Result<MaterialId> {
    material.find("material", &scene.materials, |m| &m.name)
}

/// Gives a mesh its material. A new one is made only for what can be inserted.
fn with_material(
    mut mesh: Mesh,
    name: &str,
    material: Option<&NamedIndex>,
    transform: &Transform,
    scene: &mut Scene,
) -> Result<Mesh> {
    let place = transform.affine();
    let is_near = |p: &Vec3| place.transform_point3(p.as_dvec3()).abs().max_element() <= MAX_EXTENT;
    if !(place.is_finite() && mesh.positions.iter().all(is_near)) {
        return Err(Error::Invalid(format!(
            "object `{name}` cannot be as large or as far away as its transform says; correct it"
        )));
    }
    let index = match material {
        Some(material) => find_material(material, scene)?,
        None => scene.materials.len().into(),
    };
    mesh.triangles.iter_mut().for_each(|triangle| triangle.material = index);
    mesh.check(index.index() + 1)?;
    if material.is_none() {
        let vertex_colors = !mesh.colors.is_empty();
        scene.add_material(Material { name: name.into(), vertex_colors, ..Material::default() });
    }
    Ok(mesh)
}

impl Edits {
    /// Makes them all, in order.
    ///
    /// # Errors
    /// Those of [`Edit::apply`], with the edit's number from 1 up; those before it are made.
    pub fn apply(&self, scene: &mut Scene, read_model: &ReadModel) -> Result<()> {
        self.0.iter().enumerate().try_for_each(|(i, edit)| {
            edit.apply(scene, read_model)
                .map_err(|error| Error::Invalid(format!("edit {} cannot be made: {error}", i + 1)))
        })
    }

    /// Names the models of inserted objects, so far relative to a folder, by where they are from anywhere.
    pub fn place_models(&mut self, folder: &Path) {
        for edit in &mut self.0 {
            if let Edit::InsertObject { shape: Shape::File(path), .. } = edit {
                let joined = folder.join(&path);
                *path = std::path::absolute(&joined).unwrap_or(joined);
            }
        }
    }

    /// Makes an edit and writes it down, in place of one that does not matter any more: applied to the scene that the first
    /// edit was made in, the edits lead to this one, to the bit.
    ///
    /// # Errors
    /// Those of [`Edit::apply`]; then nothing is written down.
    pub fn record(&mut self, edit: Edit, scene: &mut Scene, read_model: &ReadModel) -> Result<()> {
        let (frame, moves_nothing) = (scene.frame_of_reference(), edit.moves_nothing(scene));
        edit.apply(scene, read_model)?;
        if moves_nothing {
            return Ok(());
        }
        // The first one of a series made things dynamic, which the others do not.
        if self.0.iter().rev().take_while(|last| edit.overrides(last)).take(2).count() == 2 {
            self.0.pop();
        }
        // Another frame depends on where things were when it was made: that stays, when the second of the two goes.
        if scene.frame_of_reference() != frame {
            self.0.push(edit.clone());
        }
        self.0.push(edit);
        Ok(())
    }
}
