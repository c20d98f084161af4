//! Path tracing a few rows at a time.

use super::{Estimate, Integrator, PathSettings, Pixel};
use crate::tiles::for_each_row;
use girandole_core::image::Image;
use girandole_core::scene::View;
use girandole_core::trace::SceneTracer;

/// A path tracer's picture that goes on for as long as somebody wants: a path more at each pixel of some rows at a time. After n
/// paths a pixel it is, to the bit, what [`path_trace`](super::path_trace) makes of n paths.
#[derive(Clone, Debug)]
pub struct ProgressivePathTracer {
    view: View,
    size: [u32; 2],
    bounces: Option<u32>,
    pixels: Vec<Pixel>,
    /// Paths that every pixel has, and rows that have another one.
    paths: u32,
    row: u32,
}

impl ProgressivePathTracer {
    /// Begins a picture; of the settings, the number of paths does not count.
    pub fn new(view: &View, size: [u32; 2], settings: &PathSettings) -> Self {
        let position = |i: u32| [i % size[0], i / size[0]];
        let pixels = (0..size[0] * size[1]).map(|i| Pixel::new(settings.seed, position(i))).collect();
        Self { view: *view, size, bounces: settings.bounces, pixels, paths: 0, row: 0 }
    }

    /// Adds a path to each pixel of the next `rows`, on all cores. The tracer is of the same scene each time.
    pub fn step(&mut self, tracer: &SceneTracer, rows: u32) {
        let integrator = Integrator::new(tracer, self.bounces, &[]);
        let view = self.view.relative_to(tracer.geometry().origin);
        let (first, size) = (self.row, self.size);
        let end = first.saturating_add(rows).min(size[1]);
        let range = (first * size[0]) as usize..(end * size[0]) as usize;
        for_each_row(&mut self.pixels[range], size[0] as usize, |row, pixels| {
            for (x, pixel) in (0..).zip(pixels) {
                pixel.add_path(&integrator, &view, ([x, first + row], size));
            }
        });
        self.row = if end == size[1] { 0 } else { end };
        self.paths += u32::from(end == size[1]);
    }

    /// How many paths each pixel has at least.
    pub fn paths(&self) -> u32 {
        self.paths
    }

    /// The picture so far; black where no path was traced yet.
    pub fn estimate(&self) -> Estimate {
        let image = |pixels| Image { width: self.size[0], height: self.size[1], pixels };
        Estimate {
            mean: image(self.pixels.iter().map(|pixel| pixel.mean.as_vec3()).collect()),
            variance: image(self.pixels.iter().map(Pixel::variance).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::path_trace;
    use super::*;
    use girandole_core::scene::Geometry;
    use girandole_core::scene::builtin::{self, MovingObject};

    #[test]
    fn rows_lead_to_the_same_as_all_at_once() {
        let scene = builtin::build("table", MovingObject::Torus).expect("a room");
        let geometry = Geometry::new(&scene);
        let tracer = SceneTracer::new(&scene, &geometry);
        let (size, settings) = ([24, 19], PathSettings { paths: 3, bounces: Some(2), seed: 5 });
        let view = View::new(&scene, &scene.cameras[0], 24.0 / 19.0);
        let mut tracing = ProgressivePathTracer::new(&view, size, &settings);
        assert_eq!(tracing.estimate().mean, Image::new(24, 19));
        for rows in [1, 7, 100, 19, 4, 15] {
            tracing.step(&tracer, rows);
        }
        assert_eq!(tracing.paths(), 3);
        assert_eq!(tracing.estimate(), path_trace(&tracer, &view, size, &settings, &|_| {}));
        tracing.step(&tracer, 1);
        assert_ne!(tracing.estimate(), path_trace(&tracer, &view, size, &settings, &|_| {}));
    }
}
