//! Light in the making, slice by slice: the window stays responsive meanwhile.
//!
//! A scene that was just opened has a picture of few samples at once, in the naive mode, which needs no visibility. It grows as
//! shadow maps are drawn. Where there is a picture already, that stays until all is there.

use super::super::clock::Instant;
use super::{Rewalk, Session, Work};
use anyhow::Result;
use girandole::{MapUpdates, RenderSettings, Renderer, wgpu};
use girandole_core::Generation;
use girandole_core::illumination::{Illumination, Opening, Stage};
use std::sync::Arc;

/// Samples that a picture is begun with.
const FIRST: usize = 16;
/// What drawing the maps of further ones may take, milliseconds.
const SLICE: f64 = 40.0;
/// The shape of the picture that maps are drawn for: about that of windows, which draw by themselves what they show beyond.
const WIDE: [u32; 2] = [16, 9];
/// The fewest that are added.
const LEAST: usize = 4;

/// Light in the making.
pub(super) struct Making {
    opening: Opening,
    of: Generation,
    /// Whether the last picture stays until all is there.
    pub behind: bool,
    /// Whether it is left as it is.
    pub paused: bool,
    /// What is made behind that, until its visibility is known.
    held: Option<Box<Illumination>>,
    /// Of how many samples maps are drawn, once visibility is known.
    lit: Option<usize>,
    /// When maps were last added, and how many.
    added: Option<(Instant, usize)>,
    /// How many samples were lit when the picture was last drawn for it.
    drawn: usize,
}

impl Making {
    fn is_for(&self, session: &Session) -> bool {
        *self.opening.settings() == session.light && self.of == session.scene.generation()
    }

    /// Whether the renderer has it, whose picture is not the last one any more.
    pub fn is_loaded(&self) -> bool {
        self.lit.is_some()
    }

    /// How many maps to add: as many as the last ones say there is time for.
    fn next(&mut self) -> usize {
        let now = Instant::now();
        let lit = self.lit.unwrap_or_default();
        let more = match self.added {
            Some((at, count)) => {
                let each = (now - at).as_secs_f64() * 1e3 / count.max(1) as f64;
                ((SLICE / each.max(1e-3)) as usize).clamp(LEAST, lit.max(LEAST))
            }
            None => FIRST,
        };
        self.added = Some((now, more));
        lit + more
    }
}

impl Session {
    /// Whether light is being made, or has to be.
    pub fn is_making(&self) -> bool {
        self.making.as_ref().is_some_and(|making| !making.paused)
            || self.making.is_none() && self.work() != Work::Nothing
    }

    /// The share that is done of the light, or of the transfer, that is being made, 0 to 1, and what is done at the moment.
    pub fn progress(&self) -> Option<(f32, &'static str)> {
        let count = self.light.lights.count as f32;
        match &self.making {
            Some(Making { lit: Some(lit), .. }) => {
                Some(((0.5 + 0.5 * *lit as f32 / count).min(1.0), "Shadow maps"))
            }
            Some(making) => Some((0.5 * making.opening.progress(), "Visibility")),
            None => match self.work().message() {
                Some(message) => Some((0.0, message)),
                None => self.transfers.progress().map(|share| (share, "Light transfer")),
            },
        }
    }

    /// Whether what is shown is a first picture of few samples.
    pub fn is_preliminary(&self) -> bool {
        self.making.as_ref().is_some_and(|making| !making.behind)
    }

    /// Leaves the light that was there, with the settings that it was made by; a first picture stays as it is.
    pub fn cancel(&mut self) {
        if self.making.is_none() && self.work() == Work::Nothing {
            return self.transfers.cancel();
        }
        let held = self.renderer.as_ref().and_then(Renderer::illumination).map(|i| i.settings().clone());
        match (&mut self.making, held) {
            (Some(making), _) if !making.behind || making.lit.is_some() => making.paused = true,
            (making, Some(held)) => {
                *making = None;
                self.light = held;
                self.is_outdated = false;
                // Lest rest begins it again at once.
                self.refused = Some((self.options, self.light.clone()));
            }
            _ => {}
        }
    }

    /// Goes on with what was cancelled.
    pub fn resume(&mut self) {
        self.making.iter_mut().for_each(|making| making.paused = false);
    }

    /// Whether something was cancelled that can go on.
    pub fn is_paused(&self) -> bool {
        self.making.as_ref().is_some_and(|making| making.paused)
    }

    /// Makes light until then, at least a slice of it. Returns whether the device was given anything to do.
    pub fn make(&mut self, device: (&wgpu::Device, &wgpu::Queue), until: Instant) -> bool {
        match self.try_make(device, until) {
            Ok(submitted) => submitted,
            Err(error) => {
                self.is_open = false;
                self.making = None;
                self.refused = Some((self.options, self.light.clone()));
                self.notice = Some(crate::sentence(&error));
                false
            }
        }
    }

    fn try_make(&mut self, device: (&wgpu::Device, &wgpu::Queue), until: Instant) -> Result<bool> {
        if self.making.as_ref().is_none_or(|making| !making.is_for(self)) {
            self.making = None;
            match self.work() {
                Work::Nothing => return Ok(false),
                Work::Renderer => {
                    // What was there leaves first: two atlases may not fit. What was compiled stays.
                    let another = match self.renderer.take() {
                        Some(renderer) => renderer.another(self.options),
                        None => Renderer::new(device.0, device.1, self.options),
                    };
                    (self.is_open, self.shown) = (false, None);
                    self.renderer = Some(another?);
                    self.transfers.forget_renderer();
                }
                Work::Light => {}
            }
            (self.notice, self.refused) = (None, None);
            self.making = Some(Making {
                opening: Opening::new(self.light.clone()),
                of: self.scene.generation(),
                behind: self.is_open && self.shown.is_some(),
                paused: false,
                held: None,
                lit: None,
                added: None,
                drawn: FIRST,
            });
        }
        match &self.making {
            Some(making) if making.paused => Ok(false),
            Some(Making { lit: Some(_), .. }) => self.add_maps(),
            _ => self.make_slices(until).map(|()| false),
        }
    }

    /// Slices before maps are drawn.
    fn make_slices(&mut self, until: Instant) -> Result<()> {
        let (Some(making), Some(renderer)) = (&mut self.making, &mut self.renderer) else { return Ok(()) };
        match making.opening.step(&self.scene, || Instant::now() < until)? {
            Stage::Lights(illumination) if making.behind => making.held = Some(illumination),
            Stage::Lights(mut illumination) => {
                self.notice = illumination.lights().warnings.first().cloned();
                illumination.light(&self.scene, Some(FIRST))?;
                Arc::make_mut(&mut self.scene).take_changes();
                renderer.open_with(&self.scene, *illumination)?;
                (self.is_open, self.is_outdated, self.shown) = (true, false, None);
            }
            Stage::Slice => {}
            Stage::Visibility(database) => {
                match making.held.take() {
                    Some(mut illumination) => {
                        self.notice = illumination.lights().warnings.first().cloned();
                        illumination.set_visibility(&self.scene, database)?;
                        illumination.light(&self.scene, Some(1))?;
                        Arc::make_mut(&mut self.scene).take_changes();
                        renderer.open_with(&self.scene, *illumination)?;
                        making.lit = Some(0);
                    }
                    None => {
                        renderer.set_visibility(&self.scene, database)?;
                        making.lit = Some(FIRST);
                        self.shown = None;
                    }
                }
                self.is_outdated = false;
            }
            Stage::Done => making.lit = Some(FIRST),
        }
        Ok(())
    }

    /// Draws the maps of further samples, or has the next picture do so.
    fn add_maps(&mut self) -> Result<bool> {
        let view = self.view(WIDE);
        let (Some(making), Some(renderer)) = (&mut self.making, &mut self.renderer) else { return Ok(false) };
        let lit = making.next();
        let count = renderer.illumination().map_or(0, |i| i.lights().len());
        making.lit = Some(lit);
        renderer.light(&self.scene, (lit < count).then_some(lit))?;
        // A picture takes as long as many maps: there is one of twice as many samples each time.
        let is_picture = !making.behind && (lit >= 2 * making.drawn || lit >= count);
        if is_picture {
            (making.drawn, self.shown) = (lit, None);
        } else {
            let settings = RenderSettings { updates: MapUpdates::default(), ..self.settings };
            renderer.draw_shadow_maps_for(&view, &settings)?;
        }
        if lit >= count {
            (self.making, self.shown) = (None, None);
            self.sampled =
                Some(self.scene.generation()).filter(|_| !matches!(self.light.rewalk, Rewalk::Paths(_)));
        }
        Ok(!is_picture)
    }

    /// The scene is another version: what is being made is of no use any more.
    pub(super) fn forget_making(&mut self) {
        let held = self.renderer.as_ref().and_then(Renderer::illumination).map(|i| i.settings());
        let is_refresh = held == Some(&self.light);
        match self.making.take() {
            // It is sampled anew once all rests.
            Some(Making { behind: true, lit: None, .. }) if is_refresh => self.is_outdated = false,
            Some(_) => self.is_outdated = true,
            None => {}
        }
    }
}
