//! What experiments are made on: a device, a scale, models, and scenes on the device.

use anyhow::{Context, Result};
use girandole::{FrameStats, Gpu, RenderSettings, Renderer, RendererOptions, Viewport};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::lights::LightSettings;
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{ObjectId, Scene, View, load_model};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How much of an experiment is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// As little as shows that it runs.
    Toy,
    /// Few points of few curves, small pictures.
    Quick,
    /// All of it.
    Full,
}

/// What experiments are made on.
pub struct Bench {
    /// The device.
    pub gpu: Gpu,
    /// How much is made.
    pub scale: Scale,
    /// The thesis's bunny, or nothing where there is no file of it.
    pub bunny: Option<PathBuf>,
    /// Folder of public interiors and of our own scenes with pictures by an independent renderer, where it is there.
    pub shared: Option<PathBuf>,
    /// Its kernels are shared by all stages.
    compiled: Renderer,
}

impl Bench {
    /// On the adapter of this name (part of it suffices), or the best.
    ///
    /// # Errors
    /// Where there is none.
    pub fn new(adapter: Option<&str>, scale: Scale) -> Result<Self> {
        let gpu = pollster::block_on(Gpu::new(adapter))?;
        let compiled = Renderer::new(&gpu.device, &gpu.queue, RendererOptions::default())?;
        Ok(Self { gpu, scale, bunny: None, shared: None, compiled })
    }

    /// One of three values: of toy, quick and full scale.
    pub fn of<T: Copy>(&self, values: [T; 3]) -> T {
        values[self.scale as usize]
    }

    /// Pixels of a picture that is timed: the thesis's at full scale on a GPU, fewer on software.
    pub fn timed_size(&self) -> [u32; 2] {
        let is_software = self.gpu.info.device_type == girandole::wgpu::DeviceType::Cpu;
        match self.scale {
            Scale::Toy => [64, 48],
            Scale::Quick => [320, 240],
            Scale::Full if is_software => [512, 384],
            Scale::Full => [1024, 768],
        }
    }

    /// Pixels of a picture that is looked at.
    pub fn picture_size(&self) -> [u32; 2] {
        self.of([[64, 48], [320, 240], [512, 384]])
    }

    /// The moving object that the thesis has as its bunny, or the teapot; and what to call it.
    ///
    /// # Errors
    /// Where its file cannot be read.
    pub fn bunny(&self) -> Result<(MovingObject, &'static str)> {
        match &self.bunny {
            Some(file) => Ok((MovingObject::Model(Box::new(load_model(file)?)), "bunny")),
            None => Ok((MovingObject::Teapot, "teapot")),
        }
    }

    /// A built-in room with its own moving object.
    ///
    /// # Errors
    /// For a name that is none.
    pub fn room(&self, name: &str) -> Result<Scene> {
        Ok(builtin::build(name, builtin::default_object(name))?)
    }

    /// Opens a scene for its first camera, at [`Bench::picture_size`]; light samples are placed for that view.
    ///
    /// # Errors
    /// Where it has no light, or the device no memory.
    pub fn stage(
        &self,
        scene: &Scene,
        options: RendererOptions,
        lights: &LightSettings,
    ) -> Result<Stage<'_>> {
        self.stage_of_size(scene, options, lights, self.picture_size())
    }

    /// The same in so many pixels.
    ///
    /// # Errors
    /// As [`Bench::stage`].
    pub fn stage_of_size(
        &self,
        scene: &Scene,
        options: RendererOptions,
        lights: &LightSettings,
        size: [u32; 2],
    ) -> Result<Stage<'_>> {
        let view = first_view(scene, size)?;
        let settings = IlluminationSettings {
            lights: *lights,
            views: vec![view],
            rewalk: Rewalk::Off,
            ..IlluminationSettings::default()
        };
        self.stage_with(scene, options, Illumination::new(scene, &settings)?, (view, size))
    }

    /// The same with light of one's own, and a view.
    ///
    /// # Errors
    /// As [`Bench::stage`].
    pub fn stage_with(
        &self,
        scene: &Scene,
        options: RendererOptions,
        illumination: Illumination,
        (view, size): (View, [u32; 2]),
    ) -> Result<Stage<'_>> {
        let mut renderer = self.compiled.another(options)?;
        renderer.open_with(scene, illumination)?;
        Ok(Stage { gpu: &self.gpu, renderer, viewport: Viewport::default(), view, size })
    }
}

/// The view of a scene's first camera.
///
/// # Errors
/// Where it has none.
pub fn first_view(scene: &Scene, size: [u32; 2]) -> Result<View> {
    let camera = scene.cameras.first().context("the scene has no camera")?;
    Ok(View::new(scene, camera, size[0] as f32 / size[1] as f32))
}

/// The object that may move.
///
/// # Errors
/// Where there is none.
pub fn moving_object(scene: &Scene) -> Result<ObjectId> {
    let index =
        scene.objects.iter().position(|object| object.dynamic).context("nothing moves in the scene")?;
    Ok(index.into())
}

/// A scene on the device.
pub struct Stage<'a> {
    gpu: &'a Gpu,
    /// It has the scene open.
    pub renderer: Renderer,
    /// Where its pictures are.
    pub viewport: Viewport,
    /// From where it is seen.
    pub view: View,
    /// In so many pixels.
    pub size: [u32; 2],
}

impl Stage<'_> {
    /// How many light samples there are.
    pub fn lights(&self) -> usize {
        self.renderer.illumination().map_or(0, |light| light.lights().len())
    }

    /// A frame, waited for: its milliseconds.
    ///
    /// # Errors
    /// Those of [`Renderer::render`].
    pub fn frame(&mut self, settings: &RenderSettings) -> Result<f64> {
        let start = Instant::now();
        self.renderer.render(&mut self.viewport, &self.view, self.size, settings)?;
        self.gpu.wait()?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    /// Median milliseconds of so many frames for each of several settings, in turn, after one of each that is not counted and that
    /// draws what shadow maps are needed.
    ///
    /// # Errors
    /// Those of [`Renderer::render`].
    pub fn times(&mut self, settings: &[RenderSettings], frames: usize) -> Result<Vec<f64>> {
        Ok(self.all_times(settings, frames)?.into_iter().map(median).collect())
    }

    /// The least instead of the median: what else the machine does can only make frames slower.
    ///
    /// # Errors
    /// Those of [`Renderer::render`].
    pub fn least_times(&mut self, settings: &[RenderSettings], frames: usize) -> Result<Vec<f64>> {
        let least = |times: Vec<f64>| times.into_iter().fold(f64::INFINITY, f64::min);
        Ok(self.all_times(settings, frames)?.into_iter().map(least).collect())
    }

    fn all_times(&mut self, settings: &[RenderSettings], frames: usize) -> Result<Vec<Vec<f64>>> {
        let mut times = vec![Vec::new(); settings.len()];
        for round in 0..=frames {
            for (settings, times) in settings.iter().zip(&mut times) {
                let time = self.frame(settings)?;
                if round > 0 {
                    times.push(time);
                }
            }
        }
        Ok(times)
    }

    /// Radiance of a frame.
    ///
    /// # Errors
    /// Those of [`Renderer::render`] and of reading back.
    pub fn picture(&mut self, settings: &RenderSettings) -> Result<Image> {
        self.frame(settings)?;
        Ok(self.gpu.block_on(self.renderer.radiance(&self.viewport))??)
    }

    /// What the last frame did.
    ///
    /// # Errors
    /// Where the device was lost.
    pub fn stats(&self) -> Result<FrameStats> {
        Ok(self.gpu.block_on(self.renderer.stats(&self.viewport))??)
    }
}

/// The median; 0 of nothing.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

/// The file of a model below the shared folder, where it is there.
pub fn shared_file(shared: Option<&Path>, file: &str) -> Option<PathBuf> {
    shared.map(|folder| folder.join(file)).filter(|path| path.is_file())
}
