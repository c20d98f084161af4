//! The visibility database: for each node and light the state, and the blockers that decide it.

use super::assembly::{Assembly, End, Sources, map};
use super::blockers::{Blocker, BlockerTree};
use super::node_visibility::{Entry, NodeContext, NodeVisibility, SceneContext, Workspace};
use super::pyramid::Tests;
use super::receivers::Receivers;
use super::shapes::{Apex, Shape};
use super::surfaces::Surfaces;
use super::{LeafId, State, VisibilitySettings};
use crate::generation::Generation;
use crate::lights::LightSet;
use crate::scene::{Geometry, NONE, Scene};
use crate::{Error, Result};

/// With more lights visibility is not determined: a database holds three bytes for each node and light.
pub const MOST_LIGHTS: usize = 16384;

/// For each node and light the state, and the blockers that decide it.
#[derive(Clone, Debug)]
pub struct VisibilityDatabase {
    settings: VisibilitySettings,
    surfaces: Surfaces,
    lights: Vec<Apex>,
    /// For each light the blocker that it lies on, or [`NONE`].
    own: Vec<u32>,
    /// Over static blockers.
    groups: BlockerTree,
    /// With the visibility of each node that static blockers leave.
    assembly: Assembly,
    /// Where static receivers end.
    still: End,
    /// Area × partially occluded lights above which patches are split.
    threshold: f64,
    /// By node, with dynamic blockers.
    pub(super) moving: Vec<NodeVisibility>,
    /// By node and light, of all blockers.
    states: Vec<State>,
    tests: Tests,
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
            moving: Vec::new(),
            states: Vec::new(),
            tests: Tests::default(),
            of_geometry: geometry.generation(),
            of_lights: lights.generation(),
        };
        result.add_dynamic(scene, geometry);
        Ok(result)
    }

    /// Brings it up to a geometry in which nothing but places of dynamic objects changed, with lights as they were: it is
    /// that which [`VisibilityDatabase::build`] makes of them, and what depends on static objects alone is kept. `false` where
    /// surfaces come or go, and it has to be built anew.
    pub(crate) fn follow(&mut self, scene: &Scene, geometry: &Geometry, lights: &LightSet) -> bool {
        let surfaces = Surfaces::new(scene, geometry, &self.settings);
        if !surfaces.are_those_of(&self.surfaces) {
            return false;
        }
        self.surfaces = surfaces;
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
        self.tests = self.assembly.tests;
        let fixed = &self.assembly.visibility;
        // The visibility with dynamic blockers too.
        let blockers = BlockerTree::new(surfaces, dynamic);
        self.moving = Vec::new();
        if !blockers.is_empty() {
            let context = SceneContext { blockers: &blockers, ..context };
            let (with_dynamic, more) =
                determine(&context, &self.assembly.receivers, |node, shape, at, parent, workspace| {
                    context.visibility_by_blockers(shape, at.own_mesh, (parent, &fixed[node]), workspace)
                });
            self.moving = with_dynamic;
            self.tests += more;
        }
        let all = if self.moving.is_empty() { fixed } else { &self.moving };
        self.states.clear();
        self.states.extend(all.iter().flat_map(|node| &node.states));
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
        self.states[node as usize * self.lights.len() + light as usize]
    }

    /// The states of a leaf, one for each light.
    pub fn leaf_states(&self, leaf: u32) -> &[State] {
        let first = self.assembly.receivers.leaves[leaf as usize].node as usize * self.lights.len();
        &self.states[first..first + self.lights.len()]
    }

    /// How many leaves are on static objects: these come first.
    pub fn static_leaves(&self) -> usize {
        self.still.leaves()
    }

    /// By light, the state of a leaf that static blockers leave, whatever dynamic ones do.
    pub fn standing_states(&self, leaf: u32) -> &[State] {
        &self.assembly.visibility[self.assembly.receivers.leaves[leaf as usize].node as usize].states
    }

    /// The blockers of a node and a light, full (`true`) or partial. Of static objects this is the one blocker or
    /// [`Blocker::Group`] that decides their state. Of dynamic ones it is each patch or mesh if static ones leave the pair
    /// unoccluded; if those block a part of it, patches, and each mesh that is near, tested or not; if those block all,
    /// none. Below a full blocker nothing is tested again. If a node has none, its parent's decide, or the light and it do
    /// not face each other.
    pub fn blockers(&self, node: u32, light: u32) -> impl Iterator<Item = (Blocker, bool)> + '_ {
        let fixed = entries_of(&self.assembly.visibility, node, light)
            .map(|e| (self.groups.blocker(&self.surfaces, e.blocker()), e.full()));
        let moving =
            entries_of(&self.moving, node, light).map(|e| (self.surfaces.blocker(e.blocker()), e.full()));
        fixed.chain(moving)
    }

    /// The blockers of a [`Blocker::Group`].
    pub fn members(&self, group: u32) -> impl Iterator<Item = Blocker> + '_ {
        self.groups.members(group).into_iter().map(|b| self.surfaces.blocker(b))
    }

    /// The numbers of nodes, leaves, pairs by state, blockers and tests.
    pub fn counts(&self) -> Counts {
        let mut counts = Counts {
            nodes: self.assembly.receivers.nodes.len(),
            leaves: self.assembly.receivers.leaves.len(),
            pairs: self.assembly.receivers.leaves.len() * self.lights.len(),
            blockers: self.assembly.visibility.iter().chain(&self.moving).map(|r| r.entries.len()).sum(),
            tests: self.tests,
            ..Counts::default()
        };
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

/// The blockers of a node and a light.
pub(super) fn entries_of(nodes: &[NodeVisibility], node: u32, light: u32) -> impl Iterator<Item = &Entry> {
    nodes.get(node as usize).map_or(&[][..], |n| of_light(&n.entries, light)).iter()
}

pub(super) fn of_light(entries: &[Entry], light: u32) -> &[Entry] {
    let first = entries.partition_point(|e| e.light < light);
    let count = entries[first..].partition_point(|e| e.light == light);
    &entries[first..first + count]
}

/// The visibility of all nodes of a given hierarchy, each computed by `test` from its parent's, and the number of tests.
pub(super) fn determine(
    context: &SceneContext,
    receivers: &Receivers,
    test: impl Fn(usize, Shape, NodeContext, Option<&NodeVisibility>, &mut Workspace) -> NodeVisibility
    + Sync
    + Send,
) -> (Vec<NodeVisibility>, Tests) {
    let roots: Vec<usize> =
        (0..receivers.nodes.len()).filter(|&i| receivers.nodes[i].parent == NONE).collect();
    let ranges: Vec<_> = roots
        .iter()
        .enumerate()
        .map(|(i, &first)| first..roots.get(i + 1).copied().unwrap_or(receivers.nodes.len()))
        .collect();
    let parts = map(&ranges, |range| {
        let mut workspace = Workspace::new();
        let mut nodes: Vec<NodeVisibility> = Vec::with_capacity(range.len());
        for index in range.clone() {
            let node = &receivers.nodes[index];
            let parent = nodes.get((node.parent as usize).wrapping_sub(range.start));
            let shape = receivers.shape(context.surfaces, index as u32);
            let own_mesh = receivers.mesh(index as u32);
            let at = NodeContext { own_mesh, is_leaf: node.leaf != NONE, ..NodeContext::default() };
            nodes.push(test(index, shape, at, parent, &mut workspace));
        }
        (nodes, workspace.scratch.tests)
    });
    let mut tests = Tests::default();
    for part in &parts {
        tests += part.1;
    }
    (parts.into_iter().flat_map(|p| p.0).collect(), tests)
}
