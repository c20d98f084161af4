//! Which static receivers some views need: those that they may show, whichever way they look, and those that mirrors among these may show.
//! Of all others nothing is determined: rooms that nobody sees cost their boxes.
//!
//! A flat mirror shows what is seen from the eye's mirror image through its plane. Other mirrors may show everything.

use super::blockers::BlockerTree;
use super::cover::Cutter;
use super::database::{StaticReceivers, VisibilityDatabase, is_dynamic};
use super::hierarchy::Frame;
use super::receivers::{Source, cluster_of, patch_shape};
use super::seen::{cut_off, hides};
use super::shapes::{Apex, MAX_CORNERS, PatchPlane, Shape};
use super::sources::{Root, Sources};
use super::surfaces::{MeshPart, SimplePatch, Surfaces};
use crate::parallel::map;
use crate::scene::{Geometry, LocalView, Material, NONE, Scene, View};
use glam::DVec3;

/// Roots that one thread looks at.
const ROOTS: usize = 32;
/// Eyes and their mirror images, in mirrors that show one another too, that are looked from at most: with more everything is needed.
const MOST_EYES: usize = 16;

/// What a root's surface mirrors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mirror {
    No,
    Flat,
    Curved,
}

/// An eye, or its image in mirrors.
#[derive(Clone, Copy)]
struct Eye {
    apex: Apex,
    /// How near to it polygons may be cut off, metres.
    cut: f64,
    /// The plane that it looks through, as normal and offset: what lies behind it is not seen.
    window: Option<(DVec3, f64)>,
}

impl Eye {
    fn of(view: &LocalView) -> Self {
        // Without a normal nothing is behind it.
        let apex = Apex { position: view.eye.as_dvec3(), normal: DVec3::ZERO, finite: true };
        Self { apex, cut: cut_off(view), window: None }
    }

    fn mirrored(&self, plane: (DVec3, f64)) -> Self {
        let (normal, offset) = plane;
        let height = normal.dot(self.apex.position) - offset;
        let position = self.apex.position - normal * (2.0 * height);
        Self { apex: Apex { position, ..self.apex }, cut: 0.0, window: Some(plane) }
    }
}

/// What a scene's surfaces mirror.
#[derive(Clone, Debug, Default)]
pub(super) struct Mirrors {
    /// By material, whether it is smooth.
    materials: Vec<bool>,
    /// By simple patch.
    patches: Vec<Mirror>,
    /// By mesh.
    meshes: Vec<Mirror>,
    /// Those that may show everything.
    curved: Vec<Root>,
}

impl Mirrors {
    pub fn of(scene: &Scene, geometry: &Geometry, surfaces: &Surfaces) -> Self {
        let materials = smooth_materials(scene);
        let is_smooth = |triangle: u32| materials[geometry.triangles[triangle as usize].material.index()];
        let of_patch = |patch: &SimplePatch| match geometry.patches.get(patch.patch as usize) {
            _ if !is_smooth(patch.triangles.start) => Mirror::No,
            Some(of) if geometry.is_flat(scene, of) => Mirror::Flat,
            _ => Mirror::Curved,
        };
        let of_mesh = |mesh: &MeshPart| match mesh.tree.order.iter().any(|&t| is_smooth(t)) {
            true => Mirror::Curved,
            false => Mirror::No,
        };
        let mut result = Self {
            patches: surfaces.patches.iter().map(of_patch).collect(),
            meshes: surfaces.meshes.iter().map(of_mesh).collect(),
            curved: Vec::new(),
            materials,
        };
        let patches = surfaces.patches.iter().zip(0..).flat_map(|(patch, simple)| {
            let sides = if patch.double_sided { [false, true].as_slice() } else { &[false] };
            sides.iter().map(move |&back| (Root::Patch { simple, back }, patch.object))
        });
        let meshes = surfaces.meshes.iter().zip(0..).map(|(mesh, index)| (Root::Mesh(index), mesh.object));
        let shows_everything = |(root, object): &(Root, u32)| match result.of_root(root) {
            Mirror::No => false,
            // It may be anywhere soon.
            Mirror::Flat => is_dynamic(scene, *object),
            Mirror::Curved => true,
        };
        result.curved = patches.chain(meshes).filter(shows_everything).map(|(root, _)| root).collect();
        result
    }

    /// Follows materials that may be rougher or smoother, of surfaces that are the same.
    pub fn follow(&mut self, scene: &Scene, geometry: &Geometry, surfaces: &Surfaces) {
        if self.materials != smooth_materials(scene) {
            *self = Self::of(scene, geometry, surfaces);
        }
    }

    /// Whether anything is smooth.
    fn are_there(&self) -> bool {
        self.patches.iter().chain(&self.meshes).any(|kind| *kind != Mirror::No)
    }

    fn of_root(&self, root: &Root) -> Mirror {
        match *root {
            Root::Patch { simple, .. } => self.patches[simple as usize],
            Root::Mesh(mesh) => self.meshes[mesh as usize],
        }
    }
}

fn smooth_materials(scene: &Scene) -> Vec<bool> {
    scene.materials.iter().map(Material::is_smooth).collect()
}

/// What decides which static receivers a view needs.
pub(super) struct Needs<'a> {
    pub surfaces: &'a Surfaces,
    pub groups: &'a BlockerTree,
    pub sources: &'a Sources,
    pub mirrors: &'a Mirrors,
}

impl Needs<'_> {
    /// For each root, whether a view needs it; all are where there is no view.
    pub fn of(&self, views: &[LocalView]) -> Vec<bool> {
        let mut needed = vec![views.is_empty(); self.sources.roots().len()];
        if !views.iter().all(|view| self.add(view, &mut needed)) {
            needed.fill(true);
        }
        // Both sides of a patch share a grid.
        for (index, root) in self.sources.roots().enumerate() {
            if let Root::Patch { back: true, .. } = root {
                let is_needed = needed[index] || needed[index - 1];
                (needed[index], needed[index - 1]) = (is_needed, is_needed);
            }
        }
        needed
    }

    /// Adds what one view needs; `false` where that is everything.
    fn add(&self, view: &LocalView, needed: &mut [bool]) -> bool {
        let (mut open, mut count) = (vec![Eye::of(view)], 1);
        while let Some(eye) = open.pop() {
            if view.orthographic || self.sees_curved_mirror(&eye) {
                return false;
            }
            let mut planes: Vec<(DVec3, f64)> = Vec::new();
            for index in self.seen(&eye) {
                needed[index] = true;
                let root = self.sources.root(index);
                if self.mirrors.of_root(&root) == Mirror::Flat {
                    self.add_plane(&root, &mut planes);
                }
            }
            count += planes.len();
            if count > MOST_EYES {
                return false;
            }
            open.extend(planes.into_iter().map(|plane| eye.mirrored(plane)));
        }
        true
    }

    fn add_plane(&self, root: &Root, planes: &mut Vec<(DVec3, f64)>) {
        let &Root::Patch { simple, back } = root else { return };
        let PatchPlane { normal, offset, .. } = self.surfaces.patches[simple as usize].plane;
        let (normal, offset) = if back { (-normal, -offset) } else { (normal, offset) };
        let near = self.surfaces.tolerance.side;
        let is_known =
            |(other, at): &(DVec3, f64)| normal.dot(*other) > 1.0 - 1e-9 && (offset - at).abs() < near;
        if !planes.iter().any(is_known) {
            planes.push((normal, offset));
        }
    }

    fn sees_curved_mirror(&self, eye: &Eye) -> bool {
        self.mirrors.curved.chunks(ROOTS).any(|some| {
            let is_seen = |root: &Root| self.is_seen(eye, root, &mut Cutter::new(self.surfaces, self.groups));
            map(some, is_seen).contains(&true)
        })
    }

    /// Roots that static polygons do not hide from an eye.
    fn seen(&self, eye: &Eye) -> Vec<usize> {
        let count = self.sources.roots().len();
        let starts: Vec<usize> = (0..count).step_by(ROOTS).collect();
        let of_some = |start: &usize| -> Vec<usize> {
            let mut cutter = Cutter::new(self.surfaces, self.groups);
            let roots = *start..(start + ROOTS).min(count);
            roots.filter(|&root| self.is_seen(eye, &self.sources.root(root), &mut cutter)).collect()
        };
        map(&starts, of_some).into_iter().flatten().collect()
    }

    fn is_seen(&self, eye: &Eye, root: &Root, cutter: &mut Cutter) -> bool {
        let near = self.surfaces.tolerance.side;
        // Of what is highest along the normal of the window; a mirror does not show itself, nor hide what it shows.
        let reaches_before = |highest: &dyn Fn(DVec3) -> f64| {
            eye.window.is_none_or(|(normal, offset)| highest(normal) > offset + near)
        };
        let reaches = |patch: &SimplePatch| {
            let heights = |normal: DVec3| patch.corners.iter().map(move |corner| normal.dot(*corner));
            reaches_before(&|normal| heights(normal).fold(f64::NEG_INFINITY, f64::max))
        };
        let is_before = |patch: &SimplePatch| {
            let all = |(normal, offset): (DVec3, f64)| {
                patch.corners.iter().all(|c| normal.dot(*c) >= offset - near)
            };
            eye.window.is_none_or(all) && reaches(patch)
        };
        let accept = |_: u32, patch: &SimplePatch| is_before(patch) && hides(patch, &eye.apex, eye.cut);
        match *root {
            Root::Mesh(mesh) => {
                let cluster = cluster_of(self.surfaces, mesh, 0);
                let (middle, half) = ((cluster.low + cluster.high) * 0.5, (cluster.high - cluster.low) * 0.5);
                reaches_before(&|normal| normal.dot(middle) + normal.abs().dot(half))
                    && !cutter.hides(&eye.apex, Shape::Cluster(cluster), accept)
            }
            Root::Patch { simple, back } => {
                let patch = &self.surfaces.patches[simple as usize];
                let mut corners = match patch.corners.len() > MAX_CORNERS {
                    true => Frame::of(patch).around().to_vec(),
                    false => patch.corners.clone(),
                };
                if back {
                    corners.reverse();
                }
                let shape = patch_shape(self.surfaces, simple, back, &corners);
                reaches(patch) && !cutter.hides(&eye.apex, shape, accept)
            }
        }
    }
}

impl VisibilityDatabase {
    /// For each leaf, whether a view may show it, itself ([`VisibilityDatabase::seen_leaves`]) or, if mirrors are asked for, in mirrors; and
    /// whether there are mirrors among those that it shows itself. Of [`LeafKind::Undetermined`](super::LeafKind::Undetermined)
    /// some is shown where the view needs a surface that is not determined.
    pub fn shown_leaves(&self, view: &LocalView, mirrors: bool) -> (Vec<bool>, bool) {
        let mut shown = self.seen_leaves(view);
        let needed = || self.needed_leaves(view);
        let mut known = None;
        if self.has_undetermined_leaf() {
            shown[0] = known.get_or_insert_with(needed)[0];
        }
        let has_mirrors = mirrors && (0..shown.len()).any(|leaf| shown[leaf] && self.is_mirror(leaf as u32));
        if has_mirrors {
            for (shown, is_needed) in shown.iter_mut().zip(known.get_or_insert_with(needed)) {
                *shown |= *is_needed;
            }
        }
        (shown, has_mirrors)
    }

    /// For each leaf, whether it is a part of a static surface that a view needs, in mirrors too, or of a dynamic one; of
    /// [`LeafKind::Undetermined`](super::LeafKind::Undetermined), whether the view needs some surface that is not determined.
    fn needed_leaves(&self, view: &LocalView) -> Vec<bool> {
        let needed = self.needs().of(std::slice::from_ref(view));
        let receivers = self.receivers();
        let mut leaves = vec![true; receivers.leaves.len()];
        for (range, is_needed) in self.static_receivers.roots.iter().zip(&needed) {
            for node in range.clone().into_iter().flatten() {
                if let Some(leaf) = leaves.get_mut(receivers.nodes[node].leaf as usize) {
                    *leaf = *is_needed;
                }
            }
        }
        if let Some(rest) = leaves.first_mut().filter(|_| self.has_undetermined_leaf()) {
            let is_missing = |(range, is_needed): (&Option<_>, &bool)| *is_needed && range.is_none();
            *rest = self.static_receivers.roots.iter().zip(&needed).any(is_missing);
        }
        leaves
    }

    /// Whether a leaf is smooth enough for mirrored rays: what it reflects is sharper than light samples can show. What is not
    /// determined is where anything is.
    pub fn is_mirror(&self, leaf: u32) -> bool {
        let receivers = self.receivers();
        let kind = match receivers.nodes.get(receivers.leaves[leaf as usize].node as usize).map(|n| &n.source)
        {
            Some(Source::Patch { simple, .. }) => self.static_receivers.mirrors.patches[*simple as usize],
            Some(Source::Cluster { mesh, .. }) => self.static_receivers.mirrors.meshes[*mesh as usize],
            None => return self.static_receivers.mirrors.are_there(),
        };
        kind != Mirror::No
    }

    /// Whether the first leaf stands for what is not determined.
    pub(super) fn has_undetermined_leaf(&self) -> bool {
        self.receivers().leaves.first().is_some_and(|leaf| leaf.node == NONE)
    }

    pub(super) fn needs(&self) -> Needs<'_> {
        let Self { surfaces, groups, static_receivers, .. } = self;
        let StaticReceivers { sources, mirrors, .. } = static_receivers;
        Needs { surfaces, groups, sources, mirrors }
    }
}

/// Views relative to a geometry's origin.
pub(super) fn local(views: &[View], geometry: &Geometry) -> Vec<LocalView> {
    views.iter().map(|view| view.relative_to(geometry.origin)).collect()
}
