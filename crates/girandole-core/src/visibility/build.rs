//! A visibility database in the making, slice by slice.

use super::assembly::Assembly;
use super::blockers::BlockerTree;
use super::database::{MOST_LIGHTS, StaticReceivers, is_dynamic};
use super::growth::{Growth, Soil};
use super::light_points::LightPoint;
use super::movers::Movers;
use super::needed::{Mirrors, Needs, local};
use super::node_visibility::SceneContext;
use super::sources::Sources;
use super::surfaces::Surfaces;
use super::{State, VisibilityDatabase, VisibilitySettings};
use crate::generation::Generation;
use crate::lights::LightSet;
use crate::scene::{Geometry, Scene, View};
use crate::slices::{complete, pause};
use crate::{Error, Result};

/// Patches, or meshes, of one slice.
const SLICE: usize = if cfg!(feature = "parallel") { 64 } else { 1 };

/// A [`VisibilityDatabase`] in the making: what does not fit between two frames is made in slices of work. What is made does not
/// depend on how it is sliced. Dropping it gives it up.
pub struct VisibilityBuild {
    settings: VisibilitySettings,
    surfaces: Surfaces,
    lights: Vec<LightPoint>,
    groups: BlockerTree,
    sources: Sources,
    mirrors: Mirrors,
    /// By root of the sources, whether it is to be determined.
    chosen: Vec<bool>,
    threshold: f64,
    growth: Growth,
    of_geometry: Generation,
    of_lights: Generation,
}

impl VisibilityBuild {
    /// Begins it, for some views: see [`VisibilityDatabase::build_for`].
    ///
    /// # Errors
    /// As [`VisibilityDatabase::build`].
    pub fn new(
        (scene, geometry): (&Scene, &Geometry),
        lights: &LightSet,
        settings: &VisibilitySettings,
        views: &[View],
    ) -> Result<Self> {
        complete(Self::in_slices((scene, geometry), lights, settings, views))
    }

    /// The same for whoever has something else to do meanwhile: the future pauses between [slices](crate::slices) of work.
    ///
    /// # Errors
    /// As [`VisibilityDatabase::build`].
    pub async fn in_slices(
        (scene, geometry): (&Scene, &Geometry),
        lights: &LightSet,
        settings: &VisibilitySettings,
        views: &[View],
    ) -> Result<Self> {
        geometry.belongs_to(scene)?;
        lights.belongs_to(geometry)?;
        if lights.len() > MOST_LIGHTS {
            return Err(Error::Invalid(format!(
                "visibility is determined for {MOST_LIGHTS} light samples at most; there are {}",
                lights.len()
            )));
        }
        let surfaces = Surfaces::in_slices(scene, geometry, settings).await;
        let stands = |object: u32| !is_dynamic(scene, object);
        // The hierarchy, with the visibility that static blockers leave.
        let groups = BlockerTree::with_clusters(&surfaces, stands);
        pause().await;
        let points = LightPoint::of(lights.samples(), &surfaces, &groups);
        pause().await;
        let sources = Sources::of(&surfaces, stands);
        pause().await;
        let mut area = sources.area(&surfaces);
        if area == 0.0 {
            area = Sources::of(&surfaces, |_| true).area(&surfaces);
        }
        let mirrors = Mirrors::of(scene, geometry, &surfaces);
        pause().await;
        let needs = Needs { surfaces: &surfaces, groups: &groups, sources: &sources, mirrors: &mirrors };
        let chosen = needs.of(&local(views, geometry));
        Ok(Self {
            settings: *settings,
            threshold: area * points.len() as f64 / f64::from(settings.split).max(1e-30),
            growth: Growth::new(&sources, &chosen, None),
            mirrors,
            chosen,
            surfaces,
            lights: points,
            groups,
            sources,
            of_geometry: geometry.generation(),
            of_lights: lights.generation(),
        })
    }

    /// The share that is done, 0 to 1.
    pub fn progress(&self) -> f32 {
        self.growth.progress()
    }

    /// Whether all is done but the [end](Self::end).
    pub fn is_done(&self) -> bool {
        self.growth.is_done()
    }

    /// Goes on by a slice, some milliseconds on all cores.
    pub fn step(&mut self) {
        self.grow(SLICE);
    }

    fn grow(&mut self, most: usize) {
        let context = SceneContext { surfaces: &self.surfaces, lights: &self.lights, blockers: &self.groups };
        let soil = Soil { context: &context, settings: &self.settings, threshold: self.threshold };
        self.growth.step(&soil, &self.sources, most);
    }

    /// Puts it together, and determines what dynamic objects block. What was left is done now.
    ///
    /// # Errors
    /// [`Error::Invalid`] where this is another version of the scene.
    pub fn end(mut self, scene: &Scene, geometry: &Geometry) -> Result<VisibilityDatabase> {
        geometry.belongs_to(scene)?;
        let sentence = "this visibility was begun for another version of the scene; begin anew";
        self.of_geometry.expect(geometry.generation(), sentence)?;
        while !self.is_done() {
            self.grow(usize::MAX);
        }
        let Self { settings, surfaces, lights, groups, sources, mirrors, chosen, threshold, growth, .. } =
            self;
        let mut assembly = Assembly::new(&surfaces, geometry, lights.len(), chosen.contains(&false));
        let grown = growth.end(lights.len());
        let tests = grown.tests;
        let mut roots = vec![None; chosen.len()];
        for (root, nodes) in assembly.append(geometry, &surfaces, &settings, &sources, grown) {
            roots[root] = Some(nodes);
        }
        let undetermined = vec![State::Partial; lights.len()];
        let end = assembly.end();
        let mut result = VisibilityDatabase {
            settings,
            surfaces,
            lights,
            groups,
            static_receivers: StaticReceivers { sources, roots, undetermined, mirrors, threshold, end },
            segments: Vec::new(),
            assembly,
            movers: Movers::default(),
            dynamic: None,
            tests,
            of_geometry: self.of_geometry,
            of_lights: self.of_lights,
        };
        let moves = |object: &u32| is_dynamic(scene, *object);
        let dynamic: Vec<u32> = (0..scene.objects.len() as u32).filter(moves).collect();
        result.lay_dynamic(geometry, &dynamic, &vec![true; scene.objects.len()]);
        result.block_dynamic(scene);
        Ok(result)
    }
}
