//! Girandole lights scenes with hundreds to thousands of light samples, each with its own shadow map: soft shadows
//! from area lights, and indirect light that is blocked by what stands in its way. No ray-tracing hardware, no
//! denoiser, no history, no bake; every frame stands by itself and repeats bit for bit.
//!
//! A picture in three steps: a [`Scene`](core::scene::Scene), a [`Renderer`] on the caller's device that opens it, and a
//! frame into the caller's encoder and [`Target`].
//!
//! ```no_run
//! use girandole::core::illumination::IlluminationSettings;
//! use girandole::core::scene::{MaterialId, View};
//! use girandole::core::scene::builtin::{self, MovingObject};
//! use girandole::{RenderSettings, Renderer, RendererOptions, Target};
//!
//! # fn picture(device: &wgpu::Device, queue: &wgpu::Queue, color: &wgpu::TextureView) -> Result<(), Box<dyn std::error::Error>> {
//! let mut scene = builtin::build("pillars", MovingObject::Torus)?; // or Scene::load("room.glb".as_ref())?
//! let mut renderer = Renderer::new(device, queue, RendererOptions::default())?;
//! renderer.open(&scene, &IlluminationSettings::default())?; // samples its light, determines visibility
//!
//! let view = View::new(&scene, &scene.cameras[0], 1024.0 / 768.0); // or View::from_matrices(…)
//! let target = Target::new(color, wgpu::TextureFormat::Bgra8UnormSrgb, [1024, 768]);
//! let mut encoder = device.create_command_encoder(&Default::default());
//! renderer.record(&mut encoder, &view, &target, &RenderSettings::default())?;
//! queue.submit([encoder.finish()]);
//!
//! // What changes is followed.
//! scene.set_emission(MaterialId(0), girandole::core::glam::Vec3::ONE)?;
//! let changes = scene.take_changes();
//! renderer.update(&scene, &changes)?;
//! # Ok(())
//! # }
//! ```
//!
//! Light samples and visibility of the caller's own making go through [`Renderer::load`] and
//! [`Renderer::load_visibility`]. Depth is reversed unless [`View::from_matrices`](core::scene::View::from_matrices) was
//! given a projection that says otherwise; [`Target`] documents what comes in and goes out.
//!
//! `examples/headless.rs` is a whole program without a window: a scene made in code, [`Gpu`] for a device of its own,
//! and [`Renderer::radiance`] to read the picture back.
//!
//! What a device has to have: WebGPU's default limits and compute shaders. What the renderer uses where the device was
//! created with it: [`WANTED_FEATURES`] and [`wanted_limits`]; [`Renderer::new`] says what it does without. The
//! renderer never blocks: it records or submits work, and read-backs are futures that own what they need.

pub use girandole_core as core;
pub use wgpu;

#[cfg(all(target_arch = "wasm32", feature = "webgpu"))]
pub mod browser;
mod checks;
mod device;
mod error;
mod frame;
mod layout;
mod maps;
mod packed;
mod parallel;
mod parallel_map;
mod passes;
mod points;
mod prepare;
mod rays;
mod records;
mod renderer;
mod resident;
mod scene;
mod settings;
mod shader_constants;
mod shaders;
mod stats;
mod tier;

#[cfg(test)]
mod layout_tests;
#[cfg(test)]
mod order_test;

pub use device::compiled::{Compilation, CompiledKernel};
pub use device::{AdapterReport, Gpu, WANTED_FEATURES, adapters, instance, wanted_limits};
pub use error::{Error, Remedy, Result};
pub use shaders::shaders;
pub use tier::Tier;

pub use maps::cache::StaleCounts;
pub use renderer::Renderer;
pub use settings::{
    DebugView, MapPriority, MapUpdates, Mode, RenderSettings, RendererOptions, Shading, ShadowMap, Target,
};
pub use stats::{FrameStats, PairCounts, TransferCounts};
