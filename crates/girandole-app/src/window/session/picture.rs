//! A picture that the window shows, by what it depends on.

use super::super::budget::Quality;
use super::super::panel;
use super::Session;
use crate::picture::Shown;
use girandole::{DebugView, Mode, RenderSettings, Renderer};
use girandole_core::scene::View;

/// A picture, by all that it depends on besides the scene and its light.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Picture {
    pub view: View,
    pub size: [u32; 2],
    pub settings: RenderSettings,
    pub quality: Quality,
}

impl Picture {
    /// Whether the other one has the same radiance.
    pub fn has_radiance_of(&self, other: &Self) -> bool {
        let RenderSettings { exposure, tonemap, .. } = self.settings;
        let settings = RenderSettings { exposure, tonemap, ..other.settings };
        *self == Self { settings, ..*other }
    }

    /// Whether it is the other one, but for its quality.
    pub fn shows(&self, other: &Self) -> bool {
        *self == Self { quality: self.quality, ..*other }
    }

    /// How it is shown.
    pub fn settings_shown(&self) -> Shown {
        Shown::new(self.settings.exposure, self.settings.tonemap, self.settings.debug)
    }
}

impl Session {
    /// The picture that is wanted.
    pub(super) fn picture(&self, size: [u32; 2]) -> Picture {
        let quality = match (self.is_preliminary(), self.is_hurried()) {
            (true, _) => Quality::PRELIMINARY,
            (false, true) => self.budget.quality(),
            _ => Quality::FULL,
        };
        let mut settings = self.settings;
        let light = self.renderer.as_ref().and_then(Renderer::illumination);
        if light.is_some_and(|light| light.visibility().is_none()) {
            let RenderSettings { exposure, tonemap, .. } = settings;
            // What mirrors show needs more kernels.
            let soon = RenderSettings { mode: Mode::Naive, mirrors: 0, ..RenderSettings::default() };
            settings = RenderSettings { exposure, tonemap, ..soon };
        }
        Picture { view: self.view(size), size, settings, quality }
    }

    /// Shows the next of the debug views that the mode has, after the last one the picture.
    pub fn next_debug_view(&mut self) {
        let all = panel::DEBUG_VIEWS.map(|(view, ..)| view);
        let possible = all.into_iter().filter(|view| panel::has_debug_view(self.settings.mode, *view));
        let views: Vec<Option<DebugView>> = possible.collect();
        let kind = |view: &Option<DebugView>| view.as_ref().map(std::mem::discriminant);
        let now = views.iter().position(|view| kind(view) == kind(&self.settings.debug));
        self.settings.debug = views[now.map_or(0, |now| (now + 1) % views.len())];
    }
}
