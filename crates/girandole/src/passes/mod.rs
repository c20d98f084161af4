//! One file a pass: `new` makes pipelines, `record` takes small structs of views and returns what it made. None owns scene
//! state.

pub(crate) mod append_all_points;
pub(crate) mod average;
pub(crate) mod background;
pub(crate) mod caller_depth;
pub(crate) mod debug;

pub(crate) mod edges;
pub(crate) mod exposure;
pub(crate) mod first_samples;
pub(crate) mod layers;
pub(crate) mod light_maps;
pub(crate) mod mirrors;
pub(crate) mod multipass;
pub(crate) mod refine;
pub(crate) mod resolve;
pub(crate) mod shade_naive;
pub(crate) mod shade_points;
pub(crate) mod shadow_maps;
pub(crate) mod sort_points;
pub(crate) mod stale_error;
pub(crate) mod stale_maps;
pub(crate) mod tonemap;
pub(crate) mod trace_rays;
pub(crate) mod transfer;
pub(crate) mod visibility_buffer;

pub(crate) use crate::gpu_scene::receivers::LightMapsView;
pub(crate) use crate::maps::atlas::MapsView;
pub(crate) use crate::points::targets::GridView;

use crate::device::context::Context;
use crate::device::kernel::{Binding, Kernel, Shared, texture};
use crate::device::loop_steps;
use crate::device::recorder::Recorder;
use crate::gpu_scene::geometry::GpuScene;
use crate::layout::Frame;
use crate::points::targets::Targets;
use crate::resident::SceneFeatures;
use crate::settings::RendererOptions;
use crate::shader_constants::BATCH;
use crate::shaders::Source;
use crate::tier::Kernels;

/// What passes are compiled with.
#[derive(Clone, Copy)]
pub(crate) struct Compiler<'a> {
    pub device: &'a wgpu::Device,
    pub shared: &'a Shared,
    pub options: &'a RendererOptions,
    pub features: SceneFeatures,
    /// Which variants of the kernels.
    pub kernels: Kernels,
    /// Whether points are the picture's pixels: what is stored is their radiance.
    pub writes_radiance: bool,
}

impl<'a> Compiler<'a> {
    /// The same of passes over the ends of mirrored rays.
    pub fn mirrored(&self) -> Self {
        Self { kernels: Kernels { mirrored: true, ..self.kernels }, ..*self }
    }

    /// Of passes whose points are not the picture's pixels.
    pub fn new(context: &'a Context, features: SceneFeatures) -> Self {
        let Context { device, shared, options, .. } = context;
        let kernels = Kernels { reflects_environment: features.reflects_environment, ..shared.kernels };
        Self { device, shared, options, features, kernels, writes_radiance: false }
    }

    /// An entry point of a compute shader.
    pub fn kernel(&self, source: &Source, entry: &'static str) -> Kernel {
        Kernel::of(self.device, self.shared, (source, &self.kernels), entry, &self.constants())
    }

    /// The overrides of all kernels; each takes those that it declares.
    pub fn constants(&self) -> Vec<(&'static str, f64)> {
        let flag = |name, value: bool| (name, f64::from(u8::from(value)));
        vec![
            ("PARAMETERISATION", f64::from(self.options.shadow_map as u32)),
            ("NEAR", shadow_maps::NEAR),
            ("FILTER", f64::from(self.options.pcf)),
            ("MAX_ITEMS", f64::from(loop_steps::queue_items(self.options.pcf))),
            flag("HAS_SPECULAR", self.features.specular),
            flag("ONLY_COSINE_LIGHTS", self.features.only_cosine_lights),
            flag("HAS_LOBES", self.features.lobes),
            flag("HAS_MASKED", self.features.masked),
            flag("HAS_TEXTURES", self.features.textures),
            flag("HAS_MIRRORS", self.features.mirrors),
            flag("HAS_CURVED", self.features.curved),
            flag("HAS_TRANSPARENT", self.features.transparent),
            flag("REFLECTS_ENVIRONMENT", self.features.reflects_environment),
            flag("WRITES_RADIANCE", self.writes_radiance),
        ]
    }
}

/// A sub-pixel sample of a band of rows: what passes over its pixels are recorded with.
#[derive(Clone, Copy)]
pub(crate) struct BandSample<'a> {
    pub frame: Frame,
    pub scene: &'a GpuScene,
    pub targets: &'a Targets,
}

impl<'a> BandSample<'a> {
    /// Pixels in x, and rows of the band.
    pub fn size(&self) -> [u32; 2] {
        [self.frame.size[0], self.frame.band[1] - self.frame.band[0]]
    }

    /// The same with points every `step` pixels.
    pub fn with_step(mut self, step: u32) -> Self {
        self.frame.step = step;
        self
    }

    /// The same, storing the picture's radiance, or not.
    pub fn with_radiance(mut self, writes_radiance: bool) -> Self {
        self.frame.writes_radiance = u32::from(writes_radiance);
        self
    }

    /// The same with a batch of lights.
    pub fn with_batch(mut self, batch: LightBatch) -> Self {
        self.frame.first_light = batch.first;
        self.frame.end_light = batch.end;
        self.frame.batch = batch.first / BATCH;
        self.frame.last_batch = u32::from(batch.is_last);
        self
    }

    /// The same where no mirrored rays follow.
    pub fn without_mirrors(mut self) -> Self {
        self.frame.mirror_solid_angle = 0.0;
        self.frame.polished_alpha = 0.0;
        self
    }

    /// The same as if it were the first sample of its pixels.
    pub fn as_first_sample(mut self) -> Self {
        self.frame.sample = 0;
        self
    }

    /// The same for a layer of transparent surfaces.
    pub fn with_layer(mut self, layer: u32, is_last: bool) -> Self {
        self.frame.batch = layer;
        self.frame.last_batch = u32::from(is_last);
        self
    }

    /// Makes a band of the composite the picture.
    pub fn take_composite(&self, recorder: &mut Recorder) {
        let (composite, _) = self.targets.composite(recorder.device);
        let [width, rows] = self.size();
        let [from, to] = [composite, &self.targets.picture].map(|texture| wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x: 0, y: self.frame.band[0], z: 0 },
            ..texture.as_image_copy()
        });
        let size = wgpu::Extent3d { width, height: rows, depth_or_array_layers: 1 };
        recorder.encoder().copy_texture_to_texture(from, to, size);
    }

    /// Points in x and y of the grid with points every `step` pixels. It goes on to the row below the band.
    pub fn grid_size(&self, step: u32) -> [u32; 2] {
        let [width, rows] = self.size();
        [width, rows + 1].map(|n| (n - 1).div_ceil(step) + 1)
    }

    /// What surfaces reflect of the environment, where any do.
    pub fn reflected_environment(&self) -> impl Iterator<Item = Binding<'a>> + use<'a> {
        let reflected =
            self.scene.environment.as_ref().and_then(|environment| environment.reflected.as_ref());
        reflected.into_iter().flat_map(|reflected| {
            [texture("reflected_maps", &reflected.maps), texture("albedo_table", &reflected.albedo_table)]
        })
    }

    /// What a kernel binds as groups 0 and 1.
    pub fn groups(&self) -> (&Frame, Option<&'a wgpu::BindGroup>) {
        (&self.frame, Some(&self.scene.group))
    }
}

/// Lights that one dispatch sums.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LightBatch {
    pub first: u32,
    pub end: u32,
    pub is_last: bool,
}

/// All lights in batches of `size`. Without any light there is still one batch, for what emits.
pub(crate) fn batches(lights: u32, size: u32) -> impl Iterator<Item = LightBatch> {
    (0..lights.max(1)).step_by(size as usize).map(move |first| {
        let end = first.saturating_add(size).min(lights);
        LightBatch { first, end, is_last: end == lights }
    })
}
