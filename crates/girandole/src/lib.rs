//! Girandole lights scenes with hundreds to thousands of light samples, each with its own shadow map: soft shadows
//! from area lights, and indirect light that is blocked by what stands in its way. No ray-tracing hardware, no
//! denoiser, no history, no bake; every frame stands by itself and repeats bit for bit.

pub use girandole_core as core;

mod atlas;
mod bind;
mod error;
mod gpu;
mod gpu_scene;
mod layout;
mod occluders;
mod passes;
mod readback;
mod renderer;
mod settings;
mod shaders;
mod timers;

pub use atlas::{AtlasLayout, MapSlot};
pub use error::{Error, Result};
pub use gpu::{AdapterReport, Gpu, WANTED_FEATURES, adapters, wanted_limits};
pub use occluders::CullCounts;
pub use renderer::{FrameStats, Renderer};
pub use settings::{DEFAULT_CLAMP, RenderSettings, RendererOptions, ShadowMap};
