//! What goes on while everything is at rest: pictures of further light sets are averaged in, a slice of work a frame.

use super::clock::Instant;
use super::pending::{self, Pending};
use super::session::Session;
use super::target::PictureTarget;
use anyhow::Result;
use girandole::RenderSettings;

/// Whether pictures are refined, and what is known of the last one.
#[derive(Default)]
pub struct Refinement {
    pub on: bool,
    /// Estimated relMSE of the average of so many light sets.
    estimate: Option<(u32, f64)>,
    pending: Option<(u32, Pending<girandole::Result<Option<f64>>>)>,
}

impl Refinement {
    pub fn new(on: bool) -> Self {
        Self { on, ..Self::default() }
    }

    /// Whether an estimate is on its way.
    pub fn is_waiting(&self) -> bool {
        self.pending.is_some()
    }

    /// Takes an estimate that has come back. Returns whether one has.
    pub fn collect(&mut self) -> bool {
        let Some((sets, estimate)) = self.pending.take() else { return false };
        let mut slot = Some(estimate);
        let result = pending::take(&mut slot);
        self.pending = slot.map(|estimate| (sets, estimate));
        // A lost device is reported by the frame that needs it.
        if let Some(Ok(Some(error))) = result {
            self.estimate = Some((sets, error));
        }
        result.is_some()
    }

    /// The estimated relMSE of the last average of so many sets or fewer, from the second on.
    pub fn estimate(&self, sets: u32) -> Option<f64> {
        self.estimate.filter(|(of, _)| sets > 1 && *of <= sets).map(|(_, error)| error)
    }
}

impl Session {
    /// Whether there is nothing else to do than to refine the picture.
    pub fn may_refine(&self, size: [u32; 2]) -> bool {
        self.refinement.on
            && self.settings.debug.is_none()
            && self.is_done()
            && (self.is_fresh(size) || !self.fresh_at_rest)
            && self.refined_sets() > 0
            && !self.is_moving()
            && !self.wants_picture(size)
    }

    /// Light sets in the picture.
    pub fn refined_sets(&self) -> u32 {
        self.shown_by().map_or(0, |(renderer, viewport)| renderer.refined_sets(viewport))
    }

    /// Goes on to refine the picture that is shown, until then. Returns whether it is another one now, which the device is at.
    pub fn refine(&mut self, target: &mut PictureTarget, until: Instant) -> bool {
        let refined = self.refined(target, until);
        refined.unwrap_or_else(|error| {
            self.refinement.on = false;
            self.notice = Some(crate::sentence(&error));
            false
        })
    }

    fn refined(&mut self, target: &mut PictureTarget, until: Instant) -> Result<bool> {
        let (view, shown, settings) = (self.view(target.size), self.shown(), self.settings);
        let Some((renderer, viewport, scene)) = self.renderer_and_scene() else { return Ok(false) };
        while !renderer.refine(viewport, scene, &view, target.size, &settings)? {
            if Instant::now() >= until {
                return Ok(false);
            }
        }
        let settings = RenderSettings { exposure: shown.exposure, tonemap: shown.tonemap, ..settings };
        let (size, format) = (target.size, target.format);
        target.draw(size, |view| renderer.show(viewport, &settings, view, format))?;
        let (sets, error) = (renderer.refined_sets(viewport), renderer.refined_error(viewport));
        if !self.refinement.is_waiting() {
            self.refinement.pending = Some((sets, Pending::new(error)));
        }
        Ok(true)
    }
}
