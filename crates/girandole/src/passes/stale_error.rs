//! How wrong the picture is for what its shadow maps show of another moment; see `shaders/stale_error.wgsl`.

use super::stale_maps::{BLOCKER_GROUP, stale_words};
use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, LightMapsView};
use crate::device::buffers::storage;
use crate::device::kernel::{Groups, Kernel, buffer, texture};
use crate::device::readback::TextureCopy;
use crate::device::recorder::Recorder;
use crate::gpu_scene::lights::GpuLights;
use crate::gpu_scene::previous_transforms::PreviousTransforms;
use crate::maps::atlas::Atlas;
use crate::maps::occluders::CLUSTER;
use crate::points::lists::PointLists;
use crate::points::targets::GRID;
use crate::{Result, shaders};

/// Pixels that are looked at: this number squared.
const PIXELS_PER_SIDE: u32 = 32;

pub(crate) struct StaleError {
    kernel: Kernel,
}

impl StaleError {
    /// `listed`: for pictures whose lights are listed by receivers.
    pub fn new(compiler: &Compiler, listed: bool) -> Self {
        let entry = if listed { "of_listed_lights" } else { "of_all_lights" };
        let mut constants = compiler.constants();
        constants.extend([("CLUSTER", f64::from(CLUSTER)), ("BLOCKER_GROUP", f64::from(BLOCKER_GROUP))]);
        let Compiler { device, shared, .. } = compiler;
        Self { kernel: Kernel::new(device, shared, &shaders::STALE_ERROR, entry, &constants) }
    }

    /// Compares some pixels of the picture with what they would be.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] where a buffer exceeds the device's limits.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        band: &BandSample,
        seen: Seen,
        (lights, atlas, old): (&GpuLights, &Atlas, &PreviousTransforms),
        lists: Option<(LightMapsView, &PointLists)>,
    ) -> Result<PixelErrors> {
        let device = recorder.device;
        let size = [PIXELS_PER_SIDE; 2];
        let errors = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("errors"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: GRID,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = errors.create_view(&Default::default());
        let stale_maps = storage(device, "stale maps", &stale_words(atlas, &lights.samples, old))?;
        let previous_transforms = old.transforms_buffer(device);
        let maps = atlas.view();
        let mut resources = vec![
            texture("triangle_ids", seen.triangle_ids),
            texture("atlas", maps.atlas),
            buffer("maps", maps.maps),
            buffer("lights", &lights.buffer),
            texture("picture", &band.targets.picture_view),
            buffer("stale_maps", &stale_maps),
            buffer("previous_transforms", &previous_transforms),
            texture("errors", &view),
        ];
        if let Some((light_maps, lists)) = lists {
            resources.extend([
                buffer("receivers", light_maps.receivers.receivers()),
                buffer("light_lists", light_maps.receivers.light_lists()),
                buffer("offsets", lists.offsets(light_maps.used)),
            ]);
        }
        self.kernel.record(recorder, band.groups(), "stale_error_gpu_ms", &resources, Groups::Count(size));
        let origin = wgpu::Origin3d::ZERO;
        Ok(PixelErrors(TextureCopy::record(device, recorder.encoder(), &errors, origin, size, 16)))
    }
}

/// Errors and luminance of some pixels, on their way back.
pub(crate) struct PixelErrors(TextureCopy);

impl PixelErrors {
    /// Mean error over mean luminance; nothing where all is black.
    pub async fn relative(self) -> Result<Option<f64>> {
        let words = self.0.words().await?;
        let sum = |component: usize| -> f64 {
            words[component..].iter().step_by(4).map(|&bits| f64::from(f32::from_bits(bits))).sum()
        };
        let (error, luminance) = (sum(0), sum(1));
        Ok((luminance > 0.0).then(|| error / luminance))
    }
}
