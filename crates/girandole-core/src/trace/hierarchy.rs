//! What rays are traced against.

use super::SceneTracer;
use crate::generation::Generation;
use crate::scene::{Geometry, ObjectRange, Scene};
use crate::slices::{complete, pause};
use glam::{DVec3, Vec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, DEFAULT_MAX_STACK_DEPTH};
use obvhs::cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh};
use obvhs::ploc::{PlocBuilder, morton::morton_encode_u64_unorm};
use std::sync::Arc;

/// How much larger boxes are in the hierarchy's space, on each side.
pub(super) const MARGIN: f32 = 1e-6;
/// Levels of a hierarchy that the traversal's stack of 32 has room for.
pub(super) const MAX_DEPTH: usize = 31;

/// A hierarchy over some of a scene's triangles.
pub(super) struct Hierarchy {
    pub bvh: CwBvh,
    /// The triangles in the hierarchy's order.
    leaves: Vec<Leaf>,
}

/// A triangle where the traversal finds it.
pub(super) struct Leaf {
    pub corners: [Vec3; 3],
    pub triangle: u32,
    pub masked: bool,
    pub emits: bool,
}

impl Hierarchy {
    /// Over these triangles.
    pub async fn new(
        scene: &Scene,
        geometry: &Geometry,
        triangles: Vec<u32>,
        build: &BvhBuildParams,
    ) -> Self {
        let boxes = boxes(geometry, &triangles);
        let bvh = if boxes.is_empty() { CwBvh::default() } else { tree(&boxes, build).await };
        let leaves = bvh
            .primitive_indices
            .iter()
            .map(|&i| triangles[i as usize])
            .map(|triangle| {
                let material = &scene.materials[geometry.triangles[triangle as usize].material];
                Leaf {
                    corners: geometry.corners(triangle),
                    triangle,
                    masked: material.alpha_cutoff.is_some(),
                    emits: material.emits(),
                }
            })
            .collect();
        Self { bvh, leaves }
    }

    /// Whether it has no triangles.
    pub fn is_empty(&self) -> bool {
        self.leaves.is_empty()
    }

    /// A leaf's triangle.
    #[inline]
    pub fn leaf(&self, slot: usize) -> &Leaf {
        &self.leaves[slot]
    }
}

impl std::fmt::Debug for Hierarchy {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Hierarchy of {} triangles", self.leaves.len())
    }
}

/// Hierarchies that are kept while things move: that of static objects as it is, and that of dynamic ones for as long as they
/// stay. For whoever traces rays a few at a time.
#[derive(Clone, Debug, Default)]
pub struct HeldHierarchies(Option<Held>);

#[derive(Clone, Debug)]
struct Held {
    generation: Generation,
    key: Key,
    still: Arc<Hierarchy>,
    moving: Arc<Hierarchy>,
}

/// What the hierarchy of static objects depends on: they do not move without becoming dynamic.
#[derive(Clone, Debug, PartialEq)]
struct Key {
    objects: Vec<ObjectRange>,
    dynamic: Vec<bool>,
    origin: DVec3,
    scale: f64,
}

impl HeldHierarchies {
    /// A tracer of a scene, as [`SceneTracer::new`] gives but for the order in which triangles are tested: what is held of the last
    /// scene, or the last version of this one, is used as far as it still holds.
    pub fn tracer<'a>(&mut self, scene: &'a Scene, geometry: &'a Geometry) -> SceneTracer<'a> {
        let key = Key {
            objects: geometry.objects.clone(),
            dynamic: scene.objects.iter().map(|object| object.dynamic).collect(),
            origin: geometry.origin,
            scale: scale(geometry),
        };
        let build = |dynamic: bool| {
            let is_one = |t: &u32| {
                key.dynamic[geometry.triangles[*t as usize].object as usize] == dynamic
                    && !geometry.is_transparent(scene, *t)
            };
            let triangles = (0..geometry.triangles.len() as u32).filter(is_one).collect();
            let build = BvhBuildParams::medium_build();
            Arc::new(complete(Hierarchy::new(scene, geometry, triangles, &build)))
        };
        let generation = geometry.generation();
        let held = match self.0.take().filter(|held| held.key == key) {
            Some(held) if held.generation == generation => held,
            Some(held) => Held { generation, moving: build(true), ..held },
            None => Held { generation, still: build(false), moving: build(true), key: key.clone() },
        };
        let tracer = SceneTracer::over(scene, geometry, &[held.still.clone(), held.moving.clone()]);
        self.0 = Some(held);
        tracer
    }
}

/// From the scene to the hierarchies' space: a power of two.
pub(super) fn scale(geometry: &Geometry) -> f64 {
    libm::exp2(-libm::floor(libm::log2(f64::from(geometry.extent()))))
}

/// A box from its smallest corner to its largest. By numbers alone: the library's vectors may be of another version than ours, as it takes
/// several.
pub(crate) fn aabb(low: Vec3, high: Vec3) -> Aabb {
    Aabb::new(low.to_array().into(), high.to_array().into())
}

/// Triangles' boxes in the hierarchies' space.
pub(super) fn boxes(geometry: &Geometry, triangles: &[u32]) -> Vec<Aabb> {
    let scale = scale(geometry);
    let bounds = |&triangle: &u32| {
        let [a, b, c] = geometry.corners(triangle).map(|p| (p.as_dvec3() * scale).as_vec3());
        aabb(a.min(b).min(c) - MARGIN, a.max(b).max(c) + MARGIN)
    };
    triangles.iter().map(bounds).collect()
}

async fn tree(boxes: &[Aabb], build: &BvhBuildParams) -> CwBvh {
    let bvh = wide(boxes, build).await;
    // `obvhs` would panic where it is too deep.
    if depth(&bvh) < MAX_DEPTH { bvh } else { balanced_wide(boxes, build) }
}

/// A hierarchy as `obvhs` makes it in `build_cwbvh`, but where that would take for ever.
pub(super) async fn wide(boxes: &[Aabb], build: &BvhBuildParams) -> CwBvh {
    if has_long_chains(boxes, build) {
        return balanced_wide(boxes, build);
    }
    pause().await;
    let mut binary = clustered(boxes, build);
    pause().await;
    ReinsertionOptimizer::default().run(&mut binary, build.reinsertion_batch_ratio, None);
    pause().await;
    converted(&binary, build)
}

/// One that is never deep.
pub(super) fn balanced_wide(boxes: &[Aabb], build: &BvhBuildParams) -> CwBvh {
    converted(&balanced(boxes), build)
}

fn converted(binary: &Bvh2, build: &BvhBuildParams) -> CwBvh {
    bvh2_to_cwbvh(binary, build.max_prims_per_leaf.clamp(1, 3), true, false)
}

/// Locally ordered clustering (Meister and Bittner 2018).
pub(super) fn clustered(boxes: &[Aabb], build: &BvhBuildParams) -> Bvh2 {
    PlocBuilder::with_capacity(boxes.len()).build(
        build.ploc_search_distance,
        boxes,
        (0..boxes.len() as u32).collect(),
        build.sort_precision,
        build.search_depth_threshold,
    )
}

/// Whether clustering takes about a pass for each box, instead of some twenty in all: each pass joins boxes that are each
/// other's best partner, and boxes that are nested or equal form chains of which only the end joins. Found out from a part
/// of the boxes.
pub(super) fn has_long_chains(boxes: &[Aabb], build: &BvhBuildParams) -> bool {
    const BLOCK: usize = 512;
    const STRIDE: usize = 8;
    if boxes.len() < 4 * BLOCK {
        return false;
    }
    let order = along_curve(boxes);
    order.chunks(BLOCK).step_by(STRIDE).any(|block| {
        let block: Vec<Aabb> = block.iter().map(|&i| boxes[i as usize]).collect();
        is_long(&clustered(&block, build))
    })
}

/// Whether there were far more passes than usual: above this, `obvhs` notes how many.
pub(super) fn is_long(clustered: &Bvh2) -> bool {
    clustered.max_depth > DEFAULT_MAX_STACK_DEPTH
}

/// The boxes' indices in the order of their centres along Morton's curve.
fn along_curve(boxes: &[Aabb]) -> Vec<u32> {
    let centers = || boxes.iter().map(|b| DVec3::from(b.center().to_array().map(f64::from)));
    let low = centers().fold(DVec3::INFINITY, DVec3::min);
    let size = centers().fold(DVec3::NEG_INFINITY, DVec3::max) - low;
    // Codes are of what is below 1.
    let cells = size.map(|s| if s > 0.0 { (1.0 - 1e-9) / s } else { 0.0 });
    let codes = centers().map(|center| morton_encode_u64_unorm(((center - low) * cells).to_array().into()));
    let mut order: Vec<(u64, u32)> = codes.zip(0..).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, index)| index).collect()
}

/// Halves, halves of these and so on along Morton's curve (Lauterbach et al. 2009, but for where it is cut): not the best
/// hierarchy, but made in the same time whatever the boxes, and never deep.
fn balanced(boxes: &[Aabb]) -> Bvh2 {
    let order = along_curve(boxes);
    let mut nodes = vec![Bvh2Node::default(); 2 * boxes.len() - 1];
    // Nodes that wait, with their share of the order; children come in pairs after their parents.
    let mut waiting = vec![(0, 0..order.len())];
    let mut next = 1;
    while let Some((node, range)) = waiting.pop() {
        if range.len() == 1 {
            let index = order[range.start];
            nodes[node] = Bvh2Node::new(boxes[index as usize], 1, index);
            continue;
        }
        nodes[node] = Bvh2Node::new(Aabb::empty(), 0, next as u32);
        let middle = range.start + range.len() / 2;
        waiting.extend([(next, range.start..middle), (next + 1, middle..range.end)]);
        next += 2;
    }
    for node in (0..nodes.len()).rev() {
        if nodes[node].prim_count == 0 {
            let first = nodes[node].first_index as usize;
            let aabb = nodes[first].aabb().union(nodes[first + 1].aabb());
            nodes[node].set_aabb(aabb);
        }
    }
    let primitive_indices = (0..boxes.len() as u32).collect();
    Bvh2 { nodes, primitive_indices, children_are_ordered_after_parents: true, ..Bvh2::default() }
}

/// Levels of a hierarchy.
pub(super) fn depth(bvh: &CwBvh) -> usize {
    let mut level: Vec<usize> = if bvh.nodes.is_empty() { Vec::new() } else { vec![0] };
    let mut depth = 0;
    while !level.is_empty() {
        depth += 1;
        level = level
            .iter()
            .flat_map(|&i| {
                let node = &bvh.nodes[i];
                (0..node.imask.count_ones() as usize).map(move |child| node.child_base_idx as usize + child)
            })
            .collect();
    }
    depth
}
