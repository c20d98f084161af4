//! An illumination in the making, slice by slice.

use super::{Illumination, IlluminationSettings};
use crate::Result;
use crate::generation::Generation;
use crate::lights::LightChanges;
use crate::scene::Scene;
use crate::slices::Slices;
use crate::visibility::{VisibilityBuild, VisibilityDatabase};
use std::sync::Arc;

/// An [`Illumination`] in the making: what does not fit between two frames is made in slices of work, on all cores, some
/// milliseconds each as a rule. The first ones sample the light; with that the naive mode has a picture. The others determine
/// visibility. The library reads no clock: whoever calls says whether there is time for more. Dropping it gives it up.
///
/// ```
/// use girandole_core::illumination::{Illumination, IlluminationSettings, Opening, Stage};
/// use girandole_core::scene::builtin;
/// use std::sync::Arc;
///
/// let scene = Arc::new(builtin::build("block", builtin::MovingObject::None)?);
/// let settings = IlluminationSettings::default();
/// let mut opening = Opening::new(settings.clone());
/// let mut opened: Option<Illumination> = None;
/// loop {
///     match opening.step(&scene, || false)? {
///         Stage::Lights(illumination) => opened = Some(*illumination),
///         Stage::Slice => {}
///         Stage::Visibility(database) => {
///             opened.as_mut().unwrap().set_visibility(&scene, database)?;
///             break;
///         }
///         Stage::Done => break,
///     }
/// }
/// assert!(opened.unwrap().lights() == Illumination::new(&scene, &settings)?.lights());
/// # Ok::<(), girandole_core::Error>(())
/// ```
pub struct Opening {
    settings: IlluminationSettings,
    state: State,
}

enum State {
    New,
    Sampling(Generation, Slices<Result<Illumination>>),
    Sampled(Box<Illumination>),
    /// What visibility is determined for, and is compared with.
    Lit(Arc<Illumination>),
    Beginning(Arc<Illumination>, Slices<Result<VisibilityBuild>>),
    Determining(Arc<Illumination>, Box<VisibilityBuild>),
    Determined(Box<VisibilityDatabase>),
    Done,
}

/// What a slice of an [`Opening`] leads to.
pub enum Stage {
    /// Geometry and light samples, without visibility.
    Lights(Box<Illumination>),
    /// There is more to do.
    Slice,
    /// The visibility, for [`Illumination::set_visibility`]. It is the last.
    Visibility(Box<VisibilityDatabase>),
    /// Nothing is left.
    Done,
}

impl Opening {
    /// Begins it.
    pub fn new(settings: IlluminationSettings) -> Self {
        Self { settings, state: State::New }
    }

    /// What is asked for.
    pub fn settings(&self) -> &IlluminationSettings {
        &self.settings
    }

    /// The share that is done, 0 to 1.
    pub fn progress(&self) -> f32 {
        match &self.state {
            State::Determining(_, build) => build.progress(),
            State::Determined(_) | State::Done => 1.0,
            _ => 0.0,
        }
    }

    /// Goes on by a slice, and by more while there is time. Light and visibility are handed over by themselves: a renderer takes longer
    /// to load them than a slice takes. The scene is held until visibility is begun.
    ///
    /// # Errors
    /// As [`Illumination::new`]; and [`Error::Invalid`](crate::Error::Invalid) where the scene has changed since the first one:
    /// then begin anew.
    pub fn step(&mut self, scene: &Arc<Scene>, has_time: impl Fn() -> bool) -> Result<Stage> {
        loop {
            let stage = self.slice(scene)?;
            let hands_over = matches!(self.state, State::Sampled(_) | State::Determined(_));
            if hands_over || !matches!(stage, Stage::Slice) || !has_time() {
                return Ok(stage);
            }
        }
    }

    fn slice(&mut self, scene: &Arc<Scene>) -> Result<Stage> {
        match std::mem::replace(&mut self.state, State::Done) {
            State::New => {
                self.settings.lights.validate()?;
                let (held, settings) = (scene.clone(), self.settings.clone());
                let sampling = async move { Illumination::without_visibility(&held, &settings).await };
                self.state = State::Sampling(scene.generation(), Slices::new(sampling));
                Ok(Stage::Slice)
            }
            State::Sampling(of, mut sampling) => {
                of.expect(scene.generation(), "the scene has changed while it was opened; begin anew")?;
                let Some(lit) = sampling.step() else {
                    self.state = State::Sampling(of, sampling);
                    return Ok(Stage::Slice);
                };
                self.state = State::Sampled(Box::new(lit?));
                Ok(Stage::Slice)
            }
            State::Sampled(lit) => {
                lit.geometry.belongs_to(scene)?;
                let has_more = self.settings.visibility.is_some();
                self.state = if has_more { State::Lit(Arc::from(lit.clone())) } else { State::Done };
                Ok(Stage::Lights(lit))
            }
            State::Lit(lit) => {
                lit.geometry.belongs_to(scene)?;
                let (held, of) = (scene.clone(), lit.clone());
                let beginning = Slices::new(async move { of.begin_visibility(&held).await });
                self.state = State::Beginning(lit, beginning);
                Ok(Stage::Slice)
            }
            State::Beginning(lit, mut beginning) => {
                lit.geometry.belongs_to(scene)?;
                self.state = match beginning.step() {
                    Some(build) => State::Determining(lit, Box::new(build?)),
                    None => State::Beginning(lit, beginning),
                };
                Ok(Stage::Slice)
            }
            State::Determining(lit, mut build) => {
                lit.geometry.belongs_to(scene)?;
                self.state = if build.is_done() {
                    State::Determined(Box::new(build.end(scene, &lit.geometry)?))
                } else {
                    build.step();
                    State::Determining(lit, build)
                };
                Ok(Stage::Slice)
            }
            State::Determined(database) => Ok(Stage::Visibility(database)),
            State::Done => Ok(Stage::Done),
        }
    }
}

impl Illumination {
    async fn begin_visibility(&self, scene: &Scene) -> Result<VisibilityBuild> {
        let Self { settings, geometry, lights, .. } = self;
        let wanted = settings.visibility.unwrap_or_default();
        VisibilityBuild::in_slices((scene, geometry), lights, &wanted, settings.needed_views()).await
    }

    /// Takes the visibility that an [`Opening`] determined for it, whichever of its samples are lit by now.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where it was determined for another version of the scene, or for other samples.
    pub fn set_visibility(&mut self, scene: &Scene, database: Box<VisibilityDatabase>) -> Result<()> {
        let (sampled, _) = &self.sampled;
        database.belongs_to(&self.geometry, sampled)?;
        self.visibility = Some(Arc::from(database));
        self.served.clear();
        self.changes = LightChanges::default();
        if self.most_lit.is_some() {
            let all = sampled.clone();
            self.set_lights(scene, all);
        }
        Ok(())
    }
}
