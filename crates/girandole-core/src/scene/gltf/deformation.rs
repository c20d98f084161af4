//! What deforms meshes: morph targets, and joints with their weights.

use super::accessor::Accessor;
use super::document::lookup;
use super::{Importer, Parsed, budget};
use crate::scene::{Joint, JointWeight, Mesh, MorphTarget, Skin};
use glam::{DAffine3, DMat4, Vec3};
use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use std::collections::BTreeMap;

/// Joints that hold a vertex, in sets of four; no skin needs more.
const MAX_JOINT_SETS: u32 = 4;

impl<'d> Importer<'d> {
    /// Reads what deforms a primitive, of `count` vertices, of which these are used. The mesh does not have them yet. Where that is
    /// broken, the primitive stays as it is at rest.
    pub(super) fn deformation(
        &mut self,
        json: &Primitive,
        sources: &[u32],
        count: usize,
        mesh: &mut Mesh,
    ) -> Parsed<()> {
        let first = mesh.positions.len();
        let read = self.read_deformation(json, sources, count, mesh);
        let name =
            || if mesh.name.is_empty() { "of a mesh".into() } else { format!("of mesh `{}`", mesh.name) };
        if self.or_without("deformation", name, read)?.is_some() {
            return Ok(());
        }
        for list in mesh.morph_targets.iter_mut().flat_map(|t| [&mut t.positions, &mut t.normals]) {
            list.truncate(first);
            if !list.is_empty() {
                list.resize(first + sources.len(), Vec3::ZERO);
            }
        }
        if let Some(each) = mesh.joint_weights.len().checked_div(first) {
            mesh.joint_weights.truncate(each * first);
            mesh.joint_weights.resize(each * (first + sources.len()), JointWeight::default());
        } else {
            mesh.morph_targets.clear();
            mesh.joint_weights.clear();
        }
        Ok(())
    }

    fn read_deformation(
        &mut self,
        json: &Primitive,
        sources: &[u32],
        count: usize,
        mesh: &mut Mesh,
    ) -> Parsed<()> {
        let targets = json.targets.as_deref().unwrap_or_default();
        let first = mesh.positions.len();
        if first == 0 {
            mesh.morph_targets = vec![MorphTarget::default(); targets.len()];
        }
        if targets.len() != mesh.morph_targets.len() {
            return Err(format!(
                "it has {} morph targets and a primitive before it {}; export it again",
                targets.len(),
                mesh.morph_targets.len()
            ));
        }
        self.document.budget.take(targets.len().saturating_mul(sources.len()), budget::MORPHED_VERTEX)?;
        for (index, target) in targets.iter().enumerate() {
            let read = |accessor: Option<usize>, list: &mut Vec<Vec3>, what: &str| -> Parsed<()> {
                if accessor.is_some() || !list.is_empty() {
                    list.resize(first, Vec3::ZERO);
                    list.extend(self.shifts(accessor, sources, count, what)?);
                }
                Ok(())
            };
            let MorphTarget { positions, normals } = &mut mesh.morph_targets[index];
            read(target.positions.as_ref().map(|a| a.value()), positions, "positions")
                .and_then(|()| read(target.normals.as_ref().map(|a| a.value()), normals, "normals"))
                .map_err(|e| format!("{e} (morph target {index})"))?;
            if target.tangents.is_some() {
                self.scene.warn(
                    "tangents of morph targets are left out: normal maps turn with the base shape".into(),
                );
            }
        }
        self.joint_weights(json, sources, count, mesh)
    }

    /// What a morph target adds to each of these vertices.
    fn shifts(
        &self,
        accessor: Option<usize>,
        sources: &[u32],
        count: usize,
        what: &str,
    ) -> Parsed<Vec<Vec3>> {
        let Some(accessor) = accessor else { return Ok(vec![Vec3::ZERO; sources.len()]) };
        let accessor = self.vertex_data(accessor, Type::Vec3, count, what)?;
        let shift = |&source: &u32| {
            let shift = Vec3::from(accessor.get::<3>(source as usize));
            if shift.is_finite() {
                return Ok(shift);
            }
            Err(format!(
                "its vertex {source} has a morph target's {what} that are not finite; export it again"
            ))
        };
        sources.iter().map(shift).collect()
    }

    fn vertex_data(&self, accessor: usize, kind: Type, count: usize, what: &str) -> Parsed<Accessor<'d>> {
        let accessor = Accessor::new(self.document, accessor)?.of(kind, what)?;
        if accessor.count != count {
            return Err(format!(
                "it has {count} positions and {} of another vertex attribute; export it again",
                accessor.count
            ));
        }
        Ok(accessor)
    }

    /// Adds the joints of these vertices to the mesh's, whose vertices all have as many.
    fn joint_weights(
        &mut self,
        json: &Primitive,
        sources: &[u32],
        count: usize,
        mesh: &mut Mesh,
    ) -> Parsed<()> {
        let find = |semantic: Semantic| json.attributes.get(&Checked::Valid(semantic)).map(|a| a.value());
        let mut sets = Vec::new();
        for set in 0.. {
            let (joints, weights) = match (find(Semantic::Joints(set)), find(Semantic::Weights(set))) {
                (None, None) => break,
                (Some(joints), Some(weights)) => (joints, weights),
                _ => return Err(format!("it has JOINTS_{set} or WEIGHTS_{set} alone; export it again")),
            };
            if set == MAX_JOINT_SETS {
                let most = 4 * MAX_JOINT_SETS;
                return Err(format!("it has more than {most} joints a vertex; limit them to fewer"));
            }
            let joints = self.vertex_data(joints, Type::Vec4, count, "joints")?;
            if !matches!(joints.component, ComponentType::U8 | ComponentType::U16) {
                return Err("its joints are not bytes or shorts; export it again".into());
            }
            sets.push((joints, self.vertex_data(weights, Type::Vec4, count, "joint weights")?));
        }
        let held = mesh.joint_weights.len() / mesh.positions.len().max(1);
        let each = held.max(4 * sets.len());
        if each > held {
            let mut wider = vec![JointWeight::default(); each * mesh.positions.len()];
            for (vertex, wider) in wider.chunks_exact_mut(each).enumerate() {
                wider[..held].copy_from_slice(mesh.joint_weights_of(vertex));
            }
            mesh.joint_weights = wider;
        }
        self.document.budget.take(each.saturating_mul(sources.len()), budget::JOINT)?;
        let mut added = Vec::with_capacity(each * sources.len());
        for &source in sources {
            let first = added.len();
            for (joints, weights) in &sets {
                let (joints, weights) = (joints.get::<4>(source as usize), weights.get::<4>(source as usize));
                // What nothing hangs on need not exist.
                let pairs = joints.into_iter().zip(weights);
                added.extend(pairs.map(|(joint, weight)| JointWeight {
                    joint: if weight == 0.0 { 0 } else { joint as u32 },
                    weight,
                }));
            }
            added.resize(first + each, JointWeight::default());
            if !sets.is_empty() {
                self.check_weights(&mut added[first..], source)?;
            }
        }
        mesh.joint_weights.extend(added);
        Ok(())
    }

    fn check_weights(&mut self, joints: &mut [JointWeight], vertex: u32) -> Parsed<()> {
        if !joints.iter().all(|j| j.weight >= 0.0 && j.weight.is_finite()) {
            return Err(format!(
                "its vertex {vertex} has joint weights that are negative or not finite; export it again"
            ));
        }
        if joints.iter().all(|j| j.weight == 0.0) {
            self.scene.warn("vertices without joint weights go with the first joint".into());
            joints[0].weight = 1.0;
        }
        Ok(())
    }

    /// The weights of the morph targets on a node: its own, else the mesh's, else none.
    pub(super) fn morph_weights(&self, node: &json::Node, json_mesh: usize, mesh: usize) -> Parsed<Vec<f32>> {
        let targets = self.scene.meshes[mesh].morph_targets.len();
        let of_mesh = self.document.root.meshes.get(json_mesh).and_then(|m| m.weights.as_ref());
        let Some(weights) = node.weights.as_ref().or(of_mesh) else { return Ok(vec![0.0; targets]) };
        if weights.len() != targets {
            return Err(format!(
                "has {} morph weights for {targets} morph targets; export the file again",
                weights.len()
            ));
        }
        if !weights.iter().all(|w| w.is_finite()) {
            return Err("has a morph weight that is not finite; export the file again".into());
        }
        Ok(weights.clone())
    }

    /// Gives objects the skins that their nodes have. All nodes of the scene are there. Where one is broken, its objects stay at rest.
    pub(super) fn read_skins(&mut self) -> Parsed<()> {
        let mut known = BTreeMap::new();
        for (object, index) in std::mem::take(&mut self.skinned) {
            let skin = match known.get(&index) {
                Some(&skin) => skin,
                None => {
                    let read =
                        lookup(&self.document.root.skins, index, "skin").and_then(|json| self.skin(json));
                    let read = self.or_without("skin", || index.to_string(), read)?;
                    let skin = read.map(|skin| {
                        self.scene.skins.push(skin);
                        self.scene.skins.len() - 1
                    });
                    known.insert(index, skin);
                    skin
                }
            };
            let Some(skin) = skin else { continue };
            let fits = self.fits(object, skin);
            let name = self.scene.objects[object].name.clone();
            if self.or_without("skin", || format!("of `{name}`"), fits)?.is_some() {
                self.scene.objects[object].skin = Some(skin);
            }
        }
        Ok(())
    }

    /// Whether joints of a skin hold all vertices of an object's mesh.
    fn fits(&self, object: usize, skin: usize) -> Parsed<()> {
        let mesh = &self.scene.meshes[self.scene.objects[object].mesh];
        let name = &mesh.name;
        let is_held = |v: usize| mesh.joint_weights_of(v).iter().any(|j| j.weight > 0.0);
        if !(0..mesh.positions.len()).all(is_held) {
            return Err(format!(
                "its mesh `{name}` has a skin and a primitive without joints; export it again"
            ));
        }
        let joints = self.scene.skins[skin].joints.len();
        if let Some(bad) = mesh.joint_weights.iter().find(|j| j.joint as usize >= joints) {
            return Err(format!(
                "a vertex of its mesh `{name}` has joint {} of {joints}; the file is inconsistent, export it again",
                bad.joint
            ));
        }
        Ok(())
    }

    fn skin(&self, json: &json::Skin) -> Parsed<Skin> {
        let matrices = match &json.inverse_bind_matrices {
            Some(index) => {
                let matrices =
                    Accessor::new(self.document, index.value())?.of(Type::Mat4, "inverse bind matrices")?;
                if matrices.component != ComponentType::F32 {
                    return Err("its inverse bind matrices are not floats; export it again".into());
                }
                if matrices.count < json.joints.len() {
                    return Err(format!(
                        "it has {} joints and {} inverse bind matrices; export it again",
                        json.joints.len(),
                        matrices.count
                    ));
                }
                Some(matrices)
            }
            None => None,
        };
        let joint = |(index, node): (usize, usize)| {
            lookup(&self.document.root.nodes, node, "node")?;
            let node = self.nodes[node].ok_or_else(|| {
                format!("its joint {index} is node {node}, which is not in the scene; export it again")
            })?;
            let matrix = matrices
                .as_ref()
                .map_or(DMat4::IDENTITY, |m| DMat4::from_cols_array(&m.get::<16>(index).map(f64::from)));
            if !matrix.is_finite() {
                return Err(format!(
                    "its joint {index} has an inverse bind matrix that is not finite; export it again"
                ));
            }
            Ok(Joint { node, inverse_bind: DAffine3::from_mat4(matrix) })
        };
        let joints = json.joints.iter().map(|node| node.value()).enumerate().map(joint);
        Ok(Skin { name: json.name.clone().unwrap_or_default(), joints: joints.collect::<Parsed<_>>()? })
    }
}
