//! Which pixels something covers, and their border.

use girandole_core::glam::Vec2;
use std::collections::BTreeMap;

/// Pixels that are covered.
pub struct Mask {
    size: [u32; 2],
    covered: Vec<bool>,
    /// Rows that have any of them.
    rows: std::ops::Range<u32>,
}

/// A closed line between covered pixels and others; places as shares of the picture, from the top left corner.
pub struct Border {
    /// The middles of the pixels' edges, in order.
    pub points: Vec<Vec2>,
    /// For each, the middle of the pixel that is covered.
    pub inside: Vec<Vec2>,
}

/// Directions along the edges of pixels, covered ones on the right.
const STEPS: [[i32; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

impl Mask {
    pub fn new([width, height]: [u32; 2]) -> Self {
        let covered = vec![false; width as usize * height as usize];
        Self { size: [width, height], covered, rows: height..0 }
    }

    fn is_covered(&self, [x, y]: [i32; 2]) -> bool {
        let [width, height] = self.size.map(|size| size as i32);
        (0..width).contains(&x) && (0..height).contains(&y) && self.covered[(y * width + x) as usize]
    }

    /// Covers the pixels whose middles are in a convex polygon, given by shares of the picture.
    pub fn fill(&mut self, polygon: &[Vec2]) {
        if polygon.len() < 3 || !polygon.iter().all(|p| p.is_finite()) {
            return;
        }
        let [width, height] = self.size;
        let size = Vec2::new(width as f32, height as f32);
        let at = |i: usize| polygon[i % polygon.len()] * size - 0.5;
        let low = (0..polygon.len()).map(|i| at(i).y).fold(f32::INFINITY, f32::min);
        let high = (0..polygon.len()).map(|i| at(i).y).fold(f32::NEG_INFINITY, f32::max);
        let first = low.ceil().max(0.0);
        let last = high.floor().min(height as f32 - 1.0);
        if first > last {
            return;
        }
        for row in first as u32..=last as u32 {
            let y = row as f32;
            let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
            for i in 0..polygon.len() {
                let (a, b) = (at(i), at(i + 1));
                if (a.y <= y) != (b.y <= y) || a.y == y {
                    let x = if a.y == b.y { a.x } else { a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)) };
                    (left, right) = (left.min(x), right.max(x));
                }
            }
            let (from, to) = (left.ceil().max(0.0), right.floor().min(width as f32 - 1.0));
            if from <= to {
                self.rows = self.rows.start.min(row)..self.rows.end.max(row + 1);
                let start = row as usize * width as usize;
                self.covered[start + from as usize..=start + to as usize].fill(true);
            }
        }
    }

    /// The lines about all that is covered. What reaches beyond the picture is closed at its edge.
    pub fn borders(&self) -> Vec<Border> {
        let mut edges = self.edges();
        let mut borders = Vec::new();
        while let Some(start) = edges.keys().next().copied() {
            let mut border = Border { points: Vec::new(), inside: Vec::new() };
            let (mut corner, mut before) = (start, None);
            while let Some(direction) = take(&mut edges, corner, before) {
                self.add_to(&mut border, corner, direction);
                let [x, y] = STEPS[direction];
                corner = [corner[0] + y, corner[1] + x];
                before = Some(direction);
            }
            if border.points.len() > 4 {
                borders.push(border);
            }
        }
        borders
    }

    /// From each corner of pixels, row first, in which directions edges lead.
    fn edges(&self) -> BTreeMap<[i32; 2], Vec<usize>> {
        let width = self.size[0] as i32;
        let mut edges: BTreeMap<[i32; 2], Vec<usize>> = BTreeMap::new();
        for y in self.rows.start as i32..self.rows.end as i32 {
            for x in 0..width {
                if !self.is_covered([x, y]) {
                    continue;
                }
                let sides = [
                    ([x, y - 1], [y, x], 0),
                    ([x + 1, y], [y, x + 1], 1),
                    ([x, y + 1], [y + 1, x + 1], 2),
                    ([x - 1, y], [y + 1, x], 3),
                ];
                for (beside, corner, direction) in sides {
                    if !self.is_covered(beside) {
                        edges.entry(corner).or_default().push(direction);
                    }
                }
            }
        }
        edges
    }

    fn add_to(&self, border: &mut Border, [row, column]: [i32; 2], direction: usize) {
        let size = Vec2::new(self.size[0] as f32, self.size[1] as f32);
        let [x, y] = STEPS[direction].map(|step| step as f32);
        let middle = Vec2::new(column as f32 + 0.5 * x, row as f32 + 0.5 * y);
        // What is covered is on the right of the way, with y downwards.
        border.points.push(middle / size);
        border.inside.push((middle + 0.5 * Vec2::new(-y, x)) / size);
    }
}

/// Takes an edge that leads on from a corner; where pixels touch there alone, the one that stays at the same pixel.
fn take(
    edges: &mut BTreeMap<[i32; 2], Vec<usize>>,
    corner: [i32; 2],
    before: Option<usize>,
) -> Option<usize> {
    let here = edges.get_mut(&corner)?;
    let right = before.map(|direction| (direction + 1) % 4);
    let index = here.iter().position(|direction| Some(*direction) == right).unwrap_or(0);
    let direction = here.swap_remove(index);
    if here.is_empty() {
        edges.remove(&corner);
    }
    Some(direction)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f32, high: f32) -> [Vec2; 4] {
        [[low, low], [high, low], [high, high], [low, high]].map(Vec2::from)
    }

    #[test]
    fn a_square_has_one_border_with_its_pixels_inside() {
        let mut mask = Mask::new([10, 10]);
        mask.fill(&square(0.2, 0.7));
        assert_eq!(mask.covered.iter().filter(|covered| **covered).count(), 25);
        let borders = mask.borders();
        assert_eq!((borders.len(), borders[0].points.len()), (1, 20));
        for (point, inside) in borders[0].points.iter().zip(&borders[0].inside) {
            assert!(inside.cmpgt(Vec2::splat(0.2)).all() && inside.cmplt(Vec2::splat(0.7)).all());
            assert!((point.distance(*inside) - 0.05).abs() < 1e-6, "{point} {inside}");
        }
    }

    #[test]
    fn holes_and_islands_have_borders_of_their_own() {
        let mut mask = Mask::new([20, 20]);
        mask.rows = 0..20;
        for (x, y) in (2..12).flat_map(|x| (2..12).map(move |y| (x, y))) {
            mask.covered[y * 20 + x] = !((5..9).contains(&x) && (5..9).contains(&y));
        }
        mask.covered[14 * 20 + 14] = true;
        mask.covered[15 * 20 + 15] = true;
        mask.covered[15 * 20 + 14] = true;
        assert_eq!(mask.borders().iter().map(|b| b.points.len()).collect::<Vec<_>>(), [40, 16, 8]);
        // What touches the picture's edge is closed there; nothing has none.
        let mut all = Mask::new([3, 3]);
        all.fill(&square(-1.0, 2.0));
        assert_eq!(all.borders()[0].points.len(), 12);
        assert!(Mask::new([3, 3]).borders().is_empty());
    }

    #[test]
    fn what_is_no_polygon_covers_nothing() {
        let mut mask = Mask::new([4, 4]);
        mask.fill(&square(0.0, 1.0)[..2]);
        mask.fill(&[Vec2::NAN, Vec2::ONE, Vec2::X]);
        mask.fill(&square(1.1, 1.4));
        assert!(mask.covered.iter().all(|covered| !covered));
    }
}
