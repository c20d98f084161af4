//! The scene's surfaces: simple patches, and trees of clusters of all other triangles.

use super::VisibilitySettings;
use super::clusters::ClusterTree;
use super::primitives::{Tolerance, area_vector};
use super::shapes::PatchPlane;
use crate::parallel::{in_slices, map};
use crate::scene::{Geometry, NONE, ObjectRange, Scene, WorldPatch};
use crate::slices::{complete, pause};
use glam::DVec3;
use std::ops::Range;

/// Objects whose meshes are looked at in a slice, on each core.
const SLICE: usize = 64;
/// Corners of a patch that is treated as a polygon, at most.
const MAX_OUTLINE_CORNERS: usize = 64;
/// Area of a triangle that is treated as a polygon, as a share of the square of [`Geometry::surface_extent`], at least.
const MIN_AREA: f64 = 5e-3;
/// Largest difference of the unit normals of a patch and of its triangles.
pub(crate) const MAX_TILT: f64 = 1e-5;

/// Clusters that are visited to find whether a mesh is convex, at most.
const MAX_VISITS: u32 = 1 << 21;

/// A planar convex patch, or a large triangle that is part of none.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SimplePatch {
    /// Index into [`Geometry::patches`], or [`NONE`].
    pub patch: u32,
    pub object: u32,
    /// Its triangles in [`Geometry::triangles`].
    pub triangles: Range<u32>,
    /// Counter-clockwise about the plane's normal.
    pub corners: Vec<DVec3>,
    pub plane: PatchPlane,
    pub double_sided: bool,
    /// Whether its triangles fill the outline and have no holes.
    pub opaque: bool,
    /// Whether light passes it everywhere.
    pub transparent: bool,
    pub area: f64,
    /// Greatest distance of two corners.
    pub extent: f64,
    pub low: DVec3,
    pub high: DVec3,
}

/// The triangles of an object that belong to no simple patch.
#[derive(Clone, Debug)]
pub(crate) struct MeshPart {
    pub object: u32,
    pub tree: ClusterTree,
    /// Whether no ray from its front intersects it again.
    pub convex: bool,
    /// Whether light passes all of it.
    pub transparent: bool,
}

/// All surfaces of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Surfaces {
    pub patches: Vec<SimplePatch>,
    pub meshes: Vec<MeshPart>,
    pub tolerance: Tolerance,
    /// See [`Geometry::surface_extent`], metres.
    pub typical_extent: f64,
}

impl Surfaces {
    pub fn new(scene: &Scene, geometry: &Geometry, settings: &VisibilitySettings) -> Self {
        complete(Self::in_slices(scene, geometry, settings))
    }

    /// The same with pauses.
    pub async fn in_slices(scene: &Scene, geometry: &Geometry, settings: &VisibilitySettings) -> Self {
        let finder = Finder::new(scene, geometry, settings);
        let mut patches: Vec<SimplePatch> =
            geometry.objects.iter().flat_map(|object| finder.patches(object)).collect();
        pause().await;
        // The largest ones, in the geometry's order.
        if patches.len() > settings.most_patches as usize {
            patches.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.triangles.start.cmp(&b.triangles.start)));
            patches.truncate(settings.most_patches as usize);
            patches.sort_by_key(|p| p.triangles.start);
        }
        let mut rest = &patches[..];
        let objects: Vec<(u32, &[SimplePatch])> = (0..geometry.objects.len() as u32)
            .map(|object| {
                let count = rest.iter().take_while(|p| p.object == object).count();
                let (own, others) = rest.split_at(count);
                rest = others;
                (object, own)
            })
            .collect();
        let mesh = |index: usize| {
            let (object, patches) = objects[index];
            finder.mesh(object, patches)
        };
        let meshes = in_slices(objects.len(), SLICE, mesh).await;
        pause().await;
        let meshes = meshes.into_iter().flatten().collect();
        let typical_extent = f64::from(geometry.surface_extent());
        Self { patches, meshes, tolerance: finder.tolerance, typical_extent }
    }

    /// Finds the surfaces of these objects in other places, all others being where they were. `false` where surfaces come or
    /// go: then nothing is changed.
    pub fn follow(
        &mut self,
        scene: &Scene,
        geometry: &Geometry,
        settings: &VisibilitySettings,
        moved: impl Fn(u32) -> bool,
    ) -> bool {
        // Which patches are the largest may change.
        if self.patches.len() >= settings.most_patches as usize {
            let all = Self::new(scene, geometry, settings);
            let are_these = all.are_those_of(self);
            if are_these {
                *self = all;
            }
            return are_these;
        }
        let finder = Finder::new(scene, geometry, settings);
        let objects: Vec<u32> = (0..geometry.objects.len() as u32).filter(|&o| moved(o)).collect();
        let found = map(&objects, |&object| {
            let patches = finder.patches(&geometry.objects[object as usize]);
            let mesh = finder.mesh(object, &patches);
            (patches, mesh)
        });
        let (patches, meshes): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        let new = Self {
            patches: patches.into_iter().flatten().collect(),
            meshes: meshes.into_iter().flatten().collect(),
            ..*self
        };
        let mut old_patches: Vec<&mut SimplePatch> =
            self.patches.iter_mut().filter(|p| moved(p.object)).collect();
        let mut old_meshes: Vec<&mut MeshPart> = self.meshes.iter_mut().filter(|m| moved(m.object)).collect();
        let same_patches =
            old_patches.iter().map(|p| p.identity()).eq(new.patches.iter().map(SimplePatch::identity));
        let same_meshes =
            old_meshes.iter().map(|m| m.identity()).eq(new.meshes.iter().map(MeshPart::identity));
        if same_patches && same_meshes {
            for (old, new) in old_patches.iter_mut().zip(new.patches) {
                **old = new;
            }
            for (old, new) in old_meshes.iter_mut().zip(new.meshes) {
                **old = new;
            }
        }
        same_patches && same_meshes
    }

    /// Whether they are the same surfaces in other places.
    fn are_those_of(&self, other: &Self) -> bool {
        self.patches.iter().map(SimplePatch::identity).eq(other.patches.iter().map(SimplePatch::identity))
            && self.meshes.iter().map(MeshPart::identity).eq(other.meshes.iter().map(MeshPart::identity))
    }
}

impl MeshPart {
    /// What it still is in another place.
    fn identity(&self) -> (u32, usize) {
        (self.object, self.tree.order.len())
    }
}

/// Finds the surfaces of one object.
struct Finder<'a> {
    scene: &'a Scene,
    geometry: &'a Geometry,
    tolerance: Tolerance,
    /// Extent of a simple patch, metres, and area of a triangle that is one, m², at least.
    least: (f64, f64),
}

impl<'a> Finder<'a> {
    fn new(scene: &'a Scene, geometry: &'a Geometry, settings: &VisibilitySettings) -> Self {
        let typical = f64::from(geometry.surface_extent());
        let least = (typical * f64::from(settings.least_extent), typical * typical * MIN_AREA);
        Self { scene, geometry, tolerance: Tolerance::new(geometry), least }
    }

    /// An object's simple patches, in the geometry's order.
    fn patches(&self, object: &ObjectRange) -> Vec<SimplePatch> {
        let Self { scene, geometry, tolerance, least: (extent, area) } = self;
        let mut patches: Vec<SimplePatch> = object
            .patches
            .clone()
            .filter_map(|i| {
                let WorldPatch { outline, triangles, .. } = &geometry.patches[i as usize];
                let corners = outline.iter().map(|p| p.as_dvec3()).collect();
                SimplePatch::new(scene, geometry, (corners, triangles.clone()), i, *extent, tolerance)
            })
            .collect();
        // Large triangles that are part of none.
        for triangle in other_triangles(object, &patches) {
            if f64::from(geometry.area(triangle)) >= *area {
                let corners = geometry.corners(triangle).map(|p| p.as_dvec3()).to_vec();
                let range = triangle..triangle + 1;
                patches.extend(SimplePatch::new(scene, geometry, (corners, range), NONE, *extent, tolerance));
            }
        }
        patches.sort_by_key(|p| p.triangles.start);
        patches
    }

    /// All of an object that is not in these patches, if there is anything.
    fn mesh(&self, object: u32, patches: &[SimplePatch]) -> Option<MeshPart> {
        let triangles = other_triangles(&self.geometry.objects[object as usize], patches);
        if triangles.is_empty() {
            return None;
        }
        let tree = ClusterTree::new(self.scene, self.geometry, &triangles);
        let convex = is_convex(self.scene, self.geometry, &tree, &self.tolerance);
        let transparent = triangles.iter().all(|&t| self.geometry.is_transparent(self.scene, t));
        Some(MeshPart { object, tree, convex, transparent })
    }
}

/// The triangles of an object that are in none of its patches.
fn other_triangles(object: &ObjectRange, patches: &[SimplePatch]) -> Vec<u32> {
    let first = object.triangles.start;
    let mut simple = vec![false; object.triangles.len()];
    for triangle in patches.iter().flat_map(|p| p.triangles.clone()) {
        simple[(triangle - first) as usize] = true;
    }
    object.triangles.clone().filter(|t| !simple[(t - first) as usize]).collect()
}

impl SimplePatch {
    /// What it still is in another place.
    fn identity(&self) -> (u32, u32, Range<u32>, bool) {
        (self.patch, self.object, self.triangles.clone(), self.double_sided)
    }

    /// The patch, unless it is too small, not planar and convex enough, or not exactly filled by its triangles.
    fn new(
        scene: &Scene,
        geometry: &Geometry,
        (corners, triangles): (Vec<DVec3>, Range<u32>),
        patch: u32,
        least_extent: f64,
        tolerance: &Tolerance,
    ) -> Option<Self> {
        if corners.len() < 3 || corners.len() > MAX_OUTLINE_CORNERS {
            return None;
        }
        let first = &geometry.triangles[triangles.start as usize];
        let (object, material) = (first.object, first.material);
        let extent = corners.iter().flat_map(|a| corners.iter().map(move |b| a.distance(*b)));
        let extent = extent.fold(0.0, f64::max);
        let vector = area_vector(&corners);
        let area = vector.length();
        if extent < least_extent || area.is_nan() || area <= extent * 10.0 * tolerance.coordinate {
            return None;
        }
        let normal = vector / area;
        let offset = corners.iter().map(|c| normal.dot(*c)).sum::<f64>() / corners.len() as f64;
        let mut plane = PatchPlane { normal, offset, tilt: 0.0 };
        // All vertices in the plane and within the outline.
        let slack = tolerance.coordinate * 0.5;
        let edges: Vec<(DVec3, f64)> = (0..corners.len())
            .map(|i| {
                let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
                let inward = normal.cross(b - a).normalize_or_zero();
                (inward, inward.dot(a))
            })
            .collect();
        let fits = |p: DVec3| {
            (normal.dot(p) - offset).abs() <= slack && edges.iter().all(|(m, d)| m.dot(p) - d >= -slack)
        };
        let mut filled = 0.0;
        let mut within = corners.iter().all(|&c| fits(c));
        for triangle in triangles.clone() {
            let points = geometry.corners(triangle).map(|p| p.as_dvec3());
            within &= points.into_iter().all(fits);
            filled += area_vector(&points).dot(normal);
            plane.tilt = plane.tilt.max((geometry.normal(triangle).as_dvec3() - normal).length());
        }
        if !within || plane.tilt > MAX_TILT || plane.tilt.is_nan() {
            return None;
        }
        let material = &scene.materials[material];
        Some(Self {
            patch,
            object,
            triangles,
            low: corners.iter().copied().fold(DVec3::INFINITY, DVec3::min),
            high: corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max),
            corners,
            plane,
            double_sided: material.double_sided,
            transparent: material.is_transparent(),
            opaque: material.alpha_cutoff.is_none()
                && !material.is_transparent()
                && (filled - area).abs() <= extent * slack,
            area,
            extent,
        })
    }
}

/// Whether all of a mesh's triangles lie behind the plane of each of them, so that no ray that leaves one from its front
/// intersects another. The search is limited: `false` for many triangles that are nearly in one plane.
fn is_convex(scene: &Scene, geometry: &Geometry, tree: &ClusterTree, tolerance: &Tolerance) -> bool {
    let mut visits = MAX_VISITS;
    tree.order.iter().zip(&tree.corners).all(|(&t, corners)| {
        let normal = geometry.normal(t).as_dvec3();
        let least = corners.iter().map(|c| normal.dot(*c)).fold(f64::INFINITY, f64::min);
        let double_sided = scene.materials[geometry.triangles[t as usize].material].double_sided;
        !double_sided && tree.extends_beyond(normal, least + tolerance.ray_offset, &mut visits) == Some(false)
    })
}
