//! How much of each pixel shows the scene.

use crate::tiles;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::image::Region;
use girandole_core::scene::View;
use girandole_core::trace::SceneTracer;

/// The share of each pixel that surfaces cover, 0 to 1, row by row from the top: the alpha of a picture whose radiance is multiplied
/// by it already (Porter and Duff 1984); of a part of a picture. What lets light through covers what it keeps back, the mean over the channels.
/// `samples_per_axis` rays in x and in y go through a pixel, on a regular grid; 0 counts as 1.
pub fn coverage(
    tracer: &SceneTracer,
    view: &View,
    (size, part): ([u32; 2], Region),
    samples_per_axis: u32,
) -> Vec<f32> {
    let view = view.relative_to(tracer.geometry().origin);
    let n = samples_per_axis.max(1);
    let covered = |at: Vec2| {
        let (origin, direction) = view.pixel_ray(at, size);
        if tracer.closest_visible_within(origin, direction, view.clip.reach()).is_some() {
            return 1.0;
        }
        let wo = -direction.normalize();
        let through = tracer.transparent_hits(origin, direction, view.clip.reach()).into_iter();
        let passed: Vec3 = through
            .filter(|hit| tracer.is_visible(hit.triangle, direction))
            .map(|hit| {
                tracer.geometry().surface(tracer.scene(), hit.triangle, hit.barycentric, wo).transmittance
            })
            .product();
        1.0 - passed.element_sum() / 3.0
    };
    tiles::render(
        part.size,
        &|_| {},
        || (),
        |(), [x, y]| {
            let [x, y] = [x + part.first[0], y + part.first[1]];
            let within = |i: u32| (i as f32 + 0.5) / n as f32;
            let rays = (0..n * n).map(|i| Vec2::new(x as f32 + within(i % n), y as f32 + within(i / n)));
            rays.map(covered).sum::<f32>() / (n * n) as f32
        },
    )
}
