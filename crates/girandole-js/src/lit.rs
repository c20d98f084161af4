//! A scene on a device, lit bit by bit: what fits between two frames is made, and the picture grows with it.

use crate::settings::{Camera, Chosen, Settings};
use girandole::{Error, Mode, RenderSettings, Renderer, Result, Target, Viewport, wgpu};
use girandole_core::illumination::{IlluminationSettings, Opening, Stage};
use girandole_core::scene::{Scene, View, Viewpoint};
use girandole_core::visibility::VisibilitySettings;
use serde::Serialize;
use std::sync::Arc;

/// Samples that a picture is begun with.
const FIRST: usize = 16;

/// How far the target of a scene's own camera is, metres.
const TARGET: f64 = 1.0;

/// A scene with its renderer.
pub struct Lit {
    device: wgpu::Device,
    queue: wgpu::Queue,
    chosen: Chosen,
    scene: Option<Arc<Scene>>,
    eye: Option<Viewpoint>,
    renderer: Option<Renderer>,
    viewport: Viewport,
    /// Whether the renderer has the scene, and what its light was asked to be.
    opened: Option<IlluminationSettings>,
    opening: Option<Opening>,
    /// How many samples are lit, while they are not all.
    lit: Option<usize>,
    drawn: Option<Picture>,
}

/// All that a picture depends on besides the scene and its light.
#[derive(Clone, Copy, PartialEq)]
struct Picture {
    view: View,
    size: [u32; 2],
    settings: RenderSettings,
}

/// What is known of a scene and its light.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Stats {
    /// The scene's name.
    pub scene: String,
    /// Its triangles.
    pub triangles: usize,
    /// Light samples that there are.
    pub lights: usize,
    /// Those that shine already.
    pub lit: usize,
    /// The share of the light that is made, 0 to 1.
    pub progress: f32,
    /// What there is to say of the scene and its light.
    pub warnings: Vec<String>,
}

impl Lit {
    /// Nothing, on a device.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        Self {
            device: device.clone(),
            queue: queue.clone(),
            chosen: Chosen::default(),
            scene: None,
            eye: None,
            renderer: None,
            viewport: Viewport::default(),
            opened: None,
            opening: None,
            lit: None,
            drawn: None,
        }
    }

    /// Shows a scene from its first camera.
    pub fn show(&mut self, mut scene: Scene) {
        scene.ensure_camera();
        scene.take_changes();
        self.eye = None;
        self.scene = Some(Arc::new(scene));
        self.forget_light();
    }

    /// Chooses settings.
    pub fn set(&mut self, settings: &Settings) {
        self.chosen.set(settings);
    }

    /// Where one looks from; nothing before there is a scene.
    pub fn camera(&self) -> Option<Camera> {
        let scene = self.scene.as_ref()?;
        Some(Camera::of(&self.eye.unwrap_or_else(|| Viewpoint::of(scene, &scene.cameras[0], TARGET))))
    }

    /// Looks from elsewhere. The light stays placed for what was seen when it was made.
    ///
    /// # Errors
    /// [`Error::Scene`] where nothing can be seen from there.
    pub fn look_from(&mut self, camera: &Camera) -> Result<()> {
        let eye = camera.viewpoint();
        eye.view(1.0)?;
        self.eye = Some(eye);
        Ok(())
    }

    /// Has the light made anew, placed for what is seen now.
    pub fn place(&mut self) {
        self.opened = None;
    }

    fn forget_light(&mut self) {
        (self.opened, self.opening, self.lit, self.drawn) = (None, None, None, None);
    }

    /// Makes light while there is time, at least a slice of it, and draws the picture where it is another one by now.
    /// `target` is asked for only then, and what is drawn is submitted. Returns whether there is more to come.
    ///
    /// # Errors
    /// As those of [`Renderer`].
    pub fn render(
        &mut self,
        (size, format): ([u32; 2], wgpu::TextureFormat),
        has_time: impl Fn() -> bool,
        target: impl FnOnce() -> Option<wgpu::TextureView>,
    ) -> Result<bool> {
        if self.scene.is_none() {
            return Ok(false);
        }
        let view = self.view(size)?;
        if self.make(view, has_time)? {
            // One thing at a time: the picture comes with the next call.
            return Ok(true);
        }
        let is_drawn = self.draw((view, size, format), target)?;
        Ok(self.opening.is_some() || self.lit.is_some() || !is_drawn)
    }

    fn view(&self, [width, height]: [u32; 2]) -> Result<View> {
        let aspect = width as f32 / height as f32;
        let scene = self.scene.as_ref().ok_or_else(nothing)?;
        Ok(match &self.eye {
            Some(eye) => eye.view(aspect)?,
            None => View::new(scene, &scene.cameras[0], aspect),
        })
    }

    /// Returns whether the renderer loaded something, which takes longer than slices do.
    fn make(&mut self, view: View, has_time: impl Fn() -> bool) -> Result<bool> {
        self.ensure_renderer()?;
        self.begin(view);
        let made = self.make_slices(has_time);
        if made.is_err() {
            // It begins anew, to say the same again.
            self.forget_light();
        }
        made
    }

    fn ensure_renderer(&mut self) -> Result<()> {
        if self.renderer.as_ref().is_some_and(|renderer| *renderer.options() == self.chosen.options) {
            return Ok(());
        }
        self.forget_light();
        // What was there leaves first: two atlases may not fit.
        let renderer = match self.renderer.take() {
            Some(renderer) => renderer.another(self.chosen.options),
            None => Renderer::new(&self.device, &self.queue, self.chosen.options),
        };
        self.renderer = Some(renderer?);
        Ok(())
    }

    /// Begins to make light where it is other light that is asked for.
    fn begin(&mut self, view: View) {
        let visibility = (self.chosen.render.mode != Mode::Naive).then(VisibilitySettings::default);
        let asked =
            |views: Vec<View>| IlluminationSettings { visibility, views, ..self.chosen.light.clone() };
        if self.opened.as_ref().is_none_or(|opened| *opened != asked(opened.views.clone())) {
            let asked = asked(vec![view]);
            self.opening = Some(Opening::new(asked.clone()));
            (self.opened, self.lit) = (Some(asked), None);
        }
    }

    fn make_slices(&mut self, has_time: impl Fn() -> bool) -> Result<bool> {
        let (Some(opening), Some(renderer), Some(scene)) =
            (&mut self.opening, &mut self.renderer, &self.scene)
        else {
            return Ok(false);
        };
        match opening.step(scene, has_time)? {
            Stage::Slice => return Ok(false),
            Stage::Lights(mut illumination) => {
                self.lit = Some(FIRST).filter(|first| *first < illumination.lights().len());
                illumination.light(scene, self.lit)?;
                renderer.open_with(scene, *illumination)?;
                self.drawn = None;
                return Ok(true);
            }
            Stage::Visibility(database) => {
                renderer.set_visibility(scene, database)?;
                (self.opening, self.drawn) = (None, None);
                return Ok(true);
            }
            Stage::Done => self.opening = None,
        }
        Ok(false)
    }

    /// Draws the picture where it is another one. Returns whether it is the last one for now.
    fn draw(
        &mut self,
        (view, size, format): (View, [u32; 2], wgpu::TextureFormat),
        target: impl FnOnce() -> Option<wgpu::TextureView>,
    ) -> Result<bool> {
        let (Some(renderer), Some(scene), Some(lit)) = (&mut self.renderer, &self.scene, self.lit) else {
            return self.draw_whole((view, size, format), target);
        };
        // The first picture stays until visibility is there; then there is one of twice as many samples each time.
        if self.opening.is_none() && self.drawn.is_some() {
            let count = renderer.illumination().map_or(0, |light| light.lights().len());
            let more = Some(lit * 2).filter(|more| *more < count);
            renderer.light(scene, more)?;
            (self.lit, self.drawn) = (more, None);
        }
        self.draw_whole((view, size, format), target)
    }

    fn draw_whole(
        &mut self,
        (view, size, format): (View, [u32; 2], wgpu::TextureFormat),
        target: impl FnOnce() -> Option<wgpu::TextureView>,
    ) -> Result<bool> {
        let Some(renderer) = &mut self.renderer else { return Ok(false) };
        let Some(light) = renderer.illumination() else { return Ok(false) };
        let mut settings = self.chosen.render;
        if self.opening.as_ref().is_some_and(|opening| opening.settings() != light.settings()) {
            // The last picture, if it is of this scene, until there is other light.
            let Some(drawn) = &self.drawn else { return Ok(false) };
            settings = drawn.settings;
        } else if light.visibility().is_none() && settings.mode != Mode::Naive {
            // What mirrors show needs more kernels.
            settings = RenderSettings { mode: Mode::Naive, mirrors: 0, ..settings };
        }
        let picture = Picture { view, size, settings };
        if self.drawn == Some(picture) {
            return Ok(true);
        }
        let Some(target) = target() else { return Ok(false) };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        renderer.record(
            &mut self.viewport,
            &mut encoder,
            &view,
            &Target::new(&target, format, size),
            &settings,
        )?;
        self.queue.submit([encoder.finish()]);
        self.drawn = Some(picture);
        Ok(true)
    }

    /// What is known.
    pub fn stats(&self) -> Stats {
        let Some(scene) = &self.scene else { return Stats::default() };
        let light = self.renderer.as_ref().and_then(Renderer::illumination);
        let lights = light.map_or(0, |light| light.lights().len());
        let progress = match (&self.opening, light) {
            (Some(opening), _) => 0.5 * opening.progress(),
            (None, Some(_)) => self.lit.map_or(1.0, |lit| 0.5 + 0.5 * lit as f32 / lights.max(1) as f32),
            (None, None) => 0.0,
        };
        let said = light.map(|light| light.lights().warnings.clone()).unwrap_or_default();
        Stats {
            scene: scene.name.clone(),
            triangles: light.map_or(0, |light| light.geometry().triangles.len()),
            lights,
            lit: self.lit.unwrap_or(lights).min(lights),
            progress,
            warnings: scene.warnings.iter().cloned().chain(said).collect(),
        }
    }
}

fn nothing() -> Error {
    Error::Scene(girandole_core::Error::Invalid("load a scene first".into()))
}
