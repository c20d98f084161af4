//! Mirror images: rays that smooth surfaces reflect.

use super::{OracleSettings, Sum, mirrored};
use girandole_core::brdf::{Surface, mirror_share, mirror_solid_angle};
use girandole_core::glam::{DVec3, Vec3};
use girandole_core::lights::Clamp;
use std::f32::consts::TAU;

/// Rays over a lobe that is wider than a pixel.
const RAYS: u32 = 8;
/// Lobes that one ray stands for.
const NARROW_ALPHA: f32 = 0.004;
/// How far bent normals' rays are kept off their surface, as a cosine.
const LEAST_HEIGHT: f32 = 0.01;

/// What of a surface's reflection mirrored rays find.
pub(super) struct MirrorImage {
    /// Share of its lobe.
    pub share: f32,
    /// What it makes of what they bring.
    reflectance: Vec3,
}

impl MirrorImage {
    /// Nothing where all of it is left to light samples.
    pub fn of(surface: &Surface, wo: Vec3, lights: usize, settings: &OracleSettings) -> Option<Self> {
        if settings.mirrors == 0 || settings.clamp != Clamp::Own || !surface.is_specular() {
            return None;
        }
        let x = 1.0 - surface.shading_normal.dot(wo).clamp(0.0, 1.0);
        let fresnel = surface.f0 + (Vec3::splat(surface.f90) - surface.f0) * (x * x * x * x * x);
        let share = mirror_share(surface.alpha, fresnel.max_element(), mirror_solid_angle(lights));
        (share > 0.0).then_some(Self { share, reflectance: fresnel * share })
    }

    /// The radiance that they bring, as the surface reflects it. The sums at their ends have a ray less to send.
    pub fn radiance(
        &self,
        sum: &Sum,
        (surface, triangle, wo): (&Surface, u32, Vec3),
        settings: &OracleSettings,
        occluders: &mut [u32],
    ) -> DVec3 {
        let origin = sum.tracer.offset_ray_origin(surface.position, surface.geometric_normal);
        let left = OracleSettings { mirrors: settings.mirrors - 1, ..*settings };
        let rays = if surface.alpha < NARROW_ALPHA { 1 } else { RAYS };
        let brought: DVec3 = (0..rays)
            .map(|ray| {
                let normal = if rays == 1 { surface.shading_normal } else { facet(surface, ray) };
                let facing = Surface { shading_normal: normal, ..*surface };
                let direction = off_surface(mirrored(&facing, wo), surface.geometric_normal);
                incoming(sum, (origin, direction), (triangle, surface.alpha), &left, occluders)
            })
            .sum();
        self.reflectance.as_dvec3() * brought / f64::from(rays)
    }
}

/// A microfacet of a GGX surface; of `RAYS`, all alike in weight.
fn facet(surface: &Surface, ray: u32) -> Vec3 {
    let u = (ray as f32 + 0.5) / RAYS as f32;
    let a2 = surface.alpha * surface.alpha;
    let cos2 = (1.0 - u) / (1.0 + u * (a2 - 1.0));
    let (sine, cosine) = ((1.0 - cos2).max(0.0).sqrt(), cos2.sqrt());
    let (s, c) = libm::sincosf(TAU * (ray as f32 * 0.618_034).fract());
    let (tangent, bitangent) = surface.shading_normal.any_orthonormal_pair();
    (tangent * (sine * c) + bitangent * (sine * s) + surface.shading_normal * cosine).normalize()
}

fn off_surface(direction: Vec3, geometric: Vec3) -> Vec3 {
    let height = direction.dot(geometric);
    (direction + geometric * ((LEAST_HEIGHT - height).max(0.0) * 2.0)).normalize()
}

/// What is sent along a ray to its origin.
fn incoming(
    sum: &Sum,
    (origin, direction): (Vec3, Vec3),
    (triangle, alpha): (u32, f32),
    settings: &OracleSettings,
    occluders: &mut [u32],
) -> DVec3 {
    let tracer = sum.tracer;
    let Some(hit) = tracer.closest_hit(origin, direction, f32::INFINITY, triangle) else {
        let environment = tracer.scene().environment.as_ref();
        return environment.map_or(DVec3::ZERO, |e| e.reflected(direction, alpha).as_dvec3());
    };
    let surface = tracer.geometry().surface(tracer.scene(), hit.triangle, hit.barycentric, -direction);
    if let Some(radiance) = sum.transferred(&surface, &hit, -direction) {
        return radiance;
    }
    let nowhere = || [Vec3::ZERO; 2];
    sum.radiance(&surface, hit.triangle, -direction, (settings, &nowhere), occluders)
}
