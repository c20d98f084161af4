//! Buffers that hold what the picture needs: they depend on its size and on the number of leaf receivers.

use crate::layout::Plan;
use crate::receivers::Receivers;
use crate::targets::Targets;
use crate::{Error, Remedy, Result};
use wgpu::util::DeviceExt;

/// Points of one leaf that are shaded together; shaders know it as `CHUNK`.
pub(crate) const CHUNK: u32 = 2;
/// Words before the lists in `wanted` and `queue`; shaders know it as `COUNTS` and `FIRSTS`.
pub(crate) const HEADER: u32 = 16;
/// Words of a point in `wanted`; shaders know it as `POINT_WORDS`.
pub(crate) const POINT_WORDS: u32 = 3;
/// Rows of the tally: steps of 1, 2, 4 and 8 pixels, and further samples at edges.
pub(crate) const TALLY_ROWS: u32 = 5;

/// Words of `open` before what is said of places on curved surfaces, and before the places; shaders know them by the
/// same names.
pub(crate) const BENT_HEADER: u32 = 4;
pub(crate) const FIRST_PLACE: u32 = 8;

/// Bytes before the dispatches in `arguments`: of points to put in order, of chunks as they are shaded, of lanes that
/// share points, and of an invocation for each chunk.
pub(crate) const SCATTER_AT: u64 = 0;
pub(crate) const GATHER_AT: u64 = 16;
pub(crate) const WIDE_AT: u64 = 32;
pub(crate) const CHUNKS_AT: u64 = 48;

/// Points to shade and their order.
pub(crate) struct Selection {
    /// Places that may have to be shaded, and how many workgroups look at them.
    pub open: wgpu::Buffer,
    /// Points to shade, as they were found.
    pub wanted: wgpu::Buffer,
    /// The same in order of leaves.
    pub queue: wgpu::Buffer,
    pub arguments: wgpu::Buffer,
    pub tally: wgpu::Buffer,
    /// Without light maps, and with them.
    plans: [wgpu::Buffer; 2],
    /// Whether this frame uses them.
    pub light_maps: bool,
    /// What it was made for.
    pub key: (u32, Plan),
}

impl Selection {
    /// Points that the targets' bands hold at most.
    pub fn capacity(targets: &Targets) -> u32 {
        targets.size[0] * (targets.band_rows + 1)
    }

    /// The plan of the buffers for so many points.
    pub fn plan(receivers: &Receivers, capacity: u32) -> Plan {
        let chunks_at = HEADER + receivers.leaves;
        let chunks = capacity / CHUNK + receivers.leaves;
        Plan {
            chunks_at,
            sorted_at: chunks_at + chunks,
            points_at: HEADER + receivers.leaves,
            ..receivers.plan
        }
    }

    /// The plan of this frame.
    pub fn plan_buffer(&self) -> &wgpu::Buffer {
        &self.plans[usize::from(self.light_maps)]
    }

    /// # Errors
    /// [`Error::TooLarge`] where a buffer exceeds the device's limit.
    pub fn new(device: &wgpu::Device, capacity: u32, plan: Plan) -> Result<Self> {
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
        let (leaves, points) = (u64::from(plan.leaves), u64::from(capacity));
        let sorted = (u64::from(plan.sorted_at - plan.chunks_at)) * u64::from(CHUNK);
        Ok(Self {
            open: buffer("open places", u64::from(FIRST_PLACE) + points, U::INDIRECT)?,
            wanted: buffer(
                "points",
                u64::from(HEADER) + leaves + u64::from(POINT_WORDS) * points,
                U::empty(),
            )?,
            queue: buffer("queue", u64::from(plan.sorted_at) + sorted, U::empty())?,
            arguments: buffer("arguments", 16, U::INDIRECT)?,
            tally: buffer("tally", u64::from(TALLY_ROWS) * leaves.max(1), U::COPY_SRC | U::COPY_DST)?,
            plans: [0, 1].map(|light_maps| {
                device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: Some("plan"),
                    contents: bytemuck::bytes_of(&Plan { light_maps, ..plan }),
                    usage: U::UNIFORM,
                })
            }),
            light_maps: false,
            key: (capacity, plan),
        })
    }
}
