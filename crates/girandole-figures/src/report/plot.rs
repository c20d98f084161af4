//! Plots of a report, as SVG.

use anyhow::{Result, anyhow, ensure};
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

/// How an axis is divided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scaling {
    /// Evenly, from 0.
    #[default]
    Linear,
    /// By its logarithm.
    Logarithmic,
}

/// A curve through points.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// What it is, in the legend.
    pub name: String,
    /// x and y.
    pub points: Vec<[f64; 2]>,
}

/// Curves over axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    /// Of its file, without folder and ending, and different from the figure's others.
    pub name: String,
    /// What is written above it.
    pub title: String,
    /// Of the axes, with units.
    pub labels: [String; 2],
    /// Of the axes.
    pub scaling: [Scaling; 2],
    /// What is drawn.
    pub curves: Vec<Curve>,
    /// Whether curves of the same x are areas, each on top of those before.
    pub is_stacked: bool,
}

/// Pixels of a plot.
const SIZE: (u32, u32) = (640, 400);
/// Told apart in print and by the colour-blind (Okabe and Ito 2008).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
];

impl Plot {
    /// Over linear axes, without curves.
    pub fn new(name: &str, title: &str, x: &str, y: &str) -> Self {
        let labels = [x.into(), y.into()];
        Self { name: name.into(), title: title.into(), labels, ..Self::default() }
    }

    /// Over logarithmic axes, on which powers are lines.
    pub fn logarithmic(name: &str, title: &str, x: &str, y: &str) -> Self {
        Self { scaling: [Scaling::Logarithmic; 2], ..Self::new(name, title, x, y) }
    }

    /// Adds a curve.
    pub fn curve(&mut self, name: &str, points: Vec<[f64; 2]>) {
        self.curves.push(Curve { name: name.into(), points });
    }

    /// The drawing.
    ///
    /// # Errors
    /// Where there is no point, one is not finite, or not above 0 on a logarithmic axis.
    pub fn svg(&self) -> Result<String> {
        if self.is_stacked { self.summed().svg_as_it_is() } else { self.svg_as_it_is() }
    }

    fn svg_as_it_is(&self) -> Result<String> {
        let ranges = [self.range(0)?, self.range(1)?];
        let [x, y] = ranges.map(|[low, high]| low..high);
        match self.scaling {
            [Scaling::Linear, Scaling::Linear] => self.draw(x, y),
            [Scaling::Linear, Scaling::Logarithmic] => self.draw(x, y.log_scale()),
            [Scaling::Logarithmic, Scaling::Linear] => self.draw(x.log_scale(), y),
            [Scaling::Logarithmic, Scaling::Logarithmic] => self.draw(x.log_scale(), y.log_scale()),
        }
    }

    /// Of curves, each with those below it: the lower are drawn over the higher.
    fn summed(&self) -> Self {
        let mut sums = self.clone();
        for i in 1..sums.curves.len() {
            let (below, above) = sums.curves.split_at_mut(i);
            above[0].points.iter_mut().zip(&below[i - 1].points).for_each(|(sum, low)| sum[1] += low[1]);
        }
        sums.curves.reverse();
        sums
    }

    /// The corner where it hides least of the curves.
    fn legend(&self) -> SeriesLabelPosition {
        let corners = [
            (SeriesLabelPosition::UpperLeft, [false, true]),
            (SeriesLabelPosition::UpperRight, [true, true]),
            (SeriesLabelPosition::LowerLeft, [false, false]),
            (SeriesLabelPosition::LowerRight, [true, false]),
        ];
        let box_size = [0.4, 0.06 + 0.055 * self.curves.len() as f64];
        let traced = self.traced();
        let hidden = |corner: [bool; 2]| {
            let is_hidden = |point: &&[f64; 2]| {
                (0..2).all(|i| (if corner[i] { 1.0 - point[i] } else { point[i] }) < box_size[i])
            };
            traced.iter().filter(is_hidden).count()
        };
        let best = corners.into_iter().min_by_key(|(_, corner)| hidden(*corner));
        best.map_or(SeriesLabelPosition::UpperLeft, |(position, _)| position)
    }

    /// Points along the curves, as shares of the axes.
    fn traced(&self) -> Vec<[f64; 2]> {
        const STEPS: u32 = 16;
        let scaled = |value: f64, axis: usize| match self.scaling[axis] {
            Scaling::Linear => value,
            Scaling::Logarithmic => value.ln(),
        };
        let share = |point: [f64; 2]| {
            [0, 1].map(|axis| {
                let [low, high] = self.range(axis).unwrap_or([0.0, 1.0]).map(|end| scaled(end, axis));
                (scaled(point[axis], axis) - low) / (high - low)
            })
        };
        let between = |pair: &[[f64; 2]]| {
            let [from, to] = [pair[0], pair[1]].map(share);
            (0..=STEPS)
                .map(move |i| f64::from(i) / f64::from(STEPS))
                .map(move |t| [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * t))
        };
        self.curves.iter().flat_map(|curve| curve.points.windows(2).flat_map(between)).collect()
    }

    /// What an axis shows.
    fn range(&self, axis: usize) -> Result<[f64; 2]> {
        let values: Vec<f64> = self.curves.iter().flat_map(|c| &c.points).map(|point| point[axis]).collect();
        let is_logarithmic = self.scaling[axis] == Scaling::Logarithmic;
        ensure!(!values.is_empty(), "the plot {} has no points", self.name);
        let is_valid = |v: &f64| v.is_finite() && (!is_logarithmic || *v > 0.0);
        ensure!(values.iter().all(is_valid), "the plot {} has a point that cannot be drawn", self.name);
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if is_logarithmic {
            return Ok([low / 1.2, high * 1.2]);
        }
        let low = low.min(0.0);
        let high = if high > low { high } else { low + 1.0 };
        Ok([low, low + (high - low) * 1.05])
    }

    fn draw<X, Y>(&self, x: X, y: Y) -> Result<String>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: ValueFormatter<f64>,
        Y::CoordDescType: ValueFormatter<f64>,
    {
        let mut svg = String::new();
        let failed =
            |error: &dyn std::fmt::Display| anyhow!("the plot {} cannot be drawn: {error}", self.name);
        {
            let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
            area.fill(&WHITE).map_err(|e| failed(&e))?;
            let mut chart = ChartBuilder::on(&area)
                .caption(&self.title, ("sans-serif", 17))
                .margin(10)
                .x_label_area_size(42)
                .y_label_area_size(62)
                .build_cartesian_2d(x, y)
                .map_err(|e| failed(&e))?;
            let label = |value: &f64| label(*value);
            chart
                .configure_mesh()
                .x_desc(&self.labels[0])
                .y_desc(&self.labels[1])
                .x_label_formatter(&label)
                .y_label_formatter(&label)
                .light_line_style(WHITE)
                .bold_line_style(RGBColor(225, 225, 225))
                .label_style(("sans-serif", 13))
                .draw()
                .map_err(|e| failed(&e))?;
            for (curve, color) in self.curves.iter().zip(COLORS.iter().cycle()) {
                let points = || curve.points.iter().map(|&[x, y]| (x, y));
                if self.is_stacked {
                    let ends = [curve.points.last(), curve.points.first()].into_iter().flatten();
                    let outline = points().chain(ends.map(|end| (end[0], 0.0)));
                    let area = Polygon::new(outline.collect::<Vec<_>>(), color.filled());
                    chart.draw_series([area]).map_err(|e| failed(&e))?;
                }
                let line = LineSeries::new(points(), color.stroke_width(2));
                chart
                    .draw_series(line)
                    .map_err(|e| failed(&e))?
                    .label(&curve.name)
                    .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)));
                let dots = points().map(|point| Circle::new(point, 3, color.filled()));
                chart.draw_series(dots).map_err(|e| failed(&e))?;
            }
            chart
                .configure_series_labels()
                .position(self.legend())
                .background_style(WHITE.mix(0.8))
                .border_style(RGBColor(200, 200, 200))
                .label_font(("sans-serif", 13))
                .draw()
                .map_err(|e| failed(&e))?;
            area.present().map_err(|e| failed(&e))?;
        }
        Ok(svg)
    }
}

/// A number on an axis: as short as it is exact to three digits.
fn label(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-3..1e6).contains(&size) {
        return format!("{value:.0e}");
    }
    let digits = if size == 0.0 { 0.0 } else { (2.0 - size.log10().floor()).clamp(0.0, 6.0) };
    let text = format!("{value:.0$}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}
