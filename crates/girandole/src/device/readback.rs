//! Reading buffers and textures back, without blocking: futures that the caller polls while the device is polled.

use crate::{Error, Result};
use std::sync::{Arc, Mutex};
use std::task::{Poll, Waker};

/// Bytes of a mapped buffer, once the device has got there.
pub(crate) async fn bytes(buffer: &wgpu::Buffer) -> Result<Vec<u8>> {
    type Outcome = (Option<std::result::Result<(), wgpu::BufferAsyncError>>, Option<Waker>);
    let shared: Arc<Mutex<Outcome>> = Arc::default();
    let sender = shared.clone();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        if let Ok(mut outcome) = sender.lock() {
            outcome.0 = Some(result);
            if let Some(waker) = outcome.1.take() {
                waker.wake();
            }
        }
    });
    let poisoned = || Error::Device("a read-back was interrupted".into());
    std::future::poll_fn(|context| match shared.lock() {
        Err(_) => Poll::Ready(Err(poisoned())),
        Ok(mut outcome) => match outcome.0.take() {
            Some(result) => Poll::Ready(result.map_err(|e| Error::Device(e.to_string()))),
            None => {
                outcome.1 = Some(context.waker().clone());
                Poll::Pending
            }
        },
    })
    .await?;
    let view = buffer.get_mapped_range(..).map_err(|e| Error::Device(e.to_string()))?;
    let bytes = view.to_vec();
    drop(view);
    buffer.unmap();
    Ok(bytes)
}

/// A texture on its way back: rows are padded to what copies ask for.
pub(crate) struct TextureCopy {
    buffer: wgpu::Buffer,
    row_bytes: usize,
    padded: usize,
    rows: usize,
}

impl TextureCopy {
    /// Records the copy of part of a layer of a texture with `texel_bytes` a texel.
    pub fn record(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        texture: &wgpu::Texture,
        origin: wgpu::Origin3d,
        [width, height]: [u32; 2],
        texel_bytes: u32,
    ) -> Self {
        let row_bytes = width * texel_bytes;
        let padded = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read-back"),
            size: u64::from(padded) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo { texture, mip_level: 0, origin, aspect: wgpu::TextureAspect::All },
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded),
                    rows_per_image: Some(height),
                },
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        Self { buffer, row_bytes: row_bytes as usize, padded: padded as usize, rows: height as usize }
    }

    /// The texels' words, rows without padding.
    pub async fn words(self) -> Result<Vec<u32>> {
        let bytes = bytes(&self.buffer).await?;
        let mut words = Vec::with_capacity(self.row_bytes / 4 * self.rows);
        for row in bytes.chunks_exact(self.padded) {
            words.extend(
                row[..self.row_bytes].chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            );
        }
        Ok(words)
    }
}
