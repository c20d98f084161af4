//! Which passes multipass shading makes: elements (sets of receivers with sets of lights), a few lights a pass (Barczak
//! §4.3.4, §4.3.5).

use crate::Result;
use crate::device::buffers::storage;
use crate::gpu_scene::receivers::Receivers;
use crate::layout::{DrawArguments, MultipassParams};
use crate::records::{Element, Member};
use crate::shader_constants::{MAPPED_UNSHADOWED, NO_PART, UNSHADOWED};
use girandole_core::Generation;
use girandole_core::elements::{LightSets, optimise, unmerged};
use wgpu::util::DeviceExt;

/// Most lights a pass.
pub(crate) const MAX_LIGHTS_PER_PASS: u32 = 32;

/// All passes over a grid of points.
pub(crate) struct MultipassPlan {
    /// `MultipassParams` for the shaders.
    pub params: wgpu::Buffer,
    /// Elements with their members and lights, see `lib/multipass_params.wgsl`.
    pub elements: wgpu::Buffer,
    /// Arguments of the draw.
    pub arguments: wgpu::Buffer,
    /// Four bits a leaf and light: the part of its lists that the light is in.
    pub parts: wgpu::Buffer,
    /// How many passes.
    pub count: u32,
    /// How many without optimisation.
    pub unmerged: u32,
    /// What it was made for.
    pub key: MultipassKey,
}

/// What draws depend on, beside the receivers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MultipassKey {
    /// Of the scene.
    pub version: Generation,
    pub lights_per_pass: u32,
    pub light_maps: bool,
    pub optimised: bool,
    /// Leaves that may be in view.
    pub in_view: Vec<bool>,
}

impl MultipassPlan {
    /// # Errors
    /// [`crate::Error::TooLarge`] where a table exceeds the device's limits.
    pub fn new(device: &wgpu::Device, receivers: &Receivers, key: MultipassKey) -> Result<Self> {
        let lights = receivers.light_count() as usize;
        // A light that its light map holds and nothing blocks is done.
        let first_part = if key.light_maps { UNSHADOWED } else { MAPPED_UNSHADOWED };
        let parts = first_part..NO_PART;
        let mut sets = LightSets::new(receivers.leaf_count() as usize, lights);
        // Objects are leaves in their shading order, in which neighbours have lights in common.
        for (object, &leaf) in receivers.order.leaves.iter().enumerate() {
            let pairs = receivers.pairs.row(leaf as usize).iter();
            for (light, _) in pairs.enumerate().filter(|(_, pair)| parts.contains(&pair.part())) {
                if key.in_view[leaf as usize] {
                    sets.insert(object as u32, light as u32);
                }
            }
        }
        let before = unmerged(&sets);
        let unmerged_passes = girandole_core::elements::passes(&before, key.lights_per_pass);
        let elements = if key.optimised { optimise(&sets, key.lights_per_pass) } else { before };

        let mut words = vec![0u32; Element::WORDS * elements.len()];
        for (index, element) in elements.iter().enumerate() {
            let member =
                |&object: &u32| Member { leaf: receivers.order.leaves[object as usize], chunks_before: 0 };
            let members: Vec<Member> = element.objects.iter().map(member).collect();
            let members_at = words.len() as u32;
            words.extend_from_slice(bytemuck::cast_slice(&members));
            let record = Element {
                members_at,
                member_count: members.len() as u32,
                lights_at: words.len() as u32,
                light_count: element.lights.len() as u32,
                ..Element::default()
            };
            words.extend(&element.lights);
            words[Element::WORDS * index..][..Element::WORDS]
                .copy_from_slice(bytemuck::cast_slice(&[record]));
        }
        let passes = MultipassParams {
            elements: elements.len() as u32,
            lights_per_pass: key.lights_per_pass,
            lights_in_all: receivers.light_count(),
            padding: 0,
        };
        let parts: Vec<u32> = receivers
            .pairs
            .all()
            .chunks(8)
            .map(|pairs| pairs.iter().rev().fold(0, |word, pair| word << 4 | pair.part()))
            .collect();
        Ok(Self {
            params: device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("passes"),
                contents: bytemuck::bytes_of(&passes),
                usage: wgpu::BufferUsages::UNIFORM,
            }),
            elements: storage(device, "elements", &words)?,
            arguments: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("draw arguments"),
                size: size_of::<DrawArguments>() as u64,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT,
                mapped_at_creation: false,
            }),
            parts: storage(device, "parts", &parts)?,
            count: girandole_core::elements::passes(&elements, key.lights_per_pass),
            unmerged: unmerged_passes,
            key,
        })
    }
}
