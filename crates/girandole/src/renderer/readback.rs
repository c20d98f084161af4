//! Pictures and shadow maps, read back from the device.

use super::Renderer;
use crate::device::context::Context;
use crate::device::readback::TextureCopy;
use crate::packed::unpack_radiance;
use crate::viewport::{Viewport, nothing_rendered};
use crate::{Error, Result};
use girandole_core::image::Image;
use std::future::Future;

impl Renderer {
    /// Reads a viewport's last picture back, or the [part](crate::RenderSettings::region) that was drawn: linear radiance. The future completes while the device is polled; it owns what it
    /// needs. What was recorded into an encoder of the caller's has to be submitted before.
    ///
    /// # Errors
    /// [`Error::Scene`] before the first frame; [`Error::Device`] where the device was lost.
    pub fn radiance(&self, viewport: &Viewport) -> impl Future<Output = Result<Image>> + use<> {
        let Context { device, queue, .. } = &self.context;
        let copy = viewport.targets.as_ref().map(|targets| {
            let mut encoder = device.create_command_encoder(&Default::default());
            // Bands keep each buffer small.
            let region = targets.drawn.region;
            let copies: Vec<_> = targets
                .bands_of_region()
                .map(|[first, end]| {
                    let size = [region.size[0], end - first];
                    let origin = wgpu::Origin3d { x: region.first[0], y: first, z: 0 };
                    TextureCopy::record(device, &mut encoder, &targets.picture, origin, size, 8)
                })
                .collect();
            queue.submit([encoder.finish()]);
            (region.size, copies)
        });
        async move {
            let (size, copies) = copy.ok_or_else(nothing_rendered)?;
            let mut pixels = Vec::with_capacity(size[0] as usize * size[1] as usize);
            for copy in copies {
                pixels.extend(copy.words().await?.chunks_exact(2).map(|w| unpack_radiance([w[0], w[1]])));
            }
            Ok(Image { width: size[0], height: size[1], pixels })
        }
    }

    /// Reads a light's shadow map back: `size × size` values, near / distance (directional lights: 1 − depth), 0 =
    /// nothing there.
    ///
    /// # Errors
    /// [`Error::Scene`] where there is no such light; [`Error::Device`] where the device was lost.
    pub fn shadow_map(&self, light: usize) -> impl Future<Output = Result<Vec<f32>>> + use<> {
        let Context { device, queue, .. } = &self.context;
        let slot = self.scene.as_ref().and_then(|scene| Some((scene, scene.atlas.cache.shown(light)?.0)));
        let copy = slot.map(|(scene, slot)| {
            let mut encoder = device.create_command_encoder(&Default::default());
            let (size, [x, y], page) = scene.atlas.cache.texels(&slot);
            let origin = wgpu::Origin3d { x, y, z: page };
            let copy = TextureCopy::record(device, &mut encoder, &scene.atlas.texture, origin, [size; 2], 4);
            queue.submit([encoder.finish()]);
            copy
        });
        async move {
            let copy = copy.ok_or_else(|| Error::invalid(format!("there is no light {light}")))?;
            Ok(copy.words().await?.into_iter().map(f32::from_bits).collect())
        }
    }
}
