//! Lines and powers through points that were measured.

use crate::report::{Verdict, number};

/// y = intercept + slope · x, by least squares.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Line {
    /// What y grows by where x grows by 1.
    pub slope: f64,
    /// y where x is 0.
    pub intercept: f64,
    /// Which share of y's variance the line explains (R²); 1 where y does not vary.
    pub explained: f64,
}

impl Line {
    /// Through these points; level through fewer than two different ones.
    pub fn through(points: &[[f64; 2]]) -> Self {
        let mean = |axis: usize| points.iter().map(|p| p[axis]).sum::<f64>() / points.len().max(1) as f64;
        let middle = [mean(0), mean(1)];
        let moment = |i: usize, j: usize| -> f64 {
            points.iter().map(|p| (p[i] - middle[i]) * (p[j] - middle[j])).sum()
        };
        let [xx, xy, yy] = [moment(0, 0), moment(0, 1), moment(1, 1)];
        let slope = if xx > 0.0 { xy / xx } else { 0.0 };
        let explained = if xx * yy > 0.0 { xy * xy / (xx * yy) } else { 1.0 };
        Self { slope, intercept: middle[1] - slope * middle[0], explained }
    }
}

/// The exponent of the power of x that y is, by least squares on logarithms, of points that lie above 0.
pub fn exponent(points: &[[f64; 2]]) -> f64 {
    let is_above = |point: &&[f64; 2]| point.iter().all(|&value| value > 0.0);
    let logarithms = points.iter().filter(is_above).map(|point| point.map(f64::ln));
    Line::through(&logarithms.collect::<Vec<_>>()).slope
}

/// The points from this x on.
pub fn from(points: &[[f64; 2]], least: f64) -> Vec<[f64; 2]> {
    points.iter().copied().filter(|point| point[0] >= least).collect()
}

/// It agrees where all claims hold; the sentences of those that do not hold say why it differs.
pub fn verdict(claims: impl IntoIterator<Item = (bool, String)>) -> Verdict {
    let failed: Vec<String> = claims.into_iter().filter(|(holds, _)| !holds).map(|(_, why)| why).collect();
    if failed.is_empty() { Verdict::Agrees } else { Verdict::Differs(failed.join(" ")) }
}

/// A number with two digits after the point.
pub fn two(value: f64) -> String {
    number(value, 2)
}
