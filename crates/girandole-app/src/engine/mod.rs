//! What computes a picture: shadow maps on a GPU, the same sum with traced shadows, or the path tracer.

mod advice;
mod cpu;
pub mod gpu;
mod path;

pub use advice::sentence;
pub use cpu::energy_lost_by_clamp;

use crate::args::{Engine, RenderArgs};
use crate::output::say;
use anyhow::Result;
use girandole_core::image::Image;
use girandole_core::lights::LightSet;
use girandole_core::scene::{Geometry, Scene, View};
use serde_json::{Map, Value};

/// Flat statistics, sorted by key.
pub type Stats = Map<String, Value>;

/// What is to be rendered.
pub struct Job<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The same, flattened.
    pub geometry: &'a Geometry,
    /// Its light; empty for the path tracer, which samples its own.
    pub lights: &'a LightSet,
    /// From where.
    pub view: View,
    /// Bound of the geometric factor, m⁻²; none = exact.
    pub clamp: Option<f32>,
    /// How.
    pub args: &'a RenderArgs,
}

/// What came of it.
pub struct Picture {
    /// Linear radiance.
    pub radiance: Image,
    /// Milliseconds for it.
    pub frame_ms: f64,
    /// What the engine has to say beyond that.
    pub stats: Stats,
}

/// An engine that is ready to work.
pub enum Ready {
    /// On this device.
    Gpu(Box<gpu::Device>),
    /// Traced shadows.
    Cpu,
    /// The path tracer.
    Path,
}

impl Ready {
    /// Takes the engine that was asked for; `auto` falls back to the CPU and says how to get faster.
    pub fn choose(args: &RenderArgs) -> Result<Self> {
        match args.engine {
            Engine::Cpu => Ok(Self::Cpu),
            Engine::Path => Ok(Self::Path),
            Engine::Gpu => Ok(Self::Gpu(Box::new(gpu::Device::open(args.adapter.as_deref())?))),
            Engine::Auto => match gpu::Device::open(args.adapter.as_deref()) {
                Ok(device) => Ok(Self::Gpu(Box::new(device))),
                // Who names an adapter wants that one.
                Err(error) if args.adapter.is_some() => Err(error.into()),
                Err(error) => {
                    let why = sentence(&error);
                    say(&format!("{why}; until then, shadows are traced on the CPU, which is slower"));
                    Ok(Self::Cpu)
                }
            },
        }
    }

    /// As in `--engine`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Gpu(_) => "gpu",
            Self::Cpu => "cpu",
            Self::Path => "path",
        }
    }

    /// What it runs on.
    pub fn adapter(&self) -> String {
        match self {
            Self::Gpu(device) => device.name(),
            Self::Cpu | Self::Path => match rayon::current_num_threads() {
                1 => "CPU, 1 thread".into(),
                n => format!("CPU, {n} threads"),
            },
        }
    }

    /// Renders.
    pub fn render(self, job: &Job) -> Result<Picture> {
        match self {
            Self::Gpu(device) => device.render(job),
            Self::Cpu => Ok(cpu::render(job)),
            Self::Path => Ok(path::render(job)),
        }
    }
}
