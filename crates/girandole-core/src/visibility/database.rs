//! The visibility database: for each node and light the state.

use super::assembly::{Assembly, End};
use super::blockers::BlockerTree;
use super::build::VisibilityBuild;
use super::cover::Cutter;
use super::light_points::LightPoint;
use super::movers::Movers;
use super::needed::Mirrors;
use super::pyramid::{Pyramid, Tests};
use super::receivers::{Receivers, Source};
use super::shapes::Shape;
use super::sources::Sources;
use super::state_matrix::StateMatrix;
use super::surfaces::Surfaces;
use super::{LeafId, State, VisibilitySettings};
use crate::Result;
use crate::generation::Generation;
use crate::lights::LightSet;
use crate::scene::{Geometry, NONE, ObjectId, Scene, View};
use std::ops::Range;

/// With more lights visibility is not determined: a database holds a byte for each node and light, and two where something moves.
pub const MOST_LIGHTS: usize = 65536;

/// For each node and light the state.
#[derive(Clone, Debug)]
pub struct VisibilityDatabase {
    pub(super) settings: VisibilitySettings,
    pub(super) surfaces: Surfaces,
    pub(super) lights: Vec<LightPoint>,
    /// Over static blockers.
    pub(super) groups: BlockerTree,
    pub(super) static_receivers: StaticReceivers,
    /// Dynamic ones, in the order of objects.
    pub(super) segments: Vec<Segment>,
    /// With the visibility of each node that static blockers leave.
    pub(super) assembly: Assembly,
    /// Over dynamic blockers.
    pub(super) movers: Movers,
    /// The visibility with dynamic blockers too, if there are any.
    pub(super) dynamic: Option<StateMatrix>,
    pub(super) tests: Tests,
    pub(super) of_geometry: Generation,
    pub(super) of_lights: Generation,
}

/// The receivers on static surfaces.
#[derive(Clone, Debug)]
pub(super) struct StaticReceivers {
    pub sources: Sources,
    /// By root of the sources, the nodes of those that are determined.
    pub roots: Vec<Option<Range<usize>>>,
    /// Of the leaf of all that is not determined.
    pub undetermined: Vec<State>,
    /// What shows them besides the views.
    pub mirrors: Mirrors,
    /// Area × partially occluded lights above which patches are split, by the area of all of them.
    pub threshold: f64,
    /// Where they end.
    pub end: End,
}

/// The receivers on one dynamic object.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    pub object: u32,
    pub sources: Sources,
    /// Where they end.
    pub end: End,
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
    /// Tests made to build it, or by the update that changed it last.
    pub tests: Tests,
}

impl VisibilityDatabase {
    /// Builds everything from scratch: the hierarchy from the lights and static blockers, then the visibility with dynamic
    /// blockers; of all static surfaces.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where there are more than [`MOST_LIGHTS`] lights, or geometry or lights are not this scene's.
    pub fn build(
        scene: &Scene,
        geometry: &Geometry,
        lights: &LightSet,
        settings: &VisibilitySettings,
    ) -> Result<Self> {
        Self::build_for(scene, geometry, lights, settings, &[])
    }

    /// As [`VisibilityDatabase::build`], but of those static surfaces alone that some views need, whichever way they look, and those
    /// that mirrors show them; none = of all. The leaf of others is [`LeafKind::Undetermined`](super::LeafKind::Undetermined).
    ///
    /// # Errors
    /// As [`VisibilityDatabase::build`].
    pub fn build_for(
        scene: &Scene,
        geometry: &Geometry,
        lights: &LightSet,
        settings: &VisibilitySettings,
        views: &[View],
    ) -> Result<Self> {
        VisibilityBuild::new((scene, geometry), lights, settings, views)?.end(scene, geometry)
    }

    /// Where the leaves of dynamic objects begin in [`Receivers::leaves`]; before are those of static ones.
    pub fn first_dynamic_leaf(&self) -> u32 {
        self.static_receivers.end.leaves as u32
    }

    /// Whether it was built for this geometry and these lights.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where it was built for others.
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
        self.states().row(node as usize)[light as usize]
    }

    /// The states of a leaf, one for each light.
    pub fn leaf_states(&self, leaf: u32) -> &[State] {
        self.states_in(self.states(), leaf)
    }

    /// By light, the state of a leaf that static blockers leave, whatever dynamic ones do.
    pub fn standing_states(&self, leaf: u32) -> &[State] {
        self.states_in(&self.assembly.visibility, leaf)
    }

    fn states_in<'a>(&'a self, states: &'a StateMatrix, leaf: u32) -> &'a [State] {
        match self.assembly.receivers.leaves[leaf as usize].node {
            NONE => &self.static_receivers.undetermined,
            node => states.row(node as usize),
        }
    }

    /// A leaf's shape, but of what is not determined.
    pub(super) fn leaf_shape(&self, leaf: u32) -> Option<Shape<'_>> {
        let node = self.assembly.receivers.leaves[leaf as usize].node;
        (node != NONE).then(|| self.assembly.receivers.shape(&self.surfaces, node))
    }

    /// What finds what static polygons hide.
    pub(super) fn cutter(&self) -> Cutter<'_> {
        Cutter::new(&self.surfaces, &self.groups)
    }

    /// For each light, whether one static polygon hides the whole of a dynamic mesh from it: then the mesh blocks none of its light
    /// that is not blocked already. Nothing is said of objects with patches: their sides turn away from some lights by themselves.
    pub fn hidden_from(&self, object: ObjectId) -> Vec<bool> {
        let nodes = &self.assembly.receivers.nodes;
        let Ok(index) = self.segments.binary_search_by_key(&object.0, |segment| segment.object) else {
            return vec![false; self.lights.len()];
        };
        let before = index.checked_sub(1).map_or(self.static_receivers.end, |i| self.segments[i].end);
        let of_object = before.nodes..self.segments[index].end.nodes;
        let roots: Vec<usize> = of_object.filter(|&node| nodes[node].parent == NONE).collect();
        let is_mesh = |node: &usize| matches!(nodes[*node].source, Source::Cluster { .. });
        let is_possible = !roots.is_empty() && roots.iter().all(is_mesh);
        let Assembly { receivers, visibility } = &self.assembly;
        let mut pyramid = Pyramid::new();
        let mut hides = |light: usize, root: usize| {
            let (state, apex) = (visibility.row(root)[light], &self.lights[light].apex);
            receivers.is_hidden(&self.surfaces, (root as u32, state), apex, &mut pyramid)
        };
        (0..self.lights.len())
            .map(|light| is_possible && roots.iter().all(|root| hides(light, *root)))
            .collect()
    }

    pub(super) fn states(&self) -> &StateMatrix {
        self.dynamic.as_ref().unwrap_or(&self.assembly.visibility)
    }

    /// The numbers of nodes, leaves, pairs by state and tests, of all that is determined.
    pub fn counts(&self) -> Counts {
        let first = usize::from(self.has_undetermined_leaf());
        let leaves = self.assembly.receivers.leaves.len() - first;
        let mut counts = Counts {
            nodes: self.assembly.receivers.nodes.len(),
            leaves,
            pairs: leaves * self.lights.len(),
            tests: self.tests,
            ..Counts::default()
        };
        for (index, leaf) in self.assembly.receivers.leaves.iter().enumerate().skip(first) {
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

pub(super) fn is_dynamic(scene: &Scene, object: u32) -> bool {
    scene.objects.get(object as usize).is_some_and(|o| o.dynamic)
}
