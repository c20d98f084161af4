//! Runs of candidates that are neighbours.

use super::Place;
use crate::lights::{LightSample, punctual};
use crate::parallel::both;

/// Runs of neighbours, as halves of halves.
#[derive(Clone, Debug)]
pub(super) enum Node {
    /// Up to where along an axis the first half goes, and both.
    Halves { axis: usize, border: f32, halves: Box<[Node; 2]> },
    /// One of the runs.
    Run(usize),
}

/// Neighbours.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// Candidates that it was made of.
    pub members: Vec<u32>,
    /// What one brings per unit of power.
    pub importance: f64,
    /// The bound on `G` that that was measured with.
    pub bound: f32,
}

impl Node {
    /// Which run a place is in.
    pub fn run_at(&self, place: Place) -> usize {
        match self {
            Self::Halves { axis, border, halves } => {
                halves[usize::from(place[*axis] >= *border)].run_at(place)
            }
            Self::Run(run) => *run,
        }
    }

    /// The same, where so many runs come before its own.
    fn after(self, before: usize) -> Self {
        match self {
            Self::Halves { axis, border, mut halves } => {
                *halves = halves.map(|half| half.after(before));
                Self::Halves { axis, border, halves }
            }
            Self::Run(run) => Self::Run(run + before),
        }
    }
}

/// Runs of neighbours by position and normal. The sun is a run of its own: all of it brings the same but for the edges of shadows.
/// The `longest` are of so many candidates, or so many punctual lights.
pub(super) fn split_into_runs(
    candidates: &[LightSample],
    places: &[Place],
    longest: [usize; 2],
) -> (Option<Node>, Vec<Run>) {
    let is_sun = |&i: &u32| candidates[i as usize].is_of_sun();
    let is_punctual = |&i: &u32| candidates[i as usize].punctual().is_some();
    let (punctual, others): (Vec<u32>, Vec<u32>) = (0..places.len() as u32).partition(is_punctual);
    let (sun, others): (Vec<u32>, Vec<u32>) = others.into_iter().partition(is_sun);
    let parts = [(others, 0, longest[0]), (sun, 0, usize::MAX), (punctual, punctual::AXIS, longest[1])];
    let (mut tree, mut runs) = (None, Vec::<Run>::new());
    // Each lies beyond all that come before it.
    for (part, axis, longest) in parts.into_iter().filter(|(part, ..)| !part.is_empty()) {
        let border = part.iter().map(|&i| places[i as usize][axis]).fold(f32::INFINITY, f32::min);
        let (part, of_part) = split(part, places, longest);
        let part = part.after(runs.len());
        runs.extend(of_part);
        tree = Some(match tree.take() {
            Some(before) => Node::Halves { axis, border, halves: Box::new([before, part]) },
            None => part,
        });
    }
    (tree, runs)
}

/// Runs of these, and the halves that lead to them.
fn split(mut members: Vec<u32>, places: &[Place], longest: usize) -> (Node, Vec<Run>) {
    if members.len() <= longest {
        return (Node::Run(0), vec![Run { members, importance: 1.0, bound: f32::MAX }]);
    }
    let (axis, border, second) = halve(&mut members, places);
    let ((first, mut runs), (second, others)) =
        both(|| split(members, places, longest), || split(second, places, longest));
    let halves = Box::new([first, second.after(runs.len())]);
    runs.extend(others);
    (Node::Halves { axis, border, halves }, runs)
}

/// Takes the second half, by place along the axis of largest variance, and returns it with that axis and where it begins.
pub fn halve(run: &mut Vec<u32>, places: &[Place]) -> (usize, f32, Vec<u32>) {
    let variance = |axis: usize| {
        let at = |&i: &u32| f64::from(places[i as usize][axis]);
        let mean = run.iter().map(at).sum::<f64>() / run.len() as f64;
        run.iter().map(|i| (at(i) - mean).powi(2)).sum::<f64>()
    };
    let variances: [f64; 6] = std::array::from_fn(variance);
    let axis = (1..6).fold(0, |best, axis| if variances[axis] > variances[best] { axis } else { best });
    let key = |i: u32| places[i as usize][axis];
    let middle = run.len() / 2;
    run.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    let border = key(run[middle]);
    let mut second = run.split_off(middle);
    // What select leaves within each half is not specified.
    run.sort_unstable();
    second.sort_unstable();
    (axis, border, second)
}
