//! What rays are traced against.

use super::SceneTracer;
use crate::generation::Generation;
use crate::scene::{Geometry, ObjectRange, Scene};
use glam::{DVec3, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh};
use obvhs::ploc::PlocBuilder;
use obvhs::{Boundable, BvhBuildParams};
use std::sync::Arc;

/// How much larger boxes are in the hierarchy's space, on each side.
pub(super) const MARGIN: f32 = 1e-6;
/// Levels of a hierarchy that the traversal's stack of 32 has room for.
pub(super) const MAX_DEPTH: usize = 31;

/// A hierarchy over some of a scene's triangles.
pub(super) struct Hierarchy {
    pub bvh: CwBvh,
    /// The triangles in the hierarchy's order, `group` to a leaf.
    leaves: Vec<Leaf>,
    pub group: usize,
}

/// A triangle where the traversal finds it.
pub(super) struct Leaf {
    pub corners: [Vec3; 3],
    pub triangle: u32,
    pub masked: bool,
}

struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Hierarchy {
    /// Over these triangles.
    pub fn new(scene: &Scene, geometry: &Geometry, triangles: Vec<u32>, build: &BvhBuildParams) -> Self {
        let scale = scale(geometry);
        let bounds = |triangles: &[u32]| {
            let corners = triangles.iter().flat_map(|&i| geometry.corners(i));
            let corners: Vec<Vec3A> = corners.map(|p| (p.as_dvec3() * scale).as_vec3a()).collect();
            let mut aabb = Aabb::from_points(&corners);
            aabb.min -= Vec3A::splat(MARGIN);
            aabb.max += Vec3A::splat(MARGIN);
            Bounds(aabb)
        };
        // Many equal boxes can make a hierarchy deeper than its traversal's stack. Then neighbours in the list share a leaf,
        // enough of them that it fits.
        let mut group = 1;
        let mut bvh = CwBvh::default();
        if !triangles.is_empty() {
            bvh = tree(&triangles.chunks(group).map(bounds).collect::<Vec<_>>(), build);
            while depth(&bvh) >= MAX_DEPTH {
                group *= 4;
                bvh = tree(&triangles.chunks(group).map(bounds).collect::<Vec<_>>(), build);
            }
        }
        let leaves = bvh
            .primitive_indices
            .iter()
            .flat_map(|&chunk| {
                // The last chunk is padded with its last triangle, which changes no result.
                let last = triangles.len() - 1;
                let triangles = &triangles;
                (0..group).map(move |i| triangles[(chunk as usize * group + i).min(last)])
            })
            .map(|triangle| {
                let material = geometry.triangles[triangle as usize].material;
                Leaf {
                    corners: geometry.corners(triangle),
                    triangle,
                    masked: scene.materials[material as usize].alpha_cutoff.is_some(),
                }
            })
            .collect();
        Self { bvh, leaves, group }
    }

    /// Whether it has no triangles.
    pub fn is_empty(&self) -> bool {
        self.leaves.is_empty()
    }

    /// The triangles of a leaf.
    #[inline]
    pub fn leaf(&self, slot: usize) -> &[Leaf] {
        &self.leaves[slot * self.group..(slot + 1) * self.group]
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
            Arc::new(Hierarchy::new(scene, geometry, triangles, &BvhBuildParams::medium_build()))
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

/// Builds as `obvhs` does in `build_cwbvh`, which would panic where the result is too deep.
fn tree(boxes: &[Bounds], build: &BvhBuildParams) -> CwBvh {
    let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
        build.ploc_search_distance,
        boxes,
        (0..boxes.len() as u32).collect(),
        build.sort_precision,
        build.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut binary, build.reinsertion_batch_ratio, None);
    bvh2_to_cwbvh(&binary, build.max_prims_per_leaf.clamp(1, 3), true, false)
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
