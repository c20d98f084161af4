//! How an open scene changes, and what is written down about it for those who derive things from it.

use super::frame_of_reference::Box3;
use super::motion::Pose;
use super::{
    FrameOfReference, LightId, MAX_EXTENT, MaterialId, Mesh, Node, NodeId, Object, ObjectId, Scene, Transform,
};
use crate::generation::Generation;
use crate::{Error, Result};
use glam::{DAffine3, Vec3};

/// What led from one version of a scene to another. Lists are sorted, and name each thing once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneChanges {
    /// The version before.
    pub from: Generation,
    /// The version after.
    pub to: Generation,
    /// Objects that were there before and after, and whose place or shape in the world changed.
    pub moved: Vec<ObjectId>,
    /// Those of them that were static before: what is moved once is dynamic from then on.
    pub made_dynamic: Vec<ObjectId>,
    /// Objects that were not there before and are after.
    pub added: Vec<ObjectId>,
    /// Objects that were there before and are not after.
    pub removed: Vec<ObjectId>,
    /// Materials whose emission changed, or whose factors did, and new ones.
    pub materials: Vec<MaterialId>,
    /// Punctual lights that moved, or whose intensity changed.
    pub lights: Vec<LightId>,
    /// Whether some of these materials reflect otherwise.
    pub reflectance: bool,
    /// Whether the frame of reference is another one: all positions are, and all that depends on the scene's size.
    pub reopened: bool,
    /// Whether anything may be different, see [`Scene::touch`].
    pub everything: bool,
}

impl SceneChanges {
    /// That nothing changed at this version.
    pub fn none(at: Generation) -> Self {
        Self {
            from: at,
            to: at,
            moved: Vec::new(),
            made_dynamic: Vec::new(),
            added: Vec::new(),
            removed: Vec::new(),
            materials: Vec::new(),
            lights: Vec::new(),
            reflectance: false,
            reopened: false,
            everything: false,
        }
    }

    /// Whether nothing changed.
    pub fn is_empty(&self) -> bool {
        self.from == self.to
    }

    /// Whether dynamic objects and lights changed their places, and lights and materials what they emit, and nothing else
    /// happened.
    pub fn is_motion(&self) -> bool {
        self.made_dynamic.is_empty() && self.keeps_objects()
    }

    /// The same, where static objects may have become dynamic ones.
    pub(crate) fn keeps_objects(&self) -> bool {
        self.added.is_empty() && self.removed.is_empty() && !self.reopened && !self.everything
    }

    /// Adds the changes that came next, for example where something could not be updated in between.
    ///
    /// # Errors
    /// [`Error::Invalid`] where they start from another version than the one that these lead to.
    pub fn then(&mut self, next: &Self) -> Result<()> {
        self.to.expect(
            next.from,
            "these changes do not follow each other; take them in the order they were made",
        )?;
        self.to = next.to;
        next.made_dynamic.iter().for_each(|&id| insert(&mut self.made_dynamic, id));
        next.added.iter().for_each(|&id| insert(&mut self.added, id));
        next.moved.iter().for_each(|&id| self.note_moved(id));
        next.removed.iter().for_each(|&id| self.note_removed(id));
        next.materials.iter().for_each(|&m| insert(&mut self.materials, m));
        next.lights.iter().for_each(|&l| insert(&mut self.lights, l));
        self.reflectance |= next.reflectance;
        self.reopened |= next.reopened;
        self.everything |= next.everything;
        Ok(())
    }

    fn note_moved(&mut self, id: ObjectId) {
        if self.added.binary_search(&id).is_err() {
            insert(&mut self.moved, id);
        }
    }

    fn note_removed(&mut self, id: ObjectId) {
        remove(&mut self.moved, id);
        remove(&mut self.made_dynamic, id);
        if !remove(&mut self.added, id) {
            insert(&mut self.removed, id);
        }
    }
}

pub(super) fn insert<T: Ord>(sorted: &mut Vec<T>, item: T) {
    if let Err(at) = sorted.binary_search(&item) {
        sorted.insert(at, item);
    }
}

fn remove<T: Ord>(sorted: &mut Vec<T>, item: T) -> bool {
    let found = sorted.binary_search(&item);
    if let Ok(at) = found {
        sorted.remove(at);
    }
    found.is_ok()
}

/// What a scene knows of its own history.
#[derive(Clone, Debug)]
pub(super) struct Record {
    generation: Generation,
    /// Fixed once the scene is open.
    pub frame: Option<FrameOfReference>,
    /// Punctual lights that were taken away; ascending.
    pub removed_lights: Vec<LightId>,
    /// Since changes were last taken.
    pending: SceneChanges,
}

impl Default for Record {
    fn default() -> Self {
        let generation = Generation::fresh();
        let pending = SceneChanges::none(generation);
        Self { generation, frame: None, removed_lights: Vec::new(), pending }
    }
}

/// Changes of an open scene. Each opens it if it was not, so that the frame of reference is that of the scene before the
/// change; and each that is refused leaves the scene as it was.
impl Scene {
    /// Which version of the scene this is: each change makes another one, and copies keep it.
    pub fn generation(&self) -> Generation {
        self.record.generation
    }

    /// The frame that geometry is made in: the one that the scene was opened with, or would be as it stands.
    pub fn frame_of_reference(&self) -> FrameOfReference {
        self.record.frame.unwrap_or_else(|| FrameOfReference::of(self))
    }

    /// Whether the frame of reference is fixed.
    pub fn is_open(&self) -> bool {
        self.record.frame.is_some()
    }

    /// Fixes the frame of reference: from now on only what leaves its bounds changes it.
    pub fn open(&mut self) {
        if !self.is_open() {
            self.record.frame = Some(FrameOfReference::of(self));
        }
    }

    /// Whether anything changed since changes were last taken, or since the scene was made.
    pub fn has_changed(&self) -> bool {
        !self.record.pending.is_empty()
    }

    /// What changed since changes were last taken, or since the scene was made.
    pub fn take_changes(&mut self) -> SceneChanges {
        std::mem::replace(&mut self.record.pending, SceneChanges::none(self.record.generation))
    }

    /// Says that public fields were changed by hand, in any way: whatever was derived is stale.
    pub fn touch(&mut self) {
        self.open();
        self.record.pending.everything = true;
        let world_from_nodes = self.world_from_nodes();
        let bounds = |object: &Object| self.world_bounds(object, &|node| world_from_nodes[node.index()]);
        let all: Vec<_> = self.placed_objects().map(|(i, o)| (i, bounds(o))).collect();
        self.keep_in_frame(&all);
        self.stamp();
    }

    /// Puts a node, and what is below it, elsewhere; static objects become dynamic. Cameras alone make no new version of the scene: nothing is derived
    /// from them.
    ///
    /// # Errors
    /// [`Error::Invalid`] where there is no such node, or the transform is not finite or leads farther than 10¹⁵ m away.
    pub fn set_transform(&mut self, node: NodeId, local: Transform) -> Result<()> {
        self.set_poses(vec![Pose { node, local: Some(local), morph_weights: None }])
    }

    /// Poses nodes, all at once: what depends on several of them is looked at when it is where it comes to stand.
    pub(super) fn set_poses(&mut self, mut poses: Vec<Pose>) -> Result<()> {
        for pose in &mut poses {
            self.check_pose(pose)?;
            let node = &self.nodes[pose.node];
            pose.local = pose.local.filter(|local| *local != node.local);
            pose.morph_weights = pose.morph_weights.take().filter(|weights| *weights != node.morph_weights);
        }
        let (mut is_posed, mut is_morphed) = (vec![false; self.nodes.len()], vec![false; self.nodes.len()]);
        for pose in &poses {
            is_posed[pose.node.index()] |= pose.local.is_some();
            is_morphed[pose.node.index()] |= pose.morph_weights.is_some();
        }
        let moves = self.at_or_below(|node| is_posed[node.index()]);
        let is_moved = |object: &Object| {
            self.is_moved_by(object, &moves)
                || is_morphed[object.node.index()] && !self.meshes[object.mesh].morph_targets.is_empty()
        };
        let objects: Vec<ObjectId> =
            self.placed_objects().filter(|(_, o)| is_moved(o)).map(|(id, _)| id).collect();
        let lights = self.lights_of(&moves);
        let anything = !(objects.is_empty() && lights.is_empty());
        if anything {
            self.open();
        }
        self.swap_poses(&mut poses);
        // All nodes at once, where more than one is asked for.
        let world_from_nodes = (objects.len() + lights.len() > 1).then(|| self.world_from_nodes());
        let world_from_node = |node: NodeId| match &world_from_nodes {
            Some(all) => all[node.index()],
            None => self.world_from_node(node),
        };
        let bounds = objects.iter().map(|&o| (o, self.world_bounds(&self.objects[o], &world_from_node)));
        let bounds: Vec<_> = bounds.collect();
        let far_object = bounds.iter().find(|(_, bounds)| !bounds.is_within(MAX_EXTENT));
        let far_object = far_object.map(|(o, _)| format!("object `{}`", self.objects[*o].name));
        let is_near = |node| world_from_node(node).translation.abs().max_element() <= MAX_EXTENT;
        let far_light = lights.iter().find(|&&l| !is_near(self.lights[l].node));
        let far_light = far_light.map(|&l| format!("light `{}`", self.lights[l].name));
        if let Some(far) = far_object.or(far_light) {
            self.swap_poses(&mut poses);
            return invalid(format!(
                "{far} cannot be moved farther than {MAX_EXTENT:.0e} m away; scale it to metres"
            ));
        }
        if anything {
            self.keep_in_frame(&bounds);
            for object in objects {
                self.record.pending.note_moved(object);
                let was_dynamic = std::mem::replace(&mut self.objects[object].dynamic, true);
                if !was_dynamic && self.record.pending.moved.binary_search(&object).is_ok() {
                    insert(&mut self.record.pending.made_dynamic, object);
                }
            }
            lights.into_iter().for_each(|l| insert(&mut self.record.pending.lights, l));
            self.stamp();
        }
        Ok(())
    }

    fn check_pose(&self, pose: &Pose) -> Result<()> {
        let Pose { node, local, morph_weights } = pose;
        if node.index() >= self.nodes.len() {
            return invalid(format!("there is no node {node}; the scene has {}", self.nodes.len()));
        }
        if local.is_some_and(|local| !local.affine().is_finite()) {
            return invalid(format!("node {node} cannot have a transform that is not finite; correct it"));
        }
        let Some(weights) = morph_weights else { return Ok(()) };
        if !weights.iter().all(|weight| weight.is_finite()) {
            return invalid(format!(
                "node {node} cannot have morph weights that are not finite; correct them"
            ));
        }
        let on_node = self.placed_objects().filter(|(_, o)| o.node == *node);
        let mut counts = on_node.map(|(_, o)| self.meshes[o.mesh].morph_targets.len());
        match counts.find(|&count| count != weights.len()) {
            Some(count) => invalid(format!(
                "node {node} has a mesh with {count} morph targets and cannot have {} weights; give one for each",
                weights.len()
            )),
            None => Ok(()),
        }
    }

    /// Exchanges what nodes have and what poses say.
    fn swap_poses(&mut self, poses: &mut [Pose]) {
        for Pose { node, local, morph_weights } in poses {
            let node = &mut self.nodes[*node];
            if let Some(local) = local {
                std::mem::swap(&mut node.local, local);
            }
            if let Some(weights) = morph_weights {
                std::mem::swap(&mut node.morph_weights, weights);
            }
        }
    }

    /// Changes what a material emits, W/(sr·m²).
    ///
    /// # Errors
    /// [`Error::Invalid`] where there is no such material, or a channel is negative or not finite.
    pub fn set_emission(&mut self, material: MaterialId, emission: Vec3) -> Result<()> {
        let count = self.materials.len();
        let Some(found) = self.materials.get_mut(material.index()) else {
            return invalid(format!("there is no material {material}; the scene has {count}"));
        };
        check_light(emission)?;
        if found.emission != emission {
            found.emission = emission;
            self.open();
            self.material_changed(material);
        }
        Ok(())
    }

    /// Changes the intensity of a punctual light, W/sr (directional: W/m²).
    ///
    /// # Errors
    /// [`Error::Invalid`] where there is no such light, or a channel is negative or not finite.
    pub fn set_intensity(&mut self, light: LightId, intensity: Vec3) -> Result<()> {
        let count = self.lights.len();
        let Some(found) = self.lights.get_mut(light.index()) else {
            return invalid(format!("there is no light {light}; the scene has {count}"));
        };
        check_light(intensity)?;
        if found.intensity != intensity {
            found.intensity = intensity;
            self.open();
            insert(&mut self.record.pending.lights, light);
            self.stamp();
        }
        Ok(())
    }

    /// Adds a mesh on a root node of its own; `dynamic` as in [`Object::dynamic`].
    ///
    /// # Errors
    /// [`Error::Invalid`] where the mesh refers to vertices or materials that do not exist or lacks normals, or the
    /// transform is not finite or leads farther than 10¹⁵ m away.
    pub fn insert_object(
        &mut self,
        name: &str,
        mesh: Mesh,
        local: Transform,
        dynamic: bool,
    ) -> Result<ObjectId> {
        mesh.check(self.materials.len())?;
        self.meshes.push(mesh);
        let node = Node { name: name.into(), local, ..Node::default() };
        let placed = self.place_object(node, name, self.meshes.len() - 1, dynamic);
        if placed.is_err() {
            self.meshes.pop();
        }
        placed
    }

    /// Takes note of the last object, which is new; refuses one that is too far away.
    pub(super) fn added_object(&mut self, id: ObjectId) -> Result<()> {
        let object = &self.objects[id];
        let bounds = self.world_bounds(object, &|node| self.world_from_node(node));
        if !bounds.is_within(MAX_EXTENT) {
            return invalid(format!(
                "object `{}` is farther than {MAX_EXTENT:.0e} m away; scale it to metres",
                object.name
            ));
        }
        self.keep_in_frame(&[(id, bounds)]);
        insert(&mut self.record.pending.added, id);
        self.stamp();
        Ok(())
    }

    /// Takes an object away. Its slot stays empty; its node and its mesh stay, as others may be on them.
    ///
    /// # Errors
    /// [`Error::Invalid`] where there is no such object.
    pub fn remove_object(&mut self, object: ObjectId) -> Result<()> {
        if self.objects.get(object.index()).is_none_or(|o| o.removed) {
            return invalid(format!("there is no object {object}; it may have been removed"));
        }
        self.open();
        self.objects[object].removed = true;
        self.record.pending.note_removed(object);
        self.stamp();
        Ok(())
    }

    /// Writes down that a material is new or another one, if anybody may have seen the scene without.
    pub(super) fn material_changed(&mut self, material: MaterialId) {
        if self.is_open() {
            insert(&mut self.record.pending.materials, material);
            self.stamp();
        }
    }

    /// Takes note that nodes, materials and lights, as many as there were, have other places, shades and strengths.
    pub(super) fn note_motion(&mut self, nodes: &[NodeId], materials: &[MaterialId], lights: &[LightId]) {
        let moves = self.at_or_below(|node| nodes.contains(&node));
        let moved = |(_, object): &(ObjectId, &Object)| {
            self.is_moved_by(object, &moves)
                || nodes.contains(&object.node) && !self.meshes[object.mesh].morph_targets.is_empty()
        };
        let objects: Vec<ObjectId> = self.placed_objects().filter(moved).map(|(id, _)| id).collect();
        let mut all_lights = lights.to_vec();
        all_lights.extend(self.lights_of(&moves));
        if objects.is_empty() && materials.is_empty() && all_lights.is_empty() {
            return;
        }
        let pending = &mut self.record.pending;
        objects.into_iter().for_each(|id| pending.note_moved(id));
        materials.iter().for_each(|&m| insert(&mut pending.materials, m));
        all_lights.into_iter().for_each(|l| insert(&mut pending.lights, l));
        pending.reflectance |= !materials.is_empty();
        self.stamp();
    }

    /// Punctual lights on these nodes.
    fn lights_of(&self, nodes: &[bool]) -> Vec<LightId> {
        let all = (0..).map(LightId).zip(&self.lights);
        all.filter(|(_, light)| nodes[light.node.index()]).map(|(id, _)| id).collect()
    }

    /// Takes note that anything may be different.
    pub(super) fn note_everything(&mut self) {
        self.open();
        let pending = &mut self.record.pending;
        *pending = SceneChanges { everything: true, ..SceneChanges::none(pending.from) };
        self.stamp();
    }

    fn stamp(&mut self) {
        self.record.generation = Generation::fresh();
        self.record.pending.to = self.record.generation;
    }

    /// Makes another frame of reference if one of these objects, by their bounds, is not within it, with room for those.
    fn keep_in_frame(&mut self, objects: &[(ObjectId, Box3)]) {
        let Some(frame) = self.record.frame else { return };
        let left: Vec<ObjectId> = objects.iter().filter(|(_, b)| !frame.holds(*b)).map(|(i, _)| *i).collect();
        let Some(&first) = left.first() else { return };
        let moves = |id: ObjectId| self.objects[id].dynamic || left.contains(&id);
        self.record.frame = Some(FrameOfReference::with_movers(self, moves));
        self.record.pending.reopened = true;
        self.warn(format!(
            "object {first} `{}` left the bounds that the scene was opened with: everything is derived anew in larger \
             ones; open the scene with something static that reaches as far as things will move",
            self.objects[first].name
        ));
    }
}

pub(super) fn check_light(value: Vec3) -> Result<()> {
    if value.is_finite() && value.min_element() >= 0.0 {
        return Ok(());
    }
    invalid(format!("light of {value} is not possible; give each channel a number from 0 up"))
}

pub(super) fn invalid<T>(sentence: String) -> Result<T> {
    Err(Error::Invalid(sentence))
}

/// Whether something may be there.
pub(super) fn is_near(place: &DAffine3) -> bool {
    place.is_finite() && place.translation.abs().max_element() <= MAX_EXTENT
}
