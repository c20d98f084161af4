//! How many layers of surfaces that let light through a view may need, and in which rows: without a look at the picture, so
//! that a frame never depends on the one before.

use girandole_core::glam::{Vec2, Vec3};
use girandole_core::scene::{Geometry, LocalView, NONE, Scene};
use std::ops::Range;

/// Layers at most; what lies behind that many surfaces that let light through is seen as if there were no more of them.
pub(crate) const MAX_LAYERS: u32 = 8;
/// The view is divided into this many columns and rows.
const TILES: usize = 32;
/// Of more triangles than this it is not found out where they are.
const MOST_TRIANGLES: usize = 1 << 14;

/// The triangles of a scene that let light through.
#[derive(Clone, Debug, Default)]
pub(crate) struct TransparentTriangles {
    triangles: Vec<TransparentTriangle>,
}

#[derive(Clone, Debug)]
struct TransparentTriangle {
    corners: [Vec3; 3],
    /// Those of one plane that do not overlap have the same.
    surface: u32,
    single_sided: bool,
}

/// What a view shows of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct LayersInView {
    pub count: u32,
    /// Of the picture.
    pub rows: Range<u32>,
}

impl TransparentTriangles {
    pub fn new(scene: &Scene, geometry: &Geometry) -> Self {
        let all = (0..).zip(&geometry.triangles);
        let triangles = all.filter(|(index, _)| geometry.is_transparent(scene, *index)).map(|(index, t)| {
            TransparentTriangle {
                corners: geometry.corners(index),
                surface: if t.patch == NONE { geometry.patches.len() as u32 + index } else { t.patch },
                single_sided: !scene.materials[t.material].double_sided,
            }
        });
        Self { triangles: triangles.collect() }
    }

    /// What may be seen of them in a picture of `size`; nothing, if nothing.
    pub fn in_view(&self, view: &LocalView, size: [u32; 2]) -> Option<LayersInView> {
        if self.triangles.len() > MOST_TRIANGLES {
            return Some(LayersInView { count: MAX_LAYERS, rows: 0..size[1] });
        }
        let mut counts = [[0u32; TILES]; TILES];
        let mut last = [[NONE; TILES]; TILES];
        for triangle in &self.triangles {
            let Some([columns, rows]) = triangle.tiles(view, size) else { continue };
            for row in rows {
                for column in columns.clone() {
                    if last[row][column] != triangle.surface {
                        last[row][column] = triangle.surface;
                        counts[row][column] += 1;
                    }
                }
            }
        }
        let is_used = |row: &[u32; TILES]| row.iter().any(|count| *count > 0);
        let first = counts.iter().position(is_used)?;
        let end = counts.iter().rposition(is_used)? + 1;
        let row = |tile: usize| tile as u64 * u64::from(size[1]);
        let rows = (row(first) / TILES as u64) as u32..row(end).div_ceil(TILES as u64) as u32;
        Some(LayersInView { count: counts.into_iter().flatten().max()?.min(MAX_LAYERS), rows })
    }
}

impl TransparentTriangle {
    /// Columns and rows of the tiles that it may touch.
    fn tiles(&self, view: &LocalView, size: [u32; 2]) -> Option<[Range<usize>; 2]> {
        let [a, b, c] = self.corners.map(|p| p - view.eye);
        let towards = if view.orthographic { -view.forward } else { -a };
        // With a margin for edges, on which the GPU may round otherwise.
        let normal = (b - a).cross(c - a);
        if self.single_sided && normal.dot(towards) < -1e-4 * normal.length() * towards.length() {
            return None;
        }
        let depths = [a, b, c].map(|d| if view.orthographic { 1.0 } else { d.dot(view.forward) });
        let (nearest, farthest) =
            (depths[0].min(depths[1]).min(depths[2]), depths[0].max(depths[1]).max(depths[2]));
        if farthest <= 0.0 {
            return None;
        }
        // What reaches behind the eye may be anywhere.
        if nearest <= 1e-3 * farthest {
            return Some([0..TILES, 0..TILES]);
        }
        let points = [a, b, c].map(|d| {
            let depth = if view.orthographic { 1.0 } else { d.dot(view.forward) };
            let across = Vec2::new(d.dot(view.right), d.dot(view.up)) / (view.half_extent * depth);
            (across - view.center) * Vec2::new(0.5, -0.5) + 0.5
        });
        let margin = Vec2::ONE / Vec2::new(size[0] as f32, size[1] as f32);
        let low = points[0].min(points[1]).min(points[2]) - margin;
        let high = points[0].max(points[1]).max(points[2]) + margin;
        if high.cmple(Vec2::ZERO).any() || low.cmpge(Vec2::ONE).any() {
            return None;
        }
        let range = |low: f32, high: f32| {
            let tile = |x: f32| (x.clamp(0.0, 1.0) * TILES as f32) as usize;
            tile(low)..(tile(high) + 1).min(TILES)
        };
        Some([range(low.x, high.x), range(low.y, high.y)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use girandole_core::scene::{Camera, Material, Mesh, Projection, Transform, View};

    /// Panes one behind the other in front of a camera that looks along −z.
    fn panes(depths: &[f32], double_sided: bool) -> (TransparentTriangles, LocalView) {
        let mut scene = Scene::default();
        let glass = Material { blended: true, alpha: 0.5, double_sided, ..Material::default() };
        let material = scene.add_material(glass);
        for &z in depths {
            let mut pane = Mesh::default();
            let corners = [[-1.0, -0.25, z], [1.0, -0.25, z], [1.0, 0.25, z], [-1.0, 0.25, z]];
            pane.add_polygon(&corners.map(Vec3::from), material);
            scene.add_object("pane", pane, Transform::default());
        }
        let geometry = Geometry::new(&scene);
        let node = scene.add_node("eye", Transform::default());
        let camera = Camera {
            name: String::new(),
            node,
            projection: Projection::Perspective { yfov: 1.0 },
            clip: Default::default(),
        };
        let view = View::new(&scene, &camera, 1.0);
        (TransparentTriangles::new(&scene, &geometry), view.relative_to(geometry.origin))
    }

    #[test]
    fn layers_are_counted_where_they_overlap() {
        let (panes_ahead, view) = panes(&[-3.0, -4.0, -5.0], false);
        let seen = panes_ahead.in_view(&view, [320, 320]).expect("panes");
        assert_eq!(seen.count, 3);
        // A band about the middle.
        assert!((120..150).contains(&seen.rows.start) && (170..200).contains(&seen.rows.end), "{seen:?}");
        // Behind the eye.
        let (behind, view) = panes(&[3.0, 4.0], true);
        assert_eq!(behind.in_view(&view, [320, 320]), None);
    }
}
