//! The texture that the picture is drawn to, and copied from to the window: the panel is painted many times as often.

use girandole::wgpu;
use wgpu::util::{TextureBlitter, TextureBlitterBuilder};

/// A texture of the picture's size.
pub struct PictureTarget {
    pub size: [u32; 2],
    /// That of the window's surface.
    pub format: wgpu::TextureFormat,
    pub view: wgpu::TextureView,
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// What a picture of fewer pixels is drawn to, and enlarged from.
    smaller: Option<wgpu::TextureView>,
    enlarger: TextureBlitter,
}

impl PictureTarget {
    pub fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        size: [u32; 2],
        format: wgpu::TextureFormat,
    ) -> Self {
        let enlarger =
            TextureBlitterBuilder::new(device, format).sample_type(wgpu::FilterMode::Linear).build();
        Self {
            size,
            format,
            view: texture(device, size, format),
            device: device.clone(),
            queue: queue.clone(),
            smaller: None,
            enlarger,
        }
    }

    /// Has a picture of so many pixels drawn, and enlarges it to the whole where they are fewer.
    pub fn draw<E>(
        &mut self,
        size: [u32; 2],
        draw: impl FnOnce(&wgpu::TextureView) -> Result<(), E>,
    ) -> Result<(), E> {
        if size == self.size {
            return draw(&self.view);
        }
        let has_size = |view: &wgpu::TextureView| {
            let texture = view.texture();
            [texture.width(), texture.height()] == size
        };
        let kept = self.smaller.take().filter(has_size);
        let smaller = kept.unwrap_or_else(|| texture(&self.device, size, self.format));
        draw(&smaller)?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.enlarger.copy(&self.device, &mut encoder, &smaller, &self.view);
        self.queue.submit([encoder.finish()]);
        self.smaller = Some(smaller);
        Ok(())
    }

    /// Copies the picture to the top left corner of a texture of the same format, as far as it reaches.
    pub fn copy_to(&self, encoder: &mut wgpu::CommandEncoder, to: &wgpu::Texture) {
        let size = wgpu::Extent3d {
            width: self.size[0].min(to.width()),
            height: self.size[1].min(to.height()),
            depth_or_array_layers: 1,
        };
        encoder.copy_texture_to_texture(self.view.texture().as_image_copy(), to.as_image_copy(), size);
    }
}

fn texture(device: &wgpu::Device, size: [u32; 2], format: wgpu::TextureFormat) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}
