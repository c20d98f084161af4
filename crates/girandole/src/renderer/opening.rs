//! Scenes that are opened in slices, lit by more and more of their samples, and shown from one view after the other.

use super::{Renderer, hold, nothing_loaded};
use crate::{Error, Result};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
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
        self.change();
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
        self.change();
        let Some(mut illumination) = self.illumination.take() else {
            return Err(Error::invalid("open a scene before choosing its light samples"));
        };
        hold(&mut self.scene, None);
        illumination.light(scene, most)?;
        self.relight(scene, illumination)
    }

    /// Follows the changes of the scene that is open as [`Renderer::update`] does, and where views go: the one call before each frame of a
    /// moving camera, or of several, without changes too.
    ///
    /// Visibility is determined of what these views need and no view before needed, so that they are as fast as those that the scene was
    /// opened for. Samples that were placed for views are placed for these where that costs nothing more: little by little where they
    /// [follow paths](girandole_core::illumination::Rewalk::Paths), and with changes that have them [all sampled
    /// anew](girandole_core::illumination::Rewalk::All). Else they stay; [`Renderer::place_for`] has them sampled for other views.
    ///
    /// ```no_run
    /// # use girandole::scene::{Scene, View};
    /// # use girandole::{Renderer, RenderSettings, Result, Viewport};
    /// # fn frame(renderer: &mut Renderer, viewport: &mut Viewport, scene: &mut Scene, view: View) -> Result<()> {
    /// let changes = scene.take_changes();
    /// renderer.follow(scene, &changes, &[view])?;
    /// renderer.render(viewport, &view, [1024, 768], &RenderSettings::default())?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`Renderer::update`].
    pub fn follow(&mut self, scene: &Scene, changes: &SceneChanges, views: &[View]) -> Result<()> {
        let Some(illumination) = &mut self.illumination else {
            return Err(Error::invalid("open a scene before following it"));
        };
        let IlluminationSettings { rewalk, views: placed_for, .. } = illumination.settings();
        let is_placed = !placed_for.is_empty() && !views.is_empty();
        let follows_paths = is_placed && matches!(rewalk, Rewalk::Paths(_));
        if is_placed && *rewalk == Rewalk::All && !changes.is_empty() {
            self.update_with(|illumination| illumination.update_for(scene, changes, views), scene, changes)?;
        } else if follows_paths && changes.is_empty() {
            // These views are those of which pixels must not change at once.
            self.place_for(scene, views)?;
            self.update(scene, changes)?;
        } else {
            self.update(scene, changes)?;
            if follows_paths {
                self.place_for(scene, views)?;
            }
        }
        if views.is_empty() { Ok(()) } else { self.determine_for(scene, views) }
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

    /// Determines the visibility of what views need and no view before needed.
    fn determine_for(&mut self, scene: &Scene, views: &[View]) -> Result<()> {
        let Some(mut illumination) = self.illumination.take() else {
            return Err(Error::invalid("open a scene before its visibility"));
        };
        hold(&mut self.scene, None);
        let is_more = illumination.determine_for(views);
        hold(&mut self.scene, illumination.visibility());
        if is_more {
            self.change();
            return self.relight(scene, illumination);
        }
        self.illumination = Some(illumination);
        Ok(())
    }

    /// Takes samples that are where they were, as bright as they may be.
    fn relight(&mut self, scene: &Scene, illumination: Illumination) -> Result<()> {
        self.change();
        let still = SceneChanges::none(scene.generation());
        let Some(resident) = &mut self.scene else { return Err(nothing_loaded()) };
        if !resident.follow(&self.context, scene, &illumination, &still)? {
            return self.load_illumination(scene, illumination);
        }
        self.illumination = Some(illumination);
        self.transfer_anew(scene)
    }
}
