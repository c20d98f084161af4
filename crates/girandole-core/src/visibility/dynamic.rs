//! What dynamic objects block of the light that static ones leave.

use super::State;
use super::boxes::FullCoverHint;
use super::cones::{ConeBase, ShadowCone};
use super::light_points::LightPoint;
use super::movers::Movers;
use super::node_visibility::{Entry, NodeContext, SceneContext, Workspace, split_off_light};
use super::pyramid::{Facing, Tests};
use super::receivers::Receivers;
use super::shades::ShadePass;
use super::state_matrix::StateMatrix;
use super::surfaces::Surfaces;
use crate::parallel::map;
use crate::scene::NONE;
use std::ops::Range;

/// The dynamic blockers, and what is known of static ones.
pub(super) struct DynamicPass<'a> {
    pub surfaces: &'a Surfaces,
    pub lights: &'a [LightPoint],
    pub receivers: &'a Receivers,
    pub movers: &'a Movers,
    /// By node, the visibility that static blockers leave.
    pub fixed: &'a StateMatrix,
}

impl DynamicPass<'_> {
    /// The states with dynamic blockers too: first those that may cover receivers, then of the light that these leave all others. They
    /// are put into `before`, whose memory serves again.
    pub fn run(&self, before: StateMatrix) -> (StateMatrix, Tests) {
        let Self { surfaces, lights, receivers, movers, fixed } = *self;
        let (mut states, mut tests) = (before, Tests::default());
        if movers.covers.is_empty() {
            states.copy_from(fixed);
        } else {
            let context = SceneContext { surfaces, lights, blockers: &movers.covers };
            (states, tests) = CoverPass { context: &context, receivers, fixed }.run();
        }
        if !movers.others.is_empty() {
            let pass = ShadePass { surfaces, lights, receivers, movers, fixed, left: &states };
            let (shades, of_shades) = pass.run();
            tests += of_shades;
            shades.put_into(&mut states);
        }
        (states, tests)
    }
}

/// Those dynamic blockers that may cover a receiver.
struct CoverPass<'a> {
    /// With the hierarchy of these blockers.
    context: &'a SceneContext<'a>,
    receivers: &'a Receivers,
    /// By node, the visibility that static blockers leave.
    fixed: &'a StateMatrix,
}

/// What the parent's tests leave to a node.
struct Above<'a> {
    states: &'a [State],
    entries: &'a [Entry],
}

impl CoverPass<'_> {
    /// Tests all nodes, each against what its parent's tests left: the states with these blockers too.
    fn run(&self) -> (StateMatrix, Tests) {
        let roots = self.receivers.roots(0);
        let (mut result, mut tests) = (StateMatrix::new(self.context.lights.len()), Tests::default());
        for (part, of_part) in map(&roots, |range| self.run_root(range.clone())) {
            result.append(part);
            tests += of_part;
        }
        (result, tests)
    }

    /// The nodes of one root.
    fn run_root(&self, range: Range<usize>) -> (StateMatrix, Tests) {
        let lights = self.context.lights.len();
        let mut workspace = Workspace::new();
        let mut states: Vec<State> = Vec::with_capacity(range.len() * lights);
        let mut entries: Vec<Vec<Entry>> = Vec::with_capacity(range.len());
        for index in range.clone() {
            let first = states.len();
            states.extend_from_slice(self.fixed.row(index));
            let (before, own) = states.split_at_mut(first);
            let parent = self.receivers.nodes[index].parent;
            let above = (parent != NONE).then(|| {
                let local = parent as usize - range.start;
                Above { states: &before[local * lights..(local + 1) * lights], entries: &entries[local] }
            });
            entries.push(self.test(index, above.as_ref(), own, &mut workspace));
        }
        (StateMatrix::of(lights, states), workspace.scratch.tests)
    }

    /// Tests a node for each light of which static blockers leave something; `states` are those that they leave. Where they
    /// leave a part, only what may block all of it is tested.
    fn test(
        &self,
        index: usize,
        above: Option<&Above>,
        states: &mut [State],
        workspace: &mut Workspace,
    ) -> Vec<Entry> {
        let context = self.context;
        let shape = self.receivers.shape(context.surfaces, index as u32);
        let node = NodeContext {
            own_mesh: self.receivers.mesh(index as u32),
            is_leaf: self.receivers.nodes[index].leaf != NONE,
            ..NodeContext::default()
        };
        let tolerance = shape.tolerance(&context.surfaces.tolerance);
        let base = ConeBase::new(&shape, &tolerance);
        let mut rest: &[Entry] = above.map_or(&[], |a| a.entries);
        let mut result = Vec::with_capacity(rest.len());
        let mut lights = std::mem::take(&mut workspace.lights);
        lights_to_test(above, states, &mut lights);
        for &light in &lights {
            rest = &rest[rest.partition_point(|e| e.light < light)..];
            let inherited = split_off_light(&mut rest, light);
            let state = &mut states[light as usize];
            let apex = &context.lights[light as usize].apex;
            if above.is_none() && !context.blockers.is_near(&ShadowCone::new(apex, &base), workspace) {
                continue;
            }
            workspace.scratch.tests.boxes += 1;
            if workspace.pyramid.set(apex, shape, &tolerance) == Facing::None {
                *state = State::Full;
                continue;
            }
            workspace.open.clear();
            if above.is_none() {
                workspace.open.push((0, FullCoverHint::UNKNOWN));
            } else {
                let partial = inherited.iter().filter(|e| !e.full());
                workspace.open.extend(partial.rev().map(|e| e.for_child(&node)));
            }
            *state = context.search(light, node, *state, workspace);
            result.extend_from_slice(&workspace.found);
        }
        workspace.lights = lights;
        if let Some(above) = above {
            for (state, above) in states.iter_mut().zip(above.states) {
                if *above == State::Full {
                    *state = State::Full;
                }
            }
        }
        result
    }
}

/// Finds the lights for which a node has to be tested, in ascending order: those for which its parent was and something is
/// near.
fn lights_to_test(above: Option<&Above>, states: &[State], lights: &mut Vec<u32>) {
    lights.clear();
    let is_open = |light: &u32| states[*light as usize] != State::Full;
    match above {
        None => lights.extend((0..states.len() as u32).filter(is_open)),
        Some(above) => {
            lights.extend(above.entries.iter().filter(|e| !e.full()).map(|e| e.light).filter(is_open));
            lights.dedup();
        }
    }
}
