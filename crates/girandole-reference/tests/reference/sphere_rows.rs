//! How well each of the [spheres](crate::spheres) is rendered.

use crate::spheres::ROUGHNESS;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::scene::{Geometry, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::metrics::{CompareOptions, compare};

/// How well the spheres of a material are rendered.
#[derive(Clone, Debug)]
pub struct Row {
    /// What sends light is not reflected diffusely.
    pub is_metal: bool,
    /// Energy of each sphere as a share of the truth's.
    pub energy: Vec<f64>,
    /// FLIP over its pixels.
    pub flip: Vec<f64>,
}

/// The sphere that each pixel shows all over.
pub fn seen(tracer: &SceneTracer, view: &View, size: [u32; 2]) -> Vec<Option<usize>> {
    let geometry: &Geometry = tracer.geometry();
    let local = view.relative_to(geometry.origin);
    let pixel = |i: u32| {
        let mut found = [(0.05, 0.05), (0.95, 0.05), (0.05, 0.95), (0.95, 0.95)].map(|(x, y)| {
            let at = Vec2::new((i % size[0]) as f32 + x, (i / size[0]) as f32 + y);
            let (origin, direction) = local.pixel_ray(at, size);
            let hit = tracer.closest_visible(origin, direction)?;
            Some(geometry.triangles[hit.triangle as usize].object as usize)
        });
        let first = found[0].take()?;
        (first < 2 * ROUGHNESS.len() && found[1..].iter().all(|f| *f == Some(first))).then_some(first)
    };
    (0..size[0] * size[1]).map(pixel).collect()
}

/// How well those of metal and of plastic are rendered.
pub fn rows(truth: &Image, picture: &Image, seen: &[Option<usize>]) -> [Row; 2] {
    [true, false].map(|is_metal| {
        let of = |i: usize| {
            let sphere = i + if is_metal { 0 } else { ROUGHNESS.len() };
            let masked = |s: &Option<usize>| if *s == Some(sphere) { Vec3::ZERO } else { Vec3::X };
            let mask = Image { pixels: seen.iter().map(masked).collect(), ..*truth };
            let options = CompareOptions { mask: Some(mask), ..CompareOptions::default() };
            compare(truth, picture, &options).expect("comparable")
        };
        let all: Vec<_> = (0..ROUGHNESS.len()).map(of).collect();
        Row {
            is_metal,
            energy: all.iter().map(|c| c.energy_ratio).collect(),
            flip: all.iter().map(|c| c.flip).collect(),
        }
    })
}
