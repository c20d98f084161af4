//! An illumination in the making, slice by slice.

use super::{Illumination, IlluminationSettings};
use crate::Result;
use crate::lights::LightChanges;
use crate::scene::Scene;
use crate::visibility::{VisibilityBuild, VisibilityDatabase};
use std::sync::Arc;

/// Groups of patches, or meshes, of one slice.
const SLICE: usize = 8;

/// An [`Illumination`] in the making: what does not fit between two frames is made in slices of work, on all cores, some
/// milliseconds each as a rule. The first slice samples the light; with that the naive mode has a picture. The others determine
/// visibility. The library reads no clock: whoever calls makes as many slices as there is time for. Dropping it gives it up.
///
/// ```
/// use girandole_core::illumination::{Illumination, IlluminationSettings, Opening, Stage};
/// use girandole_core::scene::builtin;
///
/// let scene = builtin::build("block", builtin::MovingObject::None)?;
/// let settings = IlluminationSettings::default();
/// let mut opening = Opening::new(settings.clone());
/// let mut opened: Option<Illumination> = None;
/// loop {
///     match opening.step(&scene)? {
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
    has_lights: bool,
    build: Option<VisibilityBuild>,
    /// What visibility is determined for, and is compared with.
    lit: Option<Box<Illumination>>,
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
        Self { settings, has_lights: false, build: None, lit: None }
    }

    /// What is asked for.
    pub fn settings(&self) -> &IlluminationSettings {
        &self.settings
    }

    /// The share that is done, 0 to 1.
    pub fn progress(&self) -> f32 {
        match &self.build {
            Some(build) => build.progress(),
            None if self.has_lights && self.lit.is_none() => 1.0,
            None => 0.0,
        }
    }

    /// Goes on by a slice.
    ///
    /// # Errors
    /// As [`Illumination::new`]; and [`Error::Invalid`](crate::Error::Invalid) where the scene has changed since the first one:
    /// then begin anew.
    pub fn step(&mut self, scene: &Scene) -> Result<Stage> {
        if !self.has_lights {
            let lit = Illumination::without_visibility(scene, &self.settings)?;
            self.has_lights = true;
            self.lit = self.settings.visibility.is_some().then(|| Box::new(lit.clone()));
            return Ok(Stage::Lights(Box::new(lit)));
        }
        let (Some(lit), Some(settings)) = (&self.lit, &self.settings.visibility) else {
            return Ok(Stage::Done);
        };
        lit.geometry.belongs_to(scene)?;
        let Some(build) = &mut self.build else {
            self.build = Some(VisibilityBuild::new(
                (scene, &lit.geometry),
                &lit.lights,
                settings,
                self.settings.needed_views(),
            )?);
            return Ok(Stage::Slice);
        };
        if !build.is_done() {
            build.step(SLICE);
            return Ok(Stage::Slice);
        }
        let Some((build, lit)) = self.build.take().zip(self.lit.take()) else { return Ok(Stage::Done) };
        Ok(Stage::Visibility(Box::new(build.end(scene, &lit.geometry)?)))
    }
}

impl Illumination {
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
