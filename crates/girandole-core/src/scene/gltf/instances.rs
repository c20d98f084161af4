//! Meshes that a node shows many times (`EXT_mesh_gpu_instancing`): one object each, on nodes below that node, which share the mesh.
//! What else is on the node, and what is below it, is there once.

use super::accessor::Accessor;
use super::{Importer, Parsed};
use crate::scene::Transform;
use glam::{DQuat, Quat, Vec3};
use gltf::json;
use gltf::json::Value;
use gltf::json::accessor::Type;

/// The extension's name.
pub(super) const NAME: &str = "EXT_mesh_gpu_instancing";

/// Attributes of instances; those that are missing change nothing.
struct Attributes<'d> {
    translation: Option<Accessor<'d>>,
    rotation: Option<Accessor<'d>>,
    scale: Option<Accessor<'d>>,
    count: usize,
}

impl<'d> Importer<'d> {
    /// Where a node shows its mesh, relative to it; `None` where that is once, on itself.
    pub(super) fn instances(&mut self, json: &json::Node) -> Parsed<Option<Vec<Transform>>> {
        let others = json.extensions.as_ref().map(|e| &e.others);
        let Some(extension) = others.and_then(|others| others.get(NAME)) else { return Ok(None) };
        let name = || json.name.as_ref().map_or_else(|| "of a node".into(), |name| format!("of `{name}`"));
        let read = self.instance_attributes(extension);
        let Some(attributes) = self.or_without("instancing", name, read)? else { return Ok(None) };
        // Asked before the memory is taken.
        self.document.budget.take(attributes.count, size_of::<Transform>() as u64)?;
        let mut places = Vec::with_capacity(attributes.count);
        for index in 0..attributes.count {
            let place = attributes
                .place(index)
                .ok_or_else(|| "it has a place of absurd numbers; export it again".into());
            places.extend(self.or_without("instance", || format!("{index} {}", name()), place)?);
        }
        Ok(Some(places))
    }

    fn instance_attributes(&mut self, extension: &Value) -> Parsed<Attributes<'d>> {
        let listed = extension.get("attributes").and_then(Value::as_object);
        let listed = listed.ok_or("it has no attributes; export it again")?;
        let mut counts = Vec::new();
        let mut read = |name: &str, kind: Type| -> Parsed<Option<Accessor<'d>>> {
            let Some(index) = listed.get(name) else { return Ok(None) };
            let index = index.as_u64().and_then(|i| usize::try_from(i).ok());
            let index = index.ok_or_else(|| format!("its {name} is no accessor; export it again"))?;
            let accessor = Accessor::new(self.document, index)?.of(kind, "instances")?;
            counts.push(accessor.count);
            Ok(Some(accessor))
        };
        let translation = read("TRANSLATION", Type::Vec3)?;
        let rotation = read("ROTATION", Type::Vec4)?;
        let scale = read("SCALE", Type::Vec3)?;
        let count = *counts.first().ok_or("it places no instance; export it again")?;
        if let Some(other) = counts.iter().find(|&&other| other != count) {
            return Err(format!("it has {count} and {other} values for its instances; export it again"));
        }
        Ok(Attributes { translation, rotation, scale, count })
    }
}

impl Attributes<'_> {
    /// `None` where numbers are not finite, or the rotation is none.
    fn place(&self, index: usize) -> Option<Transform> {
        let vector = |accessor: &Option<Accessor>, missing: Vec3| {
            accessor.as_ref().map_or(missing, |accessor| Vec3::from(accessor.get::<3>(index)))
        };
        let (translation, scale) = (vector(&self.translation, Vec3::ZERO), vector(&self.scale, Vec3::ONE));
        let rotation =
            self.rotation.as_ref().map(|accessor| Quat::from_array(accessor.get::<4>(index)).as_dquat());
        let rotation = rotation.unwrap_or(DQuat::IDENTITY);
        let is_possible =
            translation.is_finite() && scale.is_finite() && rotation.is_finite() && rotation.length() > 1e-6;
        is_possible.then(|| Transform::Parts { translation, rotation: rotation.normalize().as_quat(), scale })
    }
}
