//! Light samples of several makes in one view, and how far their pictures are from a path tracer's.

use crate::bench::{Bench, Stage};
use crate::report::{Table, number};
use anyhow::Result;
use girandole::{Mode, RenderSettings, RendererOptions};
use girandole_core::brdf::Surface;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole_core::image::{Image, luminance};
use girandole_core::lights::{Clamp, LightSample, LightSettings};
use girandole_core::scene::{Geometry, Scene, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::metrics::{CompareOptions, Comparison, compare};
use girandole_reference::{PathSettings, path_trace, visible};

/// Bounces of light, of samples as of paths.
pub const BOUNCES: u32 = 5;
/// Share of the thesis's samples that lie on emitters: 25 of 300.
const DIRECT_SHARE: f32 = 25.0 / 300.0;
/// Points across a picture, along each axis, at which light is taken apart.
const POINTS: [u32; 2] = [20, 15];
/// Of the worst pixels, which relMSE leaves out: those next to samples without a bound would outweigh all others.
const TRIM: f32 = 0.001;

/// Samples of a make.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    /// In tables and captions.
    pub name: &'static str,
    /// How many are asked for.
    pub count: u32,
    /// Of the thesis: what the random walk leaves, as it comes; it does not see what may move.
    pub of_thesis: bool,
    /// Placed for the view.
    pub for_view: bool,
    /// Close to samples.
    pub clamp: Clamp,
    /// Light sets that are averaged.
    pub sets: u32,
}

/// Ours.
impl Default for Variant {
    fn default() -> Self {
        Self { name: "ours", count: 300, of_thesis: false, for_view: true, clamp: Clamp::Own, sets: 1 }
    }
}

impl Variant {
    /// How light is sampled.
    pub fn lights(&self) -> LightSettings {
        let ours = LightSettings { count: self.count, bounces: BOUNCES, ..LightSettings::default() };
        if !self.of_thesis {
            return ours;
        }
        LightSettings { candidates: 1, direct_share: Some(DIRECT_SHARE), walk_dynamic: false, ..ours }
    }

    /// The light.
    ///
    /// # Errors
    /// Where the scene has none.
    pub fn illumination(&self, scene: &Scene, view: &View) -> Result<Illumination> {
        let settings = IlluminationSettings {
            lights: self.lights(),
            views: if self.for_view { vec![*view] } else { Vec::new() },
            rewalk: Rewalk::Off,
            ..IlluminationSettings::default()
        };
        Ok(Illumination::new(scene, &settings)?)
    }

    /// How a picture is made: every pixel by itself.
    pub fn settings(&self) -> RenderSettings {
        RenderSettings { mode: Mode::Visibility, clamp: self.clamp, ..RenderSettings::default() }
    }

    /// The scene on the device by this light.
    ///
    /// # Errors
    /// Those of [`Bench::stage_with`].
    pub fn stage<'a>(&self, bench: &'a Bench, scene: &Scene, shown: (View, [u32; 2])) -> Result<Stage<'a>> {
        let illumination = self.illumination(scene, &shown.0)?;
        bench.stage_with(scene, RendererOptions::default(), illumination, shown)
    }

    /// The picture on a stage, of all its sets.
    ///
    /// # Errors
    /// Those of [`girandole::Renderer::refine`].
    pub fn picture(&self, bench: &Bench, scene: &Scene, stage: &mut Stage) -> Result<Image> {
        let (view, size) = (stage.view, stage.size);
        while self.sets > 1 && stage.renderer.refined_sets(&stage.viewport) < self.sets {
            stage.renderer.refine(&mut stage.viewport, scene, &view, size, &self.settings())?;
        }
        if self.sets > 1 {
            return Ok(bench.gpu.block_on(stage.renderer.radiance(&stage.viewport))??);
        }
        stage.picture(&self.settings())
    }
}

/// A picture by the path tracer, and what its own noise adds to relMSE.
pub struct Truth {
    /// The picture.
    pub image: Image,
    /// Mean over pixels and channels of σ² / (L² + 0.01).
    pub noise: f64,
}

impl Truth {
    /// By so many paths a pixel.
    pub fn new(scene: &Scene, (view, size): (View, [u32; 2]), paths: u32) -> Self {
        let geometry = Geometry::new(scene);
        let settings = PathSettings { paths, bounces: Some(BOUNCES), seed: 0 };
        let found = path_trace(&SceneTracer::new(scene, &geometry), &view, size, &settings, &|_| ());
        let pairs = found.mean.pixels.iter().zip(&found.variance.pixels);
        let noise = pairs.map(|(mean, variance)| {
            let (mean, variance) = (mean.as_dvec3(), variance.as_dvec3());
            (variance / (mean * mean + 0.01)).element_sum() / 3.0
        });
        let noise = noise.sum::<f64>() / found.mean.pixels.len() as f64;
        Self { image: found.mean, noise }
    }

    /// The error of a picture.
    ///
    /// # Errors
    /// Where it is of another size.
    pub fn error(&self, image: &Image) -> Result<Error> {
        let options = CompareOptions { trim: TRIM, ..CompareOptions::default() };
        let Comparison { rel_mse, flip, energy_ratio, .. } = compare(&self.image, image, &options)?;
        Ok(Error { rel_mse: (rel_mse - self.noise).max(0.0), flip, energy: energy_ratio })
    }
}

/// What each light gives to points that a view sees: luminance of irradiance, and whether it arrives.
pub struct Contributions {
    /// By point, then by light.
    pub points: Vec<Vec<(f64, bool)>>,
}

/// Surface points that a view sees, on a grid over its picture, at wanted places of the world; and their triangles.
pub fn points(tracer: &SceneTracer, view: &View, wanted: impl Fn(Vec3) -> bool) -> Vec<(Surface, u32)> {
    let geometry = tracer.geometry();
    let local = view.relative_to(geometry.origin);
    let surface = |i: u32| {
        let at = Vec2::new((i % POINTS[0]) as f32, (i / POINTS[0]) as f32) + 0.5;
        let (origin, direction) = local.pixel_ray(at, POINTS);
        let hit = tracer.closest_visible(origin, direction)?;
        let wo = -direction.normalize();
        Some((geometry.surface(tracer.scene(), hit.triangle, hit.barycentric, wo), hit.triangle))
    };
    let found = (0..POINTS[0] * POINTS[1]).filter_map(surface);
    found.filter(|(surface, _)| wanted(surface.position + geometry.origin.as_vec3())).collect()
}

impl Contributions {
    /// At these points.
    pub fn new(
        tracer: &SceneTracer,
        points: &[(Surface, u32)],
        (lights, clamp): (&[LightSample], Clamp),
    ) -> Self {
        let of_light = |surface: &Surface, triangle: u32, light: &LightSample| {
            let (position, normal) = (surface.position, surface.geometric_normal);
            let factor = light.geometric_factor(position, normal, surface.shading_normal, clamp);
            let arrives = factor.is_some() && visible(tracer, surface, triangle, light);
            let strength = f64::from(factor.map_or(0.0, |(g, _)| g) * luminance(light.intensity));
            (strength, arrives)
        };
        let at = |(surface, triangle): &(Surface, u32)| {
            lights.iter().map(|light| of_light(surface, *triangle, light)).collect()
        };
        Self { points: points.iter().map(at).collect() }
    }

    /// How many lights arrive at a point, in the mean over points.
    pub fn arriving(&self) -> f64 {
        let at = |point: &Vec<(f64, bool)>| point.iter().filter(|c| c.1 && c.0 > 0.0).count();
        self.points.iter().map(at).sum::<usize>() as f64 / self.points.len().max(1) as f64
    }

    /// How many equal lights would vary as much as those that light a point, in the mean over points: (Σ c)² / Σ c².
    pub fn effective(&self) -> f64 {
        let lit = self.points.iter().filter_map(|point| {
            let arriving = || point.iter().filter(|c| c.1).map(|c| c.0);
            let squares: f64 = arriving().map(|c| c * c).sum();
            (squares > 0.0).then(|| arriving().sum::<f64>().powi(2) / squares)
        });
        let lit: Vec<f64> = lit.collect();
        lit.iter().sum::<f64>() / lit.len().max(1) as f64
    }
}

/// What is known of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Error {
    /// Without what the truth's own noise adds.
    pub rel_mse: f64,
    /// The truth's noise is part of it.
    pub flip: f64,
    /// Mean over the truth's.
    pub energy: f64,
}

/// A table of variants; each figure has columns of its own.
pub fn table(own: &[&str]) -> Table {
    let columns: Vec<&str> =
        ["samples", "lights"].iter().chain(own).chain(&["relMSE", "FLIP", "energy"]).copied().collect();
    Table::new("errors", "Errors to the path tracer", &columns)
}

/// A row of it.
pub fn row(table: &mut Table, name: &str, lights: usize, own: &[String], error: &Error) {
    let mut cells = vec![name.to_owned(), lights.to_string()];
    cells.extend_from_slice(own);
    cells.extend([error.rel_mse, error.flip, error.energy].map(|value| number(value, 4)));
    table.rows.push(cells);
}
