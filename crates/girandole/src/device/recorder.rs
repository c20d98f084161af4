//! Where passes record: an encoder of the caller's or one of our own, and the uniforms of the dispatches in it.

use super::timers::Timers;
use crate::layout::Frame;

/// Uniforms in one buffer.
const UNIFORMS: u64 = 64;

/// Records a frame. In an encoder of our own, [`Recorder::split`] submits what there is; in the caller's it does not.
pub(crate) struct Recorder<'a> {
    pub device: &'a wgpu::Device,
    pub timers: &'a Timers,
    frame_layout: &'a wgpu::BindGroupLayout,
    encoder: Encoder<'a>,
    uniforms: Option<Uniforms>,
    /// Whether nothing is to be done: what is recorded has devices compile what they use first, as some do only then.
    pub is_rehearsal: bool,
}

enum Encoder<'a> {
    Callers(&'a mut wgpu::CommandEncoder),
    Own(wgpu::CommandEncoder, &'a wgpu::Queue),
}

/// A buffer of uniforms, mapped until the recording ends.
struct Uniforms {
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
    stride: u64,
    count: u64,
    /// What was written last: neighbouring dispatches often have the same.
    last: Frame,
}

impl<'a> Recorder<'a> {
    /// Records into the caller's encoder, who submits it.
    pub fn into_encoder(
        device: &'a wgpu::Device,
        frame_layout: &'a wgpu::BindGroupLayout,
        timers: &'a Timers,
        encoder: &'a mut wgpu::CommandEncoder,
    ) -> Self {
        let encoder = Encoder::Callers(encoder);
        Self { device, timers, frame_layout, encoder, uniforms: None, is_rehearsal: false }
    }

    /// Records into encoders of its own, which it submits.
    pub fn submitting(
        device: &'a wgpu::Device,
        queue: &'a wgpu::Queue,
        frame_layout: &'a wgpu::BindGroupLayout,
        timers: &'a Timers,
    ) -> Self {
        let encoder = Encoder::Own(device.create_command_encoder(&Default::default()), queue);
        Self { device, timers, frame_layout, encoder, uniforms: None, is_rehearsal: false }
    }

    /// The encoder to record into.
    pub fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        match &mut self.encoder {
            Encoder::Callers(encoder) => encoder,
            Encoder::Own(encoder, _) => encoder,
        }
    }

    /// Bind group 0 with these contents, and its dynamic offset. Each recording has uniforms of its own, so that what is
    /// recorded later into the same encoder does not change them.
    pub fn uniform(&mut self, frame: &Frame) -> (wgpu::BindGroup, u32) {
        let same = |u: &Uniforms| u.count > 0 && bytemuck::bytes_of(&u.last) == bytemuck::bytes_of(frame);
        if let Some(uniforms) = self.uniforms.as_ref().filter(|u| same(u)) {
            return (uniforms.group.clone(), ((uniforms.count - 1) * uniforms.stride) as u32);
        }
        if self.uniforms.as_ref().is_some_and(|u| u.count == UNIFORMS) {
            self.uniforms = None;
        }
        let (device, layout) = (self.device, self.frame_layout);
        let uniforms = self.uniforms.get_or_insert_with(|| Uniforms::new(device, layout));
        uniforms.push(frame)
    }

    /// Submits what was recorded so far, if the encoder is our own: a watchdog's patience is limited.
    pub fn split(&mut self) {
        if let Encoder::Own(encoder, queue) = &mut self.encoder {
            let next = self.device.create_command_encoder(&Default::default());
            let full = std::mem::replace(encoder, next);
            self.uniforms = None;
            queue.submit([full.finish()]);
        }
    }

    /// Ends the recording; submits it, if the encoder is our own.
    pub fn finish(mut self) {
        self.uniforms = None;
        if let Encoder::Own(encoder, queue) = self.encoder {
            queue.submit([encoder.finish()]);
        }
    }
}

impl Uniforms {
    fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> Self {
        let size = size_of::<Frame>() as u64;
        let stride = size.next_multiple_of(u64::from(device.limits().min_uniform_buffer_offset_alignment));
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame uniforms"),
            size: stride * UNIFORMS,
            usage: wgpu::BufferUsages::UNIFORM,
            mapped_at_creation: true,
        });
        let binding = wgpu::BufferBinding { buffer: &buffer, offset: 0, size: wgpu::BufferSize::new(size) };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(binding) }],
        });
        Self { buffer, group, stride, count: 0, last: Frame::default() }
    }

    fn push(&mut self, frame: &Frame) -> (wgpu::BindGroup, u32) {
        let offset = self.count * self.stride;
        let end = offset + size_of::<Frame>() as u64;
        // A lost device has no memory to map; it reports that by itself.
        if let Ok(mut view) = self.buffer.get_mapped_range_mut(offset..end) {
            view.copy_from_slice(bytemuck::bytes_of(frame));
        }
        self.count += 1;
        self.last = *frame;
        (self.group.clone(), offset as u32)
    }
}

impl Drop for Uniforms {
    /// What is recorded may be submitted from here on.
    fn drop(&mut self) {
        self.buffer.unmap();
    }
}
