//! An object by itself, with what of its materials counts for transfer.

use super::{bounds_of, invalid, orthogonal_part};
use crate::Result;
use crate::scene::{Geometry, Material, MaterialId, Mesh, Object, ObjectId, Scene, TextureRef, Transform};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use std::collections::BTreeMap;

/// A scene of one object in transfer space.
pub(super) struct Alone {
    pub scene: Scene,
    /// Transfer space from mesh space where that is not the identity.
    pub stretch: Option<DMat3>,
}

/// An object that is there and is moved as a whole.
pub(super) fn rigid_object(scene: &Scene, id: ObjectId) -> Result<&Object> {
    let Some(object) = scene.objects.get(id.index()).filter(|o| !o.removed) else {
        return invalid(format!("there is no object {} to have transfer; it may have been removed", id.0));
    };
    if scene.is_deformed(object) {
        return invalid(format!(
            "object {} `{}` bends, and transfer is for rigid objects; shade it by shadow maps",
            id.0, object.name
        ));
    }
    Ok(object)
}

impl Alone {
    pub fn new(scene: &Scene, id: ObjectId) -> Result<Self> {
        let object = rigid_object(scene, id)?;
        let mesh = &scene.meshes[object.mesh];
        mesh.check(scene.materials.len())?;
        let linear = scene.world_from_node(object.node).matrix3;
        if !(linear.is_finite() && linear.determinant().abs() > 0.0) {
            return invalid(format!(
                "object {} `{}` is flattened by its transform and cannot have transfer; scale it by other numbers than 0",
                id.0, object.name
            ));
        }
        let stretch = orthogonal_part(linear).is_none().then_some(linear);
        let mut alone = Scene::default();
        let mut materials: BTreeMap<MaterialId, MaterialId> = BTreeMap::new();
        let mut kept = Mesh {
            positions: mesh.positions.clone(),
            normals: mesh.normals.clone(),
            triangles: mesh.triangles.clone(),
            ..Mesh::default()
        };
        for triangle in &mut kept.triangles {
            let next = materials.len().into();
            triangle.material = *materials.entry(triangle.material).or_insert(next);
        }
        let mut used: Vec<(MaterialId, MaterialId)> =
            materials.into_iter().map(|(old, new)| (new, old)).collect();
        used.sort_unstable();
        let mut textures: BTreeMap<u32, u32> = BTreeMap::new();
        for (_, index) in used {
            let material = &scene.materials[index];
            if material.is_transparent() {
                return invalid(format!(
                    "object {} `{}` lets light through and cannot have transfer; shade it by shadow maps",
                    id.0, object.name
                ));
            }
            alone.materials.push(reduced(material, |texture| {
                let next = textures.len() as u32;
                *textures.entry(texture).or_insert(next)
            }));
        }
        let mut used: Vec<(u32, u32)> = textures.into_iter().map(|(old, new)| (new, old)).collect();
        used.sort_unstable();
        alone.textures = used.into_iter().map(|(_, index)| scene.textures[index as usize].clone()).collect();
        if !alone.textures.is_empty() {
            kept.uvs.clone_from(&mesh.uvs);
        }
        if alone.materials.iter().any(|m| m.vertex_colors) {
            kept.colors.clone_from(&mesh.colors);
        }
        let local = DAffine3::from_mat3(stretch.unwrap_or(DMat3::IDENTITY));
        alone.add_object("", kept, Transform::Affine(local));
        Ok(Self { scene: alone, stretch })
    }

    pub fn mesh(&self) -> &Mesh {
        &self.scene.meshes[0]
    }

    pub fn vertex_count(&self) -> usize {
        self.mesh().positions.len()
    }

    /// The box of all vertices of triangles in transfer space, and the radius of a sphere about its centre.
    pub fn bounds(&self) -> ((Vec3, Vec3), f32) {
        let mesh = self.mesh();
        let stretch = self.stretch.unwrap_or(DMat3::IDENTITY);
        let vertices = mesh.triangles.iter().flat_map(|t| t.vertices);
        bounds_of(
            vertices
                .map(|v| stretch * mesh.positions[v as usize].as_dvec3())
                .collect::<Vec<DVec3>>()
                .into_iter(),
        )
    }

    /// Whether all of it reflects red, green and blue alike.
    pub fn is_grey(&self) -> bool {
        let is_grey = |c: Vec3| c.x == c.y && c.y == c.z;
        let texture_is_grey = |texture: &TextureRef| {
            self.scene.textures[texture.texture as usize].texels.iter().all(|[r, g, b, _]| r == g && g == b)
        };
        self.mesh().colors.iter().copied().all(is_grey)
            && self
                .scene
                .materials
                .iter()
                .all(|m| is_grey(m.base_color) && m.base_color_texture.as_ref().is_none_or(texture_is_grey))
    }

    /// Which materials reflect from their back too.
    pub fn is_double_sided(&self) -> Vec<bool> {
        self.scene.materials.iter().map(|m| m.double_sided).collect()
    }

    /// What each material reflects diffusely, where that is the same all over.
    pub fn uniform_albedos(&self, geometry: &Geometry) -> Vec<Option<Vec3>> {
        let mut uniform: Vec<Option<Vec3>> = vec![None; self.scene.materials.len()];
        for (index, triangle) in (0..).zip(&geometry.triangles) {
            let material = &self.scene.materials[triangle.material];
            let colored = material.vertex_colors && !geometry.colors.is_empty();
            if uniform[triangle.material.index()].is_none()
                && !colored
                && material.textures().next().is_none()
            {
                let at = glam::Vec2::splat(1.0 / 3.0);
                let surface = geometry.surface(&self.scene, index, at, geometry.normal(index));
                uniform[triangle.material.index()] = Some(surface.albedo);
            }
        }
        uniform
    }
}

/// A material without what does not count for where its surface is and what it reflects diffusely.
fn reduced(material: &Material, mut texture: impl FnMut(u32) -> u32) -> Material {
    let mut keep = |reference: Option<TextureRef>, counts: bool| {
        reference.filter(|_| counts).map(|r| TextureRef { texture: texture(r.texture), ..r })
    };
    let reflects = !material.unlit;
    Material {
        name: String::new(),
        base_color: material.base_color,
        vertex_colors: material.vertex_colors && reflects,
        alpha: material.alpha,
        base_color_texture: keep(material.base_color_texture, reflects || material.alpha_cutoff.is_some()),
        metallic: material.metallic,
        metallic_roughness_texture: keep(material.metallic_roughness_texture, reflects),
        specular: material.specular,
        specular_texture: keep(material.specular_texture, reflects),
        specular_color: material.specular_color,
        specular_color_texture: keep(material.specular_color_texture, reflects),
        alpha_cutoff: material.alpha_cutoff,
        double_sided: material.double_sided,
        unlit: material.unlit,
        ..Material::default()
    }
}
