//! What candidates bring.

use super::*;
use crate::lights::view_points::{POINTS, view_points};
use crate::lights::{LightSet, LightSettings};
use crate::scene::{Geometry, View, builtin};
use crate::slices::complete;

#[test]
fn brightness_is_the_mean_over_channels() {
    let scene = builtin::build("table", builtin::default_object("table")).expect("built in");
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let points = view_points(&tracer, &[View::new(&scene, &scene.cameras[0], 1.0)], POINTS);
    let settings = LightSettings { count: 64, ..LightSettings::default() };
    let set = LightSet::sample(&scene, &geometry, &settings).expect("there is light");
    let brightness = |colour: Vec3| {
        let of = |s: &LightSample| LightSample { intensity: s.intensity.max_element() * colour, ..*s };
        let samples: Vec<LightSample> = set.samples().iter().map(of).collect();
        let places: Vec<Place> = samples.iter().map(|s| place(s, 1.0)).collect();
        complete(measure(&tracer, &points, &samples, &places, false)).brightness
    };
    let gray = brightness(Vec3::ONE);
    assert!(gray > 0.0);
    for (colour, share) in [(Vec3::X, 1.0 / 3.0), (Vec3::new(1.0, 0.5, 0.0), 0.5)] {
        let ratio = brightness(colour) / gray;
        assert!((ratio - share).abs() < 1e-4, "{ratio} for {share}");
    }
    // The control: the brightest channel is that of all of them.
    let power = |colour| power(&LightSample { intensity: colour, ..set.samples()[0] });
    assert_eq!(power(Vec3::X), power(Vec3::ONE));
}
