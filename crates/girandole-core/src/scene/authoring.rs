//! Changes of an open scene by which it is furnished: copies of objects, lamps, what materials reflect, cameras to
//! come back to.

use super::changes::{check_light, insert, invalid};
use super::{
    Camera, LightId, Material, MaterialId, Node, Object, ObjectId, Projection, PunctualKind, PunctualLight,
    Scene, Transform, Viewpoint,
};
use crate::Result;
use crate::lights::SpotCone;
use glam::{DAffine3, DMat3, Vec3};

/// What of a material can be changed in an open scene: its factors. Textures stay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shades {
    /// [`Material::base_color`], each channel 0 to 1.
    pub base_color: Vec3,
    /// [`Material::metallic`], 0 to 1.
    pub metallic: f32,
    /// [`Material::roughness`], 0 to 1.
    pub roughness: f32,
    /// [`Material::specular`], 0 to 1.
    pub specular: f32,
}

impl Material {
    /// What of it can be changed in an open scene.
    pub fn shades(&self) -> Shades {
        let Self { base_color, metallic, roughness, specular, .. } = *self;
        Shades { base_color, metallic, roughness, specular }
    }

    fn with_shades(&self, shades: Shades) -> Self {
        let Shades { base_color, metallic, roughness, specular } = shades;
        Self { base_color, metallic, roughness, specular, ..self.clone() }
    }

    /// Whether it has a specular lobe.
    pub fn is_specular(&self) -> bool {
        self.specular > 0.0 || self.metallic > 0.0
    }

    /// Whether the other one differs by its shades and its emission at most, and has a specular lobe where this one
    /// has.
    pub(super) fn is_like_but_for_shades(&self, other: &Self) -> bool {
        let same = Self { emission: self.emission, ..other.with_shades(self.shades()) };
        same == *self && self.is_specular() == other.is_specular()
    }
}

impl Scene {
    /// Puts a copy of an object on a node of its own, beside the original's in the hierarchy: it has the same mesh,
    /// and is dynamic. `local` is parent from node.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where there is no such object, or a skin bends it; and as
    /// [`Scene::insert_object`].
    pub fn duplicate_object(&mut self, object: ObjectId, name: &str, local: Transform) -> Result<ObjectId> {
        let Some(original) = self.objects.get(object.index()).filter(|o| !o.removed).cloned() else {
            return invalid(format!("there is no object {object}; it may have been removed"));
        };
        if original.skin.is_some() {
            return invalid(format!(
                "object `{}` goes with its bones, and so would a copy; add its file as a model instead",
                original.name
            ));
        }
        let Node { parent, morph_weights, transfer, .. } = self.nodes[original.node].clone();
        let node = Node { name: name.into(), parent, local, morph_weights, transfer };
        self.place_object(node, name, original.mesh, true)
    }

    /// Adds a punctual light on a root node of its own. It shines along the node's −Z.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where intensity, cone or transform is none.
    pub fn insert_light(
        &mut self,
        name: &str,
        kind: PunctualKind,
        intensity: Vec3,
        local: Transform,
    ) -> Result<LightId> {
        check_light(intensity)?;
        check_kind(kind)?;
        if !super::changes::is_near(&local.affine()) {
            return invalid(format!("light `{name}` cannot be where its transform says; correct it"));
        }
        self.open();
        let node = self.add_node(name, local);
        self.lights.push(PunctualLight { name: name.into(), node, kind, intensity });
        self.note_everything();
        Ok((self.lights.len() - 1).into())
    }

    /// Takes a punctual light away. Its slot stays, dark.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where there is no such light.
    pub fn remove_light(&mut self, light: LightId) -> Result<()> {
        if light.index() >= self.lights.len() || self.is_light_removed(light) {
            return invalid(format!("there is no light {light}; it may have been removed"));
        }
        self.set_intensity(light, Vec3::ZERO)?;
        insert(&mut self.record.removed_lights, light);
        Ok(())
    }

    /// Whether [`Scene::remove_light`] took a punctual light away.
    pub fn is_light_removed(&self, light: LightId) -> bool {
        self.record.removed_lights.binary_search(&light).is_ok()
    }

    /// The punctual lights that are there.
    pub fn placed_lights(&self) -> impl Iterator<Item = (LightId, &PunctualLight)> {
        (0..).map(LightId).zip(&self.lights).filter(|(id, _)| !self.is_light_removed(*id))
    }

    /// Gives a spot another cone: half-angles, radians, within which its intensity is full, and at which it reaches
    /// zero.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where the light is no spot, or the cone none.
    pub fn set_cone(&mut self, light: LightId, inner: f32, outer: f32) -> Result<()> {
        let kind = PunctualKind::Spot { inner, outer };
        check_kind(kind)?;
        match self.lights.get_mut(light.index()) {
            Some(found) if matches!(found.kind, PunctualKind::Spot { .. }) => {
                if std::mem::replace(&mut found.kind, kind) != kind {
                    self.note_everything();
                }
                Ok(())
            }
            _ => invalid(format!("light {light} is no spot and has no cone; choose one that is")),
        }
    }

    /// Changes what a material reflects. What has it is found again at the next sampling of light; where light
    /// samples are [held](crate::illumination::Rewalk::Off), light that comes by way of it stays as it was until then.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where there is no such material, or a number is not between 0 and 1.
    pub fn set_shades(&mut self, material: MaterialId, shades: Shades) -> Result<()> {
        let Shades { base_color, metallic, roughness, specular } = shades;
        let all = [base_color.to_array().as_slice(), &[metallic, roughness, specular]].concat();
        if !all.iter().all(|x| (0.0..=1.0).contains(x)) {
            return invalid("a material reflects between 0 and 1 of the light; correct its numbers".into());
        }
        let count = self.materials.len();
        let Some(found) = self.materials.get_mut(material.index()) else {
            return invalid(format!("there is no material {material}; the scene has {count}"));
        };
        let next = found.with_shades(shades);
        let before = std::mem::replace(found, next);
        if self.materials[material] == before {
            return Ok(());
        }
        if self.materials[material].is_like_but_for_shades(&before) {
            self.open();
            self.note_motion(&[], &[material], &[]);
        } else {
            self.note_everything();
        }
        Ok(())
    }

    /// Writes down where one looks from as a camera of this name: another place for the one that is there, else a
    /// new one. Returns its index.
    ///
    /// # Errors
    /// Those of [`Viewpoint::view`].
    pub fn set_camera(&mut self, name: &str, viewpoint: &Viewpoint) -> Result<usize> {
        viewpoint.view(1.0)?;
        let forward = (viewpoint.target - viewpoint.eye).normalize();
        let right = forward.cross(viewpoint.up).normalize();
        let axes = DMat3::from_cols(right, right.cross(forward), -forward);
        let local = Transform::Affine(DAffine3 { matrix3: axes, translation: viewpoint.eye });
        let projection: Projection = viewpoint.field.into();
        let known = |camera: &Camera| camera.name == name && self.nodes[camera.node].parent.is_none();
        let index = match self.cameras.iter().position(known) {
            Some(index) => {
                (self.cameras[index].projection, self.cameras[index].clip) = (projection, viewpoint.clip);
                let node = self.cameras[index].node;
                self.set_transform(node, local)?;
                index
            }
            None => {
                let node = self.add_node(name, local);
                self.cameras.push(Camera { name: name.into(), node, projection, clip: viewpoint.clip });
                self.cameras.len() - 1
            }
        };
        Ok(index)
    }

    /// Hangs a mesh of the scene on a new node.
    pub(super) fn place_object(
        &mut self,
        node: Node,
        name: &str,
        mesh: usize,
        dynamic: bool,
    ) -> Result<ObjectId> {
        if !node.local.affine().is_finite() {
            return invalid(format!(
                "object `{name}` cannot have a transform that is not finite; correct it"
            ));
        }
        self.open();
        self.nodes.push(node);
        let node = (self.nodes.len() - 1).into();
        self.objects.push(Object { name: name.into(), node, mesh, skin: None, dynamic, removed: false });
        let added = ObjectId::from(self.objects.len() - 1);
        if let Err(error) = self.added_object(added) {
            self.objects.pop();
            self.nodes.pop();
            return Err(error);
        }
        Ok(added)
    }
}

fn check_kind(kind: PunctualKind) -> Result<()> {
    match kind {
        PunctualKind::Spot { inner, outer }
            if !(0.0 <= inner && inner < outer && outer <= std::f32::consts::FRAC_PI_2) =>
        {
            invalid(format!(
                "a cone of {inner} to {outer} radians is not possible; give 0 ≤ inner < outer ≤ π/2"
            ))
        }
        _ => Ok(()),
    }
}

impl PunctualKind {
    /// What the intensity is multiplied by for the flux, sr: a spot's falloff is counted by its integral. `None` for
    /// parallel light.
    pub fn solid_angle(&self) -> Option<f64> {
        match *self {
            Self::Point => Some(4.0 * std::f64::consts::PI),
            Self::Spot { inner, outer } => Some(SpotCone::new(inner, outer).solid_angle()),
            Self::Directional => None,
        }
    }
}
