//! The node hierarchy of the default scene, with what its nodes carry: objects, cameras, and punctual lights (`lights`).

use super::document::lookup;
use super::{Importer, NodeId, Parsed};
use crate::scene::{Camera, ClipPlanes, Node, Object, Projection, Transform};
use glam::{DAffine3, DMat4, Quat, Vec3};
use gltf::json;
use gltf::json::validation::Checked;
use std::f32::consts::PI;

/// The extension that hides nodes with all below them.
pub(super) const VISIBILITY: &str = "KHR_node_visibility";

/// Deeper hierarchies are a mistake; resolving a node's transform takes a step for each level.
const MAX_DEPTH: usize = 4096;

/// A node that waits to be read.
#[derive(Clone, Copy)]
struct Pending {
    json: usize,
    parent: Option<NodeId>,
    depth: usize,
    dynamic: bool,
    /// Whether it or a node above it is.
    hidden: bool,
}

impl Importer<'_> {
    /// Reads the nodes of the default scene (the first one, or all roots, where there is none), parents first. What is below a node
    /// that is broken is left out with it.
    pub(super) fn read_nodes(&mut self) -> Parsed<()> {
        let root = &self.document.root;
        if root.scenes.len() > 1 {
            self.scene
                .warn(format!("the file has {} scenes: only the default one is loaded", root.scenes.len()));
        }
        let roots = self.roots()?.into_iter().rev();
        let pending = |json| Pending { json, parent: None, depth: 0, dynamic: false, hidden: false };
        let mut stack: Vec<Pending> = roots.map(pending).collect();
        while let Some(pending) = stack.pop() {
            let Pending { json: index, depth, .. } = pending;
            let read = self.node(pending);
            let Some((node, below)) = self.or_without("node", || index.to_string(), read)? else { continue };
            let json = &root.nodes[index];
            self.contents(json, node, below.dynamic, below.hidden)?;
            for child in json.children.iter().flatten().rev() {
                stack.push(Pending { json: child.value(), parent: Some(node), depth: depth + 1, ..below });
            }
        }
        Ok(())
    }

    /// The nodes at the top of what is loaded.
    fn roots(&mut self) -> Parsed<Vec<usize>> {
        let root = &self.document.root;
        let scene = root.scene.map(|s| lookup(&root.scenes, s.value(), "scene"));
        let scene = match scene {
            Some(scene) => self.or_without("default scene", || "of the file".into(), scene)?,
            None => None,
        };
        if let Some(scene) = scene.or(root.scenes.first()) {
            return Ok(scene.nodes.iter().map(|n| n.value()).collect());
        }
        let mut is_root = vec![true; root.nodes.len()];
        for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
            if let Some(flag) = is_root.get_mut(child.value()) {
                *flag = false;
            }
        }
        Ok((0..root.nodes.len()).filter(|&i| is_root[i]).collect())
    }

    /// Reads a node itself; with what holds for all below it.
    fn node(&mut self, pending: Pending) -> Parsed<(NodeId, Pending)> {
        let Pending { json: index, parent, depth, .. } = pending;
        let json = lookup(&self.document.root.nodes, index, "node")?;
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
        let node = (self.scene.nodes.len() - 1).into();
        self.nodes[index] = Some(node);
        let dynamic = pending.dynamic || has_extra(json, "dynamic");
        let visible =
            json.extensions.as_ref().and_then(|e| e.others.get(VISIBILITY)?.get("visible")?.as_bool());
        let hidden = pending.hidden || visible == Some(false);
        Ok((node, Pending { dynamic, hidden, ..pending }))
    }

    /// What a node carries. Where it is hidden, that is a camera at most.
    fn contents(&mut self, json: &json::Node, node: NodeId, dynamic: bool, hidden: bool) -> Parsed<()> {
        let root = &self.document.root;
        for name in json.extensions.iter().flat_map(|e| e.others.keys()) {
            self.meet_extension(name);
        }
        if let Some(index) = json.mesh.filter(|_| !hidden) {
            self.mesh_objects(json, index.value(), node, dynamic)?;
        }
        if let Some(index) = json.camera {
            let camera = lookup(&root.cameras, index.value(), "camera");
            if let Some(camera) = self.or_without("camera", || index.value().to_string(), camera)? {
                self.camera(camera, node);
            }
        }
        if !hidden {
            self.read_light(json, node)?;
        }
        Ok(())
    }

    fn camera(&mut self, camera: &json::Camera, node: NodeId) {
        let name = camera.name.clone().filter(|n| !n.is_empty());
        let name = name.unwrap_or_else(|| self.scene.nodes[node].name.clone());
        match projection(camera) {
            Some(projection) => {
                let mut clip = clip_planes(camera);
                if !clip.are_possible() {
                    let ClipPlanes { near, far } = clip;
                    self.scene.warn(format!(
                        "camera `{name}` has an impossible near plane at {near} m and far plane at {far} m: it cuts nothing off"
                    ));
                    clip = ClipPlanes::NONE;
                }
                self.scene.cameras.push(Camera { name, node, projection, clip });
            }
            None => self.scene.warn(format!("camera `{name}` has an impossible view and is left out")),
        }
    }

    /// The objects of a node with a mesh: one, or as many as there are instances.
    fn mesh_objects(&mut self, json: &json::Node, index: usize, node: NodeId, dynamic: bool) -> Parsed<()> {
        let read = self.mesh(index);
        let Some(mesh) = self.or_without("mesh", || index.to_string(), read)?.flatten() else {
            return Ok(());
        };
        let own = self.scene.nodes[node].name.clone();
        let name = if own.is_empty() { self.scene.meshes[mesh].name.clone() } else { own };
        let weights = self.morph_weights(json, index, mesh);
        let weights = self.or_without("morph weights", || format!("of `{name}`"), weights)?;
        let targets = self.scene.meshes[mesh].morph_targets.len();
        let weights = weights.unwrap_or_else(|| vec![0.0; targets]);
        let Some(places) = self.instances(json)? else {
            self.account(1, mesh)?;
            self.object(name, node, mesh, dynamic);
            self.scene.nodes[node].morph_weights = weights;
            if let Some(skin) = json.skin {
                self.skinned.push((self.scene.objects.len() - 1, skin.value()));
            }
            return Ok(());
        };
        if json.skin.is_some() {
            self.scene.warn("skins of instanced meshes are left out: they are shown at rest".into());
        }
        self.account(places.len(), mesh)?;
        for (i, local) in places.into_iter().enumerate() {
            let (name, morph_weights) = (format!("{name} {i}"), weights.clone());
            let transfer = self.scene.nodes[node].transfer;
            let node = Node { name: name.clone(), parent: Some(node), local, morph_weights, transfer };
            self.scene.nodes.push(node);
            self.object(name, (self.scene.nodes.len() - 1).into(), mesh, dynamic);
        }
        Ok(())
    }

    fn object(&mut self, name: String, node: NodeId, mesh: usize, dynamic: bool) {
        self.scene.objects.push(Object { name, node, mesh, dynamic, removed: false, skin: None });
    }
}

/// Whether a node's extras say so.
fn has_extra(json: &json::Node, name: &str) -> bool {
    flag(&json.extras, name).unwrap_or(false)
}

fn flag(extras: &json::Extras, name: &str) -> Option<bool> {
    let value = json::deserialize::from_str::<json::Value>(extras.as_ref()?.get()).ok()?;
    value.get(name)?.as_bool()
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
    // What is of length 1 but for rounding keeps its bits, so that what is written and read again is the same.
    let is_unit = (length - 1.0).abs() <= f64::from(f32::EPSILON);
    let rotation = if is_unit { rotation } else { rotation.as_dquat().normalize().as_quat() };
    Ok(Transform::Parts { translation, rotation, scale })
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

/// What a camera cuts off; nothing, if its extras say that its planes are there for the format alone.
fn clip_planes(json: &json::Camera) -> ClipPlanes {
    if flag(&json.extras, "clips") == Some(false) {
        return ClipPlanes::NONE;
    }
    let planes = match (&json.perspective, &json.orthographic) {
        (Some(camera), _) => Some((camera.znear, camera.zfar.unwrap_or(f32::INFINITY))),
        (None, camera) => camera.as_ref().map(|camera| (camera.znear, camera.zfar)),
    };
    planes.map_or(ClipPlanes::NONE, |(near, far)| ClipPlanes { near, far })
}
