//! The exact many-light sum: every light of a set at every pixel, visibility by traced rays.

use crate::tiles;
use girandole_core::brdf::{Surface, specular_brdf, widened_alpha};
use girandole_core::glam::{DVec3, Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSample, LightSet};
use girandole_core::scene::{LocalView, NONE, View};
use girandole_core::trace::SceneTracer;
use girandole_core::visibility::{State, VisibilityDatabase};
use std::f32::consts::FRAC_1_PI;

/// How the sum is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleSettings {
    /// A pixel is the mean of this many rays in x and in y, on a regular grid (box filter). 1 = its centre only;
    /// 0 counts as 1.
    pub samples_per_axis: u32,
    /// Bound on the geometric factor near samples.
    pub clamp: Clamp,
}

impl Default for OracleSettings {
    /// Pixel centres, exact: what a frame without anti-aliasing and clamp is compared with.
    fn default() -> Self {
        Self { samples_per_axis: 1, clamp: Clamp::Off }
    }
}

/// The picture that a light set gives, exactly: at each point seen, `L = Le + Σ (ρ/π + f) · I · V · G` over all
/// lights (Barczak §4.1; f is the specular BRDF), V by traced rays. What is seen through surfaces that let light through is
/// weakened by them; light that falls through them is not. Radiance, W/(sr·m²); the background is the environment.
///
/// Threads and tiles do not change the result. `progress` is called with the finished share, 0 to 1, from any thread.
pub fn oracle(
    tracer: &SceneTracer,
    lights: &LightSet,
    view: &View,
    size: [u32; 2],
    settings: &OracleSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Image {
    picture(&Sum { tracer, lights: lights.samples(), database: None }, view, size, settings, progress)
}

/// [`oracle`] with rays only for the pairs that a visibility database for the same lights marks as partial: an unoccluded
/// light is added without one, a fully occluded one not at all. If the database is right, the picture is the same.
pub fn oracle_with_states(
    tracer: &SceneTracer,
    lights: &LightSet,
    database: &VisibilityDatabase,
    view: &View,
    size: [u32; 2],
    settings: &OracleSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Image {
    let sum = Sum { tracer, lights: lights.samples(), database: Some(database) };
    picture(&sum, view, size, settings, progress)
}

/// The lights to sum, and how their visibility is determined.
struct Sum<'a> {
    tracer: &'a SceneTracer<'a>,
    lights: &'a [LightSample],
    database: Option<&'a VisibilityDatabase>,
}

fn picture(
    sum: &Sum,
    view: &View,
    size: [u32; 2],
    settings: &OracleSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Image {
    let view = view.relative_to(sum.tracer.geometry().origin);
    let pixels = tiles::render(
        size,
        progress,
        || vec![NONE; sum.lights.len()],
        |occluders, pixel| sum.pixel(&view, size, pixel, settings, occluders),
    );
    Image { width: size[0], height: size[1], pixels }
}

/// One pixel of [`oracle`], the same bits.
pub fn oracle_pixel(
    tracer: &SceneTracer,
    lights: &LightSet,
    view: &View,
    size: [u32; 2],
    pixel: [u32; 2],
    settings: &OracleSettings,
) -> Vec3 {
    let mut occluders = vec![NONE; lights.len()];
    let sum = Sum { tracer, lights: lights.samples(), database: None };
    let view = view.relative_to(tracer.geometry().origin);
    sum.pixel(&view, size, pixel, settings, &mut occluders)
}

/// The sum at a point of `triangle`, seen from direction `wo` (unit, away from the surface): its emission and what it
/// reflects of all lights, W/(sr·m²).
pub fn radiance(
    tracer: &SceneTracer,
    lights: &LightSet,
    surface: &Surface,
    triangle: u32,
    wo: Vec3,
    clamp: Clamp,
) -> Vec3 {
    let mut occluders = vec![NONE; lights.len()];
    let sum = Sum { tracer, lights: lights.samples(), database: None };
    sum.radiance(surface, triangle, wo, clamp, &mut occluders).as_vec3()
}

/// Whether nothing lies between a surface point and a light: the point is offset from its triangle, and neither that
/// one nor the light's own counts. Whether the two face each other is not tested, see
/// [`LightSample::geometric_factor`].
pub fn visible(tracer: &SceneTracer, surface: &Surface, triangle: u32, light: &LightSample) -> bool {
    occluder(
        tracer,
        tracer.offset_ray_origin(surface.position, surface.geometric_normal),
        triangle,
        light,
        NONE,
    )
    .is_none()
}

fn occluder(
    tracer: &SceneTracer,
    origin: Vec3,
    triangle: u32,
    light: &LightSample,
    likely: u32,
) -> Option<u32> {
    tracer.occluder(
        origin,
        triangle,
        light.shadow_ray_end(origin, tracer.geometry()),
        light.triangle(),
        likely,
    )
}

impl Sum<'_> {
    /// `occluders` caches for each light the last triangle that blocked it: it saves most of the traversal and never
    /// changes the result.
    fn pixel(
        &self,
        view: &LocalView,
        size: [u32; 2],
        [x, y]: [u32; 2],
        settings: &OracleSettings,
        occluders: &mut [u32],
    ) -> Vec3 {
        let n = settings.samples_per_axis.max(1);
        let tracer = self.tracer;
        let mut total = DVec3::ZERO;
        for j in 0..n {
            for i in 0..n {
                let within = (Vec2::new(i as f32, j as f32) + 0.5) / n as f32;
                let (origin, direction) = view.pixel_ray(Vec2::new(x as f32, y as f32) + within, size);
                let hit = tracer.closest_visible(origin, direction);
                let wo = -direction.normalize();
                let mut passed = DVec3::ONE;
                let reach = hit.map_or(f32::INFINITY, |hit| hit.t);
                let through = tracer.transparent_hits(origin, direction, reach);
                let visible = through.into_iter().filter(|hit| tracer.is_visible(hit.triangle, direction));
                for hit in visible.chain(hit) {
                    let surface =
                        tracer.geometry().surface(tracer.scene(), hit.triangle, hit.barycentric, wo);
                    total += passed * self.radiance(&surface, hit.triangle, wo, settings.clamp, occluders);
                    passed *= surface.transmittance.as_dvec3();
                }
                if let (None, Some(environment)) = (hit, &tracer.scene().environment)
                    && environment.visible
                {
                    total += passed * environment.radiance(direction.normalize()).as_dvec3();
                }
            }
        }
        (total / f64::from(n * n)).as_vec3()
    }

    fn radiance(
        &self,
        surface: &Surface,
        triangle: u32,
        wo: Vec3,
        clamp: Clamp,
        occluders: &mut [u32],
    ) -> DVec3 {
        let emission = surface.emission.as_dvec3();
        let diffuse = surface.albedo * FRAC_1_PI;
        if diffuse == Vec3::ZERO && !surface.is_specular() {
            return emission;
        }
        let origin = self.tracer.offset_ray_origin(surface.position, surface.geometric_normal);
        let front = self.tracer.geometry().normal(triangle).dot(wo) >= 0.0;
        let states = self.database.and_then(|database| {
            let leaf = database.receivers().leaf_at(triangle, surface.position, front)?;
            Some(database.leaf_states(leaf))
        });
        let mut reflected = DVec3::ZERO;
        for (index, (light, last)) in self.lights.iter().zip(occluders).enumerate() {
            let state = states.map_or(State::Partial, |s| s[index]);
            if state == State::Full {
                continue;
            }
            let (position, geometric) = (surface.position, surface.geometric_normal);
            let factor = light.geometric_factor(position, geometric, surface.shading_normal, clamp);
            let Some((factor, wi)) = factor else { continue };
            let mut brdf = diffuse;
            if surface.is_specular() {
                let alpha = match clamp {
                    Clamp::Own => widened_alpha(surface.alpha, light.solid_angle(surface.position)),
                    _ => surface.alpha,
                };
                brdf += specular_brdf(surface.shading_normal, wo, wi, surface.f0, surface.f90, alpha);
            }
            let contribution = brdf * light.intensity * factor;
            if contribution == Vec3::ZERO {
                continue;
            }
            let blocking = match state {
                State::Unoccluded => None,
                _ => occluder(self.tracer, origin, triangle, light, *last),
            };
            match blocking {
                Some(blocking) => *last = blocking,
                None => reflected += contribution.as_dvec3(),
            }
        }
        emission + reflected
    }
}
