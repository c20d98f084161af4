//! The picture beside the truth: a path tracer's picture of the same view, that converges while nothing moves, or the naive mode's.

use super::clock::{Duration, Instant};
use super::pending::{self, Pending};
use super::session::Session;
use egui::{ColorImage, TextureHandle, TextureOptions};
use girandole_core::Generation;
use girandole_core::illumination::IlluminationSettings;
use girandole_core::image::Image;
use girandole_core::scene::View;
use girandole_core::tonemap;
use girandole_core::trace::HeldHierarchies;
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use girandole_reference::{PathSettings, ProgressivePathTracer};
use std::sync::Arc;

/// Rows of a slice of the path tracer's work, and how long slices of a frame take together: as long as all else of it, but no less
/// and no more than this.
const ROWS: u32 = 4;
const SLICE: [Duration; 2] = [Duration::from_millis(40), Duration::from_millis(300)];
/// How often the truth is shown and compared anew.
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
struct Key {
    against: Against,
    scene: Generation,
    view: View,
    size: [u32; 2],
    light: IlluminationSettings,
    settings: girandole::RenderSettings,
}

/// The truth beside the picture.
#[derive(Default)]
pub struct Truth {
    pub against: Against,
    /// Where the picture ends and the truth begins, as a share of the width.
    pub split: Split,
    /// Of the last comparison.
    pub comparison: Option<Comparison>,
    key: Option<Key>,
    tracing: Option<ProgressivePathTracer>,
    hierarchies: HeldHierarchies,
    ours: Pictured,
    truth: Pictured,
    comparing: Option<Pending<Option<Comparison>>>,
    texture: Option<TextureHandle>,
    shown: Option<Instant>,
    /// When a slice was last traced.
    traced: Option<Instant>,
    /// How many light sets our picture had when it was last asked for.
    sets: u32,
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

    /// Whether another frame would bring it further.
    pub fn is_waiting(&self) -> bool {
        let is_coming = self.ours.pending.is_some() || self.truth.pending.is_some();
        self.key.is_some() && (self.tracing.is_some() || is_coming || self.comparing.is_some())
    }

    /// Goes on by a slice, if the session's picture is there and nothing moves. What it is of is begun anew where it is another one.
    pub fn step(&mut self, session: &mut Session, size: [u32; 2], context: &egui::Context) {
        let key = self.key(session, size);
        if key.is_none() || self.key != key {
            let Self { against, split, .. } = *self;
            let hierarchies = std::mem::take(&mut self.hierarchies);
            *self = Self { against, split, hierarchies, ..Self::default() };
            let Some(key) = key else { return };
            self.ask(session);
            if key.against == Against::PathTracer {
                let bounces = Some(session.light.lights.bounces);
                let settings = PathSettings { paths: 1, bounces, seed: session.light.lights.seed };
                self.tracing = Some(ProgressivePathTracer::new(&key.view, size, &settings));
            }
            self.key = Some(key);
        }
        let has_ours = self.ours.collect();
        if has_ours && self.against == Against::Naive {
            self.truth.pending = session.naive_radiance(size).map(Pending::new);
        }
        let mut has_truth = self.truth.collect();
        let is_due = self.shown.is_none_or(|at| at.elapsed() >= BETWEEN_PICTURES);
        if is_due && self.sets != session.refined_sets() && self.ours.pending.is_none() {
            self.ask(session);
        }
        if let Some(tracing) = &mut self.tracing {
            let start = Instant::now();
            let others = self.traced.map_or(SLICE[0], |at| start - at);
            let until = start + others.clamp(SLICE[0], SLICE[1]);
            session.trace(&mut self.hierarchies, |tracer| {
                while Instant::now() < until {
                    tracing.step(tracer, ROWS);
                }
            });
            self.traced = Some(Instant::now());
            if is_due && self.ours.image.is_some() && self.comparing.is_none() {
                self.truth.image = Some(Arc::new(tracing.estimate().mean));
                has_truth = true;
            }
        }
        if has_truth {
            self.show(session, context);
        }
        if let Some(comparison) = pending::take(&mut self.comparing) {
            self.comparison = comparison;
        }
    }

    /// Asks for our picture.
    fn ask(&mut self, session: &Session) {
        self.sets = session.refined_sets();
        self.ours.pending = session.renderer().map(|renderer| Pending::new(renderer.radiance()));
    }

    /// What there is to compare: nothing while anything moves or is being made.
    fn key(&self, session: &Session, size: [u32; 2]) -> Option<Key> {
        let rests = session.is_done() && !session.is_moving();
        // While the naive picture is being rendered, ours is not the renderer's last.
        let is_there = !session.wants_picture(size) || self.key.is_some();
        (self.against != Against::Nothing && rests && is_there).then(|| Key {
            against: self.against,
            scene: session.scene.generation(),
            view: session.view(size),
            size,
            light: session.light.clone(),
            settings: session.settings,
        })
    }

    /// Shows the truth as the picture is shown, and compares the two, on a thread where there are threads.
    fn show(&mut self, session: &Session, context: &egui::Context) {
        let (Some(ours), Some(truth)) = (self.ours.image.clone(), self.truth.image.clone()) else { return };
        let shown = session.shown();
        let bytes = tonemap::to_srgb8(&truth, shown.exposure.ev(&ours), shown.tonemap);
        let size = [truth.width as usize, truth.height as usize];
        let image = ColorImage::from_rgb(size, &bytes);
        match &mut self.texture {
            Some(texture) => texture.set(image, TextureOptions::NEAREST),
            None => self.texture = Some(context.load_texture("truth", image, TextureOptions::NEAREST)),
        }
        self.shown = Some(Instant::now());
        if self.paths() != Some(0) {
            self.comparing = Some(beside(move || compare(&truth, &ours, &CompareOptions::default()).ok()));
        }
    }
}

/// The result of a function that is called on a thread of its own, where there are threads.
fn beside<T: Send + 'static>(f: impl FnOnce() -> T + Send + 'static) -> Pending<T> {
    #[cfg(target_arch = "wasm32")]
    let result = std::future::ready(f());
    #[cfg(not(target_arch = "wasm32"))]
    let result = {
        let (sender, receiver) = std::sync::mpsc::channel();
        std::thread::spawn(move || sender.send(f()));
        std::future::poll_fn(move |_| match receiver.try_recv() {
            Ok(value) => std::task::Poll::Ready(value),
            Err(_) => std::task::Poll::Pending,
        })
    };
    Pending::new(result)
}
