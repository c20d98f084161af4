//! The window's surface: as large as the window, gone while it is hidden, made again where it is lost.

use anyhow::{Context, Result};
use girandole::{Gpu, wgpu};
use std::sync::Arc;
use winit::window::Window;

/// What is shown in the window.
pub struct WindowSurface {
    instance: wgpu::Instance,
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
}

impl WindowSurface {
    /// Opens the adapter whose name contains `name`, or the best one that can show pictures in the window.
    pub async fn open(window: Arc<Window>, name: Option<String>) -> Result<(Self, Gpu)> {
        let instance = girandole::instance();
        let surface = instance.create_surface(window.clone()).context("the window has no surface")?;
        let gpu = Gpu::for_surface(&instance, &surface, name.as_deref()).await?;
        let size = window.inner_size();
        let unsupported = |what: &str| {
            let adapter = gpu.adapter.get_info().name;
            girandole::Error::Unsupported { adapter, what: what.into() }
        };
        let mut config = surface
            .get_default_config(&gpu.adapter, size.width.max(1), size.height.max(1))
            .ok_or_else(|| unsupported("pictures in windows"))?;
        let wgpu::SurfaceCapabilities { formats, usages, present_modes, .. } =
            surface.get_capabilities(&gpu.adapter);
        // Canvases can be copied to, whatever is said of them.
        if !usages.contains(wgpu::TextureUsages::COPY_DST) && cfg!(not(target_arch = "wasm32")) {
            return Err(unsupported("copies of pictures to windows").into());
        }
        config.usage |= wgpu::TextureUsages::COPY_DST;
        config.format = formats.iter().copied().find(holds_srgb_values).unwrap_or(config.format);
        // A picture that takes longer than the display's beat is not held back to the next one.
        if present_modes.contains(&wgpu::PresentMode::Mailbox) {
            config.present_mode = wgpu::PresentMode::Mailbox;
        }
        // One frame less of delay between hand and eye.
        config.desired_maximum_frame_latency = 1;
        surface.configure(&gpu.device, &config);
        Ok((Self { instance, window, surface, config }, gpu))
    }

    pub fn format(&self) -> wgpu::TextureFormat {
        self.config.format
    }

    /// Takes the window's size. A minimised window has none: then the surface stays as it is.
    pub fn resize(&mut self, gpu: &Gpu, [width, height]: [u32; 2]) {
        let limit = gpu.device.limits().max_texture_dimension_2d;
        if width > 0 && height > 0 {
            (self.config.width, self.config.height) = (width.min(limit), height.min(limit));
            self.surface.configure(&gpu.device, &self.config);
        }
    }

    /// What is to be drawn to; `None` where this frame is to be left out.
    pub fn acquire(&mut self, gpu: &Gpu) -> Result<Option<wgpu::SurfaceTexture>> {
        use wgpu::CurrentSurfaceTexture as Current;
        match self.surface.get_current_texture() {
            Current::Success(texture) => Ok(Some(texture)),
            Current::Suboptimal(texture) => {
                drop(texture);
                self.surface.configure(&gpu.device, &self.config);
                Ok(None)
            }
            Current::Outdated => {
                self.surface.configure(&gpu.device, &self.config);
                Ok(None)
            }
            Current::Lost => {
                self.surface = self.instance.create_surface(self.window.clone())?;
                self.surface.configure(&gpu.device, &self.config);
                Ok(None)
            }
            // What went wrong is the device's to say.
            Current::Timeout | Current::Occluded | Current::Validation => Ok(None),
        }
    }
}

/// Whether a format holds sRGB values as they are written: what the panel is blended in.
fn holds_srgb_values(format: &wgpu::TextureFormat) -> bool {
    matches!(format, wgpu::TextureFormat::Rgba8Unorm | wgpu::TextureFormat::Bgra8Unorm)
}
