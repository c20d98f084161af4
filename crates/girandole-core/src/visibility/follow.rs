//! How a database follows lights that change and objects that move, on the hierarchy of receivers that it has.

use super::assembly::Sources;
use super::blockers::BlockerTree;
use super::database::{VisibilityDatabase, is_dynamic};
use super::dynamic::DynamicPass;
use super::held::HeldPass;
use super::light_points::LightPoint;
use super::node_visibility::SceneContext;
use super::pyramid::Tests;
use super::surfaces::Surfaces;
use crate::Result;
use crate::lights::LightSet;
use crate::scene::{Geometry, Scene};

impl VisibilityDatabase {
    /// Brings it up to a geometry in which nothing but places of dynamic objects changed, those that `moved` is true for, and
    /// to as many lights, any of which may be others than before. The hierarchy of receivers on static objects is held as it
    /// was built; of what static objects block, only the lights that changed are determined anew. Where dynamic objects moved,
    /// receivers on dynamic objects are made anew, and so is what dynamic objects block; else these are held like the others.
    /// Afterwards it equals what [`VisibilityDatabase::redetermined`] makes of it. `false` where surfaces come or go, or there
    /// are more or fewer lights: then nothing is changed, and it has to be built anew.
    pub(crate) fn follow(
        &mut self,
        scene: &Scene,
        geometry: &Geometry,
        lights: &LightSet,
        moved: impl Fn(u32) -> bool,
    ) -> bool {
        let objects = 0..scene.objects.len() as u32;
        let has_moved = objects.clone().any(&moved);
        if lights.len() != self.lights.len() || !self.surfaces.follow(scene, geometry, &self.settings, moved)
        {
            return false;
        }
        let points = LightPoint::of(lights.samples(), &self.surfaces, &self.groups);
        let pairs = (0..).zip(points.iter().zip(&self.lights));
        let changed: Vec<u32> = pairs.filter(|(_, (now, before))| now != before).map(|(i, _)| i).collect();
        self.lights = points;
        self.tests = Tests::default();
        if has_moved {
            self.assembly.truncate(self.still, &self.surfaces, |object| !is_dynamic(scene, object));
            self.sources[1] = Sources::default();
        }
        if !changed.is_empty() {
            self.determine_columns(&changed);
        }
        if has_moved {
            self.add_dynamic(scene, geometry);
        } else if !changed.is_empty() {
            self.determine_dynamic_columns(&changed);
        }
        (self.of_geometry, self.of_lights) = (geometry.generation(), lights.generation());
        true
    }

    /// The states of all nodes and lights and the blockers that decide them, determined from scratch on this hierarchy of
    /// receivers. It is equal to this database, to the bit, however that came about: for checks, and for measurements of what
    /// following costs.
    ///
    /// The hierarchy was split where that paid for the lights as they stood when it was built. That leaves more pairs partial
    /// than a new one where lights have moved since, and changes no picture. It is remade by [`VisibilityDatabase::build`], as
    /// [`Illumination::update`](crate::illumination::Illumination::update) does where static objects or the number of lights
    /// change.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where geometry or lights are not this scene's, or the database is of others.
    pub fn redetermined(&self, scene: &Scene, geometry: &Geometry, lights: &LightSet) -> Result<Self> {
        geometry.belongs_to(scene)?;
        self.belongs_to(geometry, lights)?;
        let surfaces = Surfaces::new(scene, geometry, &self.settings);
        let groups = BlockerTree::with_clusters(&surfaces, |object| !is_dynamic(scene, object));
        let mut result = Self {
            lights: LightPoint::of(lights.samples(), &surfaces, &groups),
            sources: [false, true]
                .map(|dynamic| Sources::of(&surfaces, |object| is_dynamic(scene, object) == dynamic)),
            movers: BlockerTree::of_dynamic(&surfaces, |object| is_dynamic(scene, object)),
            tests: Tests::default(),
            surfaces,
            groups,
            ..self.clone()
        };
        let all: Vec<u32> = (0..lights.len() as u32).collect();
        result.determine_columns(&all);
        result.determine_dynamic_columns(&all);
        Ok(result)
    }

    /// Adds what dynamic objects receive, and block.
    pub(super) fn add_dynamic(&mut self, scene: &Scene, geometry: &Geometry) {
        let dynamic = |object: u32| is_dynamic(scene, object);
        let (surfaces, settings) = (&self.surfaces, &self.settings);
        let context = SceneContext { surfaces, lights: &self.lights, blockers: &self.groups };
        let sources = Sources::of(surfaces, dynamic);
        self.tests += self.assembly.append(&context, geometry, settings, &sources, self.threshold);
        self.sources[1] = sources;
        self.movers = BlockerTree::of_dynamic(surfaces, dynamic);
        self.dynamic = None;
        if !self.movers.is_empty() {
            let context = SceneContext { blockers: &self.movers, ..context };
            let (receivers, fixed) = (&self.assembly.receivers, &self.assembly.visibility);
            let (states, tests) = DynamicPass { context: &context, receivers, fixed }.run();
            self.dynamic = Some(states);
            self.tests += tests;
        }
    }

    /// Determines what static blockers leave of some lights to the receivers that are held.
    fn determine_columns(&mut self, lights: &[u32]) {
        let points: Vec<LightPoint> = lights.iter().map(|&light| self.lights[light as usize]).collect();
        let context = SceneContext { surfaces: &self.surfaces, lights: &points, blockers: &self.groups };
        let pass = HeldPass { context: &context, receivers: &self.assembly.receivers };
        let roots = self.assembly.receivers.roots();
        let mut rest = &roots[..];
        for sources in &self.sources {
            let (own, others) = rest.split_at(sources.roots());
            rest = others;
            let Some(first) = own.first() else { continue };
            let (columns, tests) = pass.run(sources, own);
            self.assembly.visibility.set_columns(first.start, lights, &columns);
            self.tests += tests;
        }
    }

    /// Determines what dynamic blockers leave of some lights.
    fn determine_dynamic_columns(&mut self, lights: &[u32]) {
        let Some(states) = &mut self.dynamic else { return };
        let points: Vec<LightPoint> = lights.iter().map(|&light| self.lights[light as usize]).collect();
        let context = SceneContext { surfaces: &self.surfaces, lights: &points, blockers: &self.movers };
        let fixed = self.assembly.visibility.columns(lights);
        let pass = DynamicPass { context: &context, receivers: &self.assembly.receivers, fixed: &fixed };
        let (columns, tests) = pass.run();
        states.set_columns(0, lights, &columns);
        self.tests += tests;
    }
}
