//! Meshes: primitives of all triangle topologies, merged into one mesh.

use super::accessor::Accessor;
use super::document::{lookup, shorten};
use super::texture::MAX_COORDINATE;
use super::{Importer, MAX_TRIANGLES, MAX_VERTICES, Parsed, budget, tangents};
use crate::scene::repair::{drop_duplicates, smooth_normals, turn_normals};
use crate::scene::{MaterialId, Mesh, MeshTriangle, TextureRef};
use glam::{Vec2, Vec3, Vec4};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use rustc_hash::FxHashMap;

/// The triangles of one primitive with the vertices that they use.
#[derive(Default)]
pub(super) struct Part {
    /// The file's number of each vertex.
    sources: Vec<u32>,
    pub positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    tangents: Vec<Vec4>,
    pub uvs: Vec<[Vec2; 2]>,
    colors: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// The accessors of one primitive.
struct Attributes<'d> {
    positions: Accessor<'d>,
    normals: Option<Accessor<'d>>,
    tangents: Option<Accessor<'d>>,
    uvs: [Option<Accessor<'d>>; 2],
    colors: Option<Accessor<'d>>,
}

impl<'d> Importer<'d> {
    /// The scene's mesh for a glTF mesh, read when it is first asked for. `None` if nothing of it can be drawn.
    pub(super) fn mesh(&mut self, index: usize) -> Parsed<Option<usize>> {
        if let Some(&known) = self.meshes.get(&index) {
            return Ok(known);
        }
        let json = lookup(&self.document.root.meshes, index, "mesh")?;
        let mut mesh = Mesh { name: json.name.clone().unwrap_or_default(), ..Mesh::default() };
        for (i, primitive) in json.primitives.iter().enumerate() {
            let read = self.primitive(primitive, &mut mesh);
            let name = || match &json.name {
                Some(name) => format!("{i} of mesh `{name}`"),
                None => format!("{i} of mesh {index}"),
            };
            self.or_without("primitive", name, read)?;
        }
        if drop_duplicates(&mut mesh) > 0 {
            self.scene.warn("triangles that the file lists twice are kept once".into());
        }
        let result = if mesh.triangles.is_empty() {
            None
        } else {
            self.scene.meshes.push(mesh);
            Some(self.scene.meshes.len() - 1)
        };
        self.meshes.insert(index, result);
        Ok(result)
    }

    /// Takes so many objects that show a mesh out of what a scene may have.
    pub(super) fn account(&mut self, objects: usize, mesh: usize) -> Parsed<()> {
        let Mesh { triangles, positions, .. } = &self.scene.meshes[mesh];
        let [triangles, vertices] = [triangles.len(), positions.len()].map(|n| objects.saturating_mul(n));
        let budget = &self.document.budget;
        budget.take_objects(objects, triangles, vertices)?;
        self.triangles = self.triangles.saturating_add(triangles);
        self.vertices = self.vertices.saturating_add(vertices);
        if self.triangles > MAX_TRIANGLES || self.vertices > MAX_VERTICES {
            return Err(budget.refuse(format!(
                "it has more than {MAX_TRIANGLES} triangles or {MAX_VERTICES} vertices, instances counted; simplify \
                 it or take parts away"
            )));
        }
        Ok(())
    }

    fn primitive(&mut self, json: &Primitive, mesh: &mut Mesh) -> Parsed<()> {
        let Checked::Valid(mode) = json.mode else {
            return Err("it has a primitive of unknown topology; export it again".into());
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.scene.warn("points and lines are not supported and left out".into());
            return Ok(());
        }
        for name in json.extensions.iter().flat_map(|e| e.others.keys()) {
            self.meet_extension(name);
        }
        let Some(attributes) = self.attributes(json)? else { return Ok(()) };
        let material = json.material.map(|m| m.value());
        let known = material
            .map(|m| lookup(&self.document.root.materials, m, "material").map(|_| MaterialId::from(m)));
        let material = match known {
            Some(known) => {
                self.or_without("material", || format!("{}", material.unwrap_or_default()), known)?
            }
            None => None,
        };
        let material = material.unwrap_or_else(|| self.default_material());
        let corners = self.corners(json, mode, attributes.positions.count)?;
        if corners.is_empty() {
            return Ok(());
        }
        // Vertices that no triangle uses are few, as a rule.
        let most = if attributes.normals.is_none() { usize::MAX } else { attributes.positions.count };
        let vertices = most.min(3 * corners.len());
        self.document.budget.take(vertices, budget::MESH_VERTEX)?;
        let mut part = self.part(&attributes, &corners)?;
        if json.targets.is_none() && turn_normals(&part.positions, &mut part.normals, &part.triangles) {
            part.tangents.iter_mut().for_each(|tangent| tangent.w = -tangent.w);
            self.scene.warn(format!(
                "normals of mesh `{}` point away from the fronts of its triangles and are turned around; turn them in the file",
                mesh.name
            ));
        }
        let normal_map = self.scene.materials[material].normal_texture;
        match normal_map {
            Some(map) => self.tangents(&attributes, &mut part, map.texture),
            None => part.tangents.clear(),
        }
        let colors = attributes.colors.as_ref().filter(|colors| colors.kind == Type::Vec4);
        let alpha = |colors: &Accessor, &vertex: &u32| {
            let alpha = colors.get::<4>(vertex as usize)[3];
            if alpha.is_nan() { 1.0 } else { alpha.clamp(0.0, 1.0) }
        };
        let alphas = colors.map(|colors| part.sources.iter().map(|v| alpha(colors, v)).collect());
        let alphas: Vec<f32> = alphas.unwrap_or_default();
        let material = self.faded(material, &mut part, &alphas)?;
        self.scene.materials[material].vertex_colors |= !part.colors.is_empty();
        self.document.budget.take(part.positions.len().saturating_sub(vertices), budget::MESH_VERTEX)?;
        self.deformation(json, &part.sources, attributes.positions.count, mesh)?;
        if attributes.normals.is_none() {
            let first = mesh.positions.len() as u32;
            mesh.flat.push(first..first + part.positions.len() as u32);
        }
        append(mesh, part, material);
        Ok(())
    }

    /// `None` for a primitive without positions.
    fn attributes(&mut self, json: &Primitive) -> Parsed<Option<Attributes<'d>>> {
        for semantic in json.attributes.keys() {
            match semantic {
                Checked::Valid(Semantic::Colors(1..)) => {
                    self.scene.warn("vertex colours beyond set 0 are left out".into());
                }
                Checked::Invalid => self.scene.warn("vertex attributes of unknown names are left out".into()),
                _ => {}
            }
        }
        let find = |semantic: Semantic| json.attributes.get(&Checked::Valid(semantic)).map(|a| a.value());
        let Some(positions) = find(Semantic::Positions) else {
            self.scene.warn("primitives without positions are left out".into());
            return Ok(None);
        };
        let read = |semantic: Option<usize>, kind: Type, what: &str| -> Parsed<Option<Accessor<'d>>> {
            semantic.map(|a| Accessor::new(self.document, a)?.of(kind, what)).transpose()
        };
        let attributes = Attributes {
            positions: Accessor::new(self.document, positions)?.of(Type::Vec3, "positions")?,
            normals: read(find(Semantic::Normals), Type::Vec3, "normals")?,
            tangents: read(find(Semantic::Tangents), Type::Vec4, "tangents")?,
            uvs: [
                read(find(Semantic::TexCoords(0)), Type::Vec2, "texture coordinates")?,
                read(find(Semantic::TexCoords(1)), Type::Vec2, "texture coordinates")?,
            ],
            colors: match find(Semantic::Colors(0)) {
                Some(index) => {
                    let colors = Accessor::new(self.document, index)?;
                    let kind = if colors.kind == Type::Vec4 { Type::Vec4 } else { Type::Vec3 };
                    Some(colors.of(kind, "colours")?)
                }
                None => None,
            },
        };
        let count = attributes.positions.count;
        let [uv0, uv1] = &attributes.uvs;
        let Attributes { normals, tangents, colors, .. } = &attributes;
        for other in [normals, tangents, uv0, uv1, colors].into_iter().flatten() {
            if other.count != count {
                return Err(format!(
                    "it has {count} positions and {} of another vertex attribute; export it again",
                    other.count
                ));
            }
        }
        Ok(Some(attributes))
    }

    /// The vertex indices of each triangle, all below `count`.
    fn corners(&mut self, json: &Primitive, mode: Mode, count: usize) -> Parsed<Vec<[u32; 3]>> {
        let indices = match json.indices {
            None => None,
            Some(index) => {
                let accessor = Accessor::new(self.document, index.value())?.of(Type::Scalar, "indices")?;
                if !matches!(accessor.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
                {
                    return Err("its indices are not unsigned integers; export it again".into());
                }
                Some(accessor)
            }
        };
        let length = indices.as_ref().map_or(count, |i| i.count);
        let triangles = if mode == Mode::Triangles { length / 3 } else { length.saturating_sub(2) };
        if mode == Mode::Triangles && length % 3 != 0 {
            self.scene
                .warn("triangle lists whose length is no multiple of three lose their last corners".into());
        }
        self.document.budget.take(triangles, budget::MESH_TRIANGLE)?;
        let mut result = Vec::with_capacity(triangles);
        for i in 0..triangles {
            let corners = match mode {
                Mode::TriangleStrip => [i, i + 1 + i % 2, i + 2 - i % 2],
                Mode::TriangleFan => [i + 1, i + 2, 0],
                _ => [3 * i, 3 * i + 1, 3 * i + 2],
            };
            let corners = corners.map(|c| indices.as_ref().map_or(c as u32, |a| a.index(c)));
            if let Some(bad) = corners.iter().find(|&&c| c as usize >= count) {
                return Err(format!(
                    "a triangle has vertex {bad} of {count}; the file is cut off or was edited, export it again"
                ));
            }
            // Strips are joined by triangles that go back and forth.
            let [a, b, c] = corners;
            if mode == Mode::Triangles || (a != b && b != c && c != a) {
                result.push(corners);
            }
        }
        Ok(result)
    }

    /// Reads the vertices that the triangles use. Without normals, each triangle is flat and has its own.
    fn part(&mut self, attributes: &Attributes<'_>, corners: &[[u32; 3]]) -> Parsed<Part> {
        let mut part = Part::default();
        let flat = attributes.normals.is_none();
        let mut known: FxHashMap<u32, u32> = FxHashMap::default();
        for triangle in corners {
            let mut new = [0; 3];
            for (slot, &vertex) in new.iter_mut().zip(triangle) {
                let next = part.positions.len() as u32;
                *slot = if flat { next } else { *known.entry(vertex).or_insert(next) };
                if *slot == next {
                    part.push(attributes, vertex as usize)?;
                }
            }
            if flat {
                let [a, b, c] = new.map(|v| part.positions[v as usize].as_dvec3());
                let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
                part.normals.extend([normal; 3]);
            }
            part.triangles.push(new);
        }
        // Unusable normals are computed; those of flat triangles without area do not matter.
        if !flat && part.normals.contains(&Vec3::ZERO) {
            self.scene.warn("vertex normals without a direction are replaced by computed ones".into());
            let triangles = part.triangles.iter().copied();
            let smooth = smooth_normals(&part.positions, triangles);
            for (normal, smooth) in part.normals.iter_mut().zip(smooth) {
                if *normal == Vec3::ZERO {
                    *normal = smooth;
                }
            }
        }
        Ok(part)
    }

    /// The part's tangents: the file's (which count only with its normals), or generated, splitting vertices.
    fn tangents(&mut self, attributes: &Attributes<'_>, part: &mut Part, texture: TextureRef) {
        if !part.tangents.is_empty() {
            return;
        }
        if attributes.uvs[texture.uv_set as usize & 1].is_none() {
            self.scene.warn("normal maps on meshes without texture coordinates are left out".into());
            part.tangents = vec![Vec4::ZERO; part.positions.len()];
            return;
        }
        let generated = tangents::generate(
            &part.positions,
            &part.normals,
            &part.uvs,
            texture.uv_set as usize & 1,
            texture.transform,
            &part.triangles,
        );
        let mut split = Part::default();
        let mut known: FxHashMap<(u32, [u32; 4]), u32> = FxHashMap::default();
        for (triangle, tangents) in part.triangles.iter().zip(generated) {
            let mut new = [0; 3];
            for ((slot, &vertex), tangent) in new.iter_mut().zip(triangle).zip(tangents) {
                let next = split.positions.len() as u32;
                *slot = *known.entry((vertex, tangent.to_array().map(f32::to_bits))).or_insert(next);
                if *slot == next {
                    split.sources.push(part.sources[vertex as usize]);
                    split.positions.push(part.positions[vertex as usize]);
                    split.normals.push(part.normals[vertex as usize]);
                    split.uvs.push(part.uvs[vertex as usize]);
                    split.colors.extend(part.colors.get(vertex as usize));
                    split.tangents.push(tangent);
                }
            }
            split.triangles.push(new);
        }
        *part = split;
    }
}

impl Part {
    /// Reads one vertex.
    fn push(&mut self, attributes: &Attributes<'_>, vertex: usize) -> Parsed<()> {
        let position = Vec3::from(attributes.positions.get::<3>(vertex));
        if !position.is_finite() {
            return Err(format!(
                "its vertex {vertex} is at {}; export it again",
                shorten(&position.to_string())
            ));
        }
        self.sources.push(vertex as u32);
        self.positions.push(position);
        if let Some(normals) = &attributes.normals {
            let normal = Vec3::from(normals.get::<3>(vertex)).as_dvec3();
            self.normals.push(normal.normalize_or_zero().as_vec3());
            if let Some(tangents) = &attributes.tangents {
                let tangent = Vec4::from(tangents.get::<4>(vertex));
                let direction = tangent.truncate().as_dvec3().normalize_or_zero().as_vec3();
                self.tangents.push(direction.extend(if tangent.w < 0.0 { -1.0 } else { 1.0 }));
            }
        }
        let mut uv = [Vec2::ZERO; 2];
        for (uv, accessor) in uv.iter_mut().zip(&attributes.uvs) {
            let Some(accessor) = accessor else { continue };
            *uv = Vec2::from(accessor.get::<2>(vertex));
            if !uv.is_finite() || uv.abs().max_element() > MAX_COORDINATE {
                return Err(format!("its vertex {vertex} has texture coordinates {uv}; export it again"));
            }
        }
        if attributes.uvs.iter().any(Option::is_some) {
            self.uvs.push(uv);
        }
        if let Some(colors) = &attributes.colors {
            let color = Vec3::from(colors.get::<3>(vertex));
            if !color.is_finite() {
                return Err(format!("its vertex {vertex} has the colour {color}; export it again"));
            }
            self.colors.push(color.clamp(Vec3::ZERO, Vec3::ONE));
        }
        Ok(())
    }
}

/// Adds a part to a mesh, whose optional vertex arrays are as long as its positions or empty.
fn append(mesh: &mut Mesh, part: Part, material: MaterialId) {
    let first = mesh.positions.len();
    let count = first + part.positions.len();
    mesh.positions.extend(part.positions);
    mesh.normals.extend(part.normals);
    if !part.uvs.is_empty() || !mesh.uvs.is_empty() {
        mesh.uvs.resize(first, [Vec2::ZERO; 2]);
        mesh.uvs.extend(part.uvs);
        mesh.uvs.resize(count, [Vec2::ZERO; 2]);
    }
    if !part.tangents.is_empty() || !mesh.tangents.is_empty() {
        mesh.tangents.resize(first, Vec4::ZERO);
        mesh.tangents.extend(part.tangents);
        mesh.tangents.resize(count, Vec4::ZERO);
    }
    if !part.colors.is_empty() || !mesh.colors.is_empty() {
        mesh.colors.resize(first, Vec3::ONE);
        mesh.colors.extend(part.colors);
        mesh.colors.resize(count, Vec3::ONE);
    }
    let first = first as u32;
    mesh.triangles.extend(
        part.triangles.into_iter().map(|t| MeshTriangle { vertices: t.map(|v| v + first), material }),
    );
}
