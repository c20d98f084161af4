//! Every struct that both sides see, declared once; a test compares names and offsets with the shaders'.

use crate::parallel_map::ParallelMap;
use crate::settings::ShadowMap;
use crate::shader_constants::{
    BLENDED, COSINE, CUBE, DIRECTIONAL, DISTANT, DOUBLE_SIDED, HEMISPHERE, MAP_SIZES, MAX_CLAMP, OCTAHEDRAL,
    OWN_CLAMP, PARABOLIC, SPOT, TRANSPARENT, UNLIT, VERTEX_COLORED,
};
use bytemuck::{Pod, Zeroable};
use girandole_core::brdf::Surface;
use girandole_core::glam::{Affine2, Vec2, Vec3, Vec4};
use girandole_core::lights::{Clamp, LightSample, Profile, Rectangle};
use girandole_core::scene::{Material, NONE, TextureRef};
use girandole_core::trace::Ray;

/// `Frame` in `lib/frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Frame {
    pub eye: Vec3,
    pub orthographic: u32,
    pub right: Vec3,
    pub half_width: f32,
    pub up: Vec3,
    pub half_height: f32,
    pub forward: Vec3,
    pub depth_bias: f32,
    pub size: [u32; 2],
    pub band: [u32; 2],
    pub offset: Vec2,
    pub first_light: u32,
    pub end_light: u32,
    pub clamp: f32,
    pub far: f32,
    pub sample: u32,
    pub samples: u32,
    pub last_row: u32,
    pub step: u32,
    pub batch: u32,
    pub last_batch: u32,
    pub tolerance: f32,
    pub debug: u32,
    pub center: Vec2,
    pub depth_scale: f32,
    pub forward_depth: u32,
    pub environment: Vec2,
    pub sun_direction: Vec3,
    pub sun_chord2: f32,
    pub sun_radiance: Vec3,
    pub sample_solid_angle: f32,
    pub writes_radiance: u32,
    pub mirror_solid_angle: f32,
    pub ray_offset: f32,
    pub columns: u32,
    pub light_set: u32,
    pub sample_area: f32,
    pub polished_alpha: f32,
    pub padding_b: u32,
}

/// `CallersRay` in `trace_rays.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct CallersRay {
    pub origin: Vec3,
    pub t_max: f32,
    pub direction: Vec3,
    pub ignored: u32,
}

impl From<&Ray> for CallersRay {
    fn from(&Ray { origin, direction, t_max, ignored }: &Ray) -> Self {
        Self { origin, direction, t_max, ignored }
    }
}

/// `BufferOffsets` in `lib/buffer_offsets.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct BufferOffsets {
    pub grids_at: u32,
    pub cells_at: u32,
    pub leaves: u32,
    pub batches: u32,
    pub ranges_at: u32,
    pub chunks_at: u32,
    pub sorted_at: u32,
    pub points_at: u32,
    pub light_maps: u32,
    pub padding_a: u32,
    pub padding_b: u32,
    pub padding_c: u32,
}

/// `Vertex` in `lib/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Vertex {
    pub position: Vec3,
    pub u1: f32,
    pub normal: Vec3,
    pub v1: f32,
    pub tangent: Vec4,
    pub uv0: Vec2,
    /// Two times 16 bits: red and green, blue and nothing.
    pub color: [u32; 2],
}

/// `Triangle` in `lib/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Triangle {
    pub vertices: [u32; 3],
    pub material: u32,
}

/// `TextureUse` in `lib/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct TextureUse {
    pub matrix: [f32; 4],
    pub shift: Vec2,
    pub texture: u32,
    pub uv_set: u32,
}

impl From<Option<TextureRef>> for TextureUse {
    fn from(texture: Option<TextureRef>) -> Self {
        let t = texture.unwrap_or(TextureRef { texture: NONE, uv_set: 0, transform: Affine2::IDENTITY });
        Self {
            matrix: t.transform.matrix2.to_cols_array(),
            shift: t.transform.translation,
            texture: t.texture,
            uv_set: t.uv_set,
        }
    }
}

/// `Material` in `lib/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct GpuMaterial {
    pub base_color: Vec3,
    pub alpha: f32,
    pub emission: Vec3,
    pub alpha_cutoff: f32,
    pub specular_color: Vec3,
    pub specular: f32,
    pub metallic: f32,
    pub roughness: f32,
    pub normal_scale: f32,
    pub transmission: f32,
    pub albedo: Vec3,
    pub flags: u32,
    pub base_color_texture: TextureUse,
    pub metallic_roughness_texture: TextureUse,
    pub specular_texture: TextureUse,
    pub specular_color_texture: TextureUse,
    pub normal_texture: TextureUse,
    pub emission_texture: TextureUse,
    pub transmission_texture: TextureUse,
}

impl From<&Material> for GpuMaterial {
    fn from(m: &Material) -> Self {
        Self {
            base_color: if m.unlit { Vec3::ZERO } else { m.base_color },
            alpha: m.alpha,
            emission: if m.unlit { m.base_color } else { m.emission },
            alpha_cutoff: m.alpha_cutoff.unwrap_or(-1.0),
            specular_color: m.specular_color,
            specular: if m.unlit { 0.0 } else { m.specular },
            metallic: if m.unlit { 0.0 } else { m.metallic },
            roughness: m.roughness,
            normal_scale: m.normal_texture.map_or(1.0, |n| n.scale),
            transmission: m.transmission,
            albedo: if m.unlit { Vec3::ZERO } else { albedo(m) },
            flags: flags(m),
            base_color_texture: m.base_color_texture.into(),
            metallic_roughness_texture: m.metallic_roughness_texture.into(),
            specular_texture: m.specular_texture.into(),
            specular_color_texture: m.specular_color_texture.into(),
            normal_texture: m.normal_texture.map(|n| n.texture).into(),
            emission_texture: if m.unlit { m.base_color_texture } else { m.emission_texture }.into(),
            transmission_texture: m.transmission_texture.into(),
        }
    }
}

/// Of the diffuse reflection, but for textures.
fn albedo(m: &Material) -> Vec3 {
    let (metallic, roughness) = (m.metallic, m.roughness);
    let mut surface =
        Surface::from_metallic_roughness(m.base_color, metallic, roughness, m.specular, m.specular_color);
    let opacity = if m.blended { m.alpha } else { 1.0 };
    surface.see_through(opacity, m.transmission, Vec3::ZERO, 1.0);
    surface.albedo
}

fn flags(m: &Material) -> u32 {
    let flags = [
        (m.vertex_colors, VERTEX_COLORED),
        (m.unlit, UNLIT),
        (m.double_sided, DOUBLE_SIDED),
        (m.is_transparent(), TRANSPARENT),
        (m.blended, BLENDED),
    ];
    flags.into_iter().filter(|(is, _)| *is).map(|(_, flag)| flag).sum()
}

/// `Light` in `lib/light.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct Light {
    pub position: Vec3,
    pub profile: u32,
    pub normal: Vec3,
    pub scale: f32,
    pub tangent: Vec3,
    pub offset: f32,
    pub intensity: Vec3,
    pub atlas_slot: u32,
    pub rectangle: Vec4,
    pub lobe: Vec4,
}

/// `PreviousTransform` in `lib/previous_transform.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct PreviousTransform {
    pub x: Vec4,
    pub y: Vec4,
    pub z: Vec4,
}

/// `TransferObject` in `lib/transfer_object.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct TransferObject {
    pub box_from_world_x: Vec4,
    pub box_from_world_y: Vec4,
    pub box_from_world_z: Vec4,
    pub world_from_box_x: Vec4,
    pub world_from_box_y: Vec4,
    pub world_from_box_z: Vec4,
    pub transfer_from_world_x: Vec3,
    pub bands: u32,
    pub transfer_from_world_y: Vec3,
    pub channels: u32,
    pub transfer_from_world_z: Vec3,
    pub index: u32,
    pub points: [u32; 3],
    pub first_vertex: u32,
    pub margin: Vec3,
    pub vertices: u32,
    pub mover: u32,
    pub sides: u32,
    pub clusters: u32,
    pub bases: u32,
}

/// `VertexRange` in `lib/vertex_range.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct VertexRange {
    pub first: u32,
    pub count: u32,
    pub padding_a: u32,
    pub padding_b: u32,
}

/// `Maps` in `lib/maps.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct Maps {
    pub page: [f32; 2],
    pub unit: u32,
    pub padding: u32,
    pub sizes: [[f32; 4]; MAP_SIZES as usize],
}

/// `MultipassParams` in `lib/multipass_params.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct MultipassParams {
    pub elements: u32,
    pub lights_per_pass: u32,
    pub lights_in_all: u32,
    pub padding: u32,
}

/// Head of `ShadeList` in `lib/shade_list.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct ShadeListHeader {
    pub points: u32,
    pub next_flat: u32,
    pub next_curved: u32,
    pub padding: u32,
}

/// Head of `PointQueue` in `lib/point_queue.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct PointQueueHeader {
    pub points: u32,
    pub chunks: u32,
    pub next_chunk: u32,
    pub finished: u32,
}

/// Head of `Candidates` in `lib/candidates.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct CandidatesHeader {
    pub flat_workgroups: u32,
    pub flat_workgroups_y: u32,
    pub flat_workgroups_z: u32,
    pub flat_count: u32,
    pub curved_workgroups: u32,
    pub curved_workgroups_y: u32,
    pub curved_workgroups_z: u32,
    pub curved_count: u32,
}

/// `DispatchArguments` in `prefix_sum.wgsl`: workgroups in x, y and z.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct DispatchArguments {
    pub scatter_points: [u32; 4],
    pub shade_points: [u32; 4],
    pub shade_points_cooperative: [u32; 4],
    pub chunks: [u32; 4],
}

/// `DrawArguments` in `multipass_arguments.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct DrawArguments {
    pub vertex_count: u32,
    pub instance_count: u32,
    pub first_vertex: u32,
    pub first_instance: u32,
}

/// [`Frame::clamp`].
pub(crate) fn clamp(clamp: Clamp) -> f32 {
    match clamp {
        Clamp::Own => OWN_CLAMP,
        Clamp::At(bound) => bound,
        Clamp::Off => MAX_CLAMP,
    }
}

impl Light {
    /// Whether its light is parallel.
    pub fn is_parallel(&self) -> bool {
        self.profile >= DIRECTIONAL
    }

    /// Whether it stands for a part of a surface, one of many: a lamp's or a lit wall's.
    pub fn is_sample(&self) -> bool {
        self.profile == COSINE
    }

    /// A light sample without its place in the atlas. Maps are turned about their normals by the golden angle from
    /// one light to the next, so that the edges of their texels do not line up, and from one `set` of a refined picture to the
    /// next, so that those of lights that stay average out. `radius` is the scene's, in metres.
    pub fn new(id: u32, set: u32, sample: &LightSample, radius: f32) -> Self {
        use girandole_core::math::warp;
        let (profile, scale, offset) = match sample.profile {
            Profile::Cosine | Profile::Lobe { .. } => (COSINE, 0.0, 0.0),
            Profile::Hemisphere => (HEMISPHERE, 0.0, 0.0),
            Profile::Spot { scale, offset } => (SPOT, scale, offset),
            Profile::Directional => (DIRECTIONAL, 1.0 / radius, 1.0 / radius),
            Profile::Distant { shown, .. } => (DISTANT, 1.0 / shown.radius, 1.0 / radius),
        };
        let (x, y) = warp::frame(sample.normal);
        let turn = f64::from(id) * 0.618_033_988_75 + f64::from(set) * 0.414_213_562_37;
        let turn = turn.fract() as f32 * std::f32::consts::TAU;
        let light = Self {
            position: sample.position,
            profile,
            normal: sample.normal,
            scale,
            tangent: x * turn.cos() + y * turn.sin(),
            offset,
            intensity: sample.intensity,
            lobe: sample.profile.lobe().map_or(Vec4::W, |(axis, matt)| axis.extend(matt)),
            ..Self::default()
        };
        match (sample.profile, sample.rectangle) {
            (_, Some(rectangle)) if light.is_sample() => light.with_rectangle(&rectangle, sample.is_spread()),
            (Profile::Directional, _) => light.showing(Vec2::ZERO, radius),
            (Profile::Distant { solid_angle, shown, .. }, _) => {
                let is_of_sun = f32::from(u8::from(sample.is_of_sun()));
                let less = ParallelMap::less(shown.core / shown.radius);
                let light = Self { rectangle: Vec4::new(solid_angle, is_of_sun, less, 0.0), ..light };
                light.showing(light.across(shown.center), shown.radius)
            }
            _ => light,
        }
    }

    /// Parallel light with a map that shows a square about `middle`, in metres along its tangent and bitangent, so far to either side.
    /// Depth runs over the scene's diameter.
    pub fn showing(&self, middle: Vec2, half: f32) -> Self {
        let bitangent = self.normal.cross(self.tangent);
        let position = self.tangent * middle.x + bitangent * middle.y - self.normal / self.offset;
        Self { position, scale: 1.0 / half, ..*self }
    }

    /// A point's place across the light: along its tangent and bitangent.
    pub fn across(&self, point: Vec3) -> Vec2 {
        Vec2::new(point.dot(self.tangent), point.dot(self.normal.cross(self.tangent)))
    }

    /// Where its map, of parallel light, shows what.
    pub fn parallel_map(&self) -> ParallelMap {
        ParallelMap::new(self.rectangle.z)
    }

    /// How many metres across that would show if all its texels were as large as those in the middle of a sphere.
    pub fn shown_width(&self, center: Vec3) -> f32 {
        let place = self.across(center - self.position) * self.scale;
        2.0 / self.scale * self.parallel_map().spacing_about(place.extend(0.0).extend(0.0))
    }

    /// The light with what it stands for.
    fn with_rectangle(self, rectangle: &Rectangle, is_spread: bool) -> Self {
        let bitangent = self.normal.cross(self.tangent);
        let [u, v] = rectangle.half_axes;
        let center = rectangle.center - self.position;
        let along = |d: Vec3| [d.dot(self.tangent), d.dot(bitangent)];
        let ([x, y], [z, w]) = (along(center), along(u));
        Self {
            scale: v.length() / u.length() * if rectangle.is_open { 1.0 } else { -1.0 },
            offset: (rectangle.reach() + center.length()).powi(2) * if is_spread { -1.0 } else { 1.0 },
            rectangle: Vec4::new(x, y, z, w),
            ..self
        }
    }
}

const _: () = assert!(ShadowMap::Octahedral as u32 == OCTAHEDRAL);
const _: () = assert!(ShadowMap::Parabolic as u32 == PARABOLIC);
const _: () = assert!(ShadowMap::Cube as u32 == CUBE);

/// `LightMapUpdate` in `light_maps.wgsl`: what changes of a leaf's light map for a batch of lights.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct LightMapUpdate {
    pub leaf: u32,
    pub first: u32,
    pub end: u32,
    pub kind: u32,
    pub units: f32,
}

/// `MapPart` in `lib/map_parts.wgsl`: a part of a light's map that is drawn.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct MapPart {
    pub position: Vec3,
    pub parallel: f32,
    pub x: Vec3,
    pub first_listed: u32,
    pub y: Vec3,
    pub hidden: u32,
    pub z: Vec3,
    pub size: u32,
    pub first: [u32; 2],
    pub end: [u32; 2],
    pub origin: [u32; 2],
    pub page: u32,
    pub texels: u32,
}

/// `Occluders` in `lib/map_set_up.wgsl`: what of them there is, for a batch of parts of maps.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub(crate) struct MapOccluders {
    pub clusters: u32,
    pub first_pair: u32,
    pub slices: u32,
}

/// `Display` in `tonemap.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Display {
    pub size: [u32; 2],
    pub exposure: f32,
    pub automatic: u32,
}
