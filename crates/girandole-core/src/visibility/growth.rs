//! Grows the subtrees of receivers from their surfaces, a few at a time.

use super::VisibilitySettings;
use super::groups::Descent;
use super::hierarchy::{Frame, MeshRoot, NodeBuilder, PatchRoot, Subtree};
use super::node_visibility::{NodeVisibility, SceneContext};
use super::pyramid::Tests;
use super::sources::Sources;
use super::state_matrix::StateMatrix;
use crate::parallel::for_each;
use std::collections::VecDeque;
use std::sync::Arc;

/// Pairs of nodes and lights that a step tests of each subtree, at most: some milliseconds.
const PAIRS: usize = 1 << 10;

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
    patches: Descent<Arc<NodeVisibility>>,
    /// What is known of all of them before.
    above: Option<Arc<NodeVisibility>>,
    /// Meshes that are not begun.
    meshes: VecDeque<usize>,
    begun: Vec<Begun>,
    done: Vec<(usize, Subtree)>,
}

/// A subtree in the making.
struct Begun {
    /// Its position among the sources' roots.
    root: usize,
    /// What is known of it before.
    above: Option<Arc<NodeVisibility>>,
    subtree: Subtree,
}

impl Growth {
    /// Of the roots that are chosen, given what is known of all of them before.
    pub fn new(sources: &Sources, chosen: &[bool], above: Option<Arc<NodeVisibility>>) -> Self {
        let (sides, meshes) = chosen.split_at(sources.sides().len());
        Self {
            count: chosen.iter().filter(|is| **is).count(),
            patches: Descent::new(sides.to_vec(), above.clone()),
            above,
            meshes: (sides.len()..chosen.len()).filter(|&root| meshes[root - sides.len()]).collect(),
            begun: Vec::new(),
            done: Vec::new(),
        }
    }

    /// The share of the surfaces that are done.
    pub fn progress(&self) -> f32 {
        self.done.len() as f32 / self.count.max(1) as f32
    }

    pub fn is_done(&self) -> bool {
        self.patches.is_done() && self.meshes.is_empty() && self.begun.is_empty()
    }

    /// Goes on with so many subtrees, or groups of patches, on all cores: with a part of each, unless with all.
    pub fn step(&mut self, soil: &Soil, sources: &Sources, most: usize) {
        let context = soil.context;
        if self.begun.is_empty() {
            if let Some(groups) = sources.groups().filter(|_| !self.patches.is_done()) {
                self.patches.step(groups, (context, most), &|_, group| group.clone());
                let of_sides = self.patches.parts.drain(..).map(|(side, group)| (side as usize, Some(group)));
                self.begun.extend(of_sides.map(|(root, above)| Begun::new(root, above)));
                return;
            }
            let meshes = self.meshes.drain(..most.min(self.meshes.len()));
            self.begun.extend(meshes.map(|root| Begun::new(root, self.above.clone())));
        }
        let nodes = if most == usize::MAX { most } else { (PAIRS / context.lights.len().max(1)).max(1) };
        // The last ones first: few are begun at a time.
        let next = self.begun.len().saturating_sub(most);
        for_each(self.begun[next..].iter_mut().collect(), |begun| begun.grow(soil, sources, nodes));
        let done = self.begun.extract_if(next.., |begun| begun.subtree.is_done());
        self.done.extend(done.map(|begun| (begun.root, begun.subtree)));
    }

    /// What has grown for so many lights, in the order of the sources' roots.
    pub fn end(self, lights: usize) -> Grown {
        let Self { mut done, patches: Descent { mut tests, .. }, .. } = self;
        done.sort_unstable_by_key(|(root, _)| *root);
        let mut roots = Vec::with_capacity(self.count);
        let nodes = done.iter().map(|(_, subtree)| subtree.nodes.len()).sum();
        let mut visibility = StateMatrix::with_room(nodes, lights);
        for (root, Subtree { mut nodes, tests: of_root, .. }) in done {
            for (node, _) in breadth_first(&nodes) {
                visibility.push(&std::mem::take(&mut nodes[node].visibility).states);
            }
            roots.push((root, nodes));
            tests += of_root;
        }
        Grown { roots, visibility, tests }
    }
}

impl Begun {
    fn new(root: usize, above: Option<Arc<NodeVisibility>>) -> Self {
        Self { root, above, subtree: Subtree::default() }
    }

    /// Goes on with so many nodes at most.
    fn grow(&mut self, soil: &Soil, sources: &Sources, most: usize) {
        let Soil { context, settings, threshold } = *soil;
        let Self { root, above, subtree } = self;
        match (sources.sides().get(*root), above) {
            (Some(&(simple, back)), Some(group_visibility)) => {
                let frame = Frame::of(&context.surfaces.patches[simple as usize]);
                PatchRoot { context, settings, simple, back, group_visibility, frame, threshold }
                    .grow(subtree, most);
            }
            (_, above) => {
                let mesh = sources.meshes()[*root - sources.sides().len()];
                let (above, is_all) = (above.as_deref(), sources.one_mesh().is_some());
                let triangles = settings.cluster_triangles.max(1);
                MeshRoot { context, mesh, above, is_all, triangles }.grow(subtree, most);
            }
        }
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
