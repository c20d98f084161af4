//! Shows radiance on the caller's target.

use super::exposure::Stops;
use crate::device::kernel::{Draw, RenderKernel, Shared, buffer, texture};
use crate::device::recorder::Recorder;
use crate::layout::Display;
use crate::points::targets::Targets;
use crate::settings::{RenderSettings, Target};
use crate::shader_constants::{ACES, AGX, NO_CURVE};
use crate::shaders;
use girandole_core::tonemap::{Exposure, Tonemap};
use wgpu::util::DeviceExt;

/// What a pipeline is made for.
#[derive(Clone, Copy, PartialEq)]
struct Key {
    format: wgpu::TextureFormat,
    curve: Tonemap,
    keeps_background: bool,
}

/// The largest value of a floating-point format of colours, as far as all its channels hold it.
fn largest_float(format: wgpu::TextureFormat) -> Option<f64> {
    use wgpu::TextureFormat as F;
    match format {
        F::R16Float | F::Rg16Float | F::Rgba16Float => Some(65504.0),
        // Blue has one bit less than the others.
        F::Rg11b10Ufloat => Some(64512.0),
        F::R32Float | F::Rg32Float | F::Rgba32Float => Some(3e38),
        _ => None,
    }
}

fn kernel(device: &wgpu::Device, shared: &Shared, key: Key) -> RenderKernel {
    let curve = match key.curve {
        Tonemap::Agx => AGX,
        Tonemap::Aces => ACES,
        Tonemap::None => NO_CURVE,
    };
    // A target with an sRGB format encodes by itself; floating-point targets stay linear.
    let largest = largest_float(key.format);
    let encodes = !key.format.is_srgb() && largest.is_none();
    let flag = |name, value: bool| (name, f64::from(u8::from(value)));
    let draw = Draw {
        vertex: "fullscreen",
        fragment: Some("show"),
        topology: wgpu::PrimitiveTopology::TriangleList,
        depth: None,
        targets: vec![Some(wgpu::ColorTargetState {
            format: key.format,
            blend: key.keeps_background.then_some(wgpu::BlendState::ALPHA_BLENDING),
            write_mask: wgpu::ColorWrites::ALL,
        })],
    };
    let constants = [
        ("CURVE", f64::from(curve)),
        flag("ENCODE", encodes),
        ("LARGEST", largest.unwrap_or(1.0)),
        flag("COVERAGE", key.keeps_background),
    ];
    RenderKernel::new(device, shared, (&shaders::TONEMAP, &shared.kernels), draw, &constants)
}

/// Writes the picture to `target`.
pub(crate) fn record(
    recorder: &mut Recorder,
    shared: &Shared,
    targets: &Targets,
    stops: Stops,
    settings: &RenderSettings,
    target: &Target,
) {
    let device = recorder.device;
    let key =
        Key { format: target.format, curve: settings.tonemap, keeps_background: target.keep_background };
    let kernel = kernel(device, shared, key);
    let display = Display {
        size: target.size,
        exposure: match settings.exposure {
            Exposure::Ev(ev) => ev,
            Exposure::Auto => 0.0,
        },
        automatic: u32::from(settings.exposure == Exposure::Auto),
    };
    let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("display"),
        contents: bytemuck::bytes_of(&display),
        usage: wgpu::BufferUsages::UNIFORM,
    });
    let resources = [
        buffer("display", &uniform),
        texture("picture", &targets.picture_view),
        buffer("automatic", stops.0),
    ];
    let group = kernel.group(device, &resources);
    let load =
        if target.keep_background { wgpu::LoadOp::Load } else { wgpu::LoadOp::Clear(Default::default()) };
    let mut pass = recorder.encoder().begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("tonemap"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: target.color,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        })],
        depth_stencil_attachment: None,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    kernel.set(&mut pass, (None, None), &group);
    pass.draw(0..3, 0..1);
}
