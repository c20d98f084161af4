//! What dynamic objects block of the light that static ones leave.

use super::State;
use super::boxes::{Capsule, FullCoverHint};
use super::node_visibility::{Entry, NodeContext, SceneContext, Workspace, split_off_light};
use super::parallel::map;
use super::pyramid::{Facing, Tests};
use super::receivers::Receivers;
use super::state_matrix::StateMatrix;
use crate::scene::NONE;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// The dynamic blockers, and what is known of static ones.
pub(super) struct DynamicPass<'a> {
    /// With a hierarchy of dynamic blockers.
    pub context: &'a SceneContext<'a>,
    pub receivers: &'a Receivers,
    /// By node, the visibility that static blockers leave.
    pub fixed: &'a StateMatrix,
}

/// What the parent's tests leave to a node.
struct Above<'a> {
    fixed: &'a [State],
    states: &'a [State],
    entries: &'a [Entry],
}

impl DynamicPass<'_> {
    /// Tests all nodes, each against what its parent's tests left: the states with dynamic blockers too, and those of them that
    /// decide.
    pub fn run(&self) -> (StateMatrix, Tests) {
        let roots = self.receivers.roots();
        let own_nodes = self.context.blockers.mesh_nodes();
        let (mut result, mut tests) = (StateMatrix::new(self.context.lights.len()), Tests::default());
        for (part, of_part) in map(&roots, |range| self.run_root(range.clone(), &own_nodes)) {
            result.append(part);
            tests += of_part;
        }
        (result, tests)
    }

    /// The nodes of one root.
    fn run_root(&self, range: Range<usize>, own_nodes: &FxHashMap<u32, u32>) -> (StateMatrix, Tests) {
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
                Above {
                    fixed: self.fixed.row(parent as usize),
                    states: &before[local * lights..(local + 1) * lights],
                    entries: &entries[local],
                }
            });
            let shading_itself = self.shading_itself(index, own_nodes);
            entries.push(match shading_itself {
                Some(blocker) => shade_itself(blocker, own),
                None => self.test(index, above.as_ref(), own, &mut workspace),
            });
        }
        // Without what only the children's tests needed.
        let mut result = StateMatrix::new(lights);
        for (local, (entries, index)) in entries.iter().zip(range).enumerate() {
            let fixed = self.fixed.row(index);
            let decides = |e: &&Entry| e.full() || fixed[e.light as usize] == State::Unoccluded;
            result.push_states(&states[local * lights..(local + 1) * lights], entries.iter().filter(decides));
        }
        (result, workspace.scratch.tests)
    }

    /// The blocker that a node's own mesh is, if it may block light that comes to it and nothing may block all of that.
    fn shading_itself(&self, index: usize, own_nodes: &FxHashMap<u32, u32>) -> Option<u32> {
        let mesh = self.receivers.mesh(index as u32)?;
        let is_decided =
            !self.context.surfaces.meshes[mesh as usize].convex && !self.context.blockers.may_cover();
        is_decided.then(|| own_nodes.get(&mesh).copied()).flatten()
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
        let may_cover = context.blockers.may_cover();
        let shape = self.receivers.shape(context.surfaces, index as u32);
        let node = NodeContext {
            own_mesh: self.receivers.mesh(index as u32),
            is_leaf: self.receivers.nodes[index].leaf != NONE,
            ..NodeContext::default()
        };
        let tolerance = shape.tolerance(&context.surfaces.tolerance);
        let bounds = shape.sphere(&tolerance);
        let mut rest: &[Entry] = above.map_or(&[], |a| a.entries);
        let mut result = Vec::with_capacity(rest.len());
        let mut lights = std::mem::take(&mut workspace.lights);
        lights_to_test(above, states, may_cover, &mut lights);
        for &light in &lights {
            rest = &rest[rest.partition_point(|e| e.light < light)..];
            let inherited = split_off_light(&mut rest, light);
            let state = &mut states[light as usize];
            let apex = &context.lights[light as usize].apex;
            let from_start = above.is_none_or(|a| a.leaves_untested(light as usize, may_cover));
            if from_start && !context.blockers.is_near(&Capsule::new(apex, bounds), workspace) {
                continue;
            }
            workspace.scratch.tests.boxes += 1;
            if workspace.pyramid.set(apex, shape, &tolerance) == Facing::None {
                *state = State::Full;
                continue;
            }
            workspace.open.clear();
            if from_start {
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

impl Above<'_> {
    /// Whether dynamic blockers were not tested for a light, because static ones block a part of it and no dynamic one may
    /// block all.
    fn leaves_untested(&self, light: usize, may_cover: bool) -> bool {
        !may_cover && self.fixed[light] == State::Partial
    }
}

/// Lights that are compared at once.
const COMPARED: usize = 16;

/// Finds the lights for which a node has to be tested, in ascending order: those for which its parent was and something is
/// near, and those for which it was not.
fn lights_to_test(above: Option<&Above>, states: &[State], may_cover: bool, lights: &mut Vec<u32>) {
    lights.clear();
    let is_open = |state: State| state == State::Unoccluded || state == State::Partial && may_cover;
    let Some(above) = above else {
        return lights
            .extend((0..).zip(states).filter(|(_, state)| is_open(**state)).map(|(light, _)| light));
    };
    lights.extend(
        above.entries.iter().filter(|e| !e.full() && is_open(states[e.light as usize])).map(|e| e.light),
    );
    lights.dedup();
    if !may_cover {
        let tested = lights.len();
        let starts =
            |(above, state): (&State, &State)| *above == State::Partial && *state == State::Unoccluded;
        let chunks = above.fixed.chunks(COMPARED).zip(states.chunks(COMPARED));
        for (first, (above, states)) in (0..).step_by(COMPARED).zip(chunks) {
            // Most have none, and that is found without a branch for each.
            if above.iter().zip(states).fold(false, |any, pair| any | starts(pair)) {
                let pairs = (first..).zip(above.iter().zip(states));
                lights.extend(pairs.filter(|(_, pair)| starts(*pair)).map(|(light, _)| light));
            }
        }
        if tested > 0 && tested < lights.len() {
            lights.sort_unstable();
        }
    }
}

/// All light that static blockers leave to a node of a mesh that is not convex may be blocked by the mesh.
fn shade_itself(blocker: u32, states: &mut [State]) -> Vec<Entry> {
    let mut result = Vec::new();
    for (light, state) in (0..).zip(states) {
        if *state == State::Unoccluded {
            *state = State::Partial;
            result.push(Entry::new(light, blocker, false));
        }
    }
    result
}
