//! Girandole lights scenes with hundreds to thousands of light samples, each with its own shadow map: soft shadows
//! from area lights, and indirect light that is blocked by what stands in its way. No ray-tracing hardware, no
//! denoiser, no history, no bake; every frame stands by itself and repeats bit for bit.
//!
//! A picture in five steps: a [`Scene`](core::scene::Scene), its light as a [`LightSet`](core::lights::LightSet), a
//! [`Renderer`] on the caller's device, what blocks whom
//! ([`VisibilityDatabase`](core::visibility::VisibilityDatabase)), and a frame into the caller's texture view.
//!
//! ```no_run
//! use girandole::core::lights::{LightSet, LightSettings};
//! use girandole::core::scene::builtin::{self, MovingObject};
//! use girandole::core::scene::{Geometry, View};
//! use girandole::core::visibility::{VisibilityDatabase, VisibilitySettings};
//! use girandole::{RenderSettings, Renderer, RendererOptions};
//!
//! # fn picture(device: &wgpu::Device, queue: &wgpu::Queue, target: &wgpu::TextureView) -> Result<(), Box<dyn std::error::Error>> {
//! let scene = builtin::build("pillars", MovingObject::Torus)?; // or Scene::load("room.glb".as_ref())?
//! let geometry = Geometry::new(&scene);
//! let lights = LightSet::sample(&scene, &geometry, &LightSettings { count: 300, ..Default::default() })?;
//!
//! let mut renderer = Renderer::new(device, queue, RendererOptions::default())?;
//! renderer.load(&scene, &geometry, &lights)?;
//! // Which lights need a shadow map where: every mode but the naive one asks for it.
//! let visibility = VisibilityDatabase::build(&scene, &geometry, &lights, &VisibilitySettings::default())?;
//! renderer.load_visibility(&scene, &geometry, &lights, &visibility)?;
//!
//! let view = View::new(&scene, &scene.cameras[0], 1024.0 / 768.0);
//! let settings = RenderSettings::default();
//! renderer.render(&view, [1024, 768], &settings)?; // radiance, in linear floating point
//! renderer.show(&settings, target, wgpu::TextureFormat::Bgra8UnormSrgb)?; // tone-mapped, into the caller's view
//! # Ok(())
//! # }
//! ```
//!
//! `examples/headless.rs` is a whole program without a window: a scene made in code, [`Gpu`] for a device of its own,
//! and [`Renderer::radiance`] to read the picture back.
//!
//! What a device has to have: WebGPU's default limits and compute shaders. What the renderer uses where the device was
//! created with it: [`WANTED_FEATURES`] and [`wanted_limits`]; [`Renderer::new`] says what it does without. The
//! renderer never blocks: it submits work, and read-backs are futures.

pub use girandole_core as core;
pub use wgpu;

mod atlas;
mod device;
mod device_tuning;
mod elements;
mod error;
mod frame;
mod gpu_scene;
mod layout;
mod lights;
mod occluders;
mod packed;
mod passes;
mod point_lists;
mod prepare;
mod receivers;
mod records;
mod renderer;
mod resident;
mod settings;
mod shader_constants;
mod shaders;
mod stats;
mod surface_ids;
mod targets;

#[cfg(test)]
mod layout_tests;

pub use atlas::{AtlasLayout, MapSlot};
pub use device::{AdapterReport, Gpu, WANTED_FEATURES, adapters, wanted_limits};
pub use device_tuning::DeviceTuning;
pub use error::{Error, Remedy, Result};

pub use occluders::CullCounts;
pub use renderer::Renderer;
pub use settings::{
    DEFAULT_CLAMP, DebugView, Mode, RenderSettings, RendererOptions, Shading, ShadowMap, Target,
};
pub use stats::{FrameStats, PairCounts};
