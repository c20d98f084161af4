//! The hierarchy, and what hangs on it.

use super::{Exporter, named};
use crate::scene::{Camera, ClipPlanes, Node, Projection, PunctualKind, PunctualLight, Transform};
use crate::{Error, Result};
use glam::{DAffine3, DMat4, Quat, Vec3};
use gltf::json::accessor::Type;
use gltf::json::extensions::scene::khr_lights_punctual::{self, Light, Spot};
use gltf::json::extras::RawValue;
use gltf::json::scene::UnitQuaternion;
use gltf::json::validation::Checked::Valid;
use gltf::json::{self, Index};

/// Where cameras of scenes that say nothing of it begin to see, metres.
const NEAR: f32 = 1e-3;

impl Exporter<'_> {
    /// Writes all nodes, so that their indices stay, then what further things on one node hang on: a node holds one of each.
    pub(super) fn write_nodes(&mut self) -> Result<()> {
        let scene = self.scene;
        let animated: Vec<bool> = driven(scene);
        for (node, is_driven) in scene.nodes.iter().zip(animated) {
            let json = self.node(node, is_driven);
            self.root.push(json);
        }
        for (child, node) in scene.nodes.iter().enumerate() {
            if let Some(parent) = node.parent {
                let Some(above) = self.root.nodes.get_mut(parent.index()) else {
                    return Err(Error::Invalid(format!(
                        "node `{}` hangs on one that does not exist",
                        node.name
                    )));
                };
                above.children.get_or_insert_default().push(Index::new(child as u32));
            }
        }
        for skin in 0..scene.skins.len() {
            self.skin(skin);
        }
        for (index, object) in scene.placed_objects() {
            let Some(mesh) = self.mesh(object.mesh) else { continue };
            let node = self.free(object.node.index(), &object.name, |node| node.mesh.is_none());
            let weights = &scene.nodes[object.node].morph_weights;
            let targets = scene.meshes[object.mesh].morph_targets.len();
            let weight = |i: usize| weights.get(i).copied().unwrap_or(0.0);
            let json = &mut self.root.nodes[node];
            json.mesh = Some(mesh);
            json.skin = object.skin.map(|skin| Index::new(skin as u32));
            json.weights = (targets > 0).then(|| (0..targets).map(weight).collect());
            if json.name.is_none() {
                json.name = named(&object.name);
            }
            let extras = (scene.objects[index].dynamic, scene.nodes[object.node].transfer);
            json.extras = extra(extras);
        }
        for camera in &scene.cameras {
            let node = self.free(camera.node.index(), &camera.name, |node| node.camera.is_none());
            let camera = self.root.push(camera_json(camera));
            self.root.nodes[node].camera = Some(camera);
        }
        for light in &scene.lights {
            let node = self.free(light.node.index(), &light.name, |node| node.extensions.is_none());
            self.extensions.insert("KHR_lights_punctual");
            let light = Index::push(&mut self.lights, light_json(light));
            self.root.nodes[node].extensions = Some(json::extensions::scene::Node {
                khr_lights_punctual: Some(khr_lights_punctual::KhrLightsPunctual { light }),
                ..Default::default()
            });
        }
        let is_root = |(_, node): &(usize, &Node)| node.parent.is_none();
        let roots = scene.nodes.iter().enumerate().filter(is_root);
        let nodes = roots.map(|(index, _)| Index::new(index as u32)).collect();
        let whole = json::Scene { name: named(&scene.name), nodes, extensions: None, extras: None };
        self.root.scene = Some(self.root.push(whole));
        Ok(())
    }

    /// The node, or one below it of this name where the node has one of these already.
    fn free(&mut self, node: usize, name: &str, is_free: impl Fn(&json::Node) -> bool) -> usize {
        if is_free(&self.root.nodes[node]) {
            return node;
        }
        let child = self.root.push(json::Node { name: named(name), ..json::Node::default() });
        self.root.nodes[node].children.get_or_insert_default().push(child);
        child.value()
    }

    /// A node by itself. What animations drive has parts, and no matrix.
    fn node(&mut self, node: &Node, is_driven: bool) -> json::Node {
        let mut json = json::Node {
            name: named(&node.name),
            extras: extra((false, node.transfer)),
            ..json::Node::default()
        };
        let (translation, rotation, scale) = match node.local {
            Transform::Parts { translation, rotation, scale } => (translation, rotation, scale),
            Transform::Affine(affine) if !is_driven => {
                json.matrix = Some(DMat4::from(affine).to_cols_array().map(|x| x as f32));
                return json;
            }
            Transform::Affine(affine) => {
                let (scale, rotation, translation) = affine.to_scale_rotation_translation();
                let parts = DAffine3::from_scale_rotation_translation(scale, rotation, translation);
                if !parts.abs_diff_eq(affine, 1e-6 * affine.matrix3.determinant().abs().cbrt().max(1e-6)) {
                    self.leave_out(format!("the shear of node `{}`, which is animated", node.name));
                }
                (translation.as_vec3(), rotation.as_quat(), scale.as_vec3())
            }
        };
        json.translation = (translation != Vec3::ZERO).then(|| translation.into());
        json.rotation = (rotation != Quat::IDENTITY).then(|| UnitQuaternion(rotation.into()));
        json.scale = (scale != Vec3::ONE).then(|| scale.into());
        json
    }

    fn skin(&mut self, index: usize) {
        let skin = &self.scene.skins[index];
        let matrix = |affine| DMat4::from(affine).to_cols_array().map(|x| x as f32);
        let matrices: Vec<[f32; 16]> = skin.joints.iter().map(|joint| matrix(joint.inverse_bind)).collect();
        let matrices = self.buffers.floats(&mut self.root, &matrices, Type::Mat4, false);
        let joints = skin.joints.iter().map(|joint| Index::new(joint.node.0)).collect();
        self.root.push(json::Skin {
            inverse_bind_matrices: Some(matrices),
            joints,
            name: named(&skin.name),
            skeleton: None,
            extensions: None,
            extras: None,
        });
    }
}

/// Which nodes animations drive.
fn driven(scene: &crate::scene::Scene) -> Vec<bool> {
    let mut driven = vec![false; scene.nodes.len()];
    for channel in scene.animations.iter().flat_map(|animation| &animation.channels) {
        driven[channel.node.index()] = true;
    }
    driven
}

/// What only this program reads: whether objects may move, and are to be lit by transfer.
fn extra((is_dynamic, transfer): (bool, bool)) -> json::Extras {
    let words = [(is_dynamic, "\"dynamic\":true"), (transfer, "\"transfer\":true")];
    let words: Vec<&str> = words.into_iter().filter(|(is_so, _)| *is_so).map(|(_, word)| word).collect();
    let text = format!("{{{}}}", words.join(","));
    if words.is_empty() { None } else { RawValue::from_string(text).ok() }
}

fn camera_json(camera: &Camera) -> json::Camera {
    let (mut perspective, mut orthographic) = (None, None);
    let cuts_nothing = camera.clip == ClipPlanes::NONE;
    let type_ = match camera.projection {
        Projection::Perspective { yfov, .. } => {
            perspective = Some(json::camera::Perspective {
                aspect_ratio: None,
                yfov,
                zfar: Some(camera.clip.far).filter(|far| far.is_finite()),
                znear: if camera.clip.near > 0.0 { camera.clip.near } else { NEAR },
                extensions: None,
                extras: None,
            });
            json::camera::Type::Perspective
        }
        Projection::Orthographic { ymag, .. } => {
            orthographic = Some(json::camera::Orthographic {
                xmag: ymag,
                ymag,
                zfar: if camera.clip.far.is_finite() { camera.clip.far } else { 1e6 * ymag.max(1.0) },
                znear: camera.clip.near,
                extensions: None,
                extras: None,
            });
            json::camera::Type::Orthographic
        }
    };
    json::Camera {
        name: named(&camera.name),
        orthographic,
        perspective,
        type_: Valid(type_),
        extensions: None,
        extras: cuts_nothing.then(|| RawValue::from_string(r#"{"clips":false}"#.into()).ok()).flatten(),
    }
}

fn light_json(light: &PunctualLight) -> Light {
    let (type_, spot) = match light.kind {
        PunctualKind::Point => (khr_lights_punctual::Type::Point, None),
        PunctualKind::Directional => (khr_lights_punctual::Type::Directional, None),
        PunctualKind::Spot { inner, outer } => {
            let spot = Spot { inner_cone_angle: inner, outer_cone_angle: outer };
            (khr_lights_punctual::Type::Spot, Some(spot))
        }
    };
    // Colours are from 0 to 1, and the product keeps its bits: the rest is a power of two.
    let most = light.intensity.max_element();
    let strength = if most > 0.0 { libm::exp2f(libm::ceilf(libm::log2f(most))) } else { 1.0 };
    let strength = if strength < most { 2.0 * strength } else { strength };
    Light {
        color: (light.intensity / strength).into(),
        extensions: None,
        extras: None,
        intensity: strength,
        name: named(&light.name),
        range: None,
        spot,
        type_: Valid(type_),
    }
}
