//! A scene's buffers on the GPU.

use crate::device::buffers::storage;
use crate::device::kernel::{GroupLayout, buffer, texture};
use crate::gpu_scene::environment::GpuEnvironment;
use crate::gpu_scene::surface_ids::surface_ids;
use crate::gpu_scene::transparent::TransparentTriangles;
use crate::layout::{GpuMaterial, Light, Triangle, Vertex};
use crate::records::TextureEntry;
use crate::shader_constants::{DISTANT, TEXEL_COLUMNS, TEXEL_ROWS};
use crate::{Error, Remedy, Result};
use girandole_core::glam::{Vec2, Vec3, Vec4};
use girandole_core::lights::LightSet;
use girandole_core::scene::{
    ColorSpace, Environment, Filter, Geometry, ObjectRange, Scene, SceneChanges, Texture, Wrap,
};
use girandole_core::tonemap::{srgb_decode, srgb_encode};
use std::borrow::Cow;
use std::ops::Range;
use wgpu::util::DeviceExt;

/// Everything about the scene that shaders read.
pub(crate) struct GpuScene {
    /// Bind group 1.
    pub group: wgpu::BindGroup,
    vertices: wgpu::Buffer,
    materials: wgpu::Buffer,
    /// How many materials there are.
    pub material_count: usize,
    /// Triangle indices: those without an alpha mask, those with one, those that let light through.
    pub triangle_order: wgpu::Buffer,
    /// Ids of the triangles' surfaces.
    pub triangle_surfaces: wgpu::Buffer,
    surfaces: Vec<u32>,
    /// Triangles whose surfaces have no id on the device: points on them are neither listed nor interpolated.
    left_out: Vec<Range<u32>>,
    /// Which vertices, triangles and patches are whose.
    pub objects: Vec<ObjectRange>,
    /// How many triangles there are of each of these kinds.
    pub counts: [u32; 3],
    /// Where those are that let light through.
    pub transparent: TransparentTriangles,
    /// What is around it all, if it is seen or reflected.
    pub environment: Option<GpuEnvironment>,
}

/// Whether some surface reflects an environment by its own maps.
pub(crate) fn reflects_environment(scene: &Scene) -> bool {
    scene.environment.as_ref().is_some_and(Environment::shines)
        && scene.materials.iter().any(|m| m.specular > 0.0 || m.metallic > 0.0)
}

impl GpuScene {
    pub fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        layout: &GroupLayout,
        scene: &Scene,
        geometry: &Geometry,
    ) -> Result<Self> {
        let vertices: Vec<Vertex> = (0..geometry.positions.len()).map(|i| vertex(geometry, i)).collect();
        let triangles: Vec<Triangle> = geometry
            .triangles
            .iter()
            .map(|t| Triangle { vertices: t.vertices, material: t.material.0 })
            .collect();
        let materials: Vec<GpuMaterial> = scene.materials.iter().map(GpuMaterial::from).collect();
        let kind = |t: u32| {
            let material = &scene.materials[geometry.triangles[t as usize].material];
            if material.is_transparent() { 2 } else { usize::from(material.alpha_cutoff.is_some()) }
        };
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        order.sort_by_key(|&t| kind(t));
        let mut counts = [0; 3];
        order.iter().for_each(|&t| counts[kind(t)] += 1);
        let vertices = storage(device, "vertices", &vertices)?;
        let triangles = storage(device, "triangles", &triangles)?;
        let materials = storage(device, "materials", &materials)?;
        let texels = texels(device, queue, pack_textures(&scene.textures)?)?;
        let resources = [
            buffer("vertices", &vertices),
            buffer("triangles", &triangles),
            buffer("materials", &materials),
            texture("texels", &texels),
        ];
        let surfaces = surface_ids(scene, geometry)?;
        let is_reflected = reflects_environment(scene);
        Ok(Self {
            group: layout.group(device, &resources),
            counts,
            transparent: TransparentTriangles::new(scene, geometry),
            triangle_order: storage(device, "triangle order", &order)?,
            triangle_surfaces: storage(device, "surface ids", &surfaces)?,
            surfaces,
            left_out: Vec::new(),
            vertices,
            materials,
            material_count: scene.materials.len(),
            objects: geometry.objects.clone(),
            environment: scene
                .environment
                .as_ref()
                .map(|e| GpuEnvironment::new((device, queue), e, is_reflected))
                .filter(|e| e.shown.is_some() || e.reflected.is_some()),
        })
    }

    /// Follows objects that moved, and materials, as many as there were, that emit something else.
    ///
    /// # Errors
    /// [`Error::TooLarge`] where there are too many surfaces now.
    pub fn follow(
        &mut self,
        queue: &wgpu::Queue,
        scene: &Scene,
        geometry: &Geometry,
        SceneChanges { moved, materials, .. }: &SceneChanges,
    ) -> Result<()> {
        for &material in materials {
            let record = GpuMaterial::from(&scene.materials[material]);
            let at = material.index() * size_of::<GpuMaterial>();
            queue.write_buffer(&self.materials, at as u64, bytemuck::bytes_of(&record));
        }
        let mut ranges: Vec<Range<u32>> =
            moved.iter().map(|object| geometry.objects[object.index()].vertices.clone()).collect();
        ranges.sort_unstable_by_key(|range| range.start);
        for run in ranges.chunk_by(|before, after| before.end == after.start) {
            let range = run[0].start..run[run.len() - 1].end;
            let vertices: Vec<Vertex> = range.clone().map(|i| vertex(geometry, i as usize)).collect();
            let at = range.start as usize * size_of::<Vertex>();
            queue.write_buffer(&self.vertices, at as u64, bytemuck::cast_slice(&vertices));
        }
        if self.counts[2] > 0 && !moved.is_empty() {
            self.transparent = TransparentTriangles::new(scene, geometry);
        }
        // Planes may have come to coincide, or no longer do.
        if moved.iter().all(|object| geometry.objects[object.index()].patches.is_empty()) {
            return Ok(());
        }
        let surfaces = surface_ids(scene, geometry)?;
        if surfaces != self.surfaces {
            self.surfaces = surfaces;
            self.write_surfaces(queue);
        }
        Ok(())
    }

    /// Leaves these triangles to passes of their own, and no others.
    pub fn leave_out(&mut self, queue: &wgpu::Queue, triangles: Vec<Range<u32>>) {
        if self.left_out != triangles {
            self.left_out = triangles;
            self.write_surfaces(queue);
        }
    }

    fn write_surfaces(&self, queue: &wgpu::Queue) {
        let mut surfaces = Cow::Borrowed(&self.surfaces);
        for range in &self.left_out {
            surfaces.to_mut()[range.start as usize..range.end as usize].fill(0);
        }
        queue.write_buffer(&self.triangle_surfaces, 0, bytemuck::cast_slice(&surfaces));
    }
}

fn vertex(geometry: &Geometry, i: usize) -> Vertex {
    let [uv0, uv1] = geometry.uvs.get(i).copied().unwrap_or_default();
    let color = geometry.colors.get(i).copied().unwrap_or(Vec3::ONE);
    Vertex {
        position: geometry.positions[i],
        normal: geometry.normals[i],
        tangent: geometry.tangents.get(i).copied().unwrap_or(Vec4::ZERO),
        uv0,
        u1: uv1.x,
        v1: uv1.y,
        color: [color.truncate(), Vec2::new(color.z, 0.0)].map(pack_unorm),
    }
}

/// WGSL's `pack2x16unorm`.
fn pack_unorm(v: Vec2) -> u32 {
    let [x, y] = v.to_array().map(|x| (x.clamp(0.0, 1.0) * 65535.0).round() as u32);
    x | y << 16
}

/// Samples of a sky, each of which lights all that is seen by itself: with so many at most, each has a large map.
const FEW_OF_SKY: usize = 512;

/// Light samples for the GPU, without their places in the atlas. `radius` is the scene's.
pub(crate) fn gpu_lights(lights: &LightSet, radius: f32) -> Vec<Light> {
    let samples = (0..).zip(lights.samples());
    let mut result: Vec<Light> =
        samples.map(|(id, sample)| Light::new(id, lights.set(), sample, radius)).collect();
    let of_sky: Vec<&mut Light> = result.iter_mut().filter(|light| light.profile == DISTANT).collect();
    if of_sky.len() <= FEW_OF_SKY {
        of_sky.into_iter().for_each(|light| light.rectangle.w = 1.0);
    }
    result
}

/// The words of all textures in rows of a texture array.
fn texels(device: &wgpu::Device, queue: &wgpu::Queue, mut words: Vec<u32>) -> Result<wgpu::TextureView> {
    let rows = (words.len() as u64).div_ceil(u64::from(TEXEL_COLUMNS)).max(1);
    let layers = rows.div_ceil(u64::from(TEXEL_ROWS));
    let limit = u64::from(device.limits().max_texture_array_layers);
    if layers > limit {
        let what = format!(
            "the scene's textures take {layers} layers of an array and this device has {limit} at most"
        );
        return Err(Error::too_large(what, Remedy::SmallerScene));
    }
    let height = rows.min(u64::from(TEXEL_ROWS));
    words.resize(TEXEL_COLUMNS as usize * height as usize * layers as usize, 0);
    let texture = device.create_texture_with_data(
        queue,
        &wgpu::TextureDescriptor {
            label: Some("texels"),
            size: wgpu::Extent3d {
                width: TEXEL_COLUMNS,
                height: height as u32,
                depth_or_array_layers: layers as u32,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R32Uint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(&words),
    );
    Ok(texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    }))
}

/// All textures as one array of words, see `lib/texture.wgsl`: a directory, then the texels of all levels.
fn pack_textures(textures: &[Texture]) -> Result<Vec<u32>> {
    let mut words = vec![0u32; textures.len() * TextureEntry::WORDS];
    for (index, texture) in textures.iter().enumerate() {
        if texture.width > 0xffff || texture.height > 0xffff {
            let what = format!("texture {} is {} × {} texels", texture.name, texture.width, texture.height);
            return Err(Error::too_large(what, Remedy::TextureSize { to: 0xffff }));
        }
        let wrap = |w| match w {
            Wrap::Repeat => 0,
            Wrap::Mirror => 1,
            Wrap::Clamp => 2,
        };
        let flags = u32::from(texture.color_space == ColorSpace::Srgb)
            | u32::from(texture.filter == Filter::Nearest) << 1
            | wrap(texture.wrap[0]) << 2
            | wrap(texture.wrap[1]) << 4;
        let offset = words.len() as u32;
        let decoded = decoded(texture.color_space);
        let mut level = Cow::Borrowed(texture);
        let mut levels = 0;
        loop {
            words.extend(level.texels.iter().map(|t| u32::from_le_bytes(*t)));
            levels += 1;
            if level.width == 1 && level.height == 1 {
                break;
            }
            level = Cow::Owned(halve(&level, &decoded));
        }
        let extent = texture.width | texture.height << 16;
        let entry = TextureEntry { offset, extent, levels, flags };
        words[index * TextureEntry::WORDS..][..TextureEntry::WORDS]
            .copy_from_slice(bytemuck::cast_slice(&[entry]));
    }
    Ok(words)
}

/// Linear values of bytes.
type Decoded = [f32; 256];

fn decoded(color_space: ColorSpace) -> Decoded {
    std::array::from_fn(|byte| match color_space {
        ColorSpace::Srgb => srgb_decode(byte as f32 / 255.0),
        ColorSpace::Linear => byte as f32 / 255.0,
    })
}

/// The next level: each texel the mean of two by two in linear light.
fn halve(texture: &Texture, decoded: &Decoded) -> Texture {
    let (width, height) = ((texture.width / 2).max(1), (texture.height / 2).max(1));
    let encode = |v: f32| match texture.color_space {
        ColorSpace::Srgb => srgb_encode(v),
        ColorSpace::Linear => v,
    };
    let byte = |v: f32| (v * 255.0 + 0.5) as u8;
    let mut texels = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        let rows = [2 * y, 2 * y + 1].map(|y| y.min(texture.height - 1) as usize * texture.width as usize);
        for x in 0..width {
            let columns = [2 * x, 2 * x + 1].map(|x| x.min(texture.width - 1) as usize);
            let of_row = |row: usize| columns.map(|column| texture.texels[row + column]);
            let [[a, b], [c, d]] = rows.map(of_row);
            if a == b && b == c && c == d {
                texels.push(a);
                continue;
            }
            texels.push(std::array::from_fn(|i| match i {
                3 => byte([a, b, c, d].map(|t| f32::from(t[3]) / 255.0).iter().sum::<f32>() * 0.25),
                _ => {
                    byte(encode([a, b, c, d].map(|t| decoded[usize::from(t[i])]).iter().sum::<f32>() * 0.25))
                }
            }));
        }
    }
    let Texture { name, color_space, wrap, filter, .. } = texture;
    Texture {
        name: name.clone(),
        width,
        height,
        texels,
        color_space: *color_space,
        wrap: *wrap,
        filter: *filter,
    }
}
