//! Grows the subtrees of receivers from their surfaces, a few at a time.

use super::VisibilitySettings;
use super::groups::Descent;
use super::hierarchy::{Frame, NodeBuilder, PatchRoot, mesh_nodes};
use super::node_visibility::{NodeVisibility, SceneContext, Workspace};
use super::pyramid::Tests;
use super::sources::Sources;
use super::state_matrix::StateMatrix;
use crate::parallel::map;
use std::sync::Arc;

/// Subtrees of roots, and the tests made to grow them.
#[derive(Default)]
pub(super) struct Grown {
    pub roots: Vec<Vec<NodeBuilder>>,
    /// Of their nodes, root by root, each as [`breadth_first`] has them.
    pub visibility: StateMatrix,
    pub tests: Tests,
}

/// How subtrees are grown.
pub(super) struct Soil<'a> {
    pub context: &'a SceneContext<'a>,
    pub settings: &'a VisibilitySettings,
    /// Patches are split while their area times their partially occluded lights exceeds this.
    pub threshold: f64,
}

/// Subtrees that are being grown.
pub(super) struct Growth {
    patches: Option<Descent<Subtree>>,
    /// What is known of all of them before.
    above: Option<Arc<NodeVisibility>>,
    meshes: Vec<Subtree>,
}

type Subtree = (Vec<NodeBuilder>, Tests);

impl Growth {
    pub fn new(sources: &Sources, above: Option<Arc<NodeVisibility>>) -> Self {
        let patches = sources.groups().map(|groups| Descent::new(groups, above.clone()));
        Self { patches, above, meshes: Vec::new() }
    }

    /// The share of the surfaces that are done.
    pub fn progress(&self, sources: &Sources) -> f32 {
        let done = self.patches.as_ref().map_or(0, |patches| patches.parts.len()) + self.meshes.len();
        done as f32 / sources.roots().len().max(1) as f32
    }

    pub fn is_done(&self, sources: &Sources) -> bool {
        self.patches.as_ref().is_none_or(Descent::is_done) && self.meshes.len() == sources.meshes().len()
    }

    /// Goes on with so many groups of patches, or meshes, on all cores.
    pub fn step(&mut self, soil: &Soil, sources: &Sources, most: usize) {
        let Soil { context, settings, threshold } = *soil;
        if let (Some(descent), Some(groups)) = (&mut self.patches, sources.groups())
            && !descent.is_done()
        {
            descent.step(groups, (context, most), &|side: u32, group_visibility: &NodeVisibility| {
                let (simple, back) = sources.sides()[side as usize];
                let mut workspace = Workspace::new();
                let frame = Frame::of(&context.surfaces.patches[simple as usize]);
                let root = PatchRoot { context, settings, simple, back, group_visibility, frame, threshold };
                (root.build(&mut workspace), workspace.scratch.tests)
            });
            return;
        }
        let rest = &sources.meshes()[self.meshes.len()..];
        self.meshes.extend(map(&rest[..most.min(rest.len())], |&index| {
            let mut workspace = Workspace::new();
            let mesh = (index, self.above.as_deref(), sources.one_mesh().is_some());
            let nodes = mesh_nodes(context, mesh, settings.cluster_triangles.max(1), &mut workspace);
            (nodes, workspace.scratch.tests)
        }));
    }

    /// What has grown for so many lights, in the order of the sources' roots.
    pub fn end(self, lights: usize) -> Grown {
        let mut visibility = StateMatrix::new(lights);
        let (mut parts, mut tests) = self.patches.map_or_else(Default::default, |d| (d.parts, d.tests));
        parts.sort_unstable_by_key(|(side, _)| *side);
        let mut roots = Vec::with_capacity(parts.len() + self.meshes.len());
        for (mut nodes, of_root) in parts.into_iter().map(|(_, part)| part).chain(self.meshes) {
            for (node, _) in breadth_first(&nodes) {
                visibility.push(&std::mem::take(&mut nodes[node].visibility));
            }
            roots.push(nodes);
            tests += of_root;
        }
        Grown { roots, visibility, tests }
    }
}

/// The nodes of a subtree that were not collapsed, parents before children, and where the parent of each is among these.
pub(super) fn breadth_first(nodes: &[NodeBuilder]) -> Vec<(usize, Option<usize>)> {
    let mut result = vec![(0, None)];
    let mut next = 0;
    while let Some(&(node, _)) = result.get(next) {
        result.extend(nodes[node].children.into_iter().flatten().map(|child| (child, Some(next))));
        next += 1;
    }
    result
}

impl Grown {
    /// All at once, given what is known of all of them before.
    pub fn new(soil: &Soil, sources: &Sources, above: Option<Arc<NodeVisibility>>) -> Self {
        let mut growth = Growth::new(sources, above);
        while !growth.is_done(sources) {
            growth.step(soil, sources, usize::MAX);
        }
        growth.end(soil.context.lights.len())
    }
}
