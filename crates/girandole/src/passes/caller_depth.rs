//! Depth of the caller's own opaque things: it comes in before ours is drawn, and ours goes out afterwards.

use super::BandSample;
use super::visibility_buffer::Seen;
use crate::device::kernel::{Draw, RenderKernel, Shared, texture};
use crate::device::recorder::Recorder;
use crate::points::targets::DEPTH;
use crate::shaders;

pub(crate) struct CallerDepth {
    import: RenderKernel,
}

fn kernel(
    device: &wgpu::Device,
    shared: &Shared,
    fragment: &'static str,
    format: wgpu::TextureFormat,
) -> RenderKernel {
    let draw = Draw {
        vertex: "fullscreen",
        fragment: Some(fragment),
        topology: wgpu::PrimitiveTopology::TriangleList,
        depth: Some((format, wgpu::CompareFunction::Always)),
        targets: vec![],
    };
    RenderKernel::new(device, shared, (&shaders::CALLER_DEPTH, &shared.kernels), draw, &[])
}

fn attachment(
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<f32>,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    }
}

impl CallerDepth {
    pub fn new(device: &wgpu::Device, shared: &Shared) -> Self {
        Self { import: kernel(device, shared, "import_depth", DEPTH) }
    }

    /// Fills our depth with the caller's: nothing behind it is seen.
    pub fn import(&self, recorder: &mut Recorder, band: &BandSample, callers: &wgpu::TextureView) {
        let target = attachment(&band.targets.depth, wgpu::LoadOp::Clear(0.0));
        self.draw(recorder, band, &self.import, &[texture("callers", callers)], target);
    }

    /// Writes our depth to the caller's, where the sample shows the scene.
    pub fn export(
        &self,
        recorder: &mut Recorder,
        shared: &Shared,
        band: &BandSample,
        seen: Seen,
        (callers, format): (&wgpu::TextureView, wgpu::TextureFormat),
    ) {
        let device = recorder.device;
        let kernel = kernel(device, shared, "export_depth", format);
        let resources = [texture("ours", seen.depth), texture("triangle_ids", seen.triangle_ids)];
        self.draw(recorder, band, &kernel, &resources, attachment(callers, wgpu::LoadOp::Load));
    }

    fn draw(
        &self,
        recorder: &mut Recorder,
        band: &BandSample,
        kernel: &RenderKernel,
        resources: &[crate::device::kernel::Binding],
        target: wgpu::RenderPassDepthStencilAttachment,
    ) {
        let group = kernel.group(recorder.device, resources);
        let uniform = recorder.uniform(&band.frame);
        let mut pass = recorder.encoder().begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("the caller's depth"),
            color_attachments: &[],
            depth_stencil_attachment: Some(target),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        kernel.set(&mut pass, (Some(&uniform), None), &group);
        pass.draw(0..3, 0..1);
    }
}
