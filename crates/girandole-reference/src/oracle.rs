//! The exact many-light sum: every light of a set at every pixel, visibility by traced rays.

mod mirrors;

use crate::tiles;
use girandole_core::brdf::{
    Surface, directional_albedo, footprint_alpha, resolved_share, sample_weight, specular_brdf,
    widened_alpha, widened_gain,
};
use girandole_core::glam::{DVec3, Vec2, Vec3};
use girandole_core::image::{Image, luminance};
use girandole_core::lights::{Clamp, LightSample, LightSet, Profile, mean_solid_angle};
use girandole_core::scene::{Environment, LocalView, NONE, View};
use girandole_core::trace::{Hit, SceneTracer};
use girandole_core::transfer::TransferredLight;
use girandole_core::visibility::{State, VisibilityDatabase};
use mirrors::MirrorImage;
use std::f32::consts::FRAC_1_PI;

/// How the sum is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OracleSettings {
    /// A pixel is the mean of this many rays in x and in y, on a regular grid (box filter). 1 = its centre only;
    /// 0 counts as 1.
    pub samples_per_axis: u32,
    /// Bound on the geometric factor near samples.
    pub clamp: Clamp,
    /// How it is decided whether what is reflected sees the environment, as far as samples do not resolve it.
    pub reflected: Reflected,
    /// Mirror images: how many rays follow one another from what is smooth, as far as light samples do not resolve its lobe; with
    /// [`Clamp::Own`] alone.
    pub mirrors: u32,
}

/// How it is decided whether what a surface reflects is the environment, or something in its way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reflected {
    /// By a ray for what is sharper than samples are spaced, by samples else.
    #[default]
    Rays,
    /// By what samples in that direction see, as the renderer does.
    Samples,
}

impl Default for OracleSettings {
    /// Pixel centres, exact: what a frame without anti-aliasing and clamp is compared with.
    fn default() -> Self {
        Self { samples_per_axis: 1, clamp: Clamp::Off, reflected: Reflected::default(), mirrors: 2 }
    }
}

/// The picture that a light set gives, exactly: at each point seen, `L = Le + Σ (ρ/π + f) · I · V · G` over all
/// lights (Barczak §4.1; f is the specular BRDF), V by traced rays. With [`Clamp::Own`], lobes are widened as far as samples demand,
/// and what they cannot show of an environment comes from its prefiltered maps. What is seen through surfaces that let light through is
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
    picture(&Sum::new(tracer, lights, None), view, size, settings, progress)
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
    let sum = Sum::new(tracer, lights, Some(database));
    picture(&sum, view, size, settings, progress)
}

/// [`oracle`] with objects that are lit by precomputed radiance transfer: what they receive comes from there.
pub fn oracle_with_transfer(
    tracer: &SceneTracer,
    lights: &LightSet,
    transferred: &TransferredLight,
    view: &View,
    size: [u32; 2],
    settings: &OracleSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Image {
    let sum = Sum { transferred: Some(transferred), ..Sum::new(tracer, lights, None) };
    picture(&sum, view, size, settings, progress)
}

/// The lights to sum, and how their visibility is determined.
struct Sum<'a> {
    tracer: &'a SceneTracer<'a>,
    lights: &'a [LightSample],
    database: Option<&'a VisibilityDatabase>,
    /// What some objects receive instead.
    transferred: Option<&'a TransferredLight>,
    /// Mean solid angle of the samples of the environment, sr.
    solid_angle: f32,
}

/// What a surface reflects of the environment beyond what light samples resolve.
struct Reflection<'a> {
    environment: &'a Environment,
    direction: Vec3,
    /// Share of the lobe that samples resolve.
    resolved: f32,
    /// Weights of the samples that are seen, and of all.
    seen: f32,
    all: f32,
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
    let sum = Sum::new(tracer, lights, None);
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
    let sum = Sum::new(tracer, lights, None);
    let settings = OracleSettings { clamp, ..OracleSettings::default() };
    let a_point = || [Vec3::ZERO; 2];
    sum.radiance(surface, triangle, wo, (&settings, &a_point), &mut occluders).as_vec3()
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

impl<'a> Sum<'a> {
    fn new(
        tracer: &'a SceneTracer<'a>,
        lights: &'a LightSet,
        database: Option<&'a VisibilityDatabase>,
    ) -> Self {
        let lights = lights.samples();
        Self { tracer, lights, database, transferred: None, solid_angle: mean_solid_angle(lights) }
    }

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
                let hit = tracer.closest_visible_within(origin, direction, view.clip.reach());
                let wo = -direction.normalize();
                let mut passed = DVec3::ONE;
                let reach = hit.map_or(view.clip.reach(), |hit| hit.t);
                let through = tracer.transparent_hits(origin, direction, reach);
                let visible = through.into_iter().filter(|hit| tracer.is_visible(hit.triangle, direction));
                for hit in visible.chain(hit) {
                    let surface =
                        tracer.geometry().surface(tracer.scene(), hit.triangle, hit.barycentric, wo);
                    if let Some(radiance) = self.transferred(&surface, &hit, wo) {
                        total += passed * radiance;
                        passed *= surface.transmittance.as_dvec3();
                        continue;
                    }
                    let beside = |shift: Vec2| {
                        let at = Vec2::new(x as f32, y as f32) + within + shift / n as f32;
                        let (origin, direction) = view.pixel_ray(at, size);
                        self.mirrored(hit.triangle, origin, direction)
                    };
                    let footprint = || {
                        let here = mirrored(&surface, wo);
                        [Vec2::X, Vec2::Y].map(|shift| beside(shift) - here)
                    };
                    let settings = (settings, &footprint as &dyn Fn() -> [Vec3; 2]);
                    total += passed * self.radiance(&surface, hit.triangle, wo, settings, occluders);
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

    /// What is sent where transfer lights an object, if it does.
    fn transferred(&self, surface: &Surface, hit: &Hit, wo: Vec3) -> Option<DVec3> {
        let geometry = self.tracer.geometry();
        let front = geometry.normal(hit.triangle).dot(wo) >= 0.0;
        let irradiance = self.transferred?.irradiance(geometry, (hit.triangle, front), hit.barycentric)?;
        Some((surface.emission + surface.albedo * FRAC_1_PI * irradiance).as_dvec3())
    }

    /// `footprint` is how what a mirror shows changes from one edge of the pixel to the other, in x and in y.
    fn radiance(
        &self,
        surface: &Surface,
        triangle: u32,
        wo: Vec3,
        (settings, footprint): (&OracleSettings, &dyn Fn() -> [Vec3; 2]),
        occluders: &mut [u32],
    ) -> DVec3 {
        let emission = surface.emission.as_dvec3();
        let diffuse = surface.albedo * FRAC_1_PI;
        if diffuse == Vec3::ZERO && !surface.is_specular() {
            return emission;
        }
        let clamp = settings.clamp;
        let origin = self.tracer.offset_ray_origin(surface.position, surface.geometric_normal);
        let front = self.tracer.geometry().normal(triangle).dot(wo) >= 0.0;
        let states = self.database.and_then(|database| {
            let leaf = database.receivers().leaf_at(triangle, surface.position, front)?;
            Some(database.leaf_states(leaf))
        });
        let mirror = MirrorImage::of(surface, wo, self.lights.len(), settings);
        let mut reflection = self.reflection(surface, wo, clamp).filter(|_| mirror.is_none());
        let mut reflected = DVec3::ZERO;
        for (index, (light, last)) in self.lights.iter().zip(&mut *occluders).enumerate() {
            let weight = reflection.as_mut().map_or(0.0, |r| r.add(surface, light));
            let (position, geometric) = (surface.position, surface.geometric_normal);
            let state = match states {
                _ if !light.is_before(position, geometric, surface.shading_normal) => State::Unoccluded,
                Some(states) => states[index],
                None => State::Partial,
            };
            if state == State::Full {
                continue;
            }
            let factor = light.geometric_factor(position, geometric, surface.shading_normal, clamp);
            let Some((factor, wi)) = factor else { continue };
            let mut brdf = diffuse;
            if surface.is_specular() {
                let alpha = match clamp {
                    Clamp::Own => widened_alpha(surface.alpha, light.solid_angle(surface.position)),
                    _ => surface.alpha,
                };
                let resolved = match (&mirror, &reflection, light.profile) {
                    // No ray meets what is punctual.
                    (Some(mirror), _, Profile::Cosine | Profile::Lobe { .. } | Profile::Distant { .. }) => {
                        1.0 - mirror.share
                    }
                    (None, Some(reflection), Profile::Distant { .. }) => reflection.resolved,
                    _ => 1.0,
                };
                let share = resolved * widened_gain(surface.shading_normal.dot(wo), surface.alpha, alpha);
                brdf += share * specular_brdf(surface.shading_normal, wo, wi, surface.f0, surface.f90, alpha);
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
                None => {
                    reflected += contribution.as_dvec3();
                    reflection.iter_mut().for_each(|r| r.seen += weight);
                }
            }
        }
        if let Some(reflection) = reflection {
            let seen = match settings.reflected {
                Reflected::Samples => reflection.share_seen(),
                Reflected::Rays => {
                    let seen = f32::from(u8::from(self.sees_beyond(
                        surface,
                        triangle,
                        origin,
                        reflection.direction,
                    )));
                    seen + (reflection.share_seen() - seen) * reflection.resolved
                }
            };
            if seen > 0.0 {
                reflected += (reflection.radiance(surface, wo, footprint()) * seen).as_dvec3();
            }
        }
        if let Some(mirror) = mirror {
            reflected += mirror.radiance(self, (surface, triangle, wo), settings, occluders);
        }
        emission + reflected
    }

    /// What to take from the environment's own maps, if there is any.
    fn reflection(&self, surface: &Surface, wo: Vec3, clamp: Clamp) -> Option<Reflection<'_>> {
        let environment = self.tracer.scene().environment.as_ref()?;
        if clamp != Clamp::Own || !surface.is_specular() || self.solid_angle <= 0.0 {
            return None;
        }
        Some(Reflection {
            environment,
            direction: mirrored(surface, wo),
            resolved: resolved_share(surface.alpha, self.solid_angle),
            seen: 0.0,
            all: 0.0,
        })
    }

    /// What a ray shows where it meets a triangle's plane, if that is a mirror.
    fn mirrored(&self, triangle: u32, origin: Vec3, direction: Vec3) -> Vec3 {
        let geometry = self.tracer.geometry();
        let [a, b, c] =
            geometry.triangles[triangle as usize].vertices.map(|v| geometry.positions[v as usize] - origin);
        let (e1, e2) = (b - a, c - a);
        let p = direction.cross(e2);
        let q = (-a).cross(e1);
        let barycentric = Vec2::new(-a.dot(p), direction.dot(q)) / e1.dot(p);
        let wo = -direction.normalize();
        mirrored(&geometry.surface(self.tracer.scene(), triangle, barycentric, wo), wo)
    }

    /// Whether a ray from a surface leaves the scene.
    fn sees_beyond(&self, surface: &Surface, triangle: u32, origin: Vec3, direction: Vec3) -> bool {
        let end = origin + direction * (origin.length() + 2.0 * self.tracer.geometry().extent());
        surface.geometric_normal.dot(direction) > 0.0 && !self.tracer.occluded(origin, triangle, end, NONE)
    }
}

impl Reflection<'_> {
    /// Counts a light sample; its weight.
    fn add(&mut self, surface: &Surface, light: &LightSample) -> f32 {
        let Profile::Distant { solid_angle, .. } = light.profile else { return 0.0 };
        let lobe = sample_weight(self.direction, -light.normal, surface.alpha, solid_angle);
        let weight = luminance(light.intensity) * lobe;
        self.all += weight;
        weight
    }

    /// Share of what is reflected that samples see.
    fn share_seen(&self) -> f32 {
        if self.all > 0.0 { self.seen / self.all } else { 0.0 }
    }

    /// What is reflected if nothing is in its way, but for what samples resolve.
    fn radiance(&self, surface: &Surface, wo: Vec3, footprint: [Vec3; 2]) -> Vec3 {
        let albedo = directional_albedo(surface.shading_normal.dot(wo), surface.alpha);
        let share = surface.f0 * albedo.x + surface.f90 * albedo.y;
        let alpha = footprint_alpha(surface.alpha, footprint);
        self.environment.reflected(self.direction, alpha) * share * (1.0 - self.resolved)
    }
}

/// The direction that a mirror shows.
fn mirrored(surface: &Surface, wo: Vec3) -> Vec3 {
    let normal = surface.shading_normal;
    normal * (2.0 * normal.dot(wo)) - wo
}
