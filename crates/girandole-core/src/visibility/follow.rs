//! How a database follows lights that change and objects that move, on the hierarchy of receivers that it has.

use super::assembly::Assembly;
use super::balls::visibility_about;
use super::blockers::BlockerTree;
use super::database::{Segment, StaticReceivers, VisibilityDatabase, is_dynamic};
use super::dynamic::DynamicPass;
use super::growth::{Grown, Soil};
use super::held::HeldPass;
use super::light_points::LightPoint;
use super::movers::Movers;
use super::needed::local;
use super::node_visibility::SceneContext;
use super::pyramid::Tests;
use super::sources::Sources;
use super::state_matrix::StateMatrix;
use super::surfaces::Surfaces;
use crate::Result;
use crate::lights::{LightChanges, LightSet};
use crate::parallel::map;
use crate::scene::{Geometry, Scene, View};
use std::sync::Arc;

impl VisibilityDatabase {
    /// Brings it up to a geometry in which nothing but places of dynamic objects changed, those that `moved` is true for, and
    /// to as many lights, any of which may be others than before. Receivers on objects that did not move are held; of what
    /// static objects block there, only the lights that changed are determined anew. Receivers on objects that moved are made
    /// anew. What dynamic objects block is determined anew for all where any of them moved, else for the lights that changed.
    /// Afterwards it equals what [`VisibilityDatabase::redetermined`] makes of it. `false` where surfaces come or go, or there
    /// are more or fewer lights: then nothing is changed, and it has to be built anew.
    pub(crate) fn follow(
        &mut self,
        scene: &Scene,
        geometry: &Geometry,
        (lights, changes): (&LightSet, &LightChanges),
        moved: impl Fn(u32) -> bool,
    ) -> bool {
        let has_moved: Vec<bool> = (0..scene.objects.len() as u32).map(&moved).collect();
        if changes.is_everything()
            || lights.len() != self.lights.len()
            || !self.surfaces.follow(scene, geometry, &self.settings, moved)
        {
            return false;
        }
        self.static_receivers.mirrors.follow(scene, geometry, &self.surfaces);
        let points = LightPoint::of(lights.samples(), &self.surfaces, &self.groups);
        let changed = changes.moved();
        self.lights = points;
        self.tests = Tests::default();
        if !changed.is_empty() {
            self.determine_columns(changed, &has_moved);
        }
        if has_moved.contains(&true) {
            let objects: Vec<u32> = self.segments.iter().map(|segment| segment.object).collect();
            self.lay_dynamic(geometry, &objects, &has_moved);
            self.block_dynamic(scene);
        } else if !changed.is_empty() {
            self.determine_dynamic_columns(changed);
        }
        (self.of_geometry, self.of_lights) = (geometry.generation(), lights.generation());
        true
    }

    /// The states of all nodes and lights, determined from scratch on this hierarchy of
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
        let sources = Sources::of(&surfaces, |object| !is_dynamic(scene, object));
        let mut result = Self {
            lights: LightPoint::of(lights.samples(), &surfaces, &groups),
            static_receivers: StaticReceivers { sources, ..self.static_receivers.clone() },
            segments: self
                .segments
                .iter()
                .map(|s| Segment { sources: Sources::of_object(&surfaces, s.object), ..s.clone() })
                .collect(),
            movers: Movers::of(&surfaces, |object| is_dynamic(scene, object)),
            tests: Tests::default(),
            surfaces,
            groups,
            ..self.clone()
        };
        let all: Vec<u32> = (0..lights.len() as u32).collect();
        result.determine_columns(&all, &vec![false; scene.objects.len()]);
        result.determine_dynamic_columns(&all);
        Ok(result)
    }

    /// For each static root, whether these views need it and it is not determined.
    fn missing(&self, geometry: &Geometry, views: &[View]) -> Vec<bool> {
        let needed = self.needs().of(&local(views, geometry)).into_iter();
        needed
            .zip(&self.static_receivers.roots)
            .map(|(is_needed, root)| is_needed && root.is_none())
            .collect()
    }

    /// Whether these views need what is not determined.
    pub(crate) fn lacks(&self, geometry: &Geometry, views: &[View]) -> bool {
        self.static_receivers.roots.contains(&None) && self.missing(geometry, views).contains(&true)
    }

    /// Determines what these views need besides what is determined.
    pub(crate) fn determine_for(&mut self, geometry: &Geometry, views: &[View]) {
        let missing = self.missing(geometry, views);
        let Self { surfaces, settings, static_receivers, .. } = self;
        let StaticReceivers { sources, roots, threshold, end, .. } = static_receivers;
        let context = SceneContext { surfaces, lights: &self.lights, blockers: &self.groups };
        let soil = Soil { context: &context, settings, threshold: *threshold };
        let grown = Grown::new(&soil, sources, &missing, None);
        let (first, tests) = (*end, grown.tests);
        let taken = self.assembly.split_off(first);
        for (root, nodes) in self.assembly.append(geometry, surfaces, settings, sources, grown) {
            roots[root] = Some(nodes);
        }
        (*end, self.tests) = (self.assembly.end(), tests);
        let mut from = first;
        for segment in &mut self.segments {
            let to = segment.end;
            self.assembly.append_held(surfaces, &segment.sources, &taken, [first, from, to]);
            segment.end = self.assembly.end();
            from = to;
        }
        self.pass_dynamic();
    }

    /// Puts the receivers on dynamic objects after the static ones: those on objects that moved are made anew, the others are
    /// held.
    pub(super) fn lay_dynamic(&mut self, geometry: &Geometry, objects: &[u32], has_moved: &[bool]) {
        let (surfaces, settings) = (&self.surfaces, &self.settings);
        let StaticReceivers { threshold, end, .. } = self.static_receivers;
        let context = SceneContext { surfaces, lights: &self.lights, blockers: &self.groups };
        let made = map(objects, |&object| {
            has_moved[object as usize].then(|| {
                let sources = Sources::of_object(surfaces, object);
                let (above, of_ball) = visibility_about(&context, &sources).unzip();
                let soil = Soil { context: &context, settings, threshold };
                let mut grown =
                    Grown::new(&soil, &sources, &vec![true; sources.roots().len()], above.map(Arc::new));
                grown.tests += of_ball.unwrap_or_default();
                (sources, grown)
            })
        });
        let taken = if made.iter().all(Option::is_some) {
            // Nothing of it is held.
            self.assembly.truncate(end);
            Assembly::default()
        } else {
            self.assembly.split_off(end)
        };
        let mut before = std::mem::take(&mut self.segments).into_iter();
        let mut from = end;
        for (&object, made) in objects.iter().zip(made) {
            let held = before.next();
            let to = held.as_ref().map_or(from, |held| held.end);
            let sources = match (made, held) {
                (Some((sources, grown)), _) => {
                    self.tests += grown.tests;
                    self.assembly.append(geometry, surfaces, settings, &sources, grown);
                    sources
                }
                (None, Some(Segment { sources, .. })) => {
                    self.assembly.append_held(surfaces, &sources, &taken, [end, from, to]);
                    sources
                }
                (None, None) => Default::default(),
            };
            self.segments.push(Segment { object, sources, end: self.assembly.end() });
            from = to;
        }
    }

    /// Determines what dynamic objects block.
    pub(super) fn block_dynamic(&mut self, scene: &Scene) {
        self.movers = Movers::of(&self.surfaces, |object| is_dynamic(scene, object));
        self.pass_dynamic();
    }

    /// Determines it for all receivers, by the dynamic blockers that are there.
    fn pass_dynamic(&mut self) {
        let before = self.dynamic.take().unwrap_or_default();
        if !self.movers.is_empty() {
            let (states, tests) = self.dynamic_pass(&self.lights, &self.assembly.visibility).run(before);
            self.dynamic = Some(states);
            self.tests += tests;
        }
    }

    /// Determines what static blockers leave of some lights to the receivers that are held: all but those on objects that moved.
    fn determine_columns(&mut self, lights: &[u32], has_moved: &[bool]) {
        let points: Vec<LightPoint> = lights.iter().map(|&light| self.lights[light as usize]).collect();
        let context = SceneContext { surfaces: &self.surfaces, lights: &points, blockers: &self.groups };
        let pass = HeldPass { context: &context, receivers: &self.assembly.receivers };
        let fixed = &self.static_receivers;
        let of_segments = self.assembly.receivers.roots(fixed.end.nodes);
        let mut rest = of_segments.into_iter().map(Some);
        let mut held = vec![(&fixed.sources, fixed.roots.clone(), false)];
        for Segment { object, sources, .. } in &self.segments {
            let own: Vec<_> = rest.by_ref().take(sources.roots().len()).collect();
            if !has_moved[*object as usize] {
                held.push((sources, own, true));
            }
        }
        let found = map(&held, |(sources, roots, is_dynamic)| {
            let about = is_dynamic.then(|| visibility_about(&context, sources)).flatten();
            let (above, of_ball) = about.unzip();
            let (columns, mut tests) = pass.run((sources, roots), above.map(Arc::new));
            tests += of_ball.unwrap_or_default();
            (columns, tests)
        });
        for (columns, tests) in found {
            for (first, columns) in columns {
                self.assembly.visibility.set_columns(first, lights, &columns);
            }
            self.tests += tests;
        }
    }

    /// Determines what dynamic blockers leave of some lights.
    fn determine_dynamic_columns(&mut self, lights: &[u32]) {
        if self.dynamic.is_none() {
            return;
        }
        let points: Vec<LightPoint> = lights.iter().map(|&light| self.lights[light as usize]).collect();
        let fixed = self.assembly.visibility.columns(lights);
        let (columns, tests) = self.dynamic_pass(&points, &fixed).run(StateMatrix::default());
        if let Some(states) = &mut self.dynamic {
            states.set_columns(0, lights, &columns);
        }
        self.tests += tests;
    }

    /// For these lights and what static blockers leave of them.
    fn dynamic_pass<'a>(&'a self, lights: &'a [LightPoint], fixed: &'a StateMatrix) -> DynamicPass<'a> {
        let Self { surfaces, assembly, movers, .. } = self;
        DynamicPass { surfaces, lights, receivers: &assembly.receivers, movers, fixed }
    }
}
