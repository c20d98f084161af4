//! Which draws multipass shading makes: elements (sets of receivers with sets of lights), a few lights a draw (Barczak
//! §4.3.4, §4.3.5).

use crate::gpu_scene::storage;
use crate::layout::Draw;
use crate::receivers::{NO_PART, Receivers};
use crate::{Error, Result};
use girandole_core::elements::{LightSets, optimise, unmerged};
use girandole_core::glam::Vec2;
use girandole_core::scene::View;
use wgpu::util::DeviceExt;

/// Most lights a draw, what [`Draw`] has room for.
pub(crate) const MAX_LIGHTS_PER_PASS: u32 = 32;

/// All draws of a grid of points.
pub(crate) struct Draws {
    /// One [`Draw`] each, `stride` apart.
    pub uniforms: wgpu::Buffer,
    pub stride: u32,
    pub count: u32,
    /// Four bits a leaf and light: the part of its lists that the light is in.
    pub parts: wgpu::Buffer,
    /// Where the members of each element are; their leaves. See `batch.wgsl`.
    pub members: wgpu::Buffer,
    /// Arguments of an indirect draw for each element.
    pub arguments: wgpu::Buffer,
    pub elements: u32,
    /// The element of each draw.
    pub element_of: Vec<u32>,
    /// Passes without optimisation.
    pub unmerged: u32,
    /// What it was made for.
    pub key: DrawsKey,
}

/// What draws depend on, beside the receivers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct DrawsKey {
    pub lights_per_pass: u32,
    pub light_maps: bool,
    pub optimised: bool,
    /// Leaves that may be in view.
    pub in_view: Vec<bool>,
}

/// Which leaves may be in view: those whose bounding spheres meet the camera's pyramid.
pub(crate) fn in_view(receivers: &Receivers, view: &View) -> Vec<bool> {
    let half = view.half_extent;
    receivers
        .bounds
        .iter()
        .map(|&(center, radius)| {
            let d = center - view.eye;
            let (depth, across) = (d.dot(view.forward), Vec2::new(d.dot(view.right), d.dot(view.up)).abs());
            if view.orthographic {
                return across.cmple(half + radius).all();
            }
            let slant = (Vec2::ONE + half * half).map(f32::sqrt);
            depth >= -radius && (across - half * depth).cmple(slant * radius).all()
        })
        .collect()
}

impl Draws {
    /// # Errors
    /// [`Error::TooLarge`] where a table exceeds the device's limits.
    pub fn new(device: &wgpu::Device, receivers: &Receivers, key: DrawsKey) -> Result<Self> {
        let lights = receivers.lights as usize;
        // A light that its light map holds and nothing blocks is done.
        let first_part = u8::from(key.light_maps);
        let counts = |kind: u8| kind >= first_part && kind < NO_PART;
        let mut sets = LightSets::new(receivers.leaves as usize, lights);
        for (index, &kind) in receivers.kinds.iter().enumerate() {
            if counts(kind) && key.in_view[index / lights] {
                sets.insert((index / lights) as u32, (index % lights) as u32);
            }
        }
        let before = unmerged(&sets);
        let unmerged_passes = girandole_core::elements::passes(&before, key.lights_per_pass);
        let elements = if key.optimised { optimise(&sets, key.lights_per_pass) } else { before };

        let stride =
            size_of::<Draw>().next_multiple_of(device.limits().min_uniform_buffer_offset_alignment as usize);
        let mut uniforms = Vec::new();
        let mut members = vec![0u32; 2 * elements.len()];
        let mut element_of = Vec::new();
        for (index, element) in elements.iter().enumerate() {
            let first_member = members.len() as u32;
            members[2 * index] = first_member;
            members[2 * index + 1] = element.objects.len() as u32;
            members.extend(element.objects.iter().flat_map(|&leaf| [leaf, 0]));
            for group in element.lights.chunks(key.lights_per_pass as usize) {
                let mut draw = Draw {
                    first_member,
                    member_count: element.objects.len() as u32,
                    count: group.len() as u32,
                    lights_in_all: receivers.lights,
                    lights: [0; MAX_LIGHTS_PER_PASS as usize],
                };
                draw.lights[..group.len()].copy_from_slice(group);
                uniforms.extend_from_slice(bytemuck::bytes_of(&draw));
                uniforms.resize(uniforms.len().next_multiple_of(stride), 0);
                element_of.push(index as u32);
            }
        }
        let count = element_of.len() as u32;
        if uniforms.len() as u64 > device.limits().max_buffer_size {
            return Err(Error::TooLarge(format!(
                "{count} passes are too many for this device; use --shading fused"
            )));
        }
        if uniforms.is_empty() {
            uniforms.resize(stride, 0);
        }
        let parts: Vec<u32> = receivers
            .kinds
            .chunks(8)
            .map(|kinds| kinds.iter().rev().fold(0, |word, &kind| word << 4 | u32::from(kind)))
            .collect();
        Ok(Self {
            uniforms: device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("draws"),
                contents: &uniforms,
                usage: wgpu::BufferUsages::UNIFORM,
            }),
            stride: stride as u32,
            count,
            parts: storage(device, "parts", &parts)?,
            members: storage(device, "members", &members)?,
            arguments: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("draw arguments"),
                size: 16 * elements.len().max(1) as u64,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT,
                mapped_at_creation: false,
            }),
            elements: elements.len() as u32,
            element_of,
            unmerged: unmerged_passes,
            key,
        })
    }
}
