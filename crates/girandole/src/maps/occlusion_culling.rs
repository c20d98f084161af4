//! Clusters of static occluders that one static polygon hides from a light: its map shows nothing of them, and they are left out.

use super::map_view::Bounds;
use crate::layout::Light;
use girandole_core::glam::Vec3;
use girandole_core::scene::WorldPatch;

/// Polygons that are tried for a light, those that hide most from it, of the largest ones.
const TRIED: usize = 32;
const MOST: usize = 1024;
/// How far inside of a polygon's shadow a cluster has to be, as a share of its distance from the light: far more than rounding.
const MARGIN: f32 = 1e-4;
/// How far from a polygon's plane a light has to be, as a share of the polygon's extent.
const GRAZING: f32 = 1e-3;
/// Neighbours that are looked at together, and such groups.
const GROUP: usize = 16;

/// Boxes about static clusters, about neighbours among them, and about neighbours among those.
#[derive(Default)]
pub(crate) struct ClusterGroups([Vec<Bounds>; 3]);

impl ClusterGroups {
    pub fn new(clusters: &[Bounds]) -> Self {
        let about = |boxes: &[Bounds]| boxes.chunks(GROUP).map(|group| Bounds::about(group.iter())).collect();
        let groups: Vec<Bounds> = about(clusters);
        let above = about(&groups);
        Self([clusters.to_vec(), groups, above])
    }

    /// Whether a whole group of neighbours is within a shadow.
    fn has_hidden(&self, shadow: &Shadow) -> bool {
        let [_, groups, above] = &self.0;
        let members = |group: usize| &groups[group * GROUP..((group + 1) * GROUP).min(groups.len())];
        let touched = (0..above.len()).filter(|group| shadow.touches(&above[*group]));
        touched.flat_map(members).any(|group| shadow.contains(group))
    }
}

/// Static polygons that may hide others, the largest first.
#[derive(Default)]
pub(crate) struct HidingPolygons(Vec<Polygon>);

struct Polygon {
    outline: Vec<Vec3>,
    normal: Vec3,
    middle: Vec3,
    area: f32,
}

impl HidingPolygons {
    /// Of polygons that are drawn into all maps, wherever light is.
    pub fn new<'a>(patches: impl Iterator<Item = &'a WorldPatch>) -> Self {
        let mut polygons: Vec<Polygon> = patches.map(Polygon::new).collect();
        polygons.sort_by(|a, b| b.area.total_cmp(&a.area));
        polygons.truncate(MOST);
        Self(polygons)
    }

    /// A bit for each cluster: whether it is hidden from a light.
    pub fn hidden(&self, light: &Light, clusters: &ClusterGroups) -> Vec<u32> {
        let shadows = self.shadows(light);
        let mut words = vec![0; clusters.0[0].len().div_ceil(32)];
        // Those that hide no group of neighbours would be tried for all that they touch, and gain little.
        let shadows: Vec<&Shadow> = shadows.iter().filter(|shadow| clusters.has_hidden(shadow)).collect();
        for group in 0..clusters.0[2].len() {
            mark(&clusters.0, group, &shadows, &mut words);
        }
        words
    }

    /// Of those polygons that cover most of what a light sees.
    fn shadows(&self, light: &Light) -> Vec<Shadow> {
        let mut covers: Vec<(f32, &Polygon)> = self.0.iter().map(|p| (p.covers(light), p)).collect();
        if covers.len() > TRIED {
            covers.select_nth_unstable_by(TRIED, |a, b| b.0.total_cmp(&a.0));
            covers.truncate(TRIED);
        }
        covers.iter().filter_map(|(_, polygon)| Shadow::new(light, polygon)).collect()
    }
}

/// Marks those of the clusters of a group that are within one of these shadows. The last of the levels is the group's.
fn mark(levels: &[Vec<Bounds>], group: usize, shadows: &[&Shadow], words: &mut [u32]) {
    let Some((bounds, below)) = levels.split_last() else { return };
    if shadows.iter().any(|shadow| shadow.contains(&bounds[group])) {
        let size = GROUP.pow(below.len() as u32);
        for cluster in group * size..((group + 1) * size).min(levels[0].len()) {
            words[cluster / 32] |= 1 << (cluster % 32);
        }
        return;
    }
    let Some(boxes) = below.last() else { return };
    let partly: Vec<&Shadow> = shadows.iter().copied().filter(|s| s.touches(&bounds[group])).collect();
    for member in group * GROUP..((group + 1) * GROUP).min(boxes.len()) {
        if !partly.is_empty() {
            mark(below, member, &partly, words);
        }
    }
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

/// What is behind a polygon as seen from a light: a space within planes.
struct Shadow {
    /// Unit normals to the inside, and a point of each.
    planes: Vec<[Vec3; 2]>,
    /// Where distances count from.
    from: Vec3,
}

impl Shadow {
    /// Nothing, where the light is nearly in the polygon's plane.
    fn new(light: &Light, polygon: &Polygon) -> Option<Self> {
        let Polygon { outline, normal, middle, area } = polygon;
        let (from, height, least) = if light.is_parallel() {
            (*middle, normal.dot(light.normal), GRAZING)
        } else {
            (light.position, normal.dot(*middle - light.position), GRAZING * area.sqrt())
        };
        if height.abs() < least {
            return None;
        }
        let mut planes = vec![[*normal * height.signum(), *middle]];
        for (&a, &b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            let ray = if light.is_parallel() { light.normal } else { a - from };
            let across = ray.cross(b - a).try_normalize()?;
            planes.push([across * across.dot(*middle - a).signum(), a]);
        }
        Some(Self { planes, from })
    }

    fn contains(&self, bounds: &Bounds) -> bool {
        let margin = MARGIN * bounds.center.distance(self.from);
        self.planes.iter().all(|[normal, point]| {
            normal.dot(bounds.center - *point) >= normal.abs().dot(bounds.half_extent) + margin
        })
    }

    fn touches(&self, bounds: &Bounds) -> bool {
        self.planes.iter().all(|[normal, point]| {
            normal.dot(bounds.center - *point) >= -normal.abs().dot(bounds.half_extent)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader_constants::{COSINE, DIRECTIONAL};

    /// A wall of 2 m × 2 m about the origin, across the x axis.
    fn wall() -> HidingPolygons {
        let corner = |y, z| Vec3::new(0.0, y, z);
        let outline = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let patch = WorldPatch { object: 0, material: 0, outline, normal: Vec3::X, triangles: 0..2 };
        HidingPolygons::new(std::iter::once(&patch))
    }

    fn hides(light: &Light, center: Vec3) -> bool {
        let at = |center| Bounds { center, half_extent: Vec3::splat(0.1) };
        // A group of neighbours, and one of them in a group with others that are far away, which is looked at because of the first.
        let mut clusters = vec![at(Vec3::Y * 50.0); 40];
        clusters[32..].fill(at(center));
        clusters[5] = at(center);
        let words = wall().hidden(light, &ClusterGroups::new(&clusters));
        assert!(words == [0; 2] || words == [1 << 5, 255], "{words:?}");
        words[0] != 0
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
