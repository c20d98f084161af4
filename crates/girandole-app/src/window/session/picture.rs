//! A picture that the window shows, by what it depends on.

use super::super::budget::Quality;
use crate::picture::Shown;
use girandole::RenderSettings;
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
