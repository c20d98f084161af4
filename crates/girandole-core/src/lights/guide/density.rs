//! A density over the unit cube, learnt from points.

/// How many trees of boxes it is the mean of: where light comes in at the edge of a box that has hardly a point in one of them, it comes
/// in within a box with many in another.
pub(super) const TREES: u32 = 4;
/// Share that is uniform.
const PLAIN: f64 = 0.2;
/// A box is divided at eighths of its sides, moved along from tree to tree…
const PARTS: u32 = 8;
/// …where that makes its points likelier by this much, as the logarithm of all of their densities together…
const LEAST_GAIN: f64 = 4.0;
/// …and no more often than this, one box within the other.
const MOST_DIVISIONS: u32 = 48;
/// For how many points the parts of a box count in themselves, at least…
const PRIOR: f64 = 1.0;
/// …and as a share of all in it.
const PRIOR_SHARE: f64 = 0.05;

/// A density over the unit cube of `D` dimensions, constant in boxes: the mean of a few density estimation trees (Ram and Gray 2011),
/// with the warp of uniform points to points that are distributed by it.
#[derive(Clone, Debug)]
pub(super) struct Density<const D: usize> {
    /// By tree; the first box is the whole cube.
    trees: Vec<Vec<Part>>,
}

#[derive(Clone, Debug)]
enum Part {
    /// Two boxes, below and above a place along an axis; the first has this share of both.
    Two {
        axis: usize,
        border: f64,
        share: f64,
        parts: [usize; 2],
    },
    One {
        density: f64,
    },
}

/// A point and its weight.
pub(super) type Point<const D: usize> = ([f64; D], f64);

/// A box with the points in it, still to be divided.
struct Open<const D: usize> {
    points: Vec<Point<D>>,
    low: [f64; D],
    high: [f64; D],
    /// What of all weight lies in it, as an estimate.
    mass: f64,
    divisions: u32,
    at: usize,
}

impl<const D: usize> Density<D> {
    /// Of weighted points, by tree, each known so many times over; `None` where a tree has none with weight.
    pub fn new(copies: u32, points: impl Fn(u32) -> Vec<Point<D>>) -> Option<Self> {
        let tree = |tree| {
            let mut points = points(tree);
            points.retain(|(_, weight)| *weight > 0.0 && weight.is_finite());
            let moved = f64::from(tree) / f64::from(TREES);
            (!points.is_empty()).then(|| divided(points, f64::from(copies), moved))
        };
        Some(Self { trees: (0..TREES).map(tree).collect::<Option<_>>()? })
    }

    /// Where a point of the unit cube goes, and the density there: uniform points are distributed by it.
    pub fn warp(&self, mut at: [f64; D]) -> ([f64; D], f64) {
        const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;
        let along = at[0] * f64::from(TREES);
        let tree = &self.trees[(along as usize).min(self.trees.len() - 1)];
        at[0] = along.fract();
        let (mut low, mut high, mut part) = ([0.0; D], [1.0; D], 0);
        while let Part::Two { axis, border, share, parts } = &tree[part] {
            let s = &mut at[*axis];
            let second = *s >= *share;
            *s = if second { (*s - share) / (1.0 - share) } else { *s / share }.clamp(0.0, BELOW_ONE);
            *(if second { &mut low[*axis] } else { &mut high[*axis] }) = *border;
            part = parts[usize::from(second)];
        }
        // Rounding must not lead across a border.
        let inside = |i: usize| (low[i] + at[i] * (high[i] - low[i])).min(high[i].next_down());
        let at = std::array::from_fn(inside);
        (at, self.at(at))
    }

    fn at(&self, at: [f64; D]) -> f64 {
        let of_tree = |tree: &Vec<Part>| {
            let mut part = 0;
            loop {
                match &tree[part] {
                    Part::Two { axis, border, parts, .. } => part = parts[usize::from(at[*axis] >= *border)],
                    Part::One { density } => return *density,
                }
            }
        };
        self.trees.iter().map(of_tree).sum::<f64>() / self.trees.len() as f64
    }
}

/// Boxes about points; the first is the whole cube.
fn divided<const D: usize>(points: Vec<Point<D>>, copies: f64, moved: f64) -> Vec<Part> {
    let mut boxes = vec![Part::One { density: 1.0 }];
    let mut open = vec![Open { points, low: [0.0; D], high: [1.0; D], mass: 1.0, divisions: 0, at: 0 }];
    while let Some(this) = open.pop() {
        let volume: f64 = (0..D).map(|i| this.high[i] - this.low[i]).product();
        let Some((axis, border, share)) = this.best_division(copies, moved) else {
            boxes[this.at] = Part::One { density: PLAIN + (1.0 - PLAIN) * this.mass / volume };
            continue;
        };
        let below = (border - this.low[axis]) / (this.high[axis] - this.low[axis]);
        let masses = [this.mass * share, this.mass * (1.0 - share)];
        let [first, second] = [(masses[0], below), (masses[1], 1.0 - below)]
            .map(|(m, v)| PLAIN * volume * v + (1.0 - PLAIN) * m);
        let parts = [boxes.len(), boxes.len() + 1];
        boxes[this.at] = Part::Two { axis, border, share: first / (first + second), parts };
        boxes.extend([Part::One { density: 1.0 }, Part::One { density: 1.0 }]);
        let (left, right) = this.points.into_iter().partition(|(at, _)| at[axis] < border);
        let mut ends = [(this.low, this.high); 2];
        (ends[0].1[axis], ends[1].0[axis]) = (border, border);
        for (i, (points, (low, high))) in [left, right].into_iter().zip(ends).enumerate() {
            let (mass, at, divisions) = (masses[i], parts[i], this.divisions + 1);
            open.push(Open { points, low, high, mass, divisions, at });
        }
    }
    boxes
}

impl<const D: usize> Open<D> {
    /// Axis and place at which a division makes the points likeliest, and the share of the part below; `None` where that may be chance.
    fn best_division(&self, copies: f64, moved: f64) -> Option<(usize, f64, f64)> {
        let (sum, squares) =
            self.points.iter().fold((0.0, 0.0), |(sum, squares), (_, w)| (sum + w, squares + w * w));
        if sum <= 0.0 || self.divisions == MOST_DIVISIONS {
            return None;
        }
        // As many equal points say as much.
        let count = sum * sum / squares / copies;
        let prior = PRIOR.max(PRIOR_SHARE * count);
        let (mut best, mut most) = (None, LEAST_GAIN);
        for axis in 0..D {
            let (low, size) = (self.low[axis], self.high[axis] - self.low[axis]);
            // Up to the first border, and between two.
            let mut weights = [0.0; PARTS as usize + 1];
            for (at, weight) in &self.points {
                let part = (at[axis] - low) / size * f64::from(PARTS) + 1.0 - moved;
                weights[(part.max(0.0) as usize).min(PARTS as usize)] += weight;
            }
            let mut below = 0.0;
            for (part, weight) in (0..PARTS).zip(weights) {
                below += weight / sum;
                let width = (f64::from(part) + moved) / f64::from(PARTS);
                let share = (count * below + prior * width) / (count + prior);
                let gain = count * (term(share, width) + term(1.0 - share, 1.0 - width));
                if gain > most && width > 0.0 {
                    (best, most) = (Some((axis, low + size * width, share)), gain);
                }
            }
        }
        best
    }
}

/// What a part of a box adds to the mean logarithm of its points' densities.
fn term(share: f64, width: f64) -> f64 {
    if share > 0.0 && width > 0.0 { share * libm::log(share / width) } else { 0.0 }
}
