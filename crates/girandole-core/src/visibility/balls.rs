//! What static blockers leave of lights to a ball about a small object holds for all receivers on it: these start from there, which is
//! cheaper than to test each from the start.

use super::State;
use super::blockers::BlockerNode;
use super::clusters::{Cluster, ClusterTree};
use super::cones::{ConeBase, ShadowCone, Sphere};
use super::light_points::LightPoint;
use super::node_visibility::{Entry, NodeVisibility, SceneContext};
use super::primitives::Tolerance;
use super::pyramid::{Occlusion, Tests};
use super::shadows::{Bounds, Shadow};
use super::shapes::Apex;
use super::sources::Sources;
use super::surfaces::Surfaces;
use crate::scene::NONE;
use glam::DVec3;

/// Radius of what is small, as a share of the extent that surfaces of the scene have, at most.
const LARGEST: f64 = 0.05;

/// Whether what has this radius is small.
pub(super) fn is_small(surfaces: &Surfaces, radius: f64) -> bool {
    radius <= LARGEST * surfaces.typical_extent
}

/// What static blockers leave to a ball about these receivers, if they are small, and the tests made.
pub(super) fn visibility_about(context: &SceneContext, sources: &Sources) -> Option<(NodeVisibility, Tests)> {
    let (sphere, half) = bounds_of(context.surfaces, sources)?;
    let is_small = sphere.radius > 0.0 && is_small(context.surfaces, sphere.radius);
    is_small.then(|| Ball::new(context, sphere, half).visibility())
}

/// A ball that receivers are in, or the part of one that is in a box about the same middle.
struct Ball<'a> {
    context: &'a SceneContext<'a>,
    /// With room for ray origins.
    sphere: Sphere,
    half_extent: DVec3,
    base: ConeBase,
    tolerance: Tolerance,
}

impl<'a> Ball<'a> {
    fn new(context: &'a SceneContext, sphere: Sphere, half_extent: DVec3) -> Self {
        let (low, high) = (sphere.center - sphere.radius, sphere.center + sphere.radius);
        let tolerance = context.surfaces.tolerance.within(low, high);
        let sphere = Sphere { radius: sphere.radius + tolerance.room(), ..sphere };
        let base = ConeBase::of_sphere(sphere, &tolerance);
        Self { context, sphere, half_extent: half_extent + tolerance.room(), base, tolerance }
    }

    /// For each light, and the tests made.
    fn visibility(&self) -> (NodeVisibility, Tests) {
        let SceneContext { lights, blockers, .. } = *self.context;
        let mut result = NodeVisibility {
            states: vec![State::Unoccluded; lights.len()],
            entries: Vec::with_capacity(lights.len()),
        };
        let (mut open, mut tests) = (Vec::new(), Tests::default());
        for (index, light) in (0..).zip(lights) {
            let state = &mut result.states[index as usize];
            tests.boxes += 1;
            let Some(beam) = Shadow::new(&light.apex, &self.sphere) else {
                *state = State::Full;
                continue;
            };
            open.clear();
            open.extend((!blockers.is_empty()).then_some(0));
            let first = result.entries.len();
            let mut search = Search { ball: self, index, light, beam, tests: &mut tests };
            *state = search.run(&mut open, &mut result.entries);
            if *state == State::Unoccluded {
                result.entries.truncate(first);
                // Some of what is in it may face away.
                result.entries.push(Entry::partly_facing(index));
            }
        }
        (result, tests)
    }
}

/// The tests of a ball and a light.
struct Search<'a> {
    ball: &'a Ball<'a>,
    index: u32,
    light: &'a LightPoint,
    /// About all rays.
    beam: Shadow,
    tests: &'a mut Tests,
}

impl Search<'_> {
    /// Traverses the hierarchy of blockers until one blocks a part, and from there on where one may block everything. What is to
    /// be tested for parts of the ball is added to `found`.
    fn run(&mut self, open: &mut Vec<u32>, found: &mut Vec<Entry>) -> State {
        let SceneContext { surfaces, blockers, .. } = *self.ball.context;
        let (first, mut state) = (found.len(), State::Unoccluded);
        while let Some(group) = open.pop() {
            let node: &BlockerNode = &blockers.nodes[group as usize];
            let bounds = Bounds::new(node.low, node.high);
            self.tests.boxes += 1;
            if !self.beam.may_pass(&bounds) {
                continue;
            }
            let may_cover = node.extents[usize::from(self.light.is_outside)] > 0.0;
            if state == State::Partial && !(may_cover && self.beam.has_axis_in(&bounds)) {
                found.push(Entry::new(self.index, group, false));
                continue;
            }
            if node.count == 0 {
                open.extend([node.first + 1, node.first]);
                continue;
            }
            let mut partial = false;
            if node.mesh != NONE {
                let tree = &surfaces.meshes[node.mesh as usize].tree;
                partial = self.meets_cluster(tree, &tree.nodes[node.cluster as usize]);
            } else {
                for &blocker in &blockers.items[node.first as usize..(node.first + node.count) as usize] {
                    match self.occlusion(blocker) {
                        Occlusion::None => {}
                        // The triangle that a light lies on does not block it.
                        Occlusion::Full if self.light.own != blocker => {
                            found.truncate(first);
                            found.push(Entry::new(self.index, group, true));
                            return State::Full;
                        }
                        Occlusion::Full | Occlusion::Partial => partial = true,
                    }
                }
            }
            if partial {
                found.push(Entry::new(self.index, group, false));
                state = State::Partial;
            }
        }
        state
    }

    /// What a blocker does.
    fn occlusion(&mut self, blocker: u32) -> Occlusion {
        let surfaces = self.ball.context.surfaces;
        match surfaces.patches.get(blocker as usize) {
            Some(patch) => {
                self.of_polygon(&patch.corners, (patch.plane.normal, patch.plane.offset), patch.opaque)
            }
            None => {
                let tree = &surfaces.meshes[blocker as usize - surfaces.patches.len()].tree;
                match self.touches(&tree.nodes[0]) {
                    true => Occlusion::Partial,
                    false => Occlusion::None,
                }
            }
        }
    }

    fn touches(&mut self, cluster: &Cluster) -> bool {
        self.tests.blockers += 1;
        ShadowCone::new(&self.light.apex, &self.ball.base).may_touch(&cluster.sphere())
    }

    /// Whether any triangle of a cluster may block something.
    fn meets_cluster(&mut self, tree: &ClusterTree, cluster: &Cluster) -> bool {
        self.touches(cluster)
            && tree.triangles(cluster).iter().any(|corners| {
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
                let plane = (normal, normal.dot(corners[0]));
                normal == DVec3::ZERO || self.of_polygon(corners, plane, false) != Occlusion::None
            })
    }

    /// What a convex polygon, counter-clockwise about its normal, does: by the planes through the light and its edges.
    fn of_polygon(
        &mut self,
        corners: &[DVec3],
        (normal, offset): (DVec3, f64),
        is_opaque: bool,
    ) -> Occlusion {
        self.tests.blockers += 1;
        let Ball { sphere: Sphere { center, radius }, half_extent, tolerance: t, .. } = *self.ball;
        let apex: &Apex = &self.light.apex;
        let height = normal.dot(center) - offset;
        let light = match apex.finite {
            true => normal.dot(apex.position) - offset,
            false => -normal.dot(apex.normal),
        };
        // Its plane separates: ball and light on one side.
        let clear = if apex.finite { t.seam } else { 0.0 };
        let across = radius.min(half_extent.dot(normal.abs()));
        if light >= clear && height - across >= -t.seam || light <= -clear && height + across <= t.seam {
            return Occlusion::None;
        }
        let clear = if apex.finite { t.coordinate } else { 1e-6 };
        if light.abs() < clear {
            return Occlusion::Partial;
        }
        // How much farther apart rays may be at the ball than the polygon's corners are known to.
        let widening = if apex.finite { 1.0 + (height.abs() + radius) / light.abs() } else { 1.0 };
        let (reach, half) = (radius + t.coordinate * widening, half_extent + t.coordinate * widening);
        let sign = 1_f64.copysign(light);
        let mut is_covered = is_opaque && height * sign <= -(radius + t.coordinate);
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            let inward = apex.towards(a).cross(b - a) * sign;
            let distance = inward.dot(center - a);
            let is_near = distance.abs() <= half.dot(inward.abs())
                && distance * distance <= reach * reach * inward.length_squared();
            if distance < 0.0 && !is_near {
                return Occlusion::None;
            }
            is_covered &= distance > 0.0 && !is_near;
        }
        if is_covered { Occlusion::Full } else { Occlusion::Partial }
    }
}

/// A sphere about some receivers, if there are any, and half the extent of a box about the same middle.
fn bounds_of(surfaces: &Surfaces, sources: &Sources) -> Option<(Sphere, DVec3)> {
    let cluster = |&mesh: &u32| &surfaces.meshes[mesh as usize].tree.nodes[0];
    if let Some(cluster) = sources.one_mesh().as_ref().map(cluster) {
        return Some((cluster.sphere(), (cluster.high - cluster.low) * 0.5));
    }
    let meshes = sources.meshes().iter().map(cluster).map(|m| (m.low, m.high));
    let patches = sources.patches().map(|patch| &surfaces.patches[patch as usize]).map(|p| (p.low, p.high));
    let (low, high) = patches.chain(meshes).reduce(|(low, high), (l, h)| (low.min(l), high.max(h)))?;
    Some((Sphere::of_box(low, high), (high - low) * 0.5))
}
