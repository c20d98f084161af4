//! Blockers, and the bounding volume hierarchy over them.

use super::clusters::Cluster;
use super::cones::{ShadowCone, Sphere};
use super::node_visibility::Workspace;
use super::primitives::box_extent;
use super::pyramid::{Occlusion, Pyramid, Scratch};
use super::shapes::{Apex, PatchPlane};
use super::surfaces::{SimplePatch, Surfaces};
use crate::scene::NONE;
use crate::trace::aabb;
use glam::DVec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Share of the hierarchy's nodes that are reinserted to improve it.
const REINSERTED: f32 = 0.5;

/// A node of the hierarchy of blockers.
#[derive(Clone, Debug)]
pub(crate) struct BlockerNode {
    pub low: DVec3,
    pub high: DVec3,
    /// Number of items, 0 for an inner node.
    pub count: u32,
    /// First item, or first of two children.
    pub first: u32,
    /// The mesh that all of it is part of, or [`NONE`], and its cluster.
    pub mesh: u32,
    pub cluster: u32,
    /// Extent of the largest polygon that may cover a receiver, 0 if there is none: from a light that is not outside, see
    /// [`BlockerTree::is_outside`], and from one that is.
    pub extents: [f64; 2],
}

/// A hierarchy over some of a scene's blockers. They are numbered as the surfaces: patches, then meshes.
#[derive(Clone, Debug, Default)]
pub(crate) struct BlockerTree {
    pub nodes: Vec<BlockerNode>,
    pub items: Vec<u32>,
    /// Planes of opaque polygons, as normal and offset, before which nothing of the hierarchy is.
    outer_planes: Vec<(DVec3, f64)>,
}

impl BlockerTree {
    /// Over nothing.
    pub fn empty() -> Self {
        Self::default()
    }

    /// Over the blockers of the objects for which `accept` is true.
    pub fn new(surfaces: &Surfaces, accept: impl Fn(u32) -> bool) -> Self {
        let all = 0..surfaces.blocker_count();
        let blocks = |&b: &u32| surfaces.blocks(b) && accept(surfaces.blocker_object(b));
        Self::over(surfaces, all.filter(blocks).collect())
    }

    /// Over these blockers.
    pub fn over(surfaces: &Surfaces, blockers: Vec<u32>) -> Self {
        if blockers.is_empty() {
            return Self::empty();
        }
        let bounds: Vec<(DVec3, DVec3)> = blockers.iter().map(|&b| surfaces.blocker_box(b)).collect();
        // The hierarchy is built where the scene's size is about 1.
        let size =
            bounds.iter().map(|(low, high)| low.abs().max(high.abs()).max_element()).fold(0.0, f64::max);
        let scale = if size > 0.0 { 1.0 / size } else { 1.0 };
        let boxes: Vec<Aabb> = bounds
            .iter()
            .map(|(low, high)| {
                let scaled = |p: &DVec3| (*p * scale).as_vec3();
                aabb(scaled(low), scaled(high))
            })
            .collect();
        let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Low,
            &boxes,
            (0..boxes.len() as u32).collect(),
            SortPrecision::U64,
            0,
        );
        ReinsertionOptimizer::default().run(&mut binary, REINSERTED, None);
        let items: Vec<u32> = binary.primitive_indices.iter().map(|&i| blockers[i as usize]).collect();
        let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let nodes: Vec<BlockerNode> = binary
            .nodes
            .iter()
            .map(|n| BlockerNode {
                low: empty.0,
                high: empty.1,
                count: n.prim_count,
                first: n.first_index,
                mesh: NONE,
                cluster: NONE,
                extents: [0.0; 2],
            })
            .collect();
        let mut tree = Self { nodes, items, outer_planes: Vec::new() };
        // Exact bounds.
        for i in tree.leaves_first() {
            let (count, first) = (tree.nodes[i].count, tree.nodes[i].first as usize);
            let joined = |(low, high): (DVec3, DVec3), (l, h): (DVec3, DVec3)| (low.min(l), high.max(h));
            (tree.nodes[i].low, tree.nodes[i].high) = if count == 0 {
                tree.nodes[first..first + 2].iter().map(|n| (n.low, n.high)).fold(empty, joined)
            } else {
                tree.items[first..first + count as usize]
                    .iter()
                    .map(|&b| surfaces.blocker_box(b))
                    .fold(empty, joined)
            };
        }
        tree
    }

    /// All nodes, children before their parents.
    fn leaves_first(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.nodes.len().min(1)).collect();
        let mut next = 0;
        while next < order.len() {
            let node = &self.nodes[order[next]];
            if node.count == 0 {
                order.extend([node.first as usize, node.first as usize + 1]);
            }
            next += 1;
        }
        order.reverse();
        order
    }

    /// Whether anything may lie in front of a plane.
    fn extends_beyond(&self, surfaces: &Surfaces, normal: DVec3, offset: f64) -> bool {
        let mut open = vec![0];
        while let Some(i) = open.pop() {
            let node: &BlockerNode = &self.nodes[i as usize];
            if box_extent(normal, [node.low, node.high]).1 <= offset {
                continue;
            }
            if node.count == 0 {
                open.extend([node.first, node.first + 1]);
                continue;
            }
            let items = &self.items[node.first as usize..(node.first + node.count) as usize];
            let in_front = |b: &u32| match surfaces.patches.get(*b as usize) {
                Some(patch) => patch.corners.iter().any(|c| normal.dot(*c) > offset),
                None => true,
            };
            if items.iter().any(in_front) {
                return true;
            }
        }
        false
    }

    /// The sides of a polygon on which no surface of the hierarchy is, as planes before which nothing is.
    fn empty_sides<'a>(
        &'a self,
        surfaces: &'a Surfaces,
        patch: &'a SimplePatch,
    ) -> impl Iterator<Item = (DVec3, f64)> + 'a {
        [1.0, -1.0].into_iter().filter_map(|sign| {
            let PatchPlane { normal, offset, .. } = patch.plane.turned(sign);
            let offset = offset + surfaces.tolerance.coordinate;
            (!self.extends_beyond(surfaces, normal, offset)).then_some((normal, offset))
        })
    }

    /// Sets the extents of each node from the opaque polygons. A room's walls have nothing on one side: they cover no receiver
    /// unless the light is there, and would raise the extent of every node above them.
    pub fn set_extents(&mut self, surfaces: &Surfaces, has_static_receivers: bool) {
        let mut outer_planes = Vec::new();
        let mut of_item = vec![[0.0; 2]; self.items.len()];
        for (extents, &blocker) in of_item.iter_mut().zip(&self.items) {
            let Some(patch) = surfaces.patches.get(blocker as usize).filter(|p| p.opaque) else { continue };
            *extents = [patch.extent; 2];
            if has_static_receivers {
                let planes = outer_planes.len();
                outer_planes.extend(self.empty_sides(surfaces, patch));
                if outer_planes.len() > planes {
                    extents[0] = 0.0;
                }
            }
        }
        self.outer_planes = outer_planes;
        let joined = |a: [f64; 2], b: &[f64; 2]| [a[0].max(b[0]), a[1].max(b[1])];
        for i in self.leaves_first() {
            let (count, first) = (self.nodes[i].count, self.nodes[i].first as usize);
            self.nodes[i].extents = match count {
                0 => joined(self.nodes[first].extents, &self.nodes[first + 1].extents),
                _ => of_item[first..first + count as usize].iter().fold([0.0; 2], joined),
            };
        }
    }

    /// Whether a light is where nothing of the hierarchy is, behind a wall: only from there that wall may cover a receiver.
    pub fn is_outside(&self, apex: &Apex) -> bool {
        self.outer_planes.iter().any(|(normal, offset)| apex.is_in_front(*normal, *offset))
    }

    /// Over static blockers: with the nodes' extents, and continued down to the clusters of meshes.
    pub fn with_clusters(surfaces: &Surfaces, accept: impl Fn(u32) -> bool) -> Self {
        let mut result = Self::new(surfaces, accept);
        let tree = &mut result;
        tree.set_extents(surfaces, true);
        let mut next = 0;
        while next < tree.nodes.len() {
            let end = tree.nodes.len() as u32;
            let node = &mut tree.nodes[next];
            if node.mesh == NONE && node.count == 1 {
                let blocker = tree.items[node.first as usize];
                if let Some(mesh) = blocker.checked_sub(surfaces.patches.len() as u32) {
                    (node.mesh, node.cluster) = (mesh, 0);
                }
            }
            if node.mesh != NONE {
                let (mesh, item) = (node.mesh, node.first);
                let clusters = &surfaces.meshes[mesh as usize].tree.nodes;
                let children = clusters[node.cluster as usize].children;
                if children[0] != NONE {
                    (node.count, node.first) = (0, end);
                    tree.nodes.extend(children.map(|cluster| {
                        let Cluster { low, high, .. } = clusters[cluster as usize];
                        BlockerNode { low, high, count: 1, first: item, mesh, cluster, extents: [0.0; 2] }
                    }));
                }
            }
            next += 1;
        }
        result
    }

    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Whether the box of anything is near the rays between a receiver and a light.
    pub fn is_near(&self, cone: &ShadowCone, workspace: &mut Workspace) -> bool {
        let Workspace { scratch, stack, .. } = workspace;
        stack.clear();
        stack.push(0);
        while let Some(node) = stack.pop().and_then(|i| self.nodes.get(i as usize)) {
            scratch.tests.boxes += 1;
            if !cone.may_touch(&Sphere::of_box(node.low, node.high)) {
                continue;
            }
            if node.count > 0 {
                return true;
            }
            stack.extend([node.first, node.first + 1]);
        }
        false
    }
}

impl Surfaces {
    pub fn blocker_count(&self) -> u32 {
        (self.patches.len() + self.meshes.len()) as u32
    }

    /// Whether any of it blocks light at all.
    pub fn blocks(&self, index: u32) -> bool {
        match self.patches.get(index as usize) {
            Some(patch) => !patch.transparent,
            None => !self.meshes[index as usize - self.patches.len()].transparent,
        }
    }

    pub fn blocker_object(&self, index: u32) -> u32 {
        match self.patches.get(index as usize) {
            Some(patch) => patch.object,
            None => self.meshes[index as usize - self.patches.len()].object,
        }
    }

    /// The patch blocker that a triangle is part of, or [`NONE`].
    pub fn blocker_of(&self, triangle: u32) -> u32 {
        let index = self.patches.partition_point(|p| p.triangles.end <= triangle);
        let found = self.patches.get(index).is_some_and(|p| p.triangles.contains(&triangle));
        if found { index as u32 } else { NONE }
    }

    pub fn blocker_box(&self, index: u32) -> (DVec3, DVec3) {
        match self.patches.get(index as usize) {
            Some(patch) => (patch.low, patch.high),
            None => {
                let root = &self.meshes[index as usize - self.patches.len()].tree.nodes[0];
                (root.low, root.high)
            }
        }
    }

    pub fn blocker_sphere(&self, index: u32) -> Sphere {
        match self.patches.get(index as usize) {
            Some(patch) => Sphere::of_box(patch.low, patch.high),
            None => self.meshes[index as usize - self.patches.len()].tree.nodes[0].sphere(),
        }
    }

    /// How much of a pyramid a blocker occludes; `own_mesh` is the mesh that the receiver is part of, if any.
    pub fn test(
        &self,
        index: u32,
        pyramid: &mut Pyramid,
        own_mesh: Option<u32>,
        scratch: &mut Scratch,
    ) -> Occlusion {
        if let Some(patch) = self.patches.get(index as usize) {
            return pyramid.test_patch(patch, scratch);
        }
        let mesh = index - self.patches.len() as u32;
        let part = &self.meshes[mesh as usize];
        let intersects = match own_mesh {
            Some(own) if own == mesh => {
                scratch.tests.blockers += 1;
                !part.convex
            }
            _ => pyramid.intersects_tree(&part.tree, scratch),
        };
        if intersects { Occlusion::Partial } else { Occlusion::None }
    }
}
