//! What rays are traced against, on the GPU: a hierarchy for each mesh in its own space, and one over objects. See
//! `shaders/lib/rays.wgsl` for how they are walked.
//!
//! All of it are texels of one texture, which leaves storage buffers to the passes:
//!
//! 1. what changes when objects move: one texel that says where objects begin and by how much boxes are larger, the nodes of the upper
//!    hierarchy, and each object's place in the order of its boxes;
//! 2. for each mesh, which objects may share, the nodes of its hierarchy and its triangles in the order of their boxes. Those of
//!    objects that bend are in world space, begin in rows of their own, and are refitted.

use crate::parallel::in_order;
use crate::shader_constants::{RAY_COLUMNS, RAY_EMITS, RAY_LOWER_DEPTH, RAY_MASKED, RAY_UPPER_DEPTH};
use crate::{Error, Remedy, Result};
use bytemuck::{Pod, Zeroable};
use girandole_core::glam::{DAffine3, Vec3, Vec4};
use girandole_core::scene::{Geometry, Material, ObjectId, Scene};
use girandole_core::trace::{WideHierarchy, WideNode};
use std::collections::HashMap;

/// By how much boxes are larger on each side, as a share of the scene's size: more than a ray is wrong by, in single precision and
/// transformed into an object's space.
const MARGIN: f64 = 2e-6;

type Texel = [u32; 4];

/// A row of texels.
const COLUMNS: usize = RAY_COLUMNS as usize;

/// An object as kernels read it.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct RayObject {
    /// From positions to its mesh's.
    rows: [Vec4; 3],
    /// Where nodes and triangles of its mesh begin.
    nodes_at: u32,
    triangles_at: u32,
    /// In the geometry.
    first_triangle: u32,
    /// By how much boxes are larger.
    margin: f32,
}

/// A triangle in the space of its hierarchy.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct RayTriangle {
    /// Corners, of which the first goes with its place among the object's triangles.
    a: Vec3,
    index: u32,
    /// The second one with its flags.
    b: Vec3,
    flags: u32,
    c: Vec4,
}

/// Texels of an object, and of a node.
const OBJECT_TEXELS: usize = size_of::<RayObject>() / size_of::<Texel>();
const NODE_TEXELS: usize = size_of::<WideNode>() / size_of::<Texel>();

/// The hierarchies of a scene.
pub(crate) struct RayHierarchies {
    texture: wgpu::Texture,
    pub texels: wgpu::TextureView,
    /// Objects that rays may meet.
    objects: Vec<Placed>,
    /// Those that bend, by their place among `objects`.
    bent: Vec<(usize, Shape, WideHierarchy)>,
    /// Which materials emit: their triangles say so.
    emitters: Vec<bool>,
}

/// An object and where its hierarchy lies.
struct Placed {
    object: usize,
    /// Where nodes and triangles of its hierarchy begin.
    hierarchy_at: [u32; 2],
}

/// What a hierarchy is over: these triangles of an object, by their place among its own.
#[derive(Clone)]
struct Shape {
    object: usize,
    triangles: Vec<u32>,
}

impl RayHierarchies {
    /// Over all triangles that block light.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where they exceed the device's limits.
    pub fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        scene: &Scene,
        geometry: &Geometry,
    ) -> Result<Self> {
        let mut shapes: Vec<Shape> = Vec::new();
        let mut of_meshes = HashMap::new();
        let mut objects = Vec::new();
        for (object, range) in geometry.objects.iter().enumerate() {
            let blocks = |t: &u32| !geometry.is_transparent(scene, *t);
            let triangles = range.triangles.clone().filter(blocks).map(|t| t - range.triangles.start);
            let triangles: Vec<u32> = triangles.collect();
            if triangles.is_empty() {
                continue;
            }
            let of = &scene.objects[object];
            let is_whole = range.triangles.len() == scene.meshes[of.mesh].triangles.len();
            // A mirrored object's triangles turn around.
            let key = (of.mesh, scene.world_from_node(of.node).matrix3.determinant() < 0.0);
            let next = shapes.len();
            let shape = match is_whole && !scene.is_deformed(of) {
                true => *of_meshes.entry(key).or_insert(next),
                false => next,
            };
            if shape == next {
                shapes.push(Shape { object, triangles });
            }
            objects.push((object, shape));
        }
        let over =
            |shape: &Shape| WideHierarchy::over(&shape.boxes(scene, geometry), RAY_LOWER_DEPTH as usize);
        let built: Vec<WideHierarchy> =
            in_order(&shapes, over).into_iter().collect::<Option<_>>().ok_or_else(too_deep)?;
        let mut texels = vec![Texel::default(); head_texels(objects.len())];
        let mut places = Vec::new();
        for (shape, hierarchy) in shapes.iter().zip(&built) {
            if shape.is_bent(scene) {
                texels.resize(texels.len().next_multiple_of(COLUMNS), Texel::default());
            }
            let nodes_at = texels.len();
            texels.extend(shape.texels(scene, geometry, hierarchy));
            places.push([nodes_at, nodes_at + NODE_TEXELS * hierarchy.nodes.len()].map(|at| at as u32));
            if shape.is_bent(scene) {
                texels.resize(texels.len().next_multiple_of(COLUMNS), Texel::default());
            }
        }
        let bent = objects.iter().enumerate().filter(|(_, (_, shape))| shapes[*shape].is_bent(scene));
        let bent = bent.map(|(at, (_, shape))| (at, shapes[*shape].clone(), built[*shape].clone())).collect();
        let placed = |(object, shape): (usize, usize)| Placed { object, hierarchy_at: places[shape] };
        let objects: Vec<Placed> = objects.into_iter().map(placed).collect();
        let head = head(&objects, scene, geometry)?;
        texels[..head.len()].copy_from_slice(&head);
        let texture = texture_of(device, texels.len())?;
        write(queue, &texture, 0, texels);
        let texels = texture.create_view(&Default::default());
        Ok(Self { texture, texels, objects, bent, emitters: emitters(scene) })
    }

    /// Follows objects that moved, and materials.
    ///
    /// # Errors
    /// As [`RayHierarchies::new`].
    pub fn follow(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        scene: &Scene,
        geometry: &Geometry,
        moved: &[ObjectId],
    ) -> Result<()> {
        if emitters(scene) != self.emitters {
            *self = Self::new((device, queue), scene, geometry)?;
            return Ok(());
        }
        for (at, shape, hierarchy) in &mut self.bent {
            if moved.iter().any(|moved| moved.index() == shape.object) {
                hierarchy.refit(&shape.boxes(scene, geometry));
                let [nodes_at, _] = self.objects[*at].hierarchy_at;
                let texels = shape.texels(scene, geometry, hierarchy).collect();
                write(queue, &self.texture, nodes_at as usize / COLUMNS, texels);
            }
        }
        write(queue, &self.texture, 0, head(&self.objects, scene, geometry)?);
        Ok(())
    }
}

fn emitters(scene: &Scene) -> Vec<bool> {
    scene.materials.iter().map(Material::emits).collect()
}

/// Hierarchies of a scene with a quarter of a million objects, or a thousand million triangles.
fn too_deep() -> Error {
    Error::too_large("hierarchies for rays have more levels than kernels walk".into(), Remedy::SmallerScene)
}

/// A texture with so many texels.
fn texture_of(device: &wgpu::Device, texels: usize) -> Result<wgpu::Texture> {
    let (rows, most) = (texels.div_ceil(COLUMNS), device.limits().max_texture_dimension_2d);
    if rows > most as usize {
        let what =
            format!("hierarchies for rays take {rows} rows of a texture and this device has {most} at most");
        return Err(Error::too_large(what, Remedy::SmallerScene));
    }
    Ok(device.create_texture(&wgpu::TextureDescriptor {
        label: Some("hierarchies for rays"),
        size: wgpu::Extent3d { width: RAY_COLUMNS, height: rows as u32, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    }))
}

/// Writes texels from the beginning of a row on; the rest of the last row is void.
fn write(queue: &wgpu::Queue, texture: &wgpu::Texture, row: usize, mut texels: Vec<Texel>) {
    texels.resize(texels.len().next_multiple_of(COLUMNS), Texel::default());
    let to = wgpu::TexelCopyTextureInfo {
        origin: wgpu::Origin3d { x: 0, y: row as u32, z: 0 },
        ..texture.as_image_copy()
    };
    let rows = (texels.len() / COLUMNS) as u32;
    let layout = wgpu::TexelCopyBufferLayout { bytes_per_row: Some(16 * RAY_COLUMNS), ..Default::default() };
    let size = wgpu::Extent3d { width: RAY_COLUMNS, height: rows, depth_or_array_layers: 1 };
    queue.write_texture(to, bytemuck::cast_slice(&texels), layout, size);
}

/// What changes when objects move: the upper hierarchy, and where they are. It has rows of its own.
fn head(objects: &[Placed], scene: &Scene, geometry: &Geometry) -> Result<Vec<Texel>> {
    let extent = f64::from(geometry.extent());
    let bounds: Vec<(Vec3, Vec3)> = objects.iter().map(|o| bounds(geometry, o.object)).collect();
    let upper = WideHierarchy::over(&bounds, RAY_UPPER_DEPTH as usize).ok_or_else(too_deep)?;
    let objects_at = 1 + NODE_TEXELS * upper.nodes.len();
    let mut texels =
        vec![[objects_at as u32, ((extent * MARGIN) as f32).to_bits(), u32::from(objects.is_empty()), 0]];
    texels.extend_from_slice(bytemuck::cast_slice(&upper.nodes));
    let records = upper.boxes.iter().map(|&index| objects[index as usize].record(scene, geometry, extent));
    texels.extend(records.flat_map(bytemuck::cast::<RayObject, [Texel; OBJECT_TEXELS]>));
    Ok(texels)
}

/// Texels of that for so many objects, which have at most as many nodes: whole rows.
fn head_texels(objects: usize) -> usize {
    (1 + (NODE_TEXELS + OBJECT_TEXELS) * objects).next_multiple_of(COLUMNS)
}

impl Placed {
    fn record(&self, scene: &Scene, geometry: &Geometry, extent: f64) -> RayObject {
        let of = &scene.objects[self.object];
        let from_world = match scene.is_deformed(of) {
            true => DAffine3::IDENTITY,
            false => scene.world_from_node(of.node).inverse() * DAffine3::from_translation(geometry.origin),
        };
        // What was scaled to nothing has no triangles that a ray could meet: wherever its boxes are.
        let from_world = if from_world.is_finite() { from_world } else { DAffine3::IDENTITY };
        let axes = from_world.matrix3.transpose();
        let axes = [axes.x_axis, axes.y_axis, axes.z_axis];
        let longest = axes.iter().map(|row| row.length()).fold(0.0, f64::max);
        let reach = longest * extent + from_world.translation.abs().max_element();
        let [nodes_at, triangles_at] = self.hierarchy_at;
        RayObject {
            rows: [0, 1, 2].map(|i| axes[i].extend(from_world.translation[i]).as_vec4()),
            nodes_at,
            triangles_at,
            first_triangle: geometry.objects[self.object].triangles.start,
            margin: (reach * MARGIN) as f32,
        }
    }
}

impl Shape {
    fn is_bent(&self, scene: &Scene) -> bool {
        scene.is_deformed(&scene.objects[self.object])
    }

    /// Corners of one of its triangles, in the space of its hierarchy.
    fn corners(&self, scene: &Scene, geometry: &Geometry, at: u32) -> [Vec3; 3] {
        let range = &geometry.objects[self.object];
        let triangle = range.triangles.start + self.triangles[at as usize];
        if self.is_bent(scene) {
            return geometry.corners(triangle);
        }
        let positions = &scene.meshes[scene.objects[self.object].mesh].positions;
        let vertices = geometry.triangles[triangle as usize].vertices;
        vertices.map(|v| positions[(v - range.vertices.start) as usize])
    }

    fn boxes(&self, scene: &Scene, geometry: &Geometry) -> Vec<(Vec3, Vec3)> {
        let box_of = |at: u32| {
            let [a, b, c] = self.corners(scene, geometry, at);
            (a.min(b).min(c), a.max(b).max(c))
        };
        (0..self.triangles.len() as u32).map(box_of).collect()
    }

    /// Nodes and triangles of its hierarchy.
    fn texels(
        &self,
        scene: &Scene,
        geometry: &Geometry,
        hierarchy: &WideHierarchy,
    ) -> impl Iterator<Item = Texel> {
        let triangle = |&at: &u32| {
            let ([a, b, c], index) = (self.corners(scene, geometry, at), self.triangles[at as usize]);
            let triangle = geometry.objects[self.object].triangles.start + index;
            let material = &scene.materials[geometry.triangles[triangle as usize].material];
            let flag = |is_set: bool, flag: u32| if is_set { flag } else { 0 };
            let flags = flag(material.emits(), RAY_EMITS) | flag(material.alpha_cutoff.is_some(), RAY_MASKED);
            RayTriangle { a, index, b, flags, c: c.extend(0.0) }
        };
        let nodes: &[Texel] = bytemuck::cast_slice(&hierarchy.nodes);
        let triangles = hierarchy.boxes.iter().map(triangle);
        nodes.iter().copied().chain(triangles.flat_map(bytemuck::cast::<RayTriangle, [Texel; 3]>))
    }
}

fn bounds(geometry: &Geometry, object: usize) -> (Vec3, Vec3) {
    let vertices = geometry.objects[object].vertices.clone();
    let positions = &geometry.positions[vertices.start as usize..vertices.end as usize];
    let finite = positions.iter().filter(|p| p.is_finite());
    finite.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)))
}
