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
    /// With their positions among the sources' roots.
    pub roots: Vec<(usize, Vec<NodeBuilder>)>,
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

/// Subtrees of chosen roots that are being grown.
pub(super) struct Growth {
    /// How many.
    count: usize,
    patches: Descent<Subtree>,
    /// What is known of all of them before.
    above: Option<Arc<NodeVisibility>>,
    /// Positions among the sources' roots.
    meshes: Vec<usize>,
    of_meshes: Vec<Subtree>,
}

type Subtree = (Vec<NodeBuilder>, Tests);

impl Growth {
    /// Of the roots that are chosen, given what is known of all of them before.
    pub fn new(sources: &Sources, chosen: &[bool], above: Option<Arc<NodeVisibility>>) -> Self {
        let (sides, meshes) = chosen.split_at(sources.sides().len());
        Self {
            count: chosen.iter().filter(|is| **is).count(),
            patches: Descent::new(sides.to_vec(), above.clone()),
            above,
            meshes: (sides.len()..chosen.len()).filter(|&root| meshes[root - sides.len()]).collect(),
            of_meshes: Vec::new(),
        }
    }

    /// The share of the surfaces that are done.
    pub fn progress(&self) -> f32 {
        (self.patches.parts.len() + self.of_meshes.len()) as f32 / self.count.max(1) as f32
    }

    pub fn is_done(&self) -> bool {
        self.patches.is_done() && self.of_meshes.len() == self.meshes.len()
    }

    /// Goes on with so many groups of patches, or meshes, on all cores.
    pub fn step(&mut self, soil: &Soil, sources: &Sources, most: usize) {
        let Soil { context, settings, threshold } = *soil;
        if let Some(groups) = sources.groups().filter(|_| !self.patches.is_done()) {
            self.patches.step(groups, (context, most), &|side: u32, group_visibility: &NodeVisibility| {
                let (simple, back) = sources.sides()[side as usize];
                let mut workspace = Workspace::new();
                let frame = Frame::of(&context.surfaces.patches[simple as usize]);
                let root = PatchRoot { context, settings, simple, back, group_visibility, frame, threshold };
                (root.build(&mut workspace), workspace.scratch.tests)
            });
            return;
        }
        let rest = &self.meshes[self.of_meshes.len()..];
        self.of_meshes.extend(map(&rest[..most.min(rest.len())], |&root| {
            let mut workspace = Workspace::new();
            let index = sources.meshes()[root - sources.sides().len()];
            let mesh = (index, self.above.as_deref(), sources.one_mesh().is_some());
            let nodes = mesh_nodes(context, mesh, settings.cluster_triangles.max(1), &mut workspace);
            (nodes, workspace.scratch.tests)
        }));
    }

    /// What has grown for so many lights, in the order of the sources' roots.
    pub fn end(self, lights: usize) -> Grown {
        let mut visibility = StateMatrix::new(lights);
        let Descent { mut parts, mut tests, .. } = self.patches;
        parts.sort_unstable_by_key(|(side, _)| *side);
        let mut roots = Vec::with_capacity(self.count);
        let of_patches = parts.into_iter().map(|(side, part)| (side as usize, part));
        for (root, (mut nodes, of_root)) in of_patches.chain(self.meshes.into_iter().zip(self.of_meshes)) {
            for (node, _) in breadth_first(&nodes) {
                visibility.push(&std::mem::take(&mut nodes[node].visibility));
            }
            roots.push((root, nodes));
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
    /// Those that are chosen at once, given what is known of all of them before.
    pub fn new(soil: &Soil, sources: &Sources, chosen: &[bool], above: Option<Arc<NodeVisibility>>) -> Self {
        let mut growth = Growth::new(sources, chosen, above);
        while !growth.is_done() {
            growth.step(soil, sources, usize::MAX);
        }
        growth.end(soil.context.lights.len())
    }
}
