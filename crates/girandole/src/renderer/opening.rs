//! Scenes that are opened in slices, and lit by more and more of their samples.

use super::{Renderer, hold, nothing_loaded};
use crate::{Error, Result};
use girandole_core::illumination::Illumination;
use girandole_core::scene::{Scene, SceneChanges};
use girandole_core::visibility::VisibilityDatabase;

impl Renderer {
    /// Opens a scene with light samples and visibility of the caller's, most often those of an
    /// [`Opening`](girandole_core::illumination::Opening). [`Renderer::update`] follows the scene's changes.
    ///
    /// # Errors
    /// As for [`Renderer::load`].
    pub fn open_with(&mut self, scene: &Scene, illumination: Illumination) -> Result<()> {
        self.load_illumination(scene, illumination)
    }

    /// Takes the visibility that an [`Opening`](girandole_core::illumination::Opening) determined for the scene that is open.
    /// Shadow maps stay as they are.
    ///
    /// # Errors
    /// [`Error::Scene`] before [`Renderer::open_with`], and where it was determined for another version of the scene;
    /// [`Error::TooLarge`] where it exceeds the device's limits.
    pub fn set_visibility(&mut self, scene: &Scene, database: Box<VisibilityDatabase>) -> Result<()> {
        self.restart(None);
        let Some(mut illumination) = self.illumination.take() else {
            return Err(Error::invalid("open a scene before its visibility"));
        };
        hold(&mut self.scene, None);
        illumination.set_visibility(scene, database)?;
        self.relight(scene, illumination)
    }

    /// Lights so many of the samples alone, for the same light in the mean
    /// ([`LightSet::prefix`](girandole_core::lights::LightSet::prefix)); `None` = all. Shadow maps of dark ones are not drawn
    /// until those shine: so a picture can be begun with a few samples, and grow as maps are drawn.
    ///
    /// # Errors
    /// [`Error::Scene`] before [`Renderer::open`] and where the scene has changed since.
    pub fn light(&mut self, scene: &Scene, most: Option<usize>) -> Result<()> {
        self.restart(None);
        let Some(mut illumination) = self.illumination.take() else {
            return Err(Error::invalid("open a scene before choosing its light samples"));
        };
        hold(&mut self.scene, None);
        illumination.light(scene, most)?;
        self.relight(scene, illumination)
    }

    /// Takes samples that are where they were, as bright as they may be.
    fn relight(&mut self, scene: &Scene, illumination: Illumination) -> Result<()> {
        self.last_view = None;
        let still = SceneChanges::none(scene.generation());
        let Some(resident) = &mut self.scene else { return Err(nothing_loaded()) };
        if !resident.follow(&self.context, scene, &illumination, &still)? {
            return self.load_illumination(scene, illumination);
        }
        self.illumination = Some(illumination);
        self.transfer_anew(scene)
    }
}
