//! What the window shows: a scene, its light and its renderer, and what has to be made anew when one of them changes.
//!
//! Settings are those of the library. What the renderer was made with and what it opened, it knows itself: the session
//! compares, and makes anew no more than what differs.
//!
//! | what changes | what is made anew |
//! |---|---|
//! | the view, [`RenderSettings`] | the picture; for exposure and tone curve, only how it is shown |
//! | the scene's places and emission | what [`Renderer::update`] says |
//! | [`IlluminationSettings`] | light samples, visibility, shadow maps |
//! | [`RendererOptions`] | the renderer, and all of that |

use super::budget::Budget;
use super::camera::Eye;
use super::clock::Instant;
use super::refine::Refinement;
use super::rest::Rest;
use super::target::PictureTarget;
use crate::args::LoadArgs;
use crate::picture::Shown;
use anyhow::Result;
use girandole::{Mode, RenderSettings, Renderer, RendererOptions, Viewport};
use girandole_core::Generation;
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::Image;
use girandole_core::scene::{Edits, Geometry, Scene, SceneChanges, View};
use girandole_core::trace::{HeldHierarchies, SceneTracer};
use std::sync::Arc;

mod clip;
mod compiling;
mod editing;
mod history;
mod making;
mod picture;
mod transfer;

pub use transfer::Transfers;

use history::History;
use making::Making;
use picture::Picture;

/// What has to be made, slice by slice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    Nothing,
    /// The scene's light.
    Light,
    /// The renderer, and the scene's light.
    Renderer,
}

impl Work {
    /// What is said meanwhile.
    pub fn message(self) -> Option<&'static str> {
        match self {
            Self::Nothing => None,
            Self::Light => Some("Sampling light"),
            Self::Renderer => Some("Making the renderer"),
        }
    }
}

/// The moment of the scene's animations.
#[derive(Clone, Copy, Debug, Default)]
pub struct Playback {
    pub playing: bool,
    /// From 0 to the scene's duration.
    pub seconds: f64,
}

/// What a scene was loaded from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// As on the command line: a built-in room or a file.
    pub scene: String,
    /// The moving object of a built-in room, where it is not the room's own.
    pub object: Option<String>,
    /// How it is loaded.
    pub load: LoadArgs,
}

/// What the window starts with.
pub struct Start {
    /// Milliseconds of a frame while things move.
    pub budget: Option<f64>,
    pub source: Source,
    pub scene: Scene,
    /// Those that led from the source to the scene.
    pub edits: Edits,
    pub eye: Eye,
    pub options: RendererOptions,
    pub light: IlluminationSettings,
    pub settings: RenderSettings,
    pub refine: bool,
    pub transfers: Transfers,
}

/// A scene that is shown.
pub struct Session {
    pub source: Source,
    /// What is shown; [`Session::edit`] changes it. Light that is being sampled holds it, too.
    pub scene: Arc<Scene>,
    /// What led from the source to the scene.
    pub edits: Edits,
    pub eye: Eye,
    pub playback: Playback,
    pub options: RendererOptions,
    pub light: IlluminationSettings,
    pub settings: RenderSettings,
    /// For frames while things move.
    pub budget: Budget,
    /// Whether light is sampled anew once nothing moves any more.
    pub fresh_at_rest: bool,
    pub refinement: Refinement,
    pub transfers: Transfers,
    history: History,
    /// What went wrong, or is to be known: one sentence.
    pub notice: Option<String>,
    /// Whether the first scene is not there yet.
    pub is_blank: bool,
    renderer: Option<Renderer>,
    viewport: Viewport,
    /// Whether the renderer has the scene.
    is_open: bool,
    /// The version of the scene whose light was sampled, where samples are still those.
    sampled: Option<Generation>,
    /// Whether it is to be sampled anew though no setting differs.
    is_outdated: bool,
    making: Option<Making>,
    rest: Rest,
    /// What was refused, lest it be tried again each frame.
    refused: Option<(RendererOptions, IlluminationSettings)>,
    shown: Option<Picture>,
    /// How many pictures were rendered.
    pictures: u64,
    /// Since when the next picture waits for kernels, if it does.
    compiling: Option<Instant>,
}

impl Session {
    pub fn new(start: Start) -> Self {
        let Start { budget, source, scene, edits, eye, options, light, settings, refine, transfers } = start;
        let notice = scene.warnings.first().cloned();
        Self {
            source,
            scene: Arc::new(scene),
            edits,
            eye,
            playback: Playback::default(),
            options,
            light,
            settings,
            budget: Budget::new(budget),
            fresh_at_rest: true,
            refinement: Refinement::new(refine),
            transfers,
            history: History::default(),
            notice,
            is_blank: false,
            renderer: None,
            viewport: Viewport::default(),
            is_open: false,
            sampled: None,
            is_outdated: false,
            making: None,
            rest: Rest::default(),
            refused: None,
            shown: None,
            pictures: 0,
            compiling: None,
        }
    }

    /// Shows another scene, by the same settings.
    pub fn replace_scene(&mut self, source: Source, scene: Scene, size: [u32; 2]) {
        self.notice = scene.warnings.first().cloned();
        self.source = source;
        self.scene = Arc::new(scene);
        self.edits = Edits::default();
        self.transfers.clear();
        self.history = History::default();
        self.eye = Eye::Camera(0);
        self.playback = Playback::default();
        if !self.light.views.is_empty() {
            self.light.views = vec![self.view(size)];
        }
        (self.is_open, self.making, self.shown) = (false, None, None);
        (self.refused, self.is_blank) = (None, false);
    }

    /// The view of a picture of so many pixels.
    pub fn view(&self, [width, height]: [u32; 2]) -> View {
        self.eye.view(&self.scene, width as f32 / height as f32)
    }

    /// What has to be done before the next picture.
    pub fn work(&self) -> Work {
        let is_refused = |(options, light): &(RendererOptions, IlluminationSettings)| {
            *options == self.options && *light == self.light
        };
        if self.is_blank || self.refused.as_ref().is_some_and(is_refused) {
            return Work::Nothing;
        }
        let Some(renderer) = self.renderer.as_ref().filter(|r| *r.options() == self.options) else {
            return Work::Renderer;
        };
        let is_sampled = self.is_open && !self.is_outdated;
        let is_lit = is_sampled && renderer.illumination().is_some_and(|i| *i.settings() == self.light);
        if is_lit { Work::Nothing } else { Work::Light }
    }

    /// Moves on by so many seconds of real time. Motion waits for light that is being made.
    pub fn advance(&mut self, seconds: f64) {
        let duration = self.scene.duration();
        let held = self.renderer.as_ref().and_then(Renderer::illumination).map(|i| i.settings());
        let waits = self.is_making() && (held != Some(&self.light) || self.is_preliminary());
        if self.playback.playing && duration > 0.0 && !waits {
            self.seek((self.playback.seconds + seconds) % duration);
        }
    }

    /// Does something that may be refused: then the window says why.
    pub fn attempt(&mut self, action: impl FnOnce(&mut Self) -> Result<()>) {
        if let Err(error) = action(self) {
            self.notice = Some(crate::sentence(&error));
        }
    }

    /// Follows what changed in the scene.
    pub fn follow(&mut self, size: [u32; 2]) {
        let view = self.view(size);
        let Some(renderer) = self.renderer.as_mut().filter(|_| self.is_open) else { return };
        let has_changed = self.scene.has_changed();
        let changes = match has_changed {
            true => Arc::make_mut(&mut self.scene).take_changes(),
            false => SceneChanges::none(self.scene.generation()),
        };
        let held = renderer.illumination();
        let settled = held.is_none_or(|i| i.is_settled());
        if !(changes.is_empty() && settled) {
            self.shown = None;
            match self.light.rewalk {
                Rewalk::Off => {}
                Rewalk::Paths(_) => self.sampled = None,
                Rewalk::All => self.sampled = Some(self.scene.generation()),
            }
        }
        let is_as_wanted = held.is_some_and(|i| *i.settings() == self.light);
        if let Err(error) = renderer.follow(&self.scene, &changes, &[view]) {
            self.notice = Some(crate::sentence(&error.into()));
            self.is_open = renderer.illumination().is_some();
        }
        // Other changes of the light make it anew, and place it on that occasion.
        if let Some(held) = renderer.illumination().filter(|_| is_as_wanted) {
            let views = &held.settings().views;
            if self.light.views != *views {
                self.light.views.clone_from(views);
                self.sampled = self.sampled.filter(|_| self.light.rewalk == Rewalk::All);
            }
        }
        if has_changed {
            self.forget_making();
        }
    }

    /// So many seconds of real time have passed: what rests may have fresh light by now.
    pub fn rest(&mut self, seconds: f64, size: [u32; 2]) {
        self.rest.pass(seconds, (self.scene.generation(), self.view(size)));
        if self.fresh_at_rest && self.rest.is_resting() && !self.is_moving() && self.making.is_none() {
            self.refresh(size);
        }
    }

    /// Seconds until what is shown may have fresh light, or all its pixels, if nothing moves; `None` where it has both.
    pub fn rests_in(&self, size: [u32; 2]) -> Option<f64> {
        let waits = self.fresh_at_rest && !self.is_fresh(size) || self.is_hurried();
        self.rest.left().filter(|_| self.is_open && waits)
    }

    /// Whether light was sampled for the scene as it stands and what is seen of it, as `girandole render` does.
    pub fn is_fresh(&self, size: [u32; 2]) -> bool {
        self.sampled == Some(self.scene.generation()) && !self.is_placed_elsewhere(size)
    }

    /// Whether a call of `girandole render` would give the same light; asks for that where it is not so.
    pub fn is_ready_to_copy(&mut self, size: [u32; 2]) -> bool {
        self.playback.playing = false;
        self.refresh(size);
        let follows = matches!(self.light.rewalk, Rewalk::Paths(_));
        (self.is_fresh(size) || follows && !self.is_moving()) && self.is_done()
    }

    /// Whether all light is there that was asked for.
    pub fn is_done(&self) -> bool {
        self.making.is_none() && self.work() == Work::Nothing
    }

    /// Asks for light that is [fresh](Self::is_fresh), unless it is. Samples that follow paths are left to do so.
    pub fn refresh(&mut self, size: [u32; 2]) {
        if self.is_fresh(size)
            || !self.is_open
            || self.making.is_some()
            || matches!(self.light.rewalk, Rewalk::Paths(_))
        {
            return;
        }
        if !self.light.views.is_empty() {
            self.light.views = vec![self.view(size)];
        }
        self.is_outdated = true;
    }

    /// Whether the picture is another one by now.
    pub fn wants_picture(&self, size: [u32; 2]) -> bool {
        if self.renderer.is_none() || !self.is_open {
            return false;
        }
        if self.making.as_ref().is_some_and(|making| making.behind && making.is_loaded()) {
            return false;
        }
        let (picture, moves) = (self.picture(size), self.is_hurried());
        let is_shown = |shown: Picture| if moves { shown.shows(&picture) } else { shown == picture };
        !self.shown.is_some_and(is_shown) || self.stale_maps() > 0
    }

    /// Shadow maps that are out of date in the picture.
    pub fn stale_maps(&self) -> u32 {
        self.renderer.as_ref().map_or(0, |renderer| renderer.stale().maps)
    }

    /// What was on the device is lost: all of it is made anew.
    pub fn forget_device(&mut self) {
        (self.renderer, self.making, self.shown) = (None, None, None);
        (self.is_open, self.sampled, self.refused) = (false, None, None);
        self.transfers.forget_renderer();
        self.refinement = Refinement::new(self.refinement.on);
    }

    /// Whether a budget counts at this moment.
    pub fn is_hurried(&self) -> bool {
        !self.is_preliminary()
            && self.budget.milliseconds.is_some()
            && (self.is_moving() || !self.rest.is_resting())
    }

    /// Whether the next frame will differ from this one though nothing is touched.
    pub fn is_moving(&self) -> bool {
        let light = self.renderer.as_ref().and_then(Renderer::illumination);
        self.playback.playing && self.scene.duration() > 0.0 || light.is_some_and(|l| !l.is_settled())
    }

    /// Whether a picture was drawn.
    #[cfg(target_arch = "wasm32")]
    pub fn has_picture(&self) -> bool {
        self.shown.is_some()
    }

    /// Draws the picture where it is another one by now.
    pub fn draw(&mut self, target: &mut PictureTarget) {
        let picture = self.picture(target.size);
        let Some(renderer) = self.renderer.as_mut().filter(|_| self.is_open) else { return };
        let is_there = self.shown.is_some_and(|shown| shown.has_radiance_of(&picture));
        let is_stale = renderer.stale().maps > 0;
        self.shown = Some(picture);
        let Self { transfers, scene, viewport, .. } = self;
        let mut draw = || -> Result<()> {
            transfers.apply(renderer, scene)?;
            if !is_there || is_stale {
                let settings = picture.quality.settings(&picture.settings);
                renderer.render(viewport, &picture.view, picture.quality.size(picture.size), &settings)?;
                self.pictures += 1;
            }
            let Shown { exposure, tonemap } = picture.settings_shown();
            let settings = RenderSettings { exposure, tonemap, ..picture.settings };
            let (size, format) = (picture.quality.size(picture.size), target.format);
            Ok(target.draw(size, |view| renderer.show(viewport, &settings, view, format))?)
        };
        if let Err(error) = draw() {
            self.notice = Some(crate::sentence(&error));
        }
    }

    /// The radiance of the naive mode's picture, which is rendered now.
    pub fn naive_radiance(
        &mut self,
        size: [u32; 2],
    ) -> Option<impl Future<Output = girandole::Result<Image>> + 'static> {
        let view = self.view(size);
        let samples_per_axis = self.settings.samples_per_axis;
        let settings = RenderSettings {
            mode: Mode::Naive,
            samples_per_axis,
            clamp: self.settings.clamp,
            mirrors: self.settings.mirrors,
            ..RenderSettings::default()
        };
        let renderer = self.renderer.as_mut().filter(|_| self.is_open)?;
        let mut beside = Viewport::default();
        let rendered =
            renderer.render(&mut beside, &view, size, &settings).map(|()| renderer.radiance(&beside));
        match rendered {
            Ok(radiance) => Some(radiance),
            Err(error) => {
                self.notice = Some(crate::sentence(&error.into()));
                None
            }
        }
    }

    /// Traces rays in the scene that is open.
    pub fn trace(&self, hierarchies: &mut HeldHierarchies, trace: impl FnOnce(&SceneTracer)) {
        let light = self.renderer.as_ref().and_then(Renderer::illumination);
        // Objects may have gone that are drawn once more.
        let is_there = |geometry: &Geometry| geometry.objects.len() <= self.scene.objects.len();
        if let Some(light) = light.filter(|light| is_there(light.geometry())) {
            trace(&hierarchies.tracer(&self.scene, light.geometry()));
        }
    }

    /// The target is another one: the picture has to be drawn to it.
    pub fn forget_picture(&mut self) {
        self.shown = None;
    }

    /// The number of the last picture, another one for each that was rendered, and light sets in it.
    pub fn picture_number(&self) -> (u64, u32) {
        (self.pictures, self.refined_sets())
    }

    /// How the picture is shown.
    pub fn shown(&self) -> Shown {
        Shown::new(self.settings.exposure, self.settings.tonemap, self.settings.debug)
    }

    /// What draws, and where its picture is, once there is one.
    pub fn shown_by(&self) -> Option<(&Renderer, &Viewport)> {
        let renderer = self.renderer.as_ref().filter(|_| self.shown.is_some())?;
        Some((renderer, &self.viewport))
    }

    /// The light of the scene that is open, whether there is a picture of it or not.
    pub fn illumination(&self) -> Option<&Illumination> {
        self.renderer.as_ref().filter(|_| self.is_open)?.illumination()
    }

    /// What draws, with what it draws.
    pub(super) fn renderer_and_scene(&mut self) -> Option<(&mut Renderer, &mut Viewport, &Scene)> {
        let Self { renderer, viewport, scene, .. } = self;
        renderer.as_mut().filter(|_| self.is_open).map(|renderer| (renderer, viewport, &**scene))
    }

    /// What draws, to be timed or not.
    pub fn time_passes(&mut self, on: bool) {
        self.renderer.iter_mut().for_each(|renderer| renderer.time_passes(on));
    }

    /// Whether light samples are placed for another view than the one that is shown.
    pub fn is_placed_elsewhere(&self, size: [u32; 2]) -> bool {
        !self.light.views.is_empty() && self.light.views != [self.view(size)]
    }
}

#[cfg(test)]
pub mod tests;

#[cfg(test)]
mod history_tests;
