//! The engines: shadow maps on a GPU, the same sum with traced shadows, and the path tracer.

mod cpu;
pub mod gpu;
pub mod moving;
mod path;
mod refine;
mod windows;

pub use cpu::energy_lost_by_clamp;
pub use windows::Window;

use crate::advice::sentence;
use crate::args::{AntiAliasing, Engine, Mode, PieceArgs, RenderArgs};
use crate::output::{Stats, say};
use crate::transfer::{Transferred, cache};
use anyhow::Result;
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSet, LightSettings};
use girandole_core::scene::{Geometry, Scene, View};
use girandole_core::visibility::VisibilityDatabase;
use girandole_reference::PictureSum;
use std::sync::Arc;

/// The inputs of an engine.
pub struct Job<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The same, flattened.
    pub geometry: &'a Geometry,
    /// Its light; empty for the path tracer, which samples its own.
    pub lights: &'a LightSet,
    /// Which of it needs a shadow map where; `None` where the engine is to find out, if it has to know.
    pub visibility: Option<&'a Arc<VisibilityDatabase>>,
    /// Objects with precomputed transfer.
    pub transfers: &'a [Transferred],
    /// The camera.
    pub view: View,
    /// Bound on the geometric factor.
    pub clamp: Clamp,
    /// Options.
    pub args: &'a RenderArgs,
}

/// The result of an engine.
pub struct Picture {
    /// Linear radiance.
    pub radiance: Image,
    /// Milliseconds for it.
    pub frame_ms: f64,
    /// The engine's own statistics.
    pub stats: Stats,
    /// Of the light sets that it is the mean of.
    pub sum: Option<PictureSum>,
}

/// What lights a scene, see [`sample`].
pub fn illumination(
    scene: &Scene,
    settings: &IlluminationSettings,
    args: &RenderArgs,
) -> girandole_core::Result<Illumination> {
    if args.piece == PieceArgs::default() || matches!(settings.rewalk, Rewalk::Paths(_)) {
        return Illumination::new(scene, settings);
    }
    let geometry = Geometry::new(scene);
    let lights = sample((scene, &geometry), (&settings.lights, &settings.views), args)?;
    Illumination::with_lights(scene, settings, (geometry, lights))
}

/// Light samples for some views; where others render pieces of the same, they are kept for them.
pub fn sample(
    (scene, geometry): (&Scene, &Geometry),
    (settings, views): (&LightSettings, &[View]),
    args: &RenderArgs,
) -> girandole_core::Result<LightSet> {
    match cache("lights").filter(|_| args.piece != PieceArgs::default()) {
        Some(folder) => LightSet::sample_once(scene, geometry, settings, views, &folder),
        None => LightSet::sample_for(scene, geometry, settings, views),
    }
}

/// An engine, ready to render.
pub enum Ready {
    /// On this device.
    Gpu(Box<gpu::Device>),
    /// Traced shadows.
    Cpu,
    /// The path tracer.
    Path,
}

impl Ready {
    /// Opens the engine of the options; `auto` falls back to the CPU and prints how to get a GPU.
    pub fn choose(args: &RenderArgs) -> Result<Self> {
        let (engine, advice) = Self::open(args)?;
        advice.iter().for_each(|advice| say(advice));
        Ok(engine)
    }

    /// The same, with what is to be printed.
    pub fn open(args: &RenderArgs) -> Result<(Self, Option<String>)> {
        let engine = match args.engine {
            Engine::Cpu => Self::Cpu,
            Engine::Path => Self::Path,
            Engine::Gpu => Self::Gpu(Box::new(gpu::Device::open(args.adapter.as_deref())?)),
            Engine::Auto => match gpu::Device::open(args.adapter.as_deref()) {
                Ok(device) => Self::Gpu(Box::new(device)),
                // A named adapter is required, so there is no fallback.
                Err(error) if args.adapter.is_some() => return Err(error.into()),
                Err(error) => {
                    let why = sentence(&error);
                    let advice = format!("{why}; until then, shadows are traced on the CPU, which is slower");
                    return Ok((Self::Cpu, Some(advice)));
                }
            },
        };
        Ok((engine, None))
    }

    /// Begins to compile what pictures of a scene will need, beside what else is to be done before.
    pub fn compile_for(&mut self, scene: &Scene, geometry: &Geometry, args: &RenderArgs) -> Result<()> {
        match self {
            Self::Gpu(device) => device.compile_for(scene, geometry, args),
            Self::Cpu | Self::Path => Ok(()),
        }
    }

    /// What `--aa` is where it is not given: the passes of `full` and `vd-lp` shade anew only where something ends within a pixel,
    /// so that it costs little there. Light sets that are averaged have rays through other points of the pixels anyway.
    pub fn anti_aliasing(&self, args: &RenderArgs) -> AntiAliasing {
        let is_cheap = matches!(self, Self::Gpu(_)) && matches!(args.mode, Mode::Full | Mode::VdLp);
        if is_cheap && args.refine == 1 && args.debug.is_none() {
            AntiAliasing::Two
        } else {
            AntiAliasing::Off
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

    /// The same as an option.
    pub fn kind(&self) -> Engine {
        match self {
            Self::Gpu(_) => Engine::Gpu,
            Self::Cpu => Engine::Cpu,
            Self::Path => Engine::Path,
        }
    }

    /// The device that it runs on.
    pub fn adapter(&self) -> String {
        match self {
            Self::Gpu(device) => device.name(),
            Self::Cpu | Self::Path => match rayon::current_num_threads() {
                1 => "CPU, 1 thread".into(),
                n => format!("CPU, {n} threads"),
            },
        }
    }

    /// Renders; what pictures have in common is kept for the next one.
    pub fn render(&mut self, job: &Job) -> Result<Picture> {
        match self {
            Self::Gpu(device) => device.render(job),
            Self::Cpu => cpu::render(job),
            Self::Path => Ok(path::render(job)),
        }
    }
}
