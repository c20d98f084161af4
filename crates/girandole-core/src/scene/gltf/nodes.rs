//! The node hierarchy of the default scene, with what its nodes carry: objects, cameras, punctual lights.

use super::document::lookup;
use super::{Importer, Parsed};
use crate::scene::{Camera, Node, Object, Projection, PunctualKind, PunctualLight, Transform};
use glam::{DAffine3, DMat4, Quat, Vec3};
use gltf::json;
use gltf::json::extensions::scene::khr_lights_punctual::{Light, Type};
use gltf::json::validation::Checked;
use std::f32::consts::{FRAC_PI_2, PI};

/// Deeper hierarchies are a mistake; resolving a node's transform takes a step for each level.
const MAX_DEPTH: usize = 4096;

/// A node that waits to be read.
struct Pending {
    json: usize,
    parent: Option<usize>,
    depth: usize,
    dynamic: bool,
}

impl Importer<'_> {
    /// Reads the nodes of the default scene (the first one, or all roots, where there is none), parents first.
    pub(super) fn read_nodes(&mut self) -> Parsed<()> {
        let root = &self.document.root;
        let roots: Vec<usize> = match root.scene.map(|s| s.value()).or((!root.scenes.is_empty()).then_some(0))
        {
            Some(index) => lookup(&root.scenes, index, "scene")?.nodes.iter().map(|n| n.value()).collect(),
            None => {
                let mut is_root = vec![true; root.nodes.len()];
                for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
                    if let Some(flag) = is_root.get_mut(child.value()) {
                        *flag = false;
                    }
                }
                (0..root.nodes.len()).filter(|&i| is_root[i]).collect()
            }
        };
        if root.scenes.len() > 1 {
            self.scene
                .warn(format!("the file has {} scenes: only the default one is loaded", root.scenes.len()));
        }
        let mut stack: Vec<Pending> = roots
            .into_iter()
            .rev()
            .map(|json| Pending { json, parent: None, depth: 0, dynamic: false })
            .collect();
        while let Some(pending) = stack.pop() {
            let Pending { json: index, parent, depth, .. } = pending;
            let json = lookup(&root.nodes, index, "node")?;
            if self.nodes[index].is_some() {
                return Err(format!(
                    "its node {index} is its own ancestor or has two parents; export it again as a tree"
                ));
            }
            if depth > MAX_DEPTH {
                return Err(format!("its nodes are nested more than {MAX_DEPTH} deep; flatten them"));
            }
            let local = transform(json).map_err(|e| format!("its node {index} {e}"))?;
            let name = json.name.clone().unwrap_or_default();
            let transfer = has_extra(json, "transfer");
            self.scene.nodes.push(Node { name, parent, local, transfer, ..Node::default() });
            let node = self.scene.nodes.len() - 1;
            self.nodes[index] = Some(node);
            let dynamic = pending.dynamic || has_extra(json, "dynamic");
            self.contents(json, node, dynamic)?;
            for child in json.children.iter().flatten().rev() {
                stack.push(Pending { json: child.value(), parent: Some(node), depth: depth + 1, dynamic });
            }
        }
        Ok(())
    }

    /// What a node carries.
    fn contents(&mut self, json: &json::Node, node: usize, dynamic: bool) -> Parsed<()> {
        let root = &self.document.root;
        let extensions = json.extensions.as_ref();
        for name in extensions.iter().flat_map(|e| e.others.keys()) {
            self.meet_extension(name);
        }
        if let Some(index) = json.mesh
            && let Some(mesh) = self.mesh(index.value())?
        {
            // The first instance was accounted for when the mesh was read.
            if !self.shown.insert(mesh) {
                let (triangles, vertices) =
                    (self.scene.meshes[mesh].triangles.len(), self.scene.meshes[mesh].positions.len());
                self.account(triangles, vertices)?;
            }
            let own = self.scene.nodes[node].name.clone();
            let name = if own.is_empty() { self.scene.meshes[mesh].name.clone() } else { own };
            self.scene.nodes[node].morph_weights = self
                .morph_weights(json, index.value(), mesh)
                .map_err(|e| format!("its node `{name}` {e}"))?;
            self.scene.objects.push(Object { name, node, mesh, dynamic, removed: false, skin: None });
            if let Some(skin) = json.skin {
                self.skinned.push((self.scene.objects.len() - 1, skin.value()));
            }
        }
        if let Some(index) = json.camera {
            let camera = lookup(&root.cameras, index.value(), "camera")?;
            let name = camera.name.clone().filter(|n| !n.is_empty());
            let name = name.unwrap_or_else(|| self.scene.nodes[node].name.clone());
            match projection(camera) {
                Some(projection) => self.scene.cameras.push(Camera { name, node, projection }),
                None => self.scene.warn(format!("camera `{name}` has an impossible view and is left out")),
            }
        }
        if let Some(light) = extensions.and_then(|e| e.khr_lights_punctual.as_ref()) {
            let lights = root.extensions.as_ref().and_then(|e| e.khr_lights_punctual.as_ref());
            let lights = lights.map_or(&[][..], |l| &l.lights);
            let light = lookup(lights, light.light.value(), "light")?;
            self.light(light, node)?;
        }
        Ok(())
    }

    fn light(&mut self, json: &Light, node: usize) -> Parsed<()> {
        let name = json.name.clone().filter(|n| !n.is_empty());
        let name = name.unwrap_or_else(|| self.scene.nodes[node].name.clone());
        let intensity = Vec3::from(json.color) * json.intensity;
        if !(intensity.is_finite() && intensity.min_element() >= 0.0) {
            return Err(format!("its light `{name}` has an intensity of {intensity}; correct it"));
        }
        if json.range.is_some() {
            self.scene
                .warn("ranges of lights are left out: light falls off by the inverse square alone".into());
        }
        let kind = match json.type_ {
            Checked::Valid(Type::Point) => PunctualKind::Point,
            Checked::Valid(Type::Directional) => PunctualKind::Directional,
            Checked::Valid(Type::Spot) => {
                let spot = json.spot.clone().unwrap_or_default();
                // A cone needs some width, and glTF's falloff a difference of cosines.
                let outer = spot.outer_cone_angle.clamp(1e-3, FRAC_PI_2);
                let inner = spot.inner_cone_angle.clamp(0.0, outer * 0.999);
                PunctualKind::Spot { inner, outer }
            }
            Checked::Invalid => return Err(format!("its light `{name}` is of an unknown type; correct it")),
        };
        self.scene.lights.push(PunctualLight { name, node, kind, intensity });
        Ok(())
    }
}

/// Whether a node's extras say so.
fn has_extra(json: &json::Node, name: &str) -> bool {
    let extras = json.extras.as_ref().map(|e| e.get());
    let value = extras.and_then(|e| json::deserialize::from_str::<json::Value>(e).ok());
    value.as_ref().and_then(|v| v.get(name)?.as_bool()).unwrap_or(false)
}

fn transform(json: &json::Node) -> Parsed<Transform> {
    let absurd = || "has a transform of absurd numbers; export the file again".to_string();
    if let Some(matrix) = json.matrix {
        let matrix = DMat4::from_cols_array(&matrix.map(f64::from));
        if !matrix.is_finite() {
            return Err(absurd());
        }
        return Ok(Transform::Affine(DAffine3::from_mat4(matrix)));
    }
    let translation = Vec3::from(json.translation.unwrap_or_default());
    let scale = Vec3::from(json.scale.unwrap_or([1.0; 3]));
    let rotation = Quat::from_array(json.rotation.map_or([0.0, 0.0, 0.0, 1.0], |r| r.0));
    let length = rotation.as_dquat().length();
    if !(translation.is_finite() && scale.is_finite() && length.is_finite() && length > 1e-6) {
        return Err(absurd());
    }
    Ok(Transform::Parts { translation, rotation: rotation.as_dquat().normalize().as_quat(), scale })
}

fn projection(json: &json::Camera) -> Option<Projection> {
    match json.type_ {
        Checked::Valid(json::camera::Type::Perspective) => {
            let yfov = json.perspective.as_ref()?.yfov;
            (yfov > 1e-4 && yfov < PI - 1e-4).then_some(Projection::Perspective { yfov })
        }
        Checked::Valid(json::camera::Type::Orthographic) => {
            let ymag = json.orthographic.as_ref()?.ymag.abs();
            (ymag > 0.0 && ymag.is_finite()).then_some(Projection::Orthographic { ymag })
        }
        Checked::Invalid => None,
    }
}
