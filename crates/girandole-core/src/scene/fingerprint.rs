//! What a scene holds, as a number: pictures keep it, so that parts of one picture or sequence are told from
//! those of another.
//!
//! Contents count, and neither names nor files nor what was removed: a scene that was edited has the fingerprint
//! of one that is loaded with the same edits. It tells mistakes apart, and is no defence against malice.

use super::{Camera, Environment, Material, MaterialId, Mesh, NodeId, PunctualLight, Scene, Skin, Texture};
use crate::parallel;
use bytemuck::NoUninit;
use glam::DAffine3;
use std::collections::BTreeSet;
use std::fmt::{self, Debug, Write};
use xxhash_rust::xxh3::Xxh3;

/// A number of 128 bits that equal contents have in common, the same on every machine; printed as 32 hexadecimal
/// digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Fingerprint(u128);

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

/// A fingerprint in the making.
#[derive(Default)]
struct Sum(Xxh3);

impl Sum {
    fn number(&mut self, number: u64) {
        self.0.update(&number.to_le_bytes());
    }

    /// Items without padding, and how many there are.
    fn items<T: NoUninit>(&mut self, items: &[T]) {
        self.number(items.len() as u64);
        self.0.update(bytemuck::cast_slice(items));
    }

    /// Whatever fields it has, now or later.
    fn record(&mut self, record: &impl Debug) {
        // Nothing of this fails.
        let _ = write!(self, "{record:?};");
    }

    fn place(&mut self, place: &DAffine3) {
        // Minus zero is zero.
        self.items(&place.to_cols_array().map(|x| (x + 0.0).to_bits()));
    }

    fn end(&self) -> Fingerprint {
        Fingerprint(self.0.digest128())
    }
}

impl Write for Sum {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

impl Scene {
    /// Of what is there: shapes, materials, textures, lamps, the environment, and all motion; not of where it is
    /// at the moment.
    pub fn content(&self) -> Fingerprint {
        let meshes: BTreeSet<usize> = self.placed_objects().map(|(_, o)| o.mesh).collect();
        let meshes: Vec<usize> = meshes.into_iter().collect();
        let of_meshes = parallel::map(&meshes, |&mesh| of_mesh(&self.meshes[mesh]));
        let triangles = meshes.iter().flat_map(|&mesh| &self.meshes[mesh].triangles);
        let materials: BTreeSet<MaterialId> = triangles.map(|t| t.material).collect();
        let materials = materials.iter().filter_map(|&m| Some((m, self.materials.get(m.index())?)));
        let materials: Vec<(MaterialId, &Material)> = materials.collect();
        let textures: BTreeSet<u32> =
            materials.iter().flat_map(|(_, m)| m.textures().map(|t| t.texture)).collect();
        let textures: Vec<u32> = textures.into_iter().collect();
        let of_textures =
            parallel::map(&textures, |&texture| self.textures.get(texture as usize).map(of_texture));

        let mut sum = Sum::default();
        sum.record(&(meshes, of_meshes, textures, of_textures));
        for (index, material) in materials {
            sum.record(&(index, Material { name: String::new(), ..material.clone() }));
        }
        for (_, object) in self.placed_objects() {
            let inverse_binds = |skin: &Skin| skin.joints.iter().map(|j| j.inverse_bind).collect::<Vec<_>>();
            sum.record(&(object.mesh, object.skin.and_then(|s| self.skins.get(s)).map(inverse_binds)));
        }
        for light in &self.lights {
            sum.record(&PunctualLight { name: String::new(), node: NodeId(0), ..light.clone() });
        }
        self.animations.iter().for_each(|animation| sum.record(&animation.channels));
        self.clip().iter().for_each(|clip| sum.record(clip));
        self.environment.iter().for_each(|environment| add_environment(&mut sum, environment));
        sum.end()
    }

    /// Of where it is at a moment of its animations, in seconds; without one, as it stands. [`Scene::set_time`]
    /// makes no difference between the two.
    pub fn placement(&self, seconds: Option<f64>) -> Fingerprint {
        let poses = seconds.map_or(Vec::new(), |seconds| self.poses(seconds));
        let places = self.world_from_posed_nodes(&poses);
        let posed_weights = |node: NodeId| {
            let pose = poses.binary_search_by_key(&node, |pose| pose.node).ok()?;
            poses[pose].morph_weights.as_ref()
        };
        let mut sum = Sum::default();
        for (_, object) in self.placed_objects() {
            sum.place(&places[object.node.index()]);
            sum.items(posed_weights(object.node).unwrap_or(&self.nodes[object.node].morph_weights));
            let joints = object.skin.and_then(|s| self.skins.get(s)).into_iter().flat_map(|s| &s.joints);
            joints.for_each(|joint| sum.place(&places[joint.node.index()]));
        }
        self.lights.iter().for_each(|light| sum.place(&places[light.node.index()]));
        sum.end()
    }

    /// Of a camera at such a moment.
    pub fn camera_placement(&self, camera: &Camera, seconds: Option<f64>) -> Fingerprint {
        let poses = seconds.map_or(Vec::new(), |seconds| self.poses(seconds));
        let mut sum = Sum::default();
        sum.place(&self.world_from_posed_nodes(&poses)[camera.node.index()]);
        sum.record(&Camera { name: String::new(), node: NodeId(0), ..camera.clone() });
        sum.end()
    }
}

fn of_mesh(mesh: &Mesh) -> Fingerprint {
    let mut sum = Sum::default();
    sum.items(&mesh.positions);
    sum.items(&mesh.normals);
    sum.items(&mesh.tangents);
    sum.items(&mesh.uvs);
    sum.items(&mesh.colors);
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.vertices;
        sum.items(&[a, b, c, triangle.material.0]);
    }
    for weight in &mesh.joint_weights {
        sum.items(&[weight.joint, weight.weight.to_bits()]);
    }
    for target in &mesh.morph_targets {
        sum.items(&target.positions);
        sum.items(&target.normals);
    }
    sum.record(&mesh.flat);
    sum.end()
}

fn of_texture(texture: &Texture) -> Fingerprint {
    let mut sum = Sum::default();
    sum.items(&texture.texels);
    let Texture { name: _, width, height, texels: _, color_space, wrap, filter } = texture;
    sum.record(&(width, height, color_space, wrap, filter));
    sum.end()
}

fn add_environment(sum: &mut Sum, environment: &Environment) {
    let Environment { map, strength, rotation, visible } = environment;
    sum.items(&map.image().pixels);
    sum.record(&(map.image().width, map.disc(), strength, rotation, visible));
}
