//! The scene flattened to world space: what rays, light samples and the renderer work on.

use super::hierarchy::WorldFromNode;
use super::{FrameOfReference, LightId, MaterialId, Mesh, NONE, Scene, coincident};
use crate::Result;
use crate::brdf::Surface;
use crate::generation::Generation;
use crate::slices::{complete, pause};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use std::ops::Range;

/// Triangles that are flattened in a slice.
const SLICE: usize = 4096;

/// A triangle in world space, counter-clockwise seen from its front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Triangle {
    /// Indices into the vertex arrays of [`Geometry`].
    pub vertices: [u32; 3],
    /// Index into the scene's objects.
    pub object: u32,
    /// Its material.
    pub material: MaterialId,
    /// Index into [`Geometry::patches`], or [`NONE`].
    pub patch: u32,
}

/// A planar convex polygon in world space.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldPatch {
    /// Index into the scene's objects.
    pub object: u32,
    /// Its material.
    pub material: MaterialId,
    /// Corners, counter-clockwise seen from the front.
    pub outline: Vec<Vec3>,
    /// Unit normal of the front side.
    pub normal: Vec3,
    /// Its triangles in [`Geometry::triangles`].
    pub triangles: Range<u32>,
}

/// What an object occupies in the flattened arrays.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectRange {
    /// Range of vertices.
    pub vertices: Range<u32>,
    /// Range of triangles.
    pub triangles: Range<u32>,
    /// Range of patches.
    pub patches: Range<u32>,
}

/// A [`Scene`] flattened to world space, relative to [`Geometry::origin`] so that single precision suffices
/// however far from zero the scene stands.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// World position of what all positions here are relative to, see [`FrameOfReference::origin`].
    pub origin: DVec3,
    /// Positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit shading normals.
    pub normals: Vec<Vec3>,
    /// Unit tangents, bitangent's sign in `w`; zero where the mesh has none.
    pub tangents: Vec<Vec4>,
    /// Texture coordinates of set 0 and 1; zero where the mesh has none.
    pub uvs: Vec<[Vec2; 2]>,
    /// Linear RGB that multiplies base colours; empty where no mesh has any.
    pub colors: Vec<Vec3>,
    /// All triangles, object by object: those that have an area and a place of their own, and all of what is deformed, where some
    /// may have no area for a while.
    pub triangles: Vec<Triangle>,
    /// All planar convex patches, object by object.
    pub patches: Vec<WorldPatch>,
    /// One element an object of the scene; empty for those that were removed.
    pub objects: Vec<ObjectRange>,
    /// Smallest and largest corner of the frame's bounds: everything, and room for what moves.
    pub bounds: (Vec3, Vec3),
    /// Triangles without area or with non-finite corners, which were dropped. What is deformed keeps those without area, so that
    /// the others' indices do not change.
    pub dropped: usize,
    /// Triangles in the same place as others, which were dropped: what is listed twice emits and reflects once.
    pub coincident: usize,
    scale: f32,
    surface_extent: f32,
    detail: f32,
    /// How far punctual lights are taken off what they lie on.
    light_shifts: Vec<Vec3>,
    generation: Generation,
}

impl Geometry {
    /// Flattens a scene, in the frame of reference that it was opened with, or would be.
    pub fn new(scene: &Scene) -> Self {
        complete(Self::in_slices(scene))
    }

    /// The same for whoever has something else to do meanwhile: the future pauses between [slices](crate::slices) of work.
    pub async fn in_slices(scene: &Scene) -> Self {
        let FrameOfReference { origin, bounds, scale, surface_extent, detail } = scene.frame_of_reference();
        pause().await;
        let generation = scene.generation();
        let mut result =
            Self { origin, bounds, scale, surface_extent, detail, generation, ..Self::default() };
        let world_from_nodes = scene.world_from_nodes();
        let mut last_pause = 0;
        for (index, object) in scene.objects.iter().enumerate() {
            if result.triangles.len() > last_pause + SLICE {
                last_pause = result.triangles.len();
                pause().await;
            }
            if object.removed {
                result.objects.push(result.range_from([
                    result.positions.len(),
                    result.triangles.len(),
                    result.patches.len(),
                ]));
            } else if scene.is_deformed(object) {
                result.add_deformed(scene, index, &|node| world_from_nodes[node.index()]);
            } else {
                result.add_object(scene, index, &world_from_nodes[object.node.index()]);
            }
        }
        pause().await;
        coincident::drop_doubles(scene, &mut result);
        pause().await;
        result.light_shifts = super::light_places::shifts(scene, &result);
        result
    }

    /// Where a punctual light on this node shines from, relative to the origin: where it is, or just beside the surface that it lies on.
    pub fn light_position(&self, light: LightId, world_from_node: &DAffine3) -> Vec3 {
        let shift = self.light_shifts.get(light.index()).copied().unwrap_or(Vec3::ZERO);
        (world_from_node.translation - self.origin).as_vec3() + shift
    }

    /// Which version of the scene this is.
    pub fn generation(&self) -> Generation {
        self.generation
    }

    /// Whether this is the scene as it stands.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where it is another scene, or an earlier version.
    pub fn belongs_to(&self, scene: &Scene) -> Result<()> {
        self.generation.expect(
            scene.generation(),
            "this geometry belongs to another scene or to an earlier version of it; make it anew from the scene",
        )
    }

    /// The frame that everything here is in.
    pub fn frame_of_reference(&self) -> FrameOfReference {
        FrameOfReference {
            origin: self.origin,
            bounds: self.bounds,
            scale: self.scale,
            surface_extent: self.surface_extent,
            detail: self.detail,
        }
    }

    fn range_from(&self, [vertices, triangles, patches]: [usize; 3]) -> ObjectRange {
        ObjectRange {
            vertices: vertices as u32..self.positions.len() as u32,
            triangles: triangles as u32..self.triangles.len() as u32,
            patches: patches as u32..self.patches.len() as u32,
        }
    }

    fn add_object(&mut self, scene: &Scene, index: usize, affine: &DAffine3) {
        let mesh = &scene.meshes[scene.objects[index].mesh];
        let first_vertex = self.positions.len() as u32;
        let first = [self.positions.len(), self.triangles.len(), self.patches.len()];
        let mirrored = affine.matrix3.determinant() < 0.0;
        let normal_matrix = affine.matrix3.inverse().transpose();
        for p in &mesh.positions {
            self.positions.push((affine.transform_point3(p.as_dvec3()) - self.origin).as_vec3());
        }
        for n in &mesh.normals {
            self.normals.push((normal_matrix * n.as_dvec3()).normalize_or_zero().as_vec3());
        }
        for i in 0..mesh.positions.len() {
            self.tangents.push(mesh.tangents.get(i).map_or(Vec4::ZERO, |t| {
                let w = if mirrored { -t.w } else { t.w };
                affine.transform_vector3(t.truncate().as_dvec3()).normalize_or_zero().as_vec3().extend(w)
            }));
            self.uvs.push(mesh.uvs.get(i).copied().unwrap_or_default());
        }
        self.add_colors(first[0], mesh);
        // Triangles, in the mesh's order; a mirrored object's turn around. Those without area are dropped.
        let mut kept_before = Vec::with_capacity(mesh.triangles.len() + 1);
        for triangle in &mesh.triangles {
            kept_before.push(self.triangles.len() as u32);
            let [a, b, c] = triangle.vertices.map(|v| v + first_vertex);
            let vertices = if mirrored { [a, c, b] } else { [a, b, c] };
            if self.area_vector(vertices).length_squared() > 0.0
                && vertices.iter().all(|&v| self.positions[v as usize].is_finite())
            {
                self.triangles.push(Triangle {
                    vertices,
                    object: index as u32,
                    material: triangle.material,
                    patch: NONE,
                });
            } else {
                self.dropped += 1;
            }
        }
        kept_before.push(self.triangles.len() as u32);
        for patch in &mesh.patches {
            let range =
                kept_before[patch.triangles.start as usize]..kept_before[patch.triangles.end as usize];
            let mut outline: Vec<Vec3> =
                patch.outline.iter().map(|&v| self.positions[(v + first_vertex) as usize]).collect();
            if mirrored {
                outline.reverse();
            }
            let normal = super::mesh::polygon_normal(&outline);
            if range.is_empty() || normal == Vec3::ZERO {
                continue;
            }
            for triangle in &mut self.triangles[range.start as usize..range.end as usize] {
                triangle.patch = self.patches.len() as u32;
            }
            self.patches.push(WorldPatch {
                object: index as u32,
                material: self.triangles[range.start as usize].material,
                outline,
                normal,
                triangles: range,
            });
        }
        self.objects.push(self.range_from(first));
    }

    /// The colours of the vertices that were added last, from `first` on.
    fn add_colors(&mut self, first: usize, mesh: &Mesh) {
        if !mesh.colors.is_empty() || !self.colors.is_empty() {
            self.colors.resize(first, Vec3::ONE);
            self.colors.extend(&mesh.colors);
            self.colors.resize(self.positions.len(), Vec3::ONE);
        }
    }

    /// An object whose mesh bends: the same triangles at each moment, and no patches.
    fn add_deformed(&mut self, scene: &Scene, index: usize, world_from_node: WorldFromNode) {
        let object = &scene.objects[index];
        let mesh = &scene.meshes[object.mesh];
        let first = [self.positions.len(), self.triangles.len(), self.patches.len()];
        let deformed = scene.deform(object, world_from_node);
        self.positions.extend(deformed.positions.iter().map(|p| (*p - self.origin).as_vec3()));
        self.normals.extend(deformed.normals);
        self.tangents.extend(deformed.tangents);
        self.tangents.resize(self.positions.len(), Vec4::ZERO);
        self.uvs.extend(&mesh.uvs);
        self.uvs.resize(self.positions.len(), Default::default());
        self.add_colors(first[0], mesh);
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.vertices;
            let is_finite = triangle.vertices.iter().all(|&v| mesh.positions[v as usize].is_finite());
            if !is_finite || a == b || b == c || c == a {
                self.dropped += 1;
                continue;
            }
            let [a, b, c] = triangle.vertices.map(|v| v + first[0] as u32);
            let vertices =
                if deformed.mirrored[triangle.vertices[0] as usize] { [a, c, b] } else { [a, b, c] };
            let material = triangle.material;
            self.triangles.push(Triangle { vertices, object: index as u32, material, patch: NONE });
        }
        self.objects.push(self.range_from(first));
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].vertices.map(|v| self.positions[v as usize])
    }

    /// Unit normal of a triangle's front side; +Y where it has no area.
    pub fn normal(&self, triangle: u32) -> Vec3 {
        let vector = self.area_vector(self.triangles[triangle as usize].vertices);
        vector.normalize_or(DVec3::Y).as_vec3()
    }

    /// Area of a triangle, m².
    pub fn area(&self, triangle: u32) -> f32 {
        (self.area_vector(self.triangles[triangle as usize].vertices).length() * 0.5) as f32
    }

    fn area_vector(&self, vertices: [u32; 3]) -> DVec3 {
        let [a, b, c] = vertices.map(|v| self.positions[v as usize].as_dvec3());
        (b - a).cross(c - a)
    }

    /// The scene's size, metres, see [`FrameOfReference::scale`]. Nothing is sure to be within it; for that there is
    /// [`Geometry::extent`]; and small distances are relative to [`Geometry::detail`].
    pub fn diagonal(&self) -> f32 {
        self.scale.max(f32::MIN_POSITIVE)
    }

    /// How large surfaces are, as a rule, metres, see [`FrameOfReference::surface_extent`]: what is large or small is relative
    /// to it. Other rooms in a building change it little.
    pub fn surface_extent(&self) -> f32 {
        self.surface_extent.max(f32::MIN_POSITIVE)
    }

    /// What small distances are relative to, metres, see [`FrameOfReference::detail`]: that of a room, whatever plain it is on; at
    /// most the scene's size.
    pub fn detail(&self) -> f32 {
        self.detail.min(self.scale).max(f32::MIN_POSITIVE)
    }

    /// What the offsets of rays are relative to, metres: the same, whatever the scene's size.
    pub(crate) fn offset_detail(&self) -> f32 {
        self.detail.max(f32::MIN_POSITIVE)
    }

    /// Length of the bounds' diagonal, metres: for what has to cover everything.
    pub fn extent(&self) -> f32 {
        self.frame_of_reference().extent()
    }

    /// Middle of the bounds of what there is.
    pub(crate) fn center(&self) -> Vec3 {
        (self.bounds.0 + self.bounds.1) * 0.5
    }

    /// Bounds of what there is, but for outliers: smallest and largest corner.
    pub fn main_bounds(&self) -> (Vec3, Vec3) {
        // The origin is their centre.
        let reach = self.diagonal() * (0.5 + 1e-5);
        let main = self.positions.iter().filter(|p| p.length() <= reach);
        let (low, high) = main.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)));
        if low.cmple(high).all() { (low, high) } else { self.bounds }
    }

    /// Radius of a sphere about the origin that holds the bounds, metres.
    pub fn radius(&self) -> f32 {
        let half = self.extent() * 0.5;
        let farthest = self.bounds.0.abs().max(self.bounds.1.abs()).length();
        // But for rounding they are the same where the origin is the bounds' centre.
        if farthest > half * (1.0 + 1e-6) { farthest } else { half }
    }

    /// Position at barycentric coordinates `(u, v)` of corners 1 and 2.
    pub fn point(&self, triangle: u32, barycentric: Vec2) -> Vec3 {
        let [a, b, c] = self.corners(triangle).map(Vec3::as_dvec3);
        let (u, v) = (f64::from(barycentric.x), f64::from(barycentric.y));
        (a + (b - a) * u + (c - a) * v).as_vec3()
    }

    /// Texture coordinates of one set at barycentric coordinates.
    pub fn uv(&self, triangle: u32, barycentric: Vec2, set: u32) -> Vec2 {
        let [a, b, c] =
            self.triangles[triangle as usize].vertices.map(|v| self.uvs[v as usize][set as usize & 1]);
        a + (b - a) * barycentric.x + (c - a) * barycentric.y
    }

    /// Whether a triangle's material lets light through.
    pub fn is_transparent(&self, scene: &Scene, triangle: u32) -> bool {
        scene.materials[self.triangles[triangle as usize].material].is_transparent()
    }

    /// Whether the shading normals of a patch are that of its plane everywhere.
    pub fn is_flat(&self, scene: &Scene, patch: &WorldPatch) -> bool {
        let normal = |vertex: u32| self.normals[vertex as usize].normalize_or(patch.normal);
        let of_plane = |vertex: &u32| normal(*vertex).dot(patch.normal) > 0.99999;
        scene.materials[patch.material].normal_texture.is_none()
            && patch.triangles.clone().all(|t| self.triangles[t as usize].vertices.iter().all(of_plane))
    }

    /// Whether there is no surface at a point of an alpha-masked triangle.
    pub fn is_cut_out(&self, scene: &Scene, triangle: u32, barycentric: Vec2) -> bool {
        let material = &scene.materials[self.triangles[triangle as usize].material];
        let Some(cutoff) = material.alpha_cutoff else { return false };
        let texel =
            material.base_color_texture.map_or(1.0, |t| self.sample(scene, t, triangle, barycentric).w);
        material.alpha * texel < cutoff
    }

    /// Radiance that a triangle emits from its front at a point, W/(sr·m²).
    pub fn emission(&self, scene: &Scene, triangle: u32, barycentric: Vec2) -> Vec3 {
        let material = &scene.materials[self.triangles[triangle as usize].material];
        material.emission * self.emission_factor(scene, triangle, barycentric)
    }

    /// What the texture makes of that.
    pub(crate) fn emission_factor(&self, scene: &Scene, triangle: u32, barycentric: Vec2) -> Vec3 {
        let material = &scene.materials[self.triangles[triangle as usize].material];
        material
            .emission_texture
            .map_or(Vec3::ONE, |t| self.sample(scene, t, triangle, barycentric).truncate())
    }

    fn sample(&self, scene: &Scene, texture: super::TextureRef, triangle: u32, barycentric: Vec2) -> Vec4 {
        let uv = self.uv(triangle, barycentric, texture.uv_set);
        scene.textures[texture.texture as usize].sample(texture.transform.transform_point2(uv))
    }

    /// The surface at a point of a triangle as seen from direction `wo` (unit, away from the surface). Seen from
    /// the back, a double-sided one turns its normals around; a single-sided one is black and faces away.
    pub fn surface(&self, scene: &Scene, triangle: u32, barycentric: Vec2, wo: Vec3) -> Surface {
        let t = &self.triangles[triangle as usize];
        let material = &scene.materials[t.material];
        let sample = |texture: Option<super::TextureRef>| {
            texture.map_or(Vec4::ONE, |x| self.sample(scene, x, triangle, barycentric))
        };
        let geometric = self.normal(triangle);
        let weights = [1.0 - barycentric.x - barycentric.y, barycentric.x, barycentric.y];
        let mut normal = Vec3::ZERO;
        let mut tangent = Vec4::ZERO;
        for (&vertex, weight) in t.vertices.iter().zip(weights) {
            normal += self.normals[vertex as usize] * weight;
            tangent += self.tangents[vertex as usize] * weight;
        }
        normal = normal.normalize_or(geometric);
        if let Some(map) = material.normal_texture {
            let texel = self.sample(scene, map.texture, triangle, barycentric).truncate() * 2.0 - 1.0;
            let along = tangent.truncate();
            let along = (along - normal * normal.dot(along)).normalize_or_zero();
            let across = normal.cross(along) * if tangent.w < 0.0 { -1.0 } else { 1.0 };
            let bent = along * (texel.x * map.scale) + across * (texel.y * map.scale) + normal * texel.z;
            normal = bent.normalize_or(normal);
        }
        let base = sample(material.base_color_texture);
        let mut base_color = material.base_color * base.truncate();
        if material.vertex_colors && !self.colors.is_empty() {
            let color = |(&vertex, weight): (&u32, f32)| self.colors[vertex as usize] * weight;
            base_color *= t.vertices.iter().zip(weights).map(color).sum::<Vec3>();
        }
        let mr = sample(material.metallic_roughness_texture);
        let specular = material.specular * sample(material.specular_texture).w;
        let tint = material.specular_color * sample(material.specular_color_texture).truncate();
        let mut surface = Surface::from_metallic_roughness(
            base_color,
            material.metallic * mr.z,
            material.roughness * mr.y,
            specular,
            tint,
        );
        surface.position = self.point(triangle, barycentric);
        surface.geometric_normal = geometric;
        surface.shading_normal = normal;
        let from_back = geometric.dot(wo) < 0.0;
        if from_back && material.double_sided {
            surface.geometric_normal = -geometric;
            surface.shading_normal = -normal;
        }
        if from_back && !material.double_sided {
            surface.albedo = Vec3::ZERO;
            surface.f0 = Vec3::ZERO;
            surface.f90 = 0.0;
        } else if material.unlit {
            surface.emission = base_color;
            surface.albedo = Vec3::ZERO;
            surface.f0 = Vec3::ZERO;
            surface.f90 = 0.0;
        } else if material.emits() {
            surface.emission = self.emission(scene, triangle, barycentric);
        }
        if material.is_transparent() {
            let opacity = if material.blended { material.alpha * base.w } else { 1.0 };
            let transmission = material.transmission * sample(material.transmission_texture).x;
            let mut tint = base_color * (1.0 - material.metallic * mr.z);
            if material.unlit {
                surface.emission *= opacity;
                tint = Vec3::ZERO;
            }
            surface.see_through(opacity, transmission, tint, surface.shading_normal.dot(wo).abs());
        }
        surface
    }

    /// Whether a point looks inside a room: rays in 26 directions all meet a surface's front (or a double-sided one).
    pub fn encloses(&self, scene: &Scene, point: Vec3) -> bool {
        let tracer = crate::trace::SceneTracer::of_all_surfaces(scene, self);
        (0..27).filter(|&i| i != 13).all(|i| {
            let direction = Vec3::new((i % 3) as f32 - 1.0, (i / 3 % 3) as f32 - 1.0, (i / 9) as f32 - 1.0);
            let direction = (direction + Vec3::new(0.013, 0.007, 0.011)).normalize();
            tracer.closest_hit(point, direction, f32::INFINITY, NONE).is_some_and(|hit| {
                let t = &self.triangles[hit.triangle as usize];
                scene.materials[t.material].double_sided || self.normal(hit.triangle).dot(direction) < 0.0
            })
        })
    }
}
