//! A frame's dispatches: bands of rows, sub-pixel samples, grids of points, batches of lights.

use crate::bind;
use crate::layout::Frame;
use crate::passes::shade::BATCH;
use crate::settings::RenderSettings;
use girandole_core::glam::Vec2;
use girandole_core::scene::LocalView;

/// A batch of lights for a grid of points of a sub-pixel sample of a band of rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    pub band: [u32; 2],
    pub sample: u32,
    /// Pixels from a point of the grid to the next.
    pub step: u32,
    pub first_light: u32,
    pub end_light: u32,
    /// Whether all lights are done after this one.
    pub last_batch: bool,
}

/// The dispatches of a frame, in order: for each band and sample, and for each of `grids` (their steps in pixels),
/// batches of lights.
pub(crate) fn steps(
    size: [u32; 2],
    band_rows: u32,
    samples_per_axis: u32,
    grids: &[u32],
    lights: u32,
    batch: u32,
) -> Vec<Step> {
    let mut steps = Vec::new();
    for first_row in (0..size[1]).step_by(band_rows as usize) {
        let band = [first_row, (first_row + band_rows).min(size[1])];
        for sample in 0..samples_per_axis * samples_per_axis {
            for &step in grids {
                // Without any light there is still one step, for what emits.
                for first_light in (0..lights.max(1)).step_by(batch as usize) {
                    let end_light = first_light.saturating_add(batch).min(lights);
                    let last_batch = end_light == lights;
                    steps.push(Step { band, sample, step, first_light, end_light, last_batch });
                }
            }
        }
    }
    steps
}

/// The uniform of one dispatch.
pub(crate) fn frame(
    view: &LocalView,
    size: [u32; 2],
    settings: &RenderSettings,
    [scale, extent]: [f32; 2],
    step: &Step,
) -> Frame {
    let n = settings.samples_per_axis;
    let center = |i: u32| (i as f32 + 0.5) / n as f32;
    // The first sample is the one next to the pixel's centre.
    let central = (n - 1) / 2 * (n + 1);
    let place = match step.sample {
        0 => central,
        s if s == central => 0,
        s => s,
    };
    Frame {
        eye: view.eye,
        orthographic: u32::from(view.orthographic),
        right: view.right,
        half_width: view.half_extent.x,
        up: view.up,
        half_height: view.half_extent.y,
        forward: view.forward,
        near: scale * 1e-5,
        size,
        band: step.band,
        offset: Vec2::new(center(place % n), center(place / n)),
        first_light: step.first_light,
        end_light: step.end_light,
        clamp: settings.clamp.unwrap_or(f32::MAX),
        // Far enough to see the whole scene from any eye that sees it at all.
        far: (view.eye.length() + extent) * 2.0,
        sample: step.sample,
        samples: n * n,
        last_row: step.band[1].min(size[1] - 1),
        step: step.step,
        batch: step.first_light / BATCH,
        last_batch: u32::from(step.last_batch),
        tolerance: settings.tolerance,
        debug: u32::from(settings.debug.is_some()),
        ..Frame::default()
    }
}

/// All of a frame's uniforms in one buffer.
pub(crate) struct FrameUniforms {
    /// Bind group 0, with a dynamic offset.
    pub group: wgpu::BindGroup,
    /// Bytes from one uniform to the next.
    pub stride: u32,
}

impl FrameUniforms {
    pub fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        steps: &[Step],
        frame: impl Fn(&Step) -> Frame,
    ) -> Self {
        use wgpu::util::DeviceExt;
        let size = size_of::<Frame>();
        let stride = size.next_multiple_of(device.limits().min_uniform_buffer_offset_alignment as usize);
        let mut contents = vec![0u8; stride * steps.len()];
        for (slot, step) in contents.chunks_exact_mut(stride).zip(steps) {
            slot[..size].copy_from_slice(bytemuck::bytes_of(&frame(step)));
        }
        let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("frames"),
            contents: &contents,
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let binding =
            wgpu::BufferBinding { buffer: &buffer, offset: 0, size: wgpu::BufferSize::new(size as u64) };
        Self {
            group: bind::group(device, layout, &[wgpu::BindingResource::Buffer(binding)]),
            stride: stride as u32,
        }
    }
}
