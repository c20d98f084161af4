//! The picture beside the truth: a path tracer's picture of the same view, that converges while nothing moves, or the naive mode's.

use super::clock::{Duration, Instant};
use super::pending::{self, Pending};
use super::session::Session;
use crate::picture::Shown;
use egui::{ColorImage, TextureHandle, TextureOptions};
use girandole::RendererOptions;
use girandole_core::Generation;
use girandole_core::illumination::IlluminationSettings;
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSettings};
use girandole_core::scene::View;
use girandole_core::tonemap::{self, Tonemap};
use girandole_core::trace::HeldHierarchies;
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use girandole_reference::{PathSettings, ProgressivePathTracer};
use std::sync::Arc;

/// Rows of a slice of the path tracer's work, and how long slices of a frame take together: as long as all else of it, but no less
/// and no more than this.
const ROWS: u32 = 4;
const SLICE: [Duration; 2] = [Duration::from_millis(40), Duration::from_millis(300)];
/// How often the two are compared anew, and a truth that grows is shown.
const BETWEEN_PICTURES: Duration = Duration::from_millis(700);

/// What the picture is compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Against {
    #[default]
    Nothing,
    /// Without light samples, by as many bounces.
    PathTracer,
    /// Every light with its shadow map at every pixel.
    Naive,
}

impl Against {
    /// The one after it.
    pub fn next(self) -> Self {
        match self {
            Self::Nothing => Self::PathTracer,
            Self::PathTracer => Self::Naive,
            Self::Naive => Self::Nothing,
        }
    }
}

/// What the truth is of.
#[derive(Clone, PartialEq)]
struct Subject {
    scene: Generation,
    view: View,
    size: [u32; 2],
    of: Kind,
}

/// How it is found, by all that it depends on.
#[derive(Clone, PartialEq)]
enum Kind {
    Paths(PathSettings),
    Naive { light: IlluminationSettings, options: RendererOptions, clamp: Clamp, samples_per_axis: u32 },
}

/// The truth beside the picture.
#[derive(Default)]
pub struct Truth {
    pub against: Against,
    /// Where the picture ends and the truth begins, as a share of the width.
    pub split: Split,
    /// Of the last comparison.
    pub comparison: Option<Comparison>,
    subject: Option<Subject>,
    tracing: Option<ProgressivePathTracer>,
    hierarchies: HeldHierarchies,
    ours: Pictured,
    /// Which of the session's pictures ours is.
    number: Option<(u64, u32)>,
    truth: Pictured,
    /// Whether one of the two is not compared yet.
    has_news: bool,
    comparing: Option<Pending<Option<Comparison>>>,
    texture: Option<TextureHandle>,
    /// How the texture shows the truth.
    shown_as: Option<(f32, Tonemap)>,
    compared: Option<Instant>,
    /// When a slice was last traced.
    traced: Option<Instant>,
}

/// A place between the picture's edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split(pub f32);

impl Default for Split {
    fn default() -> Self {
        Self(0.5)
    }
}

/// A picture that is there, or on its way.
#[derive(Default)]
struct Pictured {
    pending: Option<Pending<girandole::Result<Image>>>,
    image: Option<Arc<Image>>,
}

impl Pictured {
    /// Whether it is neither there nor on its way.
    fn is_unasked(&self) -> bool {
        self.image.is_none() && self.pending.is_none()
    }

    /// Whether it has come just now.
    fn collect(&mut self) -> bool {
        match pending::take(&mut self.pending) {
            Some(image) => {
                self.image = image.ok().map(Arc::new);
                self.image.is_some()
            }
            None => false,
        }
    }
}

impl Truth {
    /// What is shown to the right of the split.
    pub fn texture(&self) -> Option<&TextureHandle> {
        self.texture.as_ref()
    }

    /// Paths that each pixel has so far.
    pub fn paths(&self) -> Option<u32> {
        self.tracing.as_ref().map(ProgressivePathTracer::paths)
    }

    /// Forgets all pictures.
    pub fn begin_anew(&mut self) {
        let Self { against, split, .. } = *self;
        let hierarchies = std::mem::take(&mut self.hierarchies);
        *self = Self { against, split, hierarchies, ..Self::default() };
    }

    /// Whether another frame would bring it further.
    pub fn is_waiting(&self) -> bool {
        let is_coming = self.ours.pending.is_some() || self.truth.pending.is_some();
        self.subject.is_some() && (self.tracing.is_some() || is_coming || self.comparing.is_some())
    }

    /// Goes on by a slice, if nothing moves. What it is of is begun anew where it is another one; other settings of our picture
    /// only make another comparison.
    pub fn step(&mut self, session: &mut Session, size: [u32; 2], context: &egui::Context) {
        let subject = self.subject(session, size);
        if subject.is_none() || self.subject != subject {
            self.begin_anew();
            self.tracing = match &subject {
                Some(Subject { view, of: Kind::Paths(settings), .. }) => {
                    Some(ProgressivePathTracer::new(view, size, settings))
                }
                _ => None,
            };
            self.subject = subject;
        }
        if self.subject.is_none() {
            return;
        }
        self.has_news |= self.ours.collect() | self.truth.collect();
        let is_due =
            self.tracing.is_none() || self.compared.is_none_or(|at| at.elapsed() >= BETWEEN_PICTURES);
        self.ask(session, size, is_due);
        self.trace(session);
        if is_due {
            self.compare(session);
        }
        self.show(session, context);
        if let Some(comparison) = pending::take(&mut self.comparing) {
            self.comparison = comparison;
        }
    }

    /// Asks for the pictures that the device has or can make.
    fn ask(&mut self, session: &mut Session, size: [u32; 2], is_due: bool) {
        // While another picture is wanted, or a debug view shown, the last one is not ours.
        if !session.is_done() || session.wants_picture(size) || session.settings.debug.is_some() {
            return;
        }
        let number = session.picture_number();
        if self.number != Some(number) && self.ours.pending.is_none() && is_due {
            self.number = Some(number);
            self.ours.pending =
                session.shown_by().map(|(renderer, viewport)| Pending::new(renderer.radiance(viewport)));
        }
        // The device is given one picture after the other.
        let naive = matches!(&self.subject, Some(Subject { of: Kind::Naive { .. }, .. }));
        if naive && self.truth.is_unasked() && self.ours.pending.is_none() {
            self.truth.pending = session.naive_radiance(size).map(Pending::new);
        }
    }

    fn trace(&mut self, session: &Session) {
        let Some(tracing) = &mut self.tracing else { return };
        let start = Instant::now();
        let others = self.traced.map_or(SLICE[0], |at| start - at);
        let until = start + others.clamp(SLICE[0], SLICE[1]);
        session.trace(&mut self.hierarchies, |tracer| {
            while Instant::now() < until {
                tracing.step(tracer, ROWS);
            }
        });
        self.traced = Some(Instant::now());
    }

    /// Compares the two, on a thread where there are threads.
    fn compare(&mut self, session: &Session) {
        if self.comparing.is_some() || session.settings.debug.is_some() {
            return;
        }
        if let Some(tracing) = self.tracing.as_ref().filter(|tracing| tracing.paths() > 0) {
            self.truth.image = Some(Arc::new(tracing.estimate().mean));
            self.has_news = true;
            self.shown_as = None;
        }
        let (Some(ours), Some(truth)) = (&self.ours.image, &self.truth.image) else { return };
        if std::mem::take(&mut self.has_news) {
            let (ours, truth) = (ours.clone(), truth.clone());
            self.compared = Some(Instant::now());
            self.comparing =
                Some(pending::beside(async move || compare(&truth, &ours, &CompareOptions::default()).ok()));
        }
    }

    /// What there is to compare: nothing while anything moves.
    fn subject(&self, session: &Session, size: [u32; 2]) -> Option<Subject> {
        let of = match self.against {
            Against::Nothing => return None,
            Against::PathTracer => Kind::Paths(path_settings(&session.light)),
            Against::Naive => Kind::Naive {
                light: session.light.clone(),
                options: session.options,
                clamp: session.settings.clamp,
                samples_per_axis: session.settings.samples_per_axis,
            },
        };
        let (scene, view) = (session.scene.generation(), session.view(size));
        (!session.is_moving()).then_some(Subject { scene, view, size, of })
    }

    /// Shows the truth as the picture is shown.
    fn show(&mut self, session: &Session, context: &egui::Context) {
        let Some(truth) = &self.truth.image else { return };
        let Shown { exposure, tonemap } = session.shown();
        let shown_as = (exposure.ev(self.ours.image.as_ref().unwrap_or(truth)), tonemap);
        if self.shown_as == Some(shown_as) {
            return;
        }
        self.shown_as = Some(shown_as);
        let bytes = tonemap::to_srgb8(truth, shown_as.0, tonemap);
        let size = [truth.width as usize, truth.height as usize];
        let image = ColorImage::from_rgb(size, &bytes);
        match &mut self.texture {
            Some(texture) => texture.set(image, TextureOptions::NEAREST),
            None => self.texture = Some(context.load_texture("truth", image, TextureOptions::NEAREST)),
        }
    }
}

/// As many bounces as the light samples have.
fn path_settings(light: &IlluminationSettings) -> PathSettings {
    let LightSettings { bounces, seed, .. } = light.lights;
    PathSettings { paths: 1, bounces: (bounces != u32::MAX).then_some(bounces), seed }
}

#[cfg(test)]
mod tests;
