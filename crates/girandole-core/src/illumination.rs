//! Everything that is derived from a scene without a GPU, and kept in step with it.

use crate::generation::Generation;
use crate::lights::{IncrementalWalk, LightChanges, LightSet, LightSettings, Pace, Placement, WaitingPaths};
use crate::scene::{Geometry, Scene, SceneChanges, View};
use crate::slices::{complete, pause};
use crate::visibility::{VisibilityDatabase, VisibilitySettings};
use crate::{Error, Result};
use std::sync::Arc;

mod opening;

pub use opening::{Opening, Stage};

/// Which light samples are sampled anew where a scene changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rewalk {
    /// All: they are what a fresh sampling of the scene gives.
    #[default]
    All,
    /// So many a frame of those that are other ones by now, as long as objects and lights only move, or are dimmed, switched off or
    /// coloured: each [update](Illumination::update) is a frame. Samples come and go little by little, and are in the mean those
    /// that the scene has once it is at rest. What makes all anew with [`Rewalk::Off`] does so here.
    Paths(Pace),
    /// None, as long as objects only move, and lights move, or are dimmed, switched off or coloured. Samples on what moves go
    /// with it, and are as bright as what their light comes from; those that the random walk left elsewhere stay, though what
    /// moves may have come into its way. Best with [`LightSettings::walk_dynamic`] off. Objects that come or go make all
    /// anew, and so does what emits in a channel in which it did not when light was sampled.
    Off,
}

/// How a scene is lit.
#[derive(Clone, Debug, PartialEq)]
pub struct IlluminationSettings {
    /// How light is sampled.
    pub lights: LightSettings,
    /// How visibility is determined; `None` = not at all, which the renderer's naive mode suffices with.
    pub visibility: Option<VisibilitySettings>,
    /// The views that light samples are placed for, see [`LightSet::sample_for`], and visibility is determined for, see
    /// [`Illumination::determine_for`]; none = samples by power, and the visibility of everything.
    pub views: Vec<View>,
    /// Which light samples follow the scene's changes.
    pub rewalk: Rewalk,
}

impl Default for IlluminationSettings {
    fn default() -> Self {
        let visibility = Some(VisibilitySettings::default());
        Self { lights: LightSettings::default(), visibility, views: Vec::new(), rewalk: Rewalk::All }
    }
}

impl IlluminationSettings {
    /// The views that visibility is determined for; none = for all. Samples that are held serve any view.
    fn needed_views(&self) -> &[View] {
        if self.rewalk == Rewalk::Off { &[] } else { &self.views }
    }
}

/// A scene's geometry, its light samples, and which of them need a shadow map where.
///
/// ```
/// use girandole_core::glam::vec3;
/// use girandole_core::illumination::{Illumination, IlluminationSettings};
/// use girandole_core::scene::{Transform, builtin};
///
/// let mut scene = builtin::build("gap", builtin::MovingObject::Torus)?;
/// let settings = IlluminationSettings::default();
/// let mut illumination = Illumination::new(&scene, &settings)?;
/// let torus = scene.objects.iter().position(|o| o.dynamic).unwrap();
/// scene.set_transform(scene.objects[torus].node, Transform::translation(vec3(0.5, 0.5, 0.5)))?;
/// let changes = scene.take_changes();
/// illumination.update(&scene, &changes)?;
/// assert!(illumination.lights() == Illumination::new(&scene, &settings)?.lights());
/// # Ok::<(), girandole_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Illumination {
    settings: IlluminationSettings,
    geometry: Geometry,
    lights: LightSet,
    /// What the last change of them was.
    changes: LightChanges,
    visibility: Option<Arc<VisibilityDatabase>>,
    /// The views that visibility was last determined for, since anything moved.
    served: Vec<View>,
    /// What was sampled last, and where things were then: held samples are moved from there, however they got where they are.
    sampled: (LightSet, Placement),
    /// What samples follow the scene by, where some paths a frame are walked again.
    walk: Option<Box<IncrementalWalk>>,
    /// How many samples are lit, where it is not all of them.
    most_lit: Option<usize>,
}

impl Illumination {
    /// Derives everything from a scene as it stands.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a setting is out of range, the scene has no light, or visibility is asked for with more
    /// than [`MOST_LIGHTS`](crate::visibility::MOST_LIGHTS) light samples.
    pub fn new(scene: &Scene, settings: &IlluminationSettings) -> Result<Self> {
        complete(Self::without_visibility(scene, settings))?.with_visibility(scene)
    }

    /// The same with light samples of this scene as it stands that [`LightSet::sample_for`] gave for these settings: what
    /// [`Illumination::new`] makes, without sampling.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the samples are of another scene, or follow paths ([`Rewalk::Paths`]), and as [`Illumination::new`].
    pub fn with_lights(
        scene: &Scene,
        settings: &IlluminationSettings,
        (geometry, lights): (Geometry, LightSet),
    ) -> Result<Self> {
        geometry.belongs_to(scene)?;
        lights.belongs_to(&geometry)?;
        if matches!(settings.rewalk, Rewalk::Paths(_)) {
            let sentence = "light samples that follow paths are sampled with them; leave the samples out";
            return Err(Error::Invalid(sentence.into()));
        }
        Self::of_lights(scene, settings, geometry, (lights, None)).with_visibility(scene)
    }

    fn with_visibility(mut self, scene: &Scene) -> Result<Self> {
        let Self { settings, geometry, lights, .. } = &self;
        let build = |s: &VisibilitySettings| {
            VisibilityDatabase::build_for(scene, geometry, lights, s, settings.needed_views())
        };
        self.visibility = settings.visibility.as_ref().map(build).transpose()?.map(Arc::new);
        Ok(self)
    }

    /// Its geometry and light samples alone.
    async fn without_visibility(scene: &Scene, settings: &IlluminationSettings) -> Result<Self> {
        let geometry = Geometry::in_slices(scene).await;
        pause().await;
        let IlluminationSettings { lights, views, .. } = settings;
        let (walk, lights) = match settings.rewalk {
            Rewalk::Paths(pace) => match IncrementalWalk::new(scene, &geometry, lights, views, pace).await {
                Ok((walk, lights)) => (Some(Box::new(walk)), lights),
                Err(_) if lights.dark => {
                    (None, LightSet::sample_as(scene, &geometry, lights, views, true).await?)
                }
                Err(error) => return Err(error),
            },
            _ => (None, LightSet::sample_as(scene, &geometry, lights, views, true).await?),
        };
        Ok(Self::of_lights(scene, settings, geometry, (lights, walk)))
    }

    fn of_lights(
        scene: &Scene,
        settings: &IlluminationSettings,
        geometry: Geometry,
        (lights, walk): (LightSet, Option<Box<IncrementalWalk>>),
    ) -> Self {
        let sampled = (lights.clone(), Placement::of(scene, &geometry));
        let settings = settings.clone();
        let changes = LightChanges::everything();
        let (visibility, served) = (None, Vec::new());
        Self { settings, geometry, lights, changes, visibility, served, sampled, walk, most_lit: None }
    }

    /// Lights so many of the samples alone, for the same light in the mean ([`LightSet::prefix`]); `None` = all. What is not lit
    /// keeps its place, and nothing else changes. Samples that follow paths are all lit at the next update.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the scene is not the one that is held.
    pub fn light(&mut self, scene: &Scene, most: Option<usize>) -> Result<()> {
        self.geometry.belongs_to(scene)?;
        self.changes = LightChanges::default();
        if self.most_lit == most {
            return Ok(());
        }
        let (sampled, placement) = &self.sampled;
        let moved = || sampled.moved(scene, &self.geometry, placement);
        let all = if sampled.belongs_to(&self.geometry).is_ok() { Some(sampled.clone()) } else { moved() };
        self.most_lit = most;
        if let Some(all) = all.filter(|_| self.walk.is_none()) {
            self.set_lights(scene, all);
        }
        Ok(())
    }

    /// Takes these light samples, at the same places.
    fn set_lights(&mut self, scene: &Scene, all: LightSet) {
        let lights = self.most_lit.map_or_else(|| all.clone(), |most| all.prefix(most));
        self.changes = LightChanges::between(&self.lights, &lights);
        self.lights = lights;
        if let Some(database) = &mut self.visibility {
            let lights = (&self.lights, &self.changes);
            Arc::make_mut(database).follow(scene, &self.geometry, lights, |_| false);
        }
    }

    /// The light samples that follow, in a scene of which only places and what is emitted changed; `None` where they are to be
    /// sampled anew.
    fn following_lights(&mut self, scene: &Scene, geometry: &Geometry) -> Option<LightSet> {
        let (lights, placement) = &self.sampled;
        match (self.settings.rewalk, &mut self.walk) {
            (Rewalk::Paths(_), Some(walk)) => walk.follow(scene, geometry),
            (Rewalk::Off, _) => {
                let all = lights.moved(scene, geometry, placement)?;
                Some(self.most_lit.map_or_else(|| all.clone(), |most| all.prefix(most)))
            }
            _ => None,
        }
    }

    /// Brings everything up to the scene after these changes. With [`Rewalk::All`] it is, to the bit, what
    /// [`Illumination::new`] makes of the scene; with [`Rewalk::Off`] the geometry is, and visibility is that of the samples
    /// that are held. While only dynamic objects and lights move, visibility is determined on the hierarchy of receivers that
    /// is there ([`VisibilityDatabase::redetermined`] tells what follows), and of what static objects block, for the samples
    /// alone that moved; else it is built anew.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the changes do not lead from the version held to the scene's, unless they say that
    /// everything changed; and as [`Illumination::new`]. Then nothing is changed:
    /// [`SceneChanges::then`] adds these changes to the next ones.
    pub fn update(&mut self, scene: &Scene, changes: &SceneChanges) -> Result<()> {
        changes.to.expect(
            scene.generation(),
            "these changes do not lead to the scene as it stands; take them right before the update",
        )?;
        if !changes.everything && changes.from != self.generation() {
            return Err(Error::Invalid(
                "these changes do not start from what is held; pass on all changes in order, or touch the scene".into(),
            ));
        }
        if changes.to != self.generation() {
            let geometry = Geometry::new(scene);
            // What is walked again little by little would mix the light of both.
            let keeps_paths = self.walk.is_none() || !changes.reflectance;
            let follows =
                (changes.keeps_objects() && keeps_paths).then(|| self.following_lights(scene, &geometry));
            match follows.flatten() {
                Some(lights) => self.follow(scene, Some(geometry), lights, changes)?,
                None => {
                    let most = self.most_lit;
                    let anew = Self::new(scene, &self.settings)?;
                    let before = std::mem::replace(self, anew);
                    self.light(scene, most)?;
                    self.changes = LightChanges::between(&before.lights, &self.lights);
                }
            }
        } else if let Some(walk) = self.walk.as_mut().filter(|walk| !walk.is_settled())
            && let Some(lights) = walk.follow(scene, &self.geometry)
        {
            self.follow(scene, None, lights, changes)?;
        }
        Ok(())
    }

    /// Brings everything up to the scene after these changes as [`Illumination::update`] does, with samples for other views where all are
    /// sampled anew.
    ///
    /// # Errors
    /// As [`Illumination::update`]; then the views are those before, too.
    pub fn update_for(&mut self, scene: &Scene, changes: &SceneChanges, views: &[View]) -> Result<()> {
        // What is held already is not sampled for them.
        if self.settings.rewalk != Rewalk::All || changes.to == self.generation() {
            return self.update(scene, changes);
        }
        let before = std::mem::replace(&mut self.settings.views, views.to_vec());
        let updated = self.update(scene, changes);
        if updated.is_err() {
            self.settings.views = before;
        }
        updated
    }

    /// Takes the scene, with this geometry if it is another one, and these light samples, after changes of places and of what is
    /// emitted alone.
    fn follow(
        &mut self,
        scene: &Scene,
        geometry: Option<Geometry>,
        lights: LightSet,
        changes: &SceneChanges,
    ) -> Result<()> {
        let may_follow = changes.made_dynamic.is_empty();
        let mut has_moved = vec![false; scene.objects.len()];
        for id in &changes.moved {
            has_moved[id.index()] = true;
        }
        let moved = |object: u32| has_moved[object as usize];
        let now = geometry.as_ref().unwrap_or(&self.geometry);
        self.changes = LightChanges::between(&self.lights, &lights);
        if let Some(database) = &mut self.visibility
            && !(may_follow && Arc::make_mut(database).follow(scene, now, (&lights, &self.changes), moved))
        {
            let (settings, views) = (database.settings(), self.settings.needed_views());
            *database = Arc::new(VisibilityDatabase::build_for(scene, now, &lights, settings, views)?);
        }
        self.lights = lights;
        if let Some(geometry) = geometry {
            self.geometry = geometry;
        }
        // Mirrors may have moved.
        self.served.clear();
        let views = self.settings.needed_views().to_vec();
        self.add_missing(&views);
        Ok(())
    }

    /// Places the light samples for other views: to the bit what [`Illumination::new`] makes of them. With [`Rewalk::Paths`] samples
    /// go over to where they matter to the other views little by little, with the updates that follow; and to where it will
    /// matter if views move on as they did since the last call. Call it at each frame, before the update where nothing else moves:
    /// these views are those of which pixels must not change at once.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the scene is not the one that is held, and as [`Illumination::new`]; then nothing is changed.
    pub fn place_for(&mut self, scene: &Scene, views: &[View]) -> Result<()> {
        self.place_on_way(scene, views, &[])
    }

    /// Places the light samples for other views as [`Illumination::place_for`] does; with [`Rewalk::Paths`] also for those to come
    /// within about two seconds, where these are known: nothing is guessed then. Views to come that are none, or all the
    /// same as those that there are, say nothing.
    ///
    /// # Errors
    /// As [`Illumination::place_for`].
    pub fn place_on_way(&mut self, scene: &Scene, views: &[View], to_come: &[View]) -> Result<()> {
        self.geometry.belongs_to(scene)?;
        if let Some(walk) = &mut self.walk {
            let others: &[View] = if to_come.iter().all(|view| views.contains(view)) { &[] } else { to_come };
            walk.place_for(scene, &self.geometry, views, others);
            self.settings.views = views.to_vec();
            self.determine_for(views);
        } else if self.settings.views != views {
            *self =
                Self::new(scene, &IlluminationSettings { views: views.to_vec(), ..self.settings.clone() })?;
        }
        Ok(())
    }

    /// Determines the visibility of what these views need and no view before needed: receivers that were there stay as they are. Whether
    /// there was any.
    pub fn determine_for(&mut self, views: &[View]) -> bool {
        let is_more = self.add_missing(views);
        if is_more {
            self.changes = LightChanges::default();
        }
        is_more
    }

    fn add_missing(&mut self, views: &[View]) -> bool {
        let Self { geometry, visibility, served, .. } = self;
        // Which way one looks makes no difference.
        let is_there =
            |(a, b): (&View, &View)| *a == View { right: a.right, up: a.up, forward: a.forward, ..*b };
        if !views.is_empty() && views.len() == served.len() && views.iter().zip(&*served).all(is_there) {
            return false;
        }
        *served = views.to_vec();
        let Some(database) = visibility.as_mut().filter(|database| database.lacks(geometry, views)) else {
            return false;
        };
        Arc::make_mut(database).determine_for(geometry, views);
        true
    }

    /// Whether light samples stay as they are as long as the scene does. Otherwise [updates](Self::update), of no changes even, make
    /// others of them, frame by frame.
    pub fn is_settled(&self) -> bool {
        self.walk.as_ref().is_none_or(|walk| walk.is_settled())
    }

    /// Paths of the random walk that are other ones by now and wait to be walked again, with [`Rewalk::Paths`].
    pub fn waiting_paths(&self) -> WaitingPaths {
        self.walk.as_ref().map_or_else(WaitingPaths::default, |walk| walk.waiting())
    }

    /// Which version of the scene it was derived from.
    pub fn generation(&self) -> Generation {
        self.geometry.generation()
    }

    /// How it was derived.
    pub fn settings(&self) -> &IlluminationSettings {
        &self.settings
    }

    /// The scene, flattened.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Its light samples.
    pub fn lights(&self) -> &LightSet {
        &self.lights
    }

    /// Which of its light samples the last [update](Self::update), or what else changed them, changed.
    pub fn light_changes(&self) -> &LightChanges {
        &self.changes
    }

    /// Which of them need a shadow map where, if that was asked for.
    pub fn visibility(&self) -> Option<&Arc<VisibilityDatabase>> {
        self.visibility.as_ref()
    }
}

#[cfg(test)]
mod tests;
