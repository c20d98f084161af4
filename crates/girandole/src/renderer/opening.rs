//! Scenes that are opened in slices, lit by more and more of their samples, and shown from one view after the other.

use super::{Renderer, hold, nothing_loaded};
use crate::{Error, Result};
use girandole_core::illumination::Illumination;
use girandole_core::scene::{Scene, SceneChanges, View};
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

    /// Places the light samples of the scene that is open for other views, all alike (none = by power): the next frame is, bit
    /// for bit, that of a renderer that opens the scene with these views. Everything that depends on them is made anew. Samples
    /// that follow [a few paths a frame](girandole_core::illumination::Rewalk::Paths) go over little by little, with the updates
    /// that come.
    ///
    /// # Errors
    /// [`Error::Scene`] before [`Renderer::open`] and where the scene has changed since (nothing changes then); otherwise as
    /// for [`Renderer::open`], and the scene has to be opened again.
    pub fn place_for(&mut self, scene: &Scene, views: &[View]) -> Result<()> {
        self.place_on_way(scene, views, &[])
    }

    /// Places the light samples as [`Renderer::place_for`] does, and where they follow a few paths a frame also for the views
    /// [to come](Illumination::place_on_way).
    ///
    /// # Errors
    /// As [`Renderer::place_for`].
    pub fn place_on_way(&mut self, scene: &Scene, views: &[View], to_come: &[View]) -> Result<()> {
        let Some(illumination) = &mut self.illumination else {
            return Err(Error::invalid("open a scene before placing its light samples"));
        };
        let lights = illumination.lights().generation();
        let leaves = |of: &Illumination| of.visibility().map(|database| database.receivers().leaves.len());
        let before = leaves(illumination);
        hold(&mut self.scene, None);
        let placed = illumination.place_on_way(scene, views, to_come);
        hold(&mut self.scene, illumination.visibility());
        placed?;
        let is_same_light = illumination.lights().generation() == lights;
        if is_same_light && leaves(illumination) == before {
            return Ok(());
        }
        let illumination = self.illumination.take().ok_or_else(nothing_loaded)?;
        if is_same_light {
            self.relight(scene, illumination)
        } else {
            self.load_illumination(scene, illumination)
        }
    }

    /// Determines the visibility of what a view needs and no view before needed: views that light samples are not placed for are so
    /// as fast as the others. Without it their pictures are right, too, but all that is in them is looked up in shadow maps.
    ///
    /// # Errors
    /// [`Error::Scene`] before [`Renderer::open`] and where the scene has changed since; [`Error::TooLarge`] beyond the device's
    /// limits.
    pub fn determine_for(&mut self, scene: &Scene, view: &View) -> Result<()> {
        let Some(mut illumination) = self.illumination.take() else {
            return Err(Error::invalid("open a scene before its visibility"));
        };
        hold(&mut self.scene, None);
        let is_more = illumination.determine_for(std::slice::from_ref(view));
        hold(&mut self.scene, illumination.visibility());
        if is_more {
            self.restart(None);
            return self.relight(scene, illumination);
        }
        self.illumination = Some(illumination);
        Ok(())
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
