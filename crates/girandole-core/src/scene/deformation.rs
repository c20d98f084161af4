//! Meshes that bend: morph targets and skins (glTF 2.0, §3.7.2.2 and §3.7.3).
//!
//! A mesh is kept as it is at rest. Where it is *deformed*, each vertex is
//!
//! 1. shifted by its morph targets, times the weights of the object's node;
//! 2. taken to the world by the weighted sum of its joints' matrices (linear blend skinning), world from joint times the inverse
//!    bind matrix. The object's own node does not count then. Without a skin it is the node's matrix alone;
//!
//! in double precision and in the file's order. Normals go with the cofactors of that sum, so that a joint that flattens
//! what it moves leaves them one. A deformed mesh has the same triangles at each moment, even those that have no area for
//! a while, and no patches, which would bend.
//!
//! Worked example: a vertex at (1, 0, 0) that a joint at the origin holds to one half and one turned by 90° about z to the
//! other is at half of (1, 0, 0) + (0, 1, 0), 0.71 m from the origin: linear blending shrinks what it bends.

use super::frame_of_reference::Box3;
use super::hierarchy::WorldFromNode;
use super::motion::Pose;
use super::{MAX_EXTENT, Mesh, NodeId, Object, ObjectId, Scene};
use crate::Result;
use glam::{DAffine3, DMat3, DVec3, Vec3, Vec4};

/// A joint of a [`Skin`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// The node that it goes with.
    pub node: NodeId,
    /// Joint from mesh at rest: the inverse bind matrix.
    pub inverse_bind: DAffine3,
}

/// The joints that bend a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    /// The name, as in the file; may be empty.
    pub name: String,
    /// What [`JointWeight::joint`] counts.
    pub joints: Vec<Joint>,
}

/// How much a joint holds a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointWeight {
    /// Index into [`Skin::joints`].
    pub joint: u32,
    /// From 0 up. What counts is its share of the sum of a vertex's weights, as files round them.
    pub weight: f32,
}

/// What a mesh turns into where its weight is 1.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MorphTarget {
    /// Shift of each vertex, metres; empty where none moves.
    pub positions: Vec<Vec3>,
    /// Difference of each normal; empty where none turns.
    pub normals: Vec<Vec3>,
}

/// A deformed mesh in the world.
pub(super) struct Deformed {
    pub positions: Vec<DVec3>,
    pub normals: Vec<Vec3>,
    /// As in [`Mesh::tangents`].
    pub tangents: Vec<Vec4>,
    /// Whether what is about a vertex is turned inside out.
    pub mirrored: Vec<bool>,
}

/// What deforms an object's mesh at a moment.
struct Rig<'a> {
    mesh: &'a Mesh,
    /// World from mesh at rest, for each joint; without a skin one, the node's.
    matrices: Vec<DAffine3>,
    is_skinned: bool,
    /// Morph targets that count, with their weights.
    targets: Vec<(usize, f64)>,
}

impl<'a> Rig<'a> {
    fn new(scene: &'a Scene, object: &Object, poses: &[Pose], world_from_node: WorldFromNode) -> Self {
        let mesh = &scene.meshes[object.mesh];
        let posed = poses.binary_search_by_key(&object.node, |pose| pose.node).ok();
        let weights = posed.and_then(|i| poses[i].morph_weights.as_deref());
        let weights = weights.unwrap_or(&scene.nodes[object.node].morph_weights);
        let targets = (0..mesh.morph_targets.len()).zip(weights.iter().map(|&w| f64::from(w)));
        let matrices = match object.skin {
            Some(skin) => scene.skins[skin]
                .joints
                .iter()
                .map(|joint| world_from_node(joint.node) * joint.inverse_bind)
                .collect(),
            None => vec![world_from_node(object.node)],
        };
        let targets = targets.filter(|&(_, weight)| weight != 0.0).collect();
        Self { mesh, matrices, is_skinned: object.skin.is_some(), targets }
    }

    /// Joints that hold a vertex, with their weights.
    fn joints(&self, vertex: usize) -> impl Iterator<Item = (usize, f64)> {
        let listed = if self.is_skinned { self.mesh.joint_weights_of(vertex) } else { &[] };
        let whole = (!self.is_skinned).then_some((0, 1.0));
        let listed = listed.iter().filter(|j| j.weight > 0.0);
        whole.into_iter().chain(listed.map(|j| (j.joint as usize, f64::from(j.weight))))
    }

    /// World from mesh about a vertex.
    fn matrix(&self, vertex: usize) -> DAffine3 {
        if !self.is_skinned {
            return self.matrices[0];
        }
        let total: f64 = self.joints(vertex).map(|(_, weight)| weight).sum();
        let mut sum = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
        for (joint, weight) in self.joints(vertex) {
            let (DAffine3 { matrix3, translation }, share) = (self.matrices[joint], weight / total);
            sum.matrix3 += matrix3 * share;
            sum.translation += translation * share;
        }
        sum
    }

    fn morphed(&self, vertex: usize, rest: Vec3, delta: impl Fn(&MorphTarget) -> &[Vec3]) -> DVec3 {
        self.targets.iter().fold(rest.as_dvec3(), |sum, &(target, weight)| {
            let shift = delta(&self.mesh.morph_targets[target]).get(vertex);
            sum + shift.map_or(DVec3::ZERO, |shift| shift.as_dvec3() * weight)
        })
    }

    fn position(&self, vertex: usize, matrix: &DAffine3) -> DVec3 {
        matrix.transform_point3(self.morphed(vertex, self.mesh.positions[vertex], |t| &t.positions))
    }

    fn deform(&self) -> Deformed {
        let mesh = self.mesh;
        let mut result = Deformed { positions: vec![], normals: vec![], tangents: vec![], mirrored: vec![] };
        for vertex in 0..mesh.positions.len() {
            let matrix = self.matrix(vertex);
            let mirrored = matrix.matrix3.determinant() < 0.0;
            let normal = self.morphed(vertex, mesh.normals[vertex], |t| &t.normals);
            let normal = cofactors(matrix.matrix3) * normal * if mirrored { -1.0 } else { 1.0 };
            result.positions.push(self.position(vertex, &matrix));
            result.normals.push(normal.normalize_or_zero().as_vec3());
            result.tangents.extend(mesh.tangents.get(vertex).map(|t| {
                let along = matrix.transform_vector3(t.truncate().as_dvec3());
                along.normalize_or_zero().as_vec3().extend(if mirrored { -t.w } else { t.w })
            }));
            result.mirrored.push(mirrored);
        }
        for triangle in &mesh.triangles {
            let vertices = triangle.vertices.map(|v| v as usize);
            let flat = mesh.flat.partition_point(|range| range.end <= triangle.vertices[0]);
            if mesh.flat.get(flat).is_some_and(|range| range.contains(&triangle.vertices[0])) {
                let [a, b, c] = vertices.map(|v| result.positions[v]);
                let front = (b - a).cross(c - a) * if result.mirrored[vertices[0]] { -1.0 } else { 1.0 };
                if let Some(normal) = front.try_normalize() {
                    vertices.into_iter().for_each(|v| result.normals[v] = normal.as_vec3());
                }
            }
        }
        result
    }

    /// A box that all vertices are in. Shares add up to 1, so a vertex is between where each of its joints alone takes it; and
    /// before that it is in the sum of the boxes of what the joint holds at rest and of all shifts.
    fn reach(&self, extents: &Extents) -> Box3 {
        let none = Box3::EMPTY.with(DVec3::ZERO);
        let shift = self.targets.iter().fold(none, |sum, &(target, weight)| {
            let shifts = extents.shifts[target];
            if shifts.is_empty() { sum } else { sum.plus(shifts.times(weight)) }
        });
        let held = extents.rest.iter().zip(&self.matrices).filter(|(rest, _)| !rest.is_empty());
        let corners = held.flat_map(|(rest, matrix)| {
            rest.plus(shift).corners().map(|corner| matrix.transform_point3(corner))
        });
        corners.fold(Box3::EMPTY, Box3::with)
    }
}

/// What the vertices of a mesh reach over.
struct Extents {
    /// At rest, by the joint that holds them.
    rest: Vec<Box3>,
    /// Of the shifts of each morph target.
    shifts: Vec<Box3>,
}

impl Extents {
    fn new(rig: &Rig) -> Self {
        let mesh = rig.mesh;
        let mut rest = vec![Box3::EMPTY; rig.matrices.len()];
        for (vertex, p) in mesh.positions.iter().enumerate().filter(|(_, p)| p.is_finite()) {
            for (joint, _) in rig.joints(vertex) {
                rest[joint] = rest[joint].with(p.as_dvec3());
            }
        }
        let shifts = mesh
            .morph_targets
            .iter()
            .map(|target| target.positions.iter().fold(Box3::EMPTY, |shifts, p| shifts.with(p.as_dvec3())));
        Self { rest, shifts: shifts.collect() }
    }
}

/// Of a matrix that is not singular, the inverse's transpose times the determinant.
fn cofactors(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

/// Deformation of objects.
impl Scene {
    /// Whether an object's mesh is deformed: it has a skin or morph targets.
    pub fn is_deformed(&self, object: &Object) -> bool {
        object.skin.is_some() || !self.meshes[object.mesh].morph_targets.is_empty()
    }

    /// Sets how much each morph target of the meshes on a node counts; 0 is the mesh at rest, and any number is possible.
    /// What is set is written down as in [`Scene::set_transform`].
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where there is no such node, a weight is not finite, a mesh on the node has
    /// another number of morph targets, or the weights lead farther than 10¹⁵ m away.
    pub fn set_morph_weights(&mut self, node: NodeId, weights: &[f32]) -> Result<()> {
        self.set_poses(vec![Pose { node, local: None, morph_weights: Some(weights.to_vec()) }])
    }

    /// Whether what an object looks like depends on where one of the nodes is that `moves` is true for.
    pub(super) fn is_moved_by(&self, object: &Object, moves: &[bool]) -> bool {
        match object.skin {
            Some(skin) => self.skins[skin].joints.iter().any(|joint| moves[joint.node.index()]),
            None => moves[object.node.index()],
        }
    }

    pub(super) fn deform(&self, object: &Object, world_from_node: WorldFromNode) -> Deformed {
        Rig::new(self, object, &[], world_from_node).deform()
    }

    /// World positions of an object's vertices.
    pub(super) fn world_positions(
        &self,
        object: &Object,
        world_from_node: WorldFromNode,
    ) -> impl Iterator<Item = DVec3> {
        let rig = Rig::new(self, object, &[], world_from_node);
        (0..rig.mesh.positions.len()).map(move |vertex| rig.position(vertex, &rig.matrix(vertex)))
    }

    /// Bounds of an object's finite vertices in the world; all of space where its matrices are not finite.
    pub(super) fn world_bounds(&self, object: &Object, world_from_node: WorldFromNode) -> Box3 {
        if !Rig::new(self, object, &[], world_from_node).matrices.iter().all(|m| m.is_finite()) {
            return Box3 { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY };
        }
        let finite = self.world_positions(object, world_from_node).filter(|p| p.is_finite());
        finite.fold(Box3::EMPTY, Box3::with)
    }

    /// Boxes that hold some objects in these poses of animations, with the objects' indices, but for those that lead too far away.
    pub(super) fn reaches(&self, objects: &[ObjectId], poses: &[Vec<Pose>]) -> Vec<(ObjectId, Box3)> {
        let world_from_nodes = self.world_from_nodes();
        let extents = objects.iter().map(|&object| {
            Extents::new(&Rig::new(self, &self.objects[object], &[], &|node| world_from_nodes[node.index()]))
        });
        let extents: Vec<Extents> = extents.collect();
        let mut reaches = Vec::new();
        for poses in poses.iter().filter(|_| !objects.is_empty()) {
            let world_from_nodes = self.world_from_posed_nodes(poses);
            for (&object, extents) in objects.iter().zip(&extents) {
                let rig =
                    Rig::new(self, &self.objects[object], poses, &|node| world_from_nodes[node.index()]);
                reaches.push((object, rig.reach(extents)));
            }
        }
        reaches.retain(|(_, reach)| reach.is_within(MAX_EXTENT));
        reaches
    }
}
