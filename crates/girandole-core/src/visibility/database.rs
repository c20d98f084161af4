//! The visibility database: for each node and light the state, and the blockers that decide it.

use super::assembly::{Assembly, End, Sources};
use super::blockers::{Blocker, BlockerTree};
use super::dynamic::{Dynamic, DynamicPass};
use super::node_visibility::{Entry, SceneContext};
use super::pyramid::Tests;
use super::receivers::{Receivers, Source};
use super::shapes::Apex;
use super::surfaces::Surfaces;
use super::{LeafId, State, VisibilitySettings};
use crate::generation::Generation;
use crate::lights::LightSet;
use crate::scene::{Geometry, NONE, ObjectId, Scene};
use crate::{Error, Result};

/// With more lights visibility is not determined: a database holds three bytes for each node and light.
pub const MOST_LIGHTS: usize = 16384;

/// For each node and light the state, and the blockers that decide it.
#[derive(Clone, Debug)]
pub struct VisibilityDatabase {
    settings: VisibilitySettings,
    surfaces: Surfaces,
    lights: Vec<Apex>,
    /// For each light the blocker that it lies on, or [`NONE`](crate::scene::NONE).
    own: Vec<u32>,
    /// Over static blockers.
    groups: BlockerTree,
    /// With the visibility of each node that static blockers leave.
    assembly: Assembly,
    /// Where static receivers end.
    still: End,
    /// Area × partially occluded lights above which patches are split.
    threshold: f64,
    /// Over dynamic blockers.
    movers: BlockerTree,
    /// The visibility with dynamic blockers too.
    dynamic: Dynamic,
    of_geometry: Generation,
    of_lights: Generation,
}

/// The size of a database.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Nodes of the hierarchy.
    pub nodes: usize,
    /// Its leaves.
    pub leaves: usize,
    /// Pairs of a leaf and a light.
    pub pairs: usize,
    /// How many of them are unoccluded, partially and fully occluded.
    pub by_state: [usize; 3],
    /// The same as shares, weighted by the leaves' areas.
    pub area_shares: [f64; 3],
    /// Full and partial blockers that are stored, over all nodes.
    pub blockers: usize,
    /// Tests made to build it.
    pub tests: Tests,
}

impl VisibilityDatabase {
    /// Builds everything from scratch: the hierarchy from the lights and static blockers, then the visibility with dynamic
    /// blockers.
    ///
    /// # Errors
    /// [`Error::Invalid`] where there are more than [`MOST_LIGHTS`] lights, or geometry or lights are not this scene's.
    pub fn build(
        scene: &Scene,
        geometry: &Geometry,
        lights: &LightSet,
        settings: &VisibilitySettings,
    ) -> Result<Self> {
        geometry.belongs_to(scene)?;
        lights.belongs_to(geometry)?;
        if lights.len() > MOST_LIGHTS {
            return Err(Error::Invalid(format!(
                "visibility is determined for {MOST_LIGHTS} light samples at most; there are {}",
                lights.len()
            )));
        }
        let surfaces = Surfaces::new(scene, geometry, settings);
        let apexes: Vec<Apex> = lights.samples().iter().map(Apex::new).collect();
        let own: Vec<u32> = lights.samples().iter().map(|l| surfaces.blocker_of(l.triangle())).collect();
        let stands = |object: u32| !is_dynamic(scene, object);
        // The hierarchy, with the visibility that static blockers leave.
        let groups = BlockerTree::with_clusters(&surfaces, &apexes, stands);
        let context = SceneContext { surfaces: &surfaces, lights: &apexes, own: &own, blockers: &groups };
        let sources = Sources::of(&surfaces, stands);
        let mut area = sources.area(&surfaces);
        if area == 0.0 {
            area = Sources::of(&surfaces, |_| true).area(&surfaces);
        }
        let threshold = area * apexes.len() as f64 / f64::from(settings.split).max(1e-30);
        let mut assembly = Assembly::new(&surfaces, geometry);
        assembly.append(&context, geometry, settings, &sources, threshold);
        let mut result = Self {
            settings: *settings,
            surfaces,
            lights: apexes,
            own,
            groups,
            still: assembly.end(),
            assembly,
            threshold,
            movers: BlockerTree::empty(),
            dynamic: Dynamic::default(),
            of_geometry: geometry.generation(),
            of_lights: lights.generation(),
        };
        result.add_dynamic(scene, geometry);
        Ok(result)
    }

    /// Brings it up to a geometry in which nothing but places of dynamic objects changed, those that `moved` is true for, with
    /// lights as they were: it is that which [`VisibilityDatabase::build`] makes of them, and what depends on static objects
    /// alone is kept. `false` where surfaces come or go, and it has to be built anew.
    pub(crate) fn follow(
        &mut self,
        scene: &Scene,
        geometry: &Geometry,
        lights: &LightSet,
        moved: impl Fn(u32) -> bool,
    ) -> bool {
        if !self.surfaces.follow(scene, geometry, &self.settings, moved) {
            return false;
        }
        self.assembly.truncate(self.still, &self.surfaces, |object| !is_dynamic(scene, object));
        self.add_dynamic(scene, geometry);
        (self.of_geometry, self.of_lights) = (geometry.generation(), lights.generation());
        true
    }

    /// Adds what dynamic objects receive, and block.
    fn add_dynamic(&mut self, scene: &Scene, geometry: &Geometry) {
        let dynamic = |object: u32| is_dynamic(scene, object);
        let (surfaces, settings) = (&self.surfaces, &self.settings);
        let context = SceneContext { surfaces, lights: &self.lights, own: &self.own, blockers: &self.groups };
        let sources = Sources::of(surfaces, dynamic);
        self.assembly.append(&context, geometry, settings, &sources, self.threshold);
        self.movers = BlockerTree::of_dynamic(surfaces, dynamic);
        let context = SceneContext { blockers: &self.movers, ..context };
        let (receivers, fixed) = (&self.assembly.receivers, &self.assembly.visibility[..]);
        self.dynamic = DynamicPass { context: &context, receivers, fixed }.run();
    }

    /// Where the leaves of dynamic objects begin in [`Receivers::leaves`]; before are those of static ones.
    pub fn first_dynamic_leaf(&self) -> u32 {
        self.still.leaves as u32
    }

    /// Whether it was built for this geometry and these lights.
    ///
    /// # Errors
    /// [`Error::Invalid`] where it was built for others.
    pub fn belongs_to(&self, geometry: &Geometry, lights: &LightSet) -> Result<()> {
        let sentence = "this visibility database belongs to another scene, an earlier version of it or other lights; \
                        build it anew";
        self.of_geometry.expect(geometry.generation(), sentence)?;
        self.of_lights.expect(lights.generation(), sentence)
    }

    /// How its hierarchy is built.
    pub fn settings(&self) -> &VisibilitySettings {
        &self.settings
    }

    /// The identity of a leaf.
    pub fn leaf_id(&self, leaf: u32) -> LeafId {
        self.assembly.receivers.ids[leaf as usize]
    }

    /// The hierarchy of receivers.
    pub fn receivers(&self) -> &Receivers {
        &self.assembly.receivers
    }

    /// How many lights there are.
    pub fn lights(&self) -> usize {
        self.lights.len()
    }

    /// The state of any node for a light: fully occluded if one blocker covers it all, or the two do not face each
    /// other.
    pub fn state(&self, node: u32, light: u32) -> State {
        self.dynamic.states[node as usize * self.lights.len() + light as usize]
    }

    /// The states of a leaf, one for each light.
    pub fn leaf_states(&self, leaf: u32) -> &[State] {
        let first = self.assembly.receivers.leaves[leaf as usize].node as usize * self.lights.len();
        &self.dynamic.states[first..first + self.lights.len()]
    }

    /// By light, the state of a leaf that static blockers leave, whatever dynamic ones do.
    pub fn standing_states(&self, leaf: u32) -> &[State] {
        &self.assembly.visibility[self.assembly.receivers.leaves[leaf as usize].node as usize].states
    }

    /// The blockers that decide the state of a node and a light, full (`true`) or partial: of static objects the one blocker
    /// or [`Blocker::Group`]; where those block nothing, or a dynamic one blocks all, the one blocker or group of dynamic
    /// objects. Below a full blocker nothing is tested again. If a node has none, its parent's decide, or the light and it do
    /// not face each other.
    pub fn blockers(&self, node: u32, light: u32) -> impl Iterator<Item = (Blocker, bool)> + '_ {
        let named = |entries: Option<&[Entry]>, tree: &BlockerTree, first_group: u32| {
            let entries = entries.map_or(&[][..], |e| of_light(e, light));
            let named = |e: &Entry| match tree.blocker(&self.surfaces, e.blocker()) {
                Blocker::Group(group) => (Blocker::Group(group + first_group), e.full()),
                one => (one, e.full()),
            };
            entries.first().map(named)
        };
        let node = node as usize;
        let fixed = self.assembly.visibility.get(node).map(|n| &n.entries[..]);
        let dynamic = self.dynamic.entries.get(node).map(|e| &e[..]);
        let first_group = self.groups.nodes.len() as u32;
        named(fixed, &self.groups, 0).into_iter().chain(named(dynamic, &self.movers, first_group))
    }

    /// The blockers of a [`Blocker::Group`].
    pub fn members(&self, group: u32) -> impl Iterator<Item = Blocker> + '_ {
        let members = match group.checked_sub(self.groups.nodes.len() as u32) {
            None => self.groups.members(group),
            Some(of_movers) => self.movers.members(of_movers),
        };
        members.into_iter().map(|b| self.surfaces.blocker(b))
    }

    /// For each light, whether one static polygon hides the whole of a dynamic mesh from it: then the mesh blocks none of its light
    /// that is not blocked already. Nothing is said of objects with patches: their sides turn away from some lights by themselves.
    pub fn hidden_from(&self, object: ObjectId) -> Vec<bool> {
        let nodes = &self.assembly.receivers.nodes;
        let roots = (self.still.nodes..nodes.len()).filter(|&node| nodes[node].parent == NONE);
        let of_object = |node: &usize| match nodes[*node].source {
            Source::Patch { simple, .. } => self.surfaces.patches[simple as usize].object == object.0,
            Source::Cluster { mesh, .. } => self.surfaces.meshes[mesh as usize].object == object.0,
        };
        let roots: Vec<usize> = roots.filter(of_object).collect();
        let is_mesh = |node: &usize| matches!(nodes[*node].source, Source::Cluster { .. });
        let mut hidden = vec![!roots.is_empty() && roots.iter().all(is_mesh); self.lights.len()];
        for (light, hidden) in (0..).zip(&mut hidden) {
            let covers = |&node: &usize| {
                of_light(&self.assembly.visibility[node].entries, light).iter().any(|e| e.full())
            };
            *hidden &= roots.iter().all(covers);
        }
        hidden
    }

    /// The numbers of nodes, leaves, pairs by state, blockers and tests.
    pub fn counts(&self) -> Counts {
        let mut counts = Counts {
            nodes: self.assembly.receivers.nodes.len(),
            leaves: self.assembly.receivers.leaves.len(),
            pairs: self.assembly.receivers.leaves.len() * self.lights.len(),
            blockers: self.assembly.visibility.iter().map(|node| node.entries.len()).sum::<usize>()
                + self.dynamic.entries.iter().map(Vec::len).sum::<usize>(),
            tests: self.assembly.tests,
            ..Counts::default()
        };
        counts.tests += self.dynamic.tests;
        for (index, leaf) in self.assembly.receivers.leaves.iter().enumerate() {
            for &state in self.leaf_states(index as u32) {
                counts.by_state[state as usize] += 1;
                counts.area_shares[state as usize] += f64::from(leaf.area);
            }
        }
        let total: f64 = counts.area_shares.iter().sum();
        if total > 0.0 {
            counts.area_shares = counts.area_shares.map(|a| a / total);
        }
        counts
    }
}

fn is_dynamic(scene: &Scene, object: u32) -> bool {
    scene.objects.get(object as usize).is_some_and(|o| o.dynamic)
}

/// The entries of a light.
pub(super) fn of_light(entries: &[Entry], light: u32) -> &[Entry] {
    let first = entries.partition_point(|e| e.light < light);
    let count = entries[first..].partition_point(|e| e.light == light);
    &entries[first..first + count]
}
