//! Groups of receivers: lights behind all members, and blockers outside the group's pyramid, are culled once for all.

use super::clusters::Cluster;
use super::node_visibility::{NodeContext, NodeVisibility, SceneContext, Workspace};
use super::pyramid::Tests;
use super::shapes::Shape;
use super::surfaces::Surfaces;
use crate::parallel::map;
use crate::scene::NONE;
use glam::DVec3;
use std::sync::Arc;

/// Members of a group without children, at most.
const MAX_MEMBERS: usize = 16;
/// Levels of the tree, at most.
const MAX_DEPTH: u32 = 48;
/// Distance of opposite normals, in extents of the scene.
const NORMAL_SCALE: f64 = 2.0;

/// A side of a simple patch, and whether it is the back.
pub(crate) type PatchSide = (u32, bool);

/// Receivers that face the same way and are near each other.
#[derive(Clone, Debug)]
pub(crate) struct ReceiverGroup {
    /// Of the members' corners, both on the surface and offset like ray origins; its range is into
    /// [`ReceiverGroups::order`].
    pub bounds: Cluster,
    /// The lowest of the members' corners along the axis of `bounds`.
    pub floor: f64,
}

/// A binary tree of groups; the first one holds all sides.
#[derive(Clone, Debug)]
pub(crate) struct ReceiverGroups {
    pub nodes: Vec<ReceiverGroup>,
    /// Indices of sides, group by group.
    pub order: Vec<u32>,
}

impl ReceiverGroups {
    /// Splits at the middle of the widest axis, of normals or of positions.
    pub fn new(surfaces: &Surfaces, sides: &[PatchSide]) -> Self {
        let patch = |side: &PatchSide| &surfaces.patches[side.0 as usize];
        let corners = || sides.iter().map(patch).flat_map(|p| [p.low, p.high]);
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        let scale = (high - low).max_element().max(f64::MIN_POSITIVE).recip();
        let coordinates = |side: &u32| -> [f64; 6] {
            let patch = &surfaces.patches[sides[*side as usize].0 as usize];
            let middle = (patch.low + patch.high - low * 2.0) * (0.5 * scale);
            let normal = normal(surfaces, sides[*side as usize]) * (0.5 * NORMAL_SCALE);
            [middle.x, middle.y, middle.z, normal.x, normal.y, normal.z]
        };
        let mut order: Vec<u32> = (0..sides.len() as u32).collect();
        let mut nodes: Vec<ReceiverGroup> = Vec::new();
        let mut open = vec![(0..order.len(), NONE, 0)];
        while let Some((range, parent, depth)) = open.pop() {
            let index = nodes.len() as u32;
            let members = &mut order[range.clone()];
            let mut group = ReceiverGroup::new(surfaces, sides, members);
            group.bounds.range = range.start as u32..range.end as u32;
            nodes.push(group);
            if parent != NONE {
                let children = &mut nodes[parent as usize].bounds.children;
                let slot = usize::from(children[0] != NONE);
                children[slot] = index;
            }
            let range_of = |axis: usize| {
                let along = members.iter().map(|m| coordinates(m)[axis]);
                along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
            };
            let ranges: [(f64, f64); 6] = std::array::from_fn(range_of);
            let extent = |axis: usize| ranges[axis].1 - ranges[axis].0;
            let axis = (0..6).fold(0, |best, axis| if extent(axis) > extent(best) { axis } else { best });
            let middle = (ranges[axis].0 + ranges[axis].1) * 0.5;
            let is_above = |m: &u32| coordinates(m)[axis] > middle;
            members.sort_unstable_by_key(|m| (is_above(m), *m));
            let below = members.partition_point(|m| !is_above(m));
            if members.len() > MAX_MEMBERS && depth < MAX_DEPTH && below > 0 && below < members.len() {
                open.push((range.start + below..range.end, index, depth + 1));
                open.push((range.start..range.start + below, index, depth + 1));
            }
        }
        Self { nodes, order }
    }

    /// The chosen ones of a group's members.
    fn members<'a>(&'a self, index: u32, chosen: &'a [bool]) -> impl Iterator<Item = u32> + 'a {
        let range = &self.nodes[index as usize].bounds.range;
        let members = &self.order[range.start as usize..range.end as usize];
        members.iter().copied().filter(|&member| chosen[member as usize])
    }
}

/// What is made of chosen sides, group by group: a part of the tree at a time.
#[derive(Clone, Debug)]
pub(super) struct Descent<T> {
    /// By side.
    chosen: Vec<bool>,
    /// Groups that are next, with the visibility of the group above.
    open: Vec<(u32, Option<Arc<NodeVisibility>>)>,
    /// Of sides, in any order.
    pub parts: Vec<(u32, T)>,
    pub tests: Tests,
}

/// What becomes of a group.
struct Visited<T> {
    below: Vec<(u32, Option<Arc<NodeVisibility>>)>,
    parts: Vec<(u32, T)>,
    tests: Tests,
}

impl<T: Send> Descent<T> {
    /// Of sides that are chosen, given what is known of all of them before.
    pub fn new(chosen: Vec<bool>, above: Option<Arc<NodeVisibility>>) -> Self {
        let root = chosen.contains(&true).then_some((0, above));
        Self { chosen, open: root.into_iter().collect(), parts: Vec::new(), tests: Tests::default() }
    }

    pub fn is_done(&self) -> bool {
        self.open.is_empty()
    }

    /// Goes on with so many groups, on all cores.
    pub fn step(
        &mut self,
        groups: &ReceiverGroups,
        (context, most): (&SceneContext, usize),
        build: &(impl Fn(u32, &Arc<NodeVisibility>) -> T + Sync + Send),
    ) {
        let Self { chosen, open, .. } = self;
        let next = open.split_off(open.len().saturating_sub(most));
        let visit = |(index, above): &(u32, Option<Arc<NodeVisibility>>)| {
            groups.visit(*index, (above.as_deref(), chosen), context, build)
        };
        for Visited { below, parts, tests } in map(&next, visit) {
            self.open.extend(below);
            self.parts.extend(parts);
            self.tests += tests;
        }
    }
}

impl ReceiverGroups {
    fn visit<T: Send>(
        &self,
        index: u32,
        (above, chosen): (Option<&NodeVisibility>, &[bool]),
        context: &SceneContext,
        build: &(impl Fn(u32, &Arc<NodeVisibility>) -> T + Sync + Send),
    ) -> Visited<T> {
        let group = &self.nodes[index as usize];
        let mut workspace = Workspace::new();
        let node = NodeContext::default();
        let visibility =
            Arc::new(context.visibility_by_groups(Shape::Group(group), node, above, &mut workspace));
        let tests = workspace.scratch.tests;
        let children = group.bounds.children;
        if children[0] == NONE {
            let members: Vec<u32> = self.members(index, chosen).collect();
            let parts = map(&members, |&member| (member, build(member, &visibility)));
            return Visited { below: Vec::new(), parts, tests };
        }
        let has_chosen = |child: &u32| self.members(*child, chosen).next().is_some();
        let below = children.into_iter().filter(has_chosen).map(|child| (child, Some(visibility.clone())));
        Visited { below: below.collect(), parts: Vec::new(), tests }
    }
}

impl ReceiverGroup {
    fn new(surfaces: &Surfaces, sides: &[PatchSide], members: &[u32]) -> Self {
        let normals = || members.iter().map(|m| normal(surfaces, sides[*m as usize]));
        let axis = normals().sum::<DVec3>().normalize_or_zero();
        let cosine = normals().map(|n| n.dot(axis)).fold(1.0, f64::min);
        let corners =
            || members.iter().flat_map(|m| &surfaces.patches[sides[*m as usize].0 as usize].corners);
        // On the surface, to decide what faces a light, and offset, to enclose the rays.
        let points = || {
            members.iter().flat_map(|m| {
                let side = sides[*m as usize];
                let patch = &surfaces.patches[side.0 as usize];
                let ray_offset = surfaces.tolerance.within(patch.low, patch.high).ray_offset;
                let offset = normal(surfaces, side) * ray_offset;
                patch.corners.iter().flat_map(move |c| [*c, *c + offset])
            })
        };
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
        let center = (low + high) * 0.5;
        let angle = if axis == DVec3::ZERO { std::f64::consts::PI } else { libm::acos(cosine) };
        let bounds = Cluster {
            center,
            radius: points().map(|p| p.distance(center)).fold(0.0, f64::max),
            low,
            high,
            axis,
            angle,
            angle_sine_cosine: Cluster::sine_cosine(angle),
            area: 0.0,
            range: 0..0,
            children: [NONE; 2],
        };
        Self { bounds, floor: corners().map(|c| axis.dot(*c)).fold(f64::INFINITY, f64::min) }
    }
}

fn normal(surfaces: &Surfaces, (simple, back): PatchSide) -> DVec3 {
    surfaces.patches[simple as usize].plane.normal * if back { -1.0 } else { 1.0 }
}
