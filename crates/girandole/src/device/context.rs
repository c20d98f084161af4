//! What everything is made with.

use super::kernel::Shared;
use super::timers::Timers;
use crate::settings::RendererOptions;

/// The device, and what is fixed when a renderer is made.
pub(crate) struct Context {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub options: RendererOptions,
    pub shared: Shared,
    pub timers: Timers,
}
