//! A density over the unit cube, learnt from points.

/// Share that is uniform.
const PLAIN: f64 = 0.2;
/// A box is divided at eighths of its sides…
const PARTS: u32 = 8;
/// …where that makes its points likelier by this much, as the logarithm of all of their densities together…
const LEAST_GAIN: f64 = 4.0;
/// …and no more often than this, one box within the other.
const MOST_DIVISIONS: u32 = 48;
/// For how many points the parts of a box count in themselves.
const PRIOR: f64 = 1.0;

/// A density over the unit cube of `D` dimensions, constant in each of its boxes: a density estimation tree (Ram and Gray 2011), with
/// the warp of uniform points to points that are distributed by it.
#[derive(Clone, Debug)]
pub(super) struct Density<const D: usize> {
    /// The first is the whole cube.
    boxes: Vec<Part>,
}

#[derive(Clone, Debug)]
enum Part {
    /// Two boxes, below and above a place along an axis; the first has this share of both.
    Two { axis: usize, border: f64, share: f64, parts: [usize; 2] },
    One { density: f64 },
}

/// A point and its weight.
type Point<const D: usize> = ([f64; D], f64);

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
    /// Of weighted points; `None` where none has weight.
    pub fn new(mut points: Vec<Point<D>>) -> Option<Self> {
        points.retain(|(_, weight)| *weight > 0.0 && weight.is_finite());
        if points.is_empty() {
            return None;
        }
        let mut boxes = vec![Part::One { density: 1.0 }];
        let mut open = vec![Open { points, low: [0.0; D], high: [1.0; D], mass: 1.0, divisions: 0, at: 0 }];
        while let Some(mut this) = open.pop() {
            let volume = this.volume();
            match this.best_division() {
                Some((axis, border, share)) => {
                    let size = this.high[axis] - this.low[axis];
                    let below = (border - this.low[axis]) / size;
                    let masses = [this.mass * share, this.mass * (1.0 - share)];
                    let volumes = [volume * below, volume * (1.0 - below)];
                    let of = |i: usize| PLAIN * volumes[i] + (1.0 - PLAIN) * masses[i];
                    let parts = [boxes.len(), boxes.len() + 1];
                    boxes[this.at] = Part::Two { axis, border, share: of(0) / (of(0) + of(1)), parts };
                    boxes.extend([Part::One { density: 1.0 }, Part::One { density: 1.0 }]);
                    let (low, high) = (this.low, this.high);
                    let (first, second) = this.points.drain(..).partition(|(at, _)| at[axis] < border);
                    let divisions = this.divisions + 1;
                    let mut ends = [(low, high), (low, high)];
                    (ends[0].1[axis], ends[1].0[axis]) = (border, border);
                    for ((points, (low, high)), (mass, at)) in
                        [first, second].into_iter().zip(ends).zip(masses.into_iter().zip(parts))
                    {
                        open.push(Open { points, low, high, mass, divisions, at });
                    }
                }
                None => boxes[this.at] = Part::One { density: PLAIN + (1.0 - PLAIN) * this.mass / volume },
            }
        }
        Some(Self { boxes })
    }

    /// Where a point of the unit cube goes, and the density there: uniform points are distributed by it.
    pub fn warp(&self, mut at: [f64; D]) -> ([f64; D], f64) {
        const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;
        let (mut low, mut high, mut part) = ([0.0; D], [1.0; D], 0);
        loop {
            match &self.boxes[part] {
                Part::Two { axis, border, share, parts } => {
                    let s = &mut at[*axis];
                    let second = *s >= *share;
                    *s = if second { (*s - share) / (1.0 - share) } else { *s / share }.clamp(0.0, BELOW_ONE);
                    *(if second { &mut low[*axis] } else { &mut high[*axis] }) = *border;
                    part = parts[usize::from(second)];
                }
                Part::One { density } => {
                    let inside = |i: usize| (low[i] + at[i] * (high[i] - low[i])).min(BELOW_ONE);
                    return (std::array::from_fn(inside), *density);
                }
            }
        }
    }
}

impl<const D: usize> Open<D> {
    fn volume(&self) -> f64 {
        (0..D).map(|i| self.high[i] - self.low[i]).product()
    }

    /// Axis and place at which a division makes the points likeliest, and the share of the part below; `None` where that may be chance.
    fn best_division(&self) -> Option<(usize, f64, f64)> {
        let (sum, squares) =
            self.points.iter().fold((0.0, 0.0), |(sum, squares), (_, w)| (sum + w, squares + w * w));
        if sum <= 0.0 || self.divisions == MOST_DIVISIONS {
            return None;
        }
        // As many equal points say as much.
        let count = sum * sum / squares;
        let mut best = None;
        let mut most = LEAST_GAIN;
        for axis in 0..D {
            let (low, size) = (self.low[axis], self.high[axis] - self.low[axis]);
            let mut weights = [0.0; PARTS as usize];
            for (at, weight) in &self.points {
                let part = ((at[axis] - low) / size * f64::from(PARTS)) as usize;
                weights[part.min(PARTS as usize - 1)] += weight;
            }
            let mut below = 0.0;
            for (part, weight) in (1..PARTS).zip(weights) {
                below += weight / sum;
                let width = f64::from(part) / f64::from(PARTS);
                let share = (count * below + PRIOR * width) / (count + PRIOR);
                let gain = count * (term(share, width) + term(1.0 - share, 1.0 - width));
                if gain > most {
                    (best, most) = (Some((axis, low + size * width, share)), gain);
                }
            }
        }
        best
    }
}

/// What a part of a box adds to the mean logarithm of its points' densities.
fn term(share: f64, width: f64) -> f64 {
    if share > 0.0 { share * libm::log(share / width) } else { 0.0 }
}
