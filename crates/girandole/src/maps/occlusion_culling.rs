//! What one static polygon hides from a light: its map shows nothing of it, and it is left out. Of static occluders that is found by the
//! cluster; of dynamic objects, as a whole, by visibility determination: what they do there changes no map of that light.

use super::bounds::{Bounds, BoundsTree};
use crate::layout::Light;
use crate::parallel::in_order;
use girandole_core::glam::Vec3;
use girandole_core::scene::{Object, ObjectId, Scene, WorldPatch};
use girandole_core::visibility::VisibilityDatabase;
use std::ops::Range;

/// Polygons that are tried for a light, those that hide most from it, of the largest ones.
const TRIED: usize = 32;
const MOST: usize = 1024;
/// So many neighbours are hidden together or count as seen.
const FEW: usize = 4;
/// Clusters of a scene at most: with more, what is kept for each light takes too much room.
const MOST_CLUSTERS: usize = 1 << 16;
/// Lights for which one thread looks, at least, with one store for what it looks at.
const RUN: usize = 16;
/// How far inside of a polygon's shadow a cluster has to be, as a share of its distance from the light: far more than rounding.
const MARGIN: f32 = 1e-4;
/// How far from a polygon's plane a light has to be, as a share of the polygon's extent.
const GRAZING: f32 = 1e-3;

/// What static polygons hide of static clusters from lights, found when it is first asked for.
#[derive(Default)]
pub(crate) struct OcclusionCulling {
    /// The largest first.
    polygons: Vec<Polygon>,
    /// Of each kind of clusters.
    trees: [BoundsTree; 2],
    lights: Vec<HiddenClusters>,
}

/// What is hidden from a light, of each kind.
#[derive(Clone, Default)]
struct HiddenClusters {
    /// What it was found for.
    place: Option<[Vec3; 2]>,
    clusters: [Vec<Range<usize>>; 2],
}

impl OcclusionCulling {
    /// By polygons that are drawn into all maps, wherever light is.
    pub fn new<'a>(patches: impl Iterator<Item = &'a WorldPatch>, clusters: [&[Bounds]; 2]) -> Self {
        let mut polygons: Vec<Polygon> = patches.map(Polygon::new).collect();
        polygons.sort_by(|a, b| b.area.total_cmp(&a.area));
        polygons.truncate(MOST);
        let is_searched = clusters.iter().all(|clusters| clusters.len() <= MOST_CLUSTERS);
        let trees = clusters.map(|clusters| BoundsTree::new(if is_searched { clusters } else { &[] }));
        Self { polygons, trees, lights: Vec::new() }
    }

    /// Finds what is hidden from some of these lights, where that is not known.
    pub fn find(&mut self, lights: &[Light], some: impl Iterator<Item = u32>) {
        self.lights.resize(lights.len(), HiddenClusters::default());
        // What is hidden from parallel light is the same wherever its map lies, and from others however they are turned.
        let place = |i: u32| match &lights[i as usize] {
            light if light.is_parallel() => [Vec3::ZERO, light.normal],
            light => [light.position, Vec3::ZERO],
        };
        let is_known = |i: u32| self.lights[i as usize].place == Some(place(i));
        let unknown: Vec<u32> = some.filter(|&light| !is_known(light)).collect();
        let runs: Vec<&[u32]> = unknown.chunks(RUN).collect();
        let found = in_order(&runs, |run| {
            let mut shadows = Shadows::default();
            run.iter().map(|&light| self.hidden(&lights[light as usize], &mut shadows)).collect::<Vec<_>>()
        });
        for (&light, clusters) in unknown.iter().zip(found.into_iter().flatten()) {
            self.lights[light as usize] = HiddenClusters { place: Some(place(light)), clusters };
        }
    }

    /// Static clusters of a kind that are hidden from a light.
    pub fn of_light(&self, light: u32, set: usize) -> &[Range<usize>] {
        self.lights.get(light as usize).map_or(&[], |light| &light.clusters[set])
    }

    fn hidden(&self, light: &Light, shadows: &mut Shadows) -> [Vec<Range<usize>>; 2] {
        shadows.cast(light, &self.polygons);
        let all = (0..shadows.cast.len()).fold(0u32, |mask, i| mask | 1 << i);
        [0, 1].map(|set| {
            let mut hidden: Vec<Range<usize>> = Vec::new();
            // Of the polygons' shadows, those that a range of clusters is partly in.
            self.trees[set].visit(all, &mut |mask, bounds, clusters| {
                let mut partly = 0;
                for i in (0..shadows.cast.len()).filter(|i| mask >> i & 1 == 1) {
                    match shadows.place_of(bounds, i) {
                        Place::Outside => {}
                        Place::Partly => partly |= 1 << i,
                        Place::Inside => {
                            match hidden.last_mut() {
                                Some(last) if last.end == clusters.start => last.end = clusters.end,
                                _ => hidden.push(clusters),
                            }
                            return None;
                        }
                    }
                }
                (partly != 0 && clusters.len() > FEW).then_some(partly)
            });
            hidden
        })
    }
}

/// For each object and light, whether it is dynamic and hidden as a whole; nothing, where that is not known.
#[derive(Clone, Debug, Default)]
pub(crate) struct OccludedObjects(Vec<Vec<bool>>);

impl OccludedObjects {
    pub fn of(scene: &Scene, database: Option<&VisibilityDatabase>) -> Self {
        let Some(database) = database else { return Self::default() };
        let hidden = |(id, object): (usize, &Object)| {
            if object.dynamic && !object.removed { database.hidden_from(id.into()) } else { Vec::new() }
        };
        Self(scene.objects.iter().enumerate().map(hidden).collect())
    }

    pub fn is_hidden(&self, object: ObjectId, light: usize) -> bool {
        self.0.get(object.0 as usize).and_then(|hidden| hidden.get(light)) == Some(&true)
    }
}

struct Polygon {
    outline: Vec<Vec3>,
    normal: Vec3,
    middle: Vec3,
    area: f32,
}

impl Polygon {
    fn new(patch: &WorldPatch) -> Self {
        let outline = patch.outline.clone();
        let fan = outline.windows(2).skip(1).map(|p| (p[0] - outline[0]).cross(p[1] - outline[0]));
        let area = 0.5 * fan.sum::<Vec3>().length();
        let middle = outline.iter().sum::<Vec3>() / outline.len() as f32;
        Self { outline, normal: patch.normal, middle, area }
    }

    /// About how much of what a light sees it covers, in any unit.
    fn covers(&self, light: &Light) -> f32 {
        if light.is_parallel() {
            return self.area * self.normal.dot(light.normal).abs();
        }
        let to = self.middle - light.position;
        self.area * self.normal.dot(to).abs() / to.length().powi(3).max(f32::MIN_POSITIVE)
    }
}

/// What is behind polygons as seen from a light: each one's shadow is a space within planes.
#[derive(Default)]
struct Shadows {
    /// Where each one's distances count from, and its planes.
    cast: Vec<(Vec3, Range<usize>)>,
    /// Unit normals to the inside, and a point of each.
    planes: Vec<[Vec3; 2]>,
    /// How much of what the light sees polygons cover.
    covers: Vec<(f32, usize)>,
}

impl Shadows {
    /// Takes the shadows of those polygons that cover most of what a light sees.
    fn cast(&mut self, light: &Light, polygons: &[Polygon]) {
        self.cast.clear();
        self.planes.clear();
        self.covers.clear();
        self.covers
            .extend(polygons.iter().enumerate().map(|(index, polygon)| (polygon.covers(light), index)));
        if polygons.len() > TRIED {
            self.covers.select_nth_unstable_by(TRIED, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        }
        for at in 0..polygons.len().min(TRIED) {
            self.add(light, &polygons[self.covers[at].1]);
        }
    }

    /// Adds a polygon's shadow, unless the light is nearly in its plane.
    fn add(&mut self, light: &Light, polygon: &Polygon) {
        let Polygon { outline, normal, middle, area } = polygon;
        let (from, height, least) = if light.is_parallel() {
            (*middle, normal.dot(light.normal), GRAZING)
        } else {
            (light.position, normal.dot(*middle - light.position), GRAZING * area.sqrt())
        };
        if height.abs() < least {
            return;
        }
        let first = self.planes.len();
        self.planes.push([*normal * height.signum(), *middle]);
        for (&a, &b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            let ray = if light.is_parallel() { light.normal } else { a - from };
            let Some(across) = ray.cross(b - a).try_normalize() else { return };
            self.planes.push([across * across.dot(*middle - a).signum(), a]);
        }
        self.cast.push((from, first..self.planes.len()));
    }

    fn place_of(&self, bounds: &Bounds, shadow: usize) -> Place {
        let (from, planes) = &self.cast[shadow];
        let margin = MARGIN * bounds.center.distance(*from);
        let mut place = Place::Inside;
        for [normal, point] in &self.planes[planes.clone()] {
            let distance = normal.dot(bounds.center - *point);
            let reach = normal.abs().dot(bounds.half_extent);
            if distance < -reach {
                return Place::Outside;
            }
            if distance < reach + margin {
                place = Place::Partly;
            }
        }
        place
    }
}

/// Where a box is to a shadow.
#[derive(Clone, Copy)]
enum Place {
    Outside,
    Partly,
    Inside,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_constants::{COSINE, DIRECTIONAL};
    use girandole_core::scene::MaterialId;

    /// A wall of 2 m × 2 m about the origin, across the x axis.
    fn wall(clusters: &[Bounds]) -> OcclusionCulling {
        let corner = |y, z| Vec3::new(0.0, y, z);
        let outline = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let patch =
            WorldPatch { object: 0, material: MaterialId(0), outline, normal: Vec3::X, triangles: 0..2 };
        OcclusionCulling::new(std::iter::once(&patch), [clusters, &[]])
    }

    fn hides(light: &Light, center: Vec3) -> bool {
        let at = |center| Bounds { center, half_extent: Vec3::splat(0.1) };
        // Neighbours among others that are far away.
        let mut clusters = vec![at(Vec3::Y * 50.0); 40];
        clusters[10..20].fill(at(center));
        let mut culling = wall(&clusters);
        culling.find(&[Light::default(), *light], std::iter::once(1));
        assert!(culling.of_light(0, 0).is_empty() && culling.of_light(1, 1).is_empty());
        let hidden = culling.of_light(1, 0);
        assert!(hidden.is_empty() || hidden.iter().cloned().flatten().eq(10..20), "{hidden:?}");
        // Where the light moves, it is found again.
        let moved =
            Light { position: light.position + light.normal + Vec3::Y * 99.0, normal: Vec3::Y, ..*light };
        let hidden = hidden.len();
        culling.find(&[Light::default(), moved], std::iter::once(1));
        assert!(culling.of_light(1, 0).is_empty());
        hidden == 1
    }

    #[test]
    fn hidden_is_what_is_wholly_behind_a_polygon() {
        for side in [-1.0, 1.0] {
            let light = Light { position: Vec3::new(-side, 0.0, 0.0), profile: COSINE, ..Light::default() };
            // At a distance of 1 m behind it, the wall's shadow is 4 m across.
            assert!(hides(&light, Vec3::new(side, 0.0, 0.0)));
            assert!(hides(&light, Vec3::new(side, 1.75, -1.75)));
            assert!(!hides(&light, Vec3::new(side, 1.95, 0.0)));
            assert!(!hides(&light, Vec3::new(side, 0.0, -2.5)));
            assert!(!hides(&light, Vec3::new(-0.5 * side, 0.0, 0.0)));
            assert!(!hides(&light, Vec3::new(0.05 * side, 0.0, 0.0)));
            let sun = Light { normal: Vec3::X * side, profile: DIRECTIONAL, ..Light::default() };
            assert!(hides(&sun, Vec3::new(9.0 * side, 0.8, 0.8)));
            assert!(!hides(&sun, Vec3::new(9.0 * side, 1.0, 0.0)));
            assert!(!hides(&sun, Vec3::new(-side, 0.0, 0.0)));
        }
        let in_its_plane = Light { position: Vec3::new(1e-4, 5.0, 0.0), profile: COSINE, ..Light::default() };
        assert!(!hides(&in_its_plane, Vec3::new(-1.0, -1.0, 0.0)));
    }
}
