//! What is picked, and what is done to it by keys: deleted, duplicated.

use super::session::Session;
use super::tools::Tools;
use girandole_core::glam::{DAffine3, DVec3, Vec3};
use girandole_core::scene::{
    Edit, LightId, NamedIndex, NodeId, Object, ObjectId, PunctualLight, Transform, View, load_model,
};

/// Something that can be picked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selected {
    Object(ObjectId),
    /// A punctual light.
    Light(LightId),
}

/// How much of the scene, along two axes, a wall, a floor or the ground has at least.
const WALL: f32 = 0.5;

/// Between a copy and its original, in the original's size.
const GAP: f64 = 0.1;

impl Selected {
    /// The object, where it is one that is there.
    pub fn object(self, session: &Session) -> Option<&Object> {
        let Self::Object(id) = self else { return None };
        session.scene.objects.get(id.index()).filter(|object| !object.removed)
    }

    /// The light, where it is one that is there.
    pub fn light(self, session: &Session) -> Option<&PunctualLight> {
        let Self::Light(id) = self else { return None };
        session.scene.lights.get(id.index()).filter(|_| !session.scene.is_light_removed(id))
    }

    /// Whether it is there.
    pub fn is_there(self, session: &Session) -> bool {
        self.node(session).is_some()
    }

    /// The node that it is on.
    pub fn node(self, session: &Session) -> Option<NodeId> {
        let light = self.light(session).map(|light| light.node);
        self.object(session).map(|object| object.node).or(light)
    }

    /// What it is called.
    pub fn name(self, session: &Session) -> String {
        let light = self.light(session).map(|light| &light.name);
        match (self, self.object(session).map(|object| &object.name).or(light)) {
            (_, Some(name)) if !name.is_empty() => name.clone(),
            (Self::Object(id), _) => format!("object {}", id.index()),
            (Self::Light(index), _) => format!("light {index}"),
        }
    }

    /// The middle of its bounds, as it was last drawn, or the place of its light; `None` where it cannot be moved by
    /// its node.
    pub fn center(self, session: &Session) -> Option<DVec3> {
        if self.object(session).is_some_and(|object| object.skin.is_some()) {
            return None;
        }
        match self {
            Self::Object(id) => bounds(session, id).map(|(low, high)| (low + high) * 0.5),
            Self::Light(_) => Some(session.scene.world_from_node(self.node(session)?).translation),
        }
    }

    /// Whether it is a wall, a floor or a shell: what stays where it is unless it is asked for by name.
    pub fn is_structure(self, session: &Session, view: &View) -> bool {
        let Self::Object(id) = self else { return false };
        let light = session.illumination();
        let Some((object, light)) = self.object(session).zip(light) else { return false };
        let Some((low, high)) = bounds(session, id).filter(|_| !object.dynamic) else { return false };
        let encloses = low.cmple(view.eye).all() && view.eye.cmple(high).all();
        let (first, last) = light.geometry().main_bounds();
        let shares = (high - low).as_vec3() / (last - first).max(Vec3::splat(1e-9));
        encloses || shares.to_array().iter().filter(|share| **share >= WALL).count() >= 2
    }
}

/// Smallest and largest corner of an object in the world, as it was last drawn.
pub fn bounds(session: &Session, id: ObjectId) -> Option<(DVec3, DVec3)> {
    let geometry = session.illumination()?.geometry();
    let range = geometry.objects.get(id.index())?.vertices.clone();
    let positions = &geometry.positions[range.start as usize..range.end as usize];
    let first = *positions.first()?;
    let (low, high) = positions.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p)));
    Some((geometry.origin + low.as_dvec3(), geometry.origin + high.as_dvec3()))
}

/// Takes the last change of the scene back. What is picked may have gone with it.
pub fn undo(session: &mut Session, tools: &mut Tools) {
    session.undo();
    keep(session, tools);
}

/// Makes the change again that was taken back last.
pub fn redo(session: &mut Session, tools: &mut Tools) {
    session.redo();
    keep(session, tools);
}

fn keep(session: &Session, tools: &mut Tools) {
    if tools.selected.is_some_and(|selected| !selected.is_there(session)) {
        tools.select(None);
    }
}

/// Takes what is picked away.
pub fn delete(session: &mut Session, tools: &mut Tools) {
    let Some(selected) = tools.selected.filter(|selected| selected.is_there(session)) else { return };
    if tools.is_locked {
        let name = selected.name(session);
        let sentence = format!("{name} is part of the room; double-click it before it is deleted");
        return session.notice = Some(sentence);
    }
    tools.select(None);
    session.edit(match selected {
        Selected::Object(id) => Edit::RemoveObject { object: NamedIndex::object(&session.scene, id) },
        Selected::Light(index) => Edit::RemoveLight { light: NamedIndex::light(&session.scene, index) },
    });
    session.end_step();
}

/// Puts a copy of what is picked beside it, and picks the copy.
pub fn duplicate(session: &mut Session, tools: &mut Tools) {
    let Some(selected) = tools.selected.filter(|selected| selected.is_there(session)) else { return };
    let Some(node) = selected.node(session) else { return };
    let name = copied_name(&selected.name(session));
    let world = session.scene.world_from_node(node);
    let (objects, lights) = (session.scene.objects.len(), session.scene.lights.len());
    let shifted = DAffine3::from_translation(shift(selected, session, tools)) * world;
    let edit = match selected {
        Selected::Object(id) => {
            let object = NamedIndex::object(&session.scene, id);
            let above = session.scene.nodes[node].parent;
            let above = above.map_or(DAffine3::IDENTITY, |parent| session.scene.world_from_node(parent));
            let transform = Transform::Affine(above.inverse() * shifted);
            Edit::DuplicateObject { object, name, transform }
        }
        Selected::Light(index) => {
            let PunctualLight { kind, intensity, .. } = session.scene.lights[index];
            Edit::InsertLight { name, kind, intensity, transform: Transform::Affine(shifted) }
        }
    };
    session.edit_all(vec![edit], &load_model);
    session.end_step();
    let copy = match selected {
        Selected::Object(_) => Selected::Object(objects.into()),
        Selected::Light(_) => Selected::Light(lights.into()),
    };
    if copy.is_there(session) {
        tools.select(Some(copy));
    }
}

/// Where a copy goes: to the right in the picture, along one of the world's axes, free of the original.
fn shift(selected: Selected, session: &Session, tools: &Tools) -> DVec3 {
    let size = match selected {
        Selected::Object(id) => bounds(session, id).map(|(low, high)| high - low),
        Selected::Light(_) => None,
    };
    let size = size.unwrap_or(DVec3::splat(f64::from(session.scene.frame_of_reference().scale) * 0.05));
    let right = session.view(tools.picture_size).right;
    if right.x.abs() >= right.z.abs() {
        DVec3::X * f64::from(right.x.signum()) * size.x * (1.0 + GAP)
    } else {
        DVec3::Z * f64::from(right.z.signum()) * size.z * (1.0 + GAP)
    }
}

/// `chair` has the copy `chair copy`, that has `chair copy 2`.
fn copied_name(name: &str) -> String {
    let Some((base, number)) = name.rsplit_once(" copy") else { return format!("{name} copy") };
    match number.trim() {
        "" => format!("{base} copy 2"),
        number => match number.parse::<u32>() {
            Ok(number) => format!("{base} copy {}", number.saturating_add(1)),
            Err(_) => format!("{name} copy"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_are_numbered() {
        for (name, copy) in [
            ("chair", "chair copy"),
            ("chair copy", "chair copy 2"),
            ("chair copy 2", "chair copy 3"),
            ("a copycat", "a copycat copy"),
            ("", " copy"),
        ] {
            assert_eq!(copied_name(name), copy);
        }
    }
}
