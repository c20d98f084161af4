//! Convex polygons out of planar triangles.
//!
//! Like Hertel and Mehlhorn (*Fast triangulation of simple polygons*, 1983): a side between two polygons is removed
//! where the union stays convex. The longest sides go first, so that a regular grid falls into a few large blocks.

use super::super::NONE;
use super::surface::FlatTriangle;
use glam::DVec2;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A convex polygon that consists of whole triangles.
pub(super) struct Polygon {
    /// Indices into the triangles it was made from.
    pub triangles: Vec<u32>,
    /// Triangle and corner of each corner of the outline, counter-clockwise.
    pub outline: Vec<[u32; 2]>,
    /// m².
    pub area: f64,
}

const DEAD: u32 = NONE - 1;

fn area(triangles: &[FlatTriangle], which: &[u32]) -> f64 {
    which
        .iter()
        .map(|&t| {
            let [a, b, c] = triangles[t as usize].corners;
            (b - a).perp_dot(c - a) * 0.5
        })
        .sum()
}

/// All triangles as one polygon, if their outline is a single convex loop.
pub(super) fn whole_polygon(triangles: &[FlatTriangle], tolerance: f64) -> Option<Polygon> {
    let mut boundary: FxHashMap<u32, [u32; 2]> = FxHashMap::default();
    let mut start = None;
    for (t, triangle) in triangles.iter().enumerate() {
        for side in 0..3 {
            if triangle.neighbors[side] == NONE {
                let from = triangle.points[side];
                start = start.or(Some(from));
                if boundary.insert(from, [t as u32, side as u32]).is_some() {
                    return None;
                }
            }
        }
    }
    let start = start?;
    let mut outline = Vec::with_capacity(boundary.len());
    let mut at = start;
    loop {
        let corner = *boundary.get(&at)?;
        outline.push(corner);
        let [t, side] = corner;
        at = triangles[t as usize].points[(side as usize + 1) % 3];
        if at == start {
            break;
        }
        if outline.len() == boundary.len() {
            return None;
        }
    }
    if outline.len() != boundary.len() {
        return None;
    }
    checked(triangles, (0..triangles.len() as u32).collect(), &outline, tolerance)
}

/// Cuts the triangles into convex polygons. Those whose outline turns out too crooked are tried again without any
/// tolerance; what even then is not convex is left out.
pub(super) fn convex_polygons(triangles: &[FlatTriangle], tolerance: f64) -> Vec<Polygon> {
    let all: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut result = Vec::new();
    for (members, outline) in Merge::new(triangles, &all, tolerance).run() {
        let strict = members.clone();
        match checked(triangles, members, &outline, tolerance) {
            Some(polygon) => result.push(polygon),
            None => {
                let again = Merge::new(triangles, &strict, 0.0).run();
                result.extend(again.into_iter().filter_map(|(m, o)| checked(triangles, m, &o, tolerance)));
            }
        }
    }
    result
}

fn at(triangles: &[FlatTriangle], [t, side]: [u32; 2]) -> DVec2 {
    triangles[t as usize].corners[side as usize]
}

/// The polygon without collinear corners, if it is convex and as large as its triangles.
fn checked(
    triangles: &[FlatTriangle],
    members: Vec<u32>,
    outline: &[[u32; 2]],
    tolerance: f64,
) -> Option<Polygon> {
    let point = |c: [u32; 2]| at(triangles, c);
    // The lowest of the leftmost corners is one of the hull's.
    let first = (0..outline.len()).min_by(|&a, &b| {
        let (a, b) = (point(outline[a]), point(outline[b]));
        a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
    })?;
    let ordered = |i: usize| outline[(first + i) % outline.len()];
    let mut kept = vec![ordered(0)];
    for i in 1..outline.len() {
        let (a, p, b) = (point(kept[kept.len() - 1]), point(ordered(i)), point(ordered(i + 1)));
        let straight =
            (p - a).perp_dot(b - p).abs() <= tolerance * (b - a).length() && (p - a).dot(b - p) > 0.0;
        if !straight {
            kept.push(ordered(i));
        }
    }
    if kept.len() < 3 {
        return None;
    }
    let (mut turn, mut doubled, mut perimeter) = (0.0, 0.0, 0.0);
    for i in 0..kept.len() {
        let [a, p, b] = [i, i + 1, i + 2].map(|i| point(kept[i % kept.len()]));
        let cross = (p - a).perp_dot(b - p);
        if cross <= 0.0 {
            return None;
        }
        turn += libm::atan2(cross, (p - a).dot(b - p));
        doubled += a.perp_dot(p);
        perimeter += (p - a).length();
    }
    let area = area(triangles, &members);
    let once = (turn - std::f64::consts::TAU).abs() < 0.1;
    let fits = (doubled * 0.5 - area).abs() <= tolerance * perimeter + 1e-9 * area;
    (once && fits).then_some(Polygon { triangles: members, outline: kept, area })
}

/// Polygons as loops of half-edges, of which each triangle gives three.
struct Merge<'t> {
    triangles: &'t [FlatTriangle],
    members: &'t [u32],
    tolerance: f64,
    next: Vec<u32>,
    previous: Vec<u32>,
    twin: Vec<u32>,
    /// Union-find over the members.
    parent: Vec<u32>,
    /// Length up to which the chain through a half-edge is known not to be removable.
    refused: Vec<f64>,
    queue: BinaryHeap<(u64, Reverse<u32>)>,
}

impl<'t> Merge<'t> {
    fn new(triangles: &'t [FlatTriangle], members: &'t [u32], tolerance: f64) -> Self {
        // Members ascend.
        let local = |t: u32| {
            if members.len() == triangles.len() {
                Some(t)
            } else {
                members.binary_search(&t).ok().map(|i| i as u32)
            }
        };
        let count = members.len() as u32 * 3;
        let mut twin = vec![NONE; count as usize];
        for (i, &t) in members.iter().enumerate() {
            let triangle = &triangles[t as usize];
            for side in 0..3 {
                let Some(other) = Some(triangle.neighbors[side]).filter(|&n| n != NONE).and_then(local)
                else {
                    continue;
                };
                let wanted = triangle.points[(side + 1) % 3];
                let points = triangles[members[other as usize] as usize].points;
                if let Some(their) = points.iter().position(|&p| p == wanted) {
                    twin[i * 3 + side] = other * 3 + their as u32;
                }
            }
        }
        let mut merge = Self {
            triangles,
            members,
            tolerance,
            next: (0..count).map(|h| h / 3 * 3 + (h + 1) % 3).collect(),
            previous: (0..count).map(|h| h / 3 * 3 + (h + 2) % 3).collect(),
            twin,
            parent: (0..members.len() as u32).collect(),
            refused: vec![-1.0; count as usize],
            queue: BinaryHeap::new(),
        };
        for h in 0..count {
            merge.offer(h);
        }
        merge
    }

    fn corner(&self, h: u32) -> [u32; 2] {
        [self.members[(h / 3) as usize], h % 3]
    }

    fn origin(&self, h: u32) -> DVec2 {
        at(self.triangles, self.corner(h))
    }

    fn polygon(&mut self, h: u32) -> u32 {
        let mut i = h / 3;
        while self.parent[i as usize] != i {
            let up = self.parent[i as usize];
            self.parent[i as usize] = self.parent[up as usize];
            i = self.parent[i as usize];
        }
        i
    }

    /// First and last half-edge of the straight chain through `h` that one and the same polygon lies beyond.
    fn chain(&self, h: u32) -> Option<(u32, u32)> {
        let (mut first, mut last) = (h, h);
        loop {
            let before = self.previous[first as usize];
            if self.twin[before as usize] == NONE
                || self.twin[before as usize] != self.next[self.twin[first as usize] as usize]
            {
                break;
            }
            first = before;
            if first == h {
                return None;
            }
        }
        loop {
            let after = self.next[last as usize];
            if self.twin[after as usize] == NONE
                || self.twin[after as usize] != self.previous[self.twin[last as usize] as usize]
            {
                break;
            }
            last = after;
        }
        Some((first, last))
    }

    fn chain_length(&self, (first, last): (u32, u32)) -> f64 {
        (self.origin(self.next[last as usize]) - self.origin(first)).length()
    }

    fn offer(&mut self, h: u32) {
        if self.twin[h as usize] < DEAD
            && let Some(chain) = self.chain(h)
        {
            // Lengths are not negative, so their bits sort like them.
            self.queue.push((self.chain_length(chain).to_bits(), Reverse(h)));
        }
    }

    /// Whether a polygon may turn at `p` on its way from `a` to `b`.
    fn convex(&self, a: DVec2, p: DVec2, b: DVec2) -> bool {
        let cross = (p - a).perp_dot(b - p);
        cross >= 0.0 || (-cross <= self.tolerance * (b - a).length() && (p - a).dot(b - p) > 0.0)
    }

    fn run(mut self) -> Vec<(Vec<u32>, Vec<[u32; 2]>)> {
        while let Some((length, Reverse(h))) = self.queue.pop() {
            let length = f64::from_bits(length);
            if self.next[h as usize] == DEAD || length <= self.refused[h as usize] {
                continue;
            }
            let Some((first, last)) = self.chain(h) else { continue };
            let now = self.chain_length((first, last));
            if now > length {
                self.queue.push((now.to_bits(), Reverse(h)));
                continue;
            }
            self.remove(first, last, now);
        }
        self.collect()
    }

    /// Removes a chain between two polygons if their union is convex.
    fn remove(&mut self, first: u32, last: u32, length: f64) {
        let (a, b) = (self.polygon(first), self.polygon(self.twin[first as usize]));
        let into_start = self.previous[first as usize];
        let from_start = self.next[self.twin[first as usize] as usize];
        let into_end = self.previous[self.twin[last as usize] as usize];
        let from_end = self.next[last as usize];
        let start =
            [self.origin(into_start), self.origin(first), self.origin(self.next[from_start as usize])];
        let end = [self.origin(into_end), self.origin(from_end), self.origin(self.next[from_end as usize])];
        let possible =
            a != b && self.convex(start[0], start[1], start[2]) && self.convex(end[0], end[1], end[2]);
        let mut h = first;
        loop {
            let (twin, following) = (self.twin[h as usize], self.next[h as usize]);
            for side in [h, twin] {
                self.refused[side as usize] = length;
                if possible {
                    self.next[side as usize] = DEAD;
                }
            }
            if h == last {
                break;
            }
            h = following;
        }
        if !possible {
            return;
        }
        self.parent[b as usize] = a;
        for (into, from) in [(into_start, from_start), (into_end, from_end)] {
            self.next[into as usize] = from;
            self.previous[from as usize] = into;
        }
        // Where both sides at a junction now face the same polygon, their chains have become one.
        self.offer(into_start);
        self.offer(into_end);
    }

    /// The triangles and outline of each polygon.
    fn collect(mut self) -> Vec<(Vec<u32>, Vec<[u32; 2]>)> {
        let mut polygons: Vec<(Vec<u32>, Vec<[u32; 2]>)> = Vec::new();
        let mut slot = vec![NONE; self.members.len()];
        for h in 0..self.next.len() as u32 {
            let polygon = self.polygon(h) as usize;
            if slot[polygon] == NONE {
                slot[polygon] = polygons.len() as u32;
                polygons.push(Default::default());
            }
            let target = slot[polygon] as usize;
            if h % 3 == 0 {
                polygons[target].0.push(self.members[(h / 3) as usize]);
            }
            if self.next[h as usize] != DEAD && polygons[target].1.is_empty() {
                let mut at = h;
                loop {
                    let corner = self.corner(at);
                    polygons[target].1.push(corner);
                    at = self.next[at as usize];
                    if at == h {
                        break;
                    }
                }
            }
        }
        polygons
    }
}
