//! Buffers that hold what the picture needs: they depend on its size and on the number of leaf receivers.

use crate::gpu_scene::receivers::Receivers;
use crate::layout::{BufferOffsets, CandidatesHeader, DispatchArguments, PointQueueHeader, ShadeListHeader};
use crate::points::targets::Targets;
use crate::records::ShadePoint;
use crate::shader_constants::{CHUNK, TALLY_ROWS};
use crate::{Error, Remedy, Result};
use std::mem::offset_of;
use wgpu::util::DeviceExt;

/// Byte offsets of the arguments of dispatches.
pub(crate) const SCATTER_AT: u64 = offset_of!(DispatchArguments, scatter_points) as u64;
pub(crate) const SHADE_AT: u64 = offset_of!(DispatchArguments, shade_points) as u64;
pub(crate) const COOPERATIVE_AT: u64 = offset_of!(DispatchArguments, shade_points_cooperative) as u64;
pub(crate) const CHUNKS_AT: u64 = offset_of!(DispatchArguments, chunks) as u64;
pub(crate) const FLAT_AT: u64 = offset_of!(CandidatesHeader, flat_workgroups) as u64;
pub(crate) const CURVED_AT: u64 = offset_of!(CandidatesHeader, curved_workgroups) as u64;

/// Points to shade and their order.
pub(crate) struct PointLists {
    /// Pixels that may have to be shaded, and the arguments of the dispatches that test them.
    pub candidates: wgpu::Buffer,
    /// Points to shade, in any order.
    pub shade_list: wgpu::Buffer,
    /// The same in order of leaves.
    pub point_queue: wgpu::Buffer,
    pub dispatch_arguments: wgpu::Buffer,
    pub tally: wgpu::Buffer,
    /// Without light maps, and with them.
    offsets: [wgpu::Buffer; 2],
    /// What it was made for.
    pub key: (u32, BufferOffsets),
}

impl PointLists {
    /// Points that the targets' bands hold at most.
    pub fn capacity(targets: &Targets) -> u32 {
        targets.size[0] * (targets.band_rows + 1)
    }

    /// Where things are in the buffers for so many points.
    pub fn offsets_for(receivers: &Receivers, capacity: u32) -> BufferOffsets {
        // The first chunk of each leaf and their number come before.
        let chunks_at = 2 * receivers.offsets.leaves;
        let chunks = capacity / CHUNK + receivers.offsets.leaves;
        BufferOffsets {
            chunks_at,
            sorted_at: chunks_at + chunks,
            points_at: receivers.offsets.leaves,
            ..receivers.offsets
        }
    }

    /// The uniform of these offsets, without light maps or with them.
    pub fn offsets(&self, light_maps: bool) -> &wgpu::Buffer {
        &self.offsets[usize::from(light_maps)]
    }

    /// # Errors
    /// [`Error::TooLarge`] where a buffer exceeds the device's limit.
    pub fn new(device: &wgpu::Device, capacity: u32, offsets: BufferOffsets) -> Result<Self> {
        use wgpu::BufferUsages as U;
        let limit = device.limits().max_storage_buffer_binding_size;
        let buffer = |label, words: u64, usage| {
            if words * 4 > limit {
                let what = format!(
                    "the {label} of this picture take {} MiB and this device binds {} MiB at most",
                    words >> 18,
                    limit >> 20
                );
                return Err(Error::too_large(what, Remedy::SmallerPictureOrNaive));
            }
            let size = words * 4;
            Ok(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: U::STORAGE | usage,
                mapped_at_creation: false,
            }))
        };
        let (leaves, points) = (u64::from(offsets.leaves), u64::from(capacity));
        let sorted = u64::from(offsets.sorted_at - offsets.chunks_at) * u64::from(CHUNK);
        let words = |header: usize, words: u64| header as u64 / 4 + words;
        let shade_list = words(size_of::<ShadeListHeader>(), leaves + ShadePoint::WORDS as u64 * points);
        let point_queue = words(size_of::<PointQueueHeader>(), u64::from(offsets.sorted_at) + sorted);
        Ok(Self {
            candidates: buffer("candidates", words(size_of::<CandidatesHeader>(), points), U::INDIRECT)?,
            shade_list: buffer("points to shade", shade_list, U::empty())?,
            point_queue: buffer("sorted points", point_queue, U::empty())?,
            dispatch_arguments: buffer(
                "dispatch arguments",
                words(size_of::<DispatchArguments>(), 0),
                U::INDIRECT,
            )?,
            tally: buffer("tally", u64::from(TALLY_ROWS) * leaves.max(1), U::COPY_SRC | U::COPY_DST)?,
            offsets: [0, 1].map(|light_maps| {
                device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: Some("buffer offsets"),
                    contents: bytemuck::bytes_of(&BufferOffsets { light_maps, ..offsets }),
                    usage: U::UNIFORM,
                })
            }),
            key: (capacity, offsets),
        })
    }
}
