//! Steps of a scene's history: what its own methods changed, to be taken back and made again.
//!
//! 1. [`Snapshot::of`] remembers what changes can change: not meshes and textures, of which there may be much, and
//!    which are only added to.
//! 2. [`Snapshot::step`] compares it with the scene as it stands later. What differs is a [`Step`].
//! 3. [`Step::exchange`] gives the scene what it had before the step, and keeps what it has now: called again, it
//!    makes the step again. Steps are taken back last first.
//!
//! ```
//! use girandole_core::glam::Vec3;
//! use girandole_core::scene::{Edits, MaterialId, Snapshot, builtin};
//!
//! let mut scene = builtin::build("table", builtin::MovingObject::Torus)?;
//! let (mut edits, before) = (Edits::default(), scene.materials.clone());
//! let snapshot = Snapshot::of(&scene, &edits);
//! scene.set_emission(MaterialId(0), Vec3::ONE)?;
//! let mut step = snapshot.step(&scene, &edits).unwrap();
//! step.exchange(&mut scene, &mut edits);
//! assert_eq!(scene.materials, before);
//! step.exchange(&mut scene, &mut edits);
//! assert_eq!(scene.materials[0].emission, Vec3::ONE);
//! # Ok::<(), girandole_core::Error>(())
//! ```

use super::{
    Camera, Edit, Edits, FrameOfReference, LightId, Material, MaterialId, Mesh, Node, NodeId, Object,
    PunctualLight, Scene,
};

/// What changes of an open scene can change, and the edits that led to it.
#[derive(Clone, Debug)]
pub struct Snapshot {
    nodes: Vec<Node>,
    objects: Vec<Object>,
    materials: Vec<Material>,
    lights: Vec<PunctualLight>,
    removed_lights: Vec<LightId>,
    cameras: Vec<Camera>,
    meshes: usize,
    frame: Option<FrameOfReference>,
    edits: Vec<Edit>,
}

/// What a scene had before something was changed in it, or has after that.
#[derive(Clone, Debug)]
pub struct Step {
    nodes: Difference<Node>,
    objects: Difference<Object>,
    materials: Difference<Material>,
    lights: Difference<PunctualLight>,
    removed_lights: Vec<LightId>,
    cameras: Difference<Camera>,
    meshes: Difference<Mesh>,
    frame: Option<FrameOfReference>,
    edits: Difference<Edit>,
}

/// What one version of a list has and another one has not.
#[derive(Clone, Debug)]
struct Difference<T> {
    changed: Vec<(usize, T)>,
    /// How many elements both have, and what follows them in one.
    common: usize,
    tail: Vec<T>,
}

impl<T: Clone + PartialEq> Difference<T> {
    fn new(before: Vec<T>, now: &[T]) -> Self {
        let common = before.len().min(now.len());
        let mut before = before.into_iter().enumerate();
        let changed = before.by_ref().take(common).filter(|(i, item)| *item != now[*i]).collect();
        Self { changed, common, tail: before.map(|(_, item)| item).collect() }
    }
}

impl<T> Difference<T> {
    /// Whether the list is the same without it.
    fn is_none_of(&self, list: &[T]) -> bool {
        self.changed.is_empty() && self.keeps_length(list)
    }

    fn keeps_length(&self, list: &[T]) -> bool {
        self.tail.is_empty() && list.len() == self.common
    }

    fn exchange(&mut self, list: &mut Vec<T>) {
        for (index, item) in &mut self.changed {
            std::mem::swap(item, &mut list[*index]);
        }
        let tail = list.split_off(self.common);
        list.append(&mut self.tail);
        self.tail = tail;
    }
}

impl Snapshot {
    /// Of a scene as it stands, to which these edits led.
    pub fn of(scene: &Scene, edits: &Edits) -> Self {
        Self {
            nodes: scene.nodes.clone(),
            objects: scene.objects.clone(),
            materials: scene.materials.clone(),
            lights: scene.lights.clone(),
            removed_lights: scene.record.removed_lights.clone(),
            cameras: scene.cameras.clone(),
            meshes: scene.meshes.len(),
            frame: scene.record.frame,
            edits: edits.0.clone(),
        }
    }

    /// What has to be exchanged to come back to it; `None` where nothing has changed. Since it was taken, the scene
    /// was changed by its own methods alone, not by hand.
    pub fn step(self, scene: &Scene, edits: &Edits) -> Option<Step> {
        let step = Step {
            nodes: Difference::new(self.nodes, &scene.nodes),
            objects: Difference::new(self.objects, &scene.objects),
            materials: Difference::new(self.materials, &scene.materials),
            lights: Difference::new(self.lights, &scene.lights),
            removed_lights: self.removed_lights,
            cameras: Difference::new(self.cameras, &scene.cameras),
            meshes: Difference { changed: Vec::new(), common: self.meshes, tail: Vec::new() },
            frame: self.frame,
            edits: Difference::new(self.edits, &edits.0),
        };
        (!step.is_none_of(scene, edits)).then_some(step)
    }
}

impl Step {
    fn is_none_of(&self, scene: &Scene, edits: &Edits) -> bool {
        self.nodes.is_none_of(&scene.nodes)
            && self.objects.is_none_of(&scene.objects)
            && self.materials.is_none_of(&scene.materials)
            && self.lights.is_none_of(&scene.lights)
            && self.removed_lights == scene.record.removed_lights
            && self.cameras.is_none_of(&scene.cameras)
            && self.meshes.is_none_of(&scene.meshes)
            && self.edits.is_none_of(&edits.0)
    }

    /// Gives the scene, and the list of its edits, what this holds, and holds what they had. The scene collects what
    /// that changes, as it does of any other change.
    pub fn exchange(&mut self, scene: &mut Scene, edits: &mut Edits) {
        let stays = self.keeps_all_but_motion(scene);
        let moved: Vec<NodeId> = self.nodes.changed.iter().map(|(node, _)| (*node).into()).collect();
        let materials: Vec<MaterialId> =
            self.materials.changed.iter().map(|(material, _)| (*material).into()).collect();
        let lights: Vec<LightId> = self.lights.changed.iter().map(|(light, _)| (*light).into()).collect();
        self.nodes.exchange(&mut scene.nodes);
        self.objects.exchange(&mut scene.objects);
        self.materials.exchange(&mut scene.materials);
        self.lights.exchange(&mut scene.lights);
        self.cameras.exchange(&mut scene.cameras);
        self.meshes.exchange(&mut scene.meshes);
        self.edits.exchange(&mut edits.0);
        std::mem::swap(&mut self.removed_lights, &mut scene.record.removed_lights);
        std::mem::swap(&mut self.frame, &mut scene.record.frame);
        if stays {
            scene.note_motion(&moved, &materials, &lights);
        } else {
            scene.note_everything();
        }
    }

    /// Whether what differs is where things are, how they reflect and what they emit, and nothing else.
    fn keeps_all_but_motion(&self, scene: &Scene) -> bool {
        let reflects_alike =
            |(i, before): &(usize, Material)| before.is_like_but_for_shades(&scene.materials[*i]);
        let shines_alike = |(i, before): &(usize, PunctualLight)| {
            let PunctualLight { kind, node, .. } = &scene.lights[*i];
            (before.kind, before.node) == (*kind, *node)
        };
        self.frame == scene.record.frame
            && self.objects.is_none_of(&scene.objects)
            && self.meshes.is_none_of(&scene.meshes)
            && self.materials.keeps_length(&scene.materials)
            && self.materials.changed.iter().all(reflects_alike)
            && self.lights.keeps_length(&scene.lights)
            && self.lights.changed.iter().all(shines_alike)
    }
}
