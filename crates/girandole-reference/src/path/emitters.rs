//! Emitters: points on emissive triangles, uniform over the area, and punctual lights.

use super::random::Random;
use girandole_core::glam::{DVec3, Vec2, Vec3};
use girandole_core::scene::{PunctualKind, PunctualLight};
use girandole_core::trace::SceneTracer;

/// Emissive triangles, drawn in proportion to area × strongest channel of the material's emission.
pub(super) struct Emitters {
    triangles: Vec<u32>,
    cumulative: Vec<f64>,
    /// Density per area, m⁻², for each triangle of the geometry; 0 = emits nothing.
    pdf_area: Vec<f32>,
    double_sided: Vec<bool>,
}

pub(super) struct EmitterPoint {
    pub(super) triangle: u32,
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    pub(super) emission: Vec3,
    pub(super) double_sided: bool,
}

impl Emitters {
    pub(super) fn new(tracer: &SceneTracer) -> Self {
        let (scene, geometry) = (tracer.scene(), tracer.geometry());
        let material = |i: u32| &scene.materials[geometry.triangles[i as usize].material];
        let all = 0..geometry.triangles.len() as u32;
        let strength = |i: u32| f64::from(material(i).emission.max_element().max(0.0));
        let triangles: Vec<u32> = all.clone().filter(|&i| material(i).emits()).collect();
        let mut total = 0.0;
        let cumulative = triangles
            .iter()
            .map(|&i| {
                total += strength(i) * f64::from(geometry.area(i));
                total
            })
            .collect();
        let pdf_area = all.clone().map(|i| if total > 0.0 { (strength(i) / total) as f32 } else { 0.0 });
        Self {
            triangles,
            cumulative,
            pdf_area: pdf_area.collect(),
            double_sided: all.map(|i| material(i).double_sided).collect(),
        }
    }

    pub(super) fn sample(&self, tracer: &SceneTracer, random: &mut Random) -> Option<EmitterPoint> {
        let chosen = random.fine_unit() * self.cumulative.last()?;
        let index = self.cumulative.partition_point(|&c| c <= chosen).min(self.triangles.len() - 1);
        let triangle = self.triangles[index];
        let (root, along) = (random.unit().sqrt(), random.unit());
        let barycentric = Vec2::new(root * (1.0 - along), root * along);
        let (scene, geometry) = (tracer.scene(), tracer.geometry());
        let cut_out = geometry.is_cut_out(scene, triangle, barycentric);
        Some(EmitterPoint {
            triangle,
            position: geometry.point(triangle, barycentric),
            normal: geometry.normal(triangle),
            emission: if cut_out { Vec3::ZERO } else { geometry.emission(scene, triangle, barycentric) },
            double_sided: self.double_sided[triangle as usize],
        })
    }

    /// Density per solid angle at `from` with which [`Emitters::sample`] finds point `to` of a triangle, sr⁻¹.
    pub(super) fn pdf_solid_angle(&self, triangle: u32, normal: Vec3, from: Vec3, to: Vec3) -> f32 {
        let d = to - from;
        let r2 = d.length_squared();
        let cosine = (normal.dot(d) / r2.sqrt()).abs();
        if cosine > 0.0 { self.pdf_area[triangle as usize] * r2 / cosine } else { 0.0 }
    }
}

/// A punctual light in world space.
pub(super) struct Punctual {
    position: Vec3,
    forward: Vec3,
    light: PunctualLight,
}

impl Punctual {
    pub(super) fn all(tracer: &SceneTracer) -> Vec<Self> {
        let scene = tracer.scene();
        let world_from_nodes = scene.world_from_nodes();
        let in_world = |(index, light): (usize, &PunctualLight)| {
            let affine = world_from_nodes[light.node.index()];
            Self {
                position: tracer.geometry().light_position(index.into(), &affine),
                forward: affine.transform_vector3(DVec3::NEG_Z).normalize_or_zero().as_vec3(),
                light: light.clone(),
            }
        };
        scene.lights.iter().enumerate().map(in_world).collect()
    }

    /// The end of a shadow ray from a point, the unit direction to it, and the irradiance on a surface there
    /// that faces it, W/m². `extent` is that of the scene's bounds, metres.
    pub(super) fn towards(&self, from: Vec3, extent: f32) -> (Vec3, Vec3, Vec3) {
        if self.light.kind == PunctualKind::Directional {
            let far = from.length() + 2.0 * extent;
            return (from - self.forward * far, -self.forward, self.light.intensity);
        }
        let d = self.position - from;
        let wi = d.normalize_or_zero();
        let cone = match self.light.kind {
            PunctualKind::Spot { inner, outer } => {
                let (full, zero) = (libm::cosf(inner), libm::cosf(outer));
                let x = ((-wi.dot(self.forward) - zero) / (full - zero).max(1e-3)).clamp(0.0, 1.0);
                x * x
            }
            _ => 1.0,
        };
        (self.position, wi, self.light.intensity * (cone / d.length_squared().max(f32::MIN_POSITIVE)))
    }
}
