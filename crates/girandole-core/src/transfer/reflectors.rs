//! Small pieces of an object's surface, each with one transfer vector for what it reflects.
//!
//! Vertices do not serve: those in seams and grooves are dark while what lies beside them, and reflects, is not.

use crate::scene::Geometry;
use glam::Vec2;

/// Pieces of an object all of whose triangles are divided.
const PIECES: f32 = 2048.0;
/// The most parts of an edge.
const MOST_PARTS: u32 = 32;
/// How many times smaller than those others pieces may be that something is close to.
const FINER: f32 = 4.0;

/// Triangles, each divided into n² of its shape.
#[derive(Default)]
pub(super) struct Reflectors {
    /// By triangle: its first piece, and the parts of each of its edges.
    triangles: Vec<(usize, u32)>,
    count: usize,
}

impl Reflectors {
    /// `nearest` is, by triangle, how near to it something is that it lights: pieces are no larger than half of that, as far as that is possible.
    pub fn new(geometry: &Geometry, nearest: &[f32]) -> Self {
        let areas = || (0..geometry.triangles.len() as u32).map(|triangle| geometry.area(triangle));
        let largest = (areas().sum::<f32>() / PIECES).sqrt();
        let mut count = 0;
        let triangles = areas()
            .zip(nearest)
            .map(|(area, near)| {
                let size = (near / 2.0).clamp(largest / FINER, largest);
                let parts = ((area.sqrt() / size).ceil() as u32).clamp(1, MOST_PARTS);
                let first = count;
                count += (parts * parts) as usize;
                (first, parts)
            })
            .collect();
        Self { triangles, count }
    }

    pub fn count(&self) -> usize {
        self.count
    }

    /// The piece of a triangle that a point is in.
    pub fn at(&self, triangle: u32, barycentric: Vec2) -> usize {
        let (first, parts) = self.triangles[triangle as usize];
        let scaled = (barycentric * parts as f32).max(Vec2::ZERO);
        let row = (scaled.y as u32).min(parts - 1);
        let column = (scaled.x as u32).min(parts - 1 - row);
        let within = scaled - Vec2::new(column as f32, row as f32);
        let beyond = within.x + within.y > 1.0 && column + row + 1 < parts;
        first + (row * (2 * parts - row) + 2 * column + u32::from(beyond)) as usize
    }

    /// Triangle and barycentric coordinates of the middle of each piece, in their order.
    pub fn middles(&self) -> impl Iterator<Item = (u32, Vec2)> {
        (0..).zip(&self.triangles).flat_map(|(triangle, &(_, parts))| {
            (0..parts).flat_map(move |row| {
                (0..2 * (parts - row) - 1).map(move |place| {
                    let corner = Vec2::new((place / 2) as f32, row as f32);
                    let third = if place % 2 == 0 { 1.0 } else { 2.0 } / 3.0;
                    (triangle, (corner + third) / parts as f32)
                })
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence;
    use crate::scene::builtin::shapes;
    use crate::scene::{Material, MaterialId, Scene, Transform};

    fn sphere() -> Geometry {
        let mut scene = Scene::default();
        scene.add_material(Material::default());
        scene.add_object("", shapes::sphere(1.0, 12, 6, MaterialId(0)), Transform::IDENTITY);
        Geometry::new(&scene)
    }

    #[test]
    fn every_piece_holds_its_middle_and_as_much_of_the_triangle_as_others() {
        let geometry = sphere();
        let reflectors = Reflectors::new(&geometry, &vec![f32::INFINITY; geometry.triangles.len()]);
        assert!(reflectors.count() > geometry.triangles.len(), "some are divided");
        for (index, (triangle, middle)) in reflectors.middles().enumerate() {
            assert_eq!(reflectors.at(triangle, middle), index);
        }
        assert_eq!(reflectors.middles().count(), reflectors.count());
        let triangle =
            (0..).find(|t| reflectors.triangles[*t as usize].1 > 2).expect("three parts of an edge");
        let (first, parts) = reflectors.triangles[triangle as usize];
        let mut hits = vec![0; (parts * parts) as usize];
        let count = 4096 * parts * parts;
        for i in 0..count {
            let mut at = Vec2::new(sequence::sample(i, 0, 1), sequence::sample(i, 1, 1));
            if at.x + at.y > 1.0 {
                at = 1.0 - at;
            }
            hits[reflectors.at(triangle, at) - first] += 1;
        }
        assert!(hits.iter().all(|hits| (3900..4300).contains(hits)), "{hits:?}");
        // Corners, and what rounding puts beside them, are in pieces too.
        for corner in [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::new(1.0 + 1e-6, -1e-6), Vec2::new(0.5, 0.5 + 1e-6)]
        {
            assert!((first..first + hits.len()).contains(&reflectors.at(triangle, corner)), "{corner}");
        }
    }

    #[test]
    fn what_something_is_near_to_is_divided_finely_and_nothing_else() {
        let geometry = sphere();
        let mut nearest = vec![f32::INFINITY; geometry.triangles.len()];
        let coarse = Reflectors::new(&geometry, &nearest);
        nearest[7] = 1e-3;
        let fine = Reflectors::new(&geometry, &nearest);
        for (triangle, (before, after)) in coarse.triangles.iter().zip(&fine.triangles).enumerate() {
            let factor = if triangle == 7 { FINER as u32 } else { 1 };
            assert!(after.1 <= before.1 * factor && after.1 + factor > before.1 * factor, "{triangle}");
        }
    }
}
