//! Light for scenes that bring none, or too little.

use super::added_light::AddedLight;
use super::defaults::{inside, is_enclosed};
use super::environment::pixel_direction;
use super::{
    ClipPlanes, Environment, FieldOfView, Geometry, Material, MaterialId, PunctualKind, PunctualLight, Scene,
    Transform, View, Viewpoint,
};
use crate::image::Image;
use crate::lights::{LightSet, LightSettings, share_reached};
use crate::slices::{complete, pause};
use crate::trace::SceneTracer;
use glam::{DVec3, Vec2, Vec3};

/// Irradiance that a lamp under a ceiling gives a room's middle, W/m²: a white wall then shines with about 1 W/(sr·m²).
const IRRADIANCE: f32 = 3.0;
/// Aspect of the picture by which light is judged.
pub(super) const ASPECT: f32 = 4.0 / 3.0;
/// Light that reaches less than this share of what is seen is no lighting.
const LEAST_REACHED: f32 = 0.5;
/// By which it is judged.
const SAMPLES: u32 = 128;

/// Pixels of a studio's map.
const SIZE: [u32; 2] = [128, 64];
/// Radiance of a studio's dome from the ground, the horizon and the zenith, W/(sr·m²).
const DOME: [f32; 3] = [0.08, 0.2, 0.4];

/// A soft light in a studio.
struct SoftLight {
    /// From the scene to it, of a view towards −Z.
    direction: Vec3,
    /// Its radius, as a cosine, and where it has faded.
    cosines: [f32; 2],
    /// W/(sr·m²).
    radiance: f32,
}

/// A key light to the left above the camera, and a fill light to its right.
const LIGHTS: [SoftLight; 2] = [
    SoftLight { direction: Vec3::new(-0.55, 0.7, 0.45), cosines: [0.92, 0.85], radiance: 3.1 },
    SoftLight { direction: Vec3::new(0.9, 0.25, 0.35), cosines: [0.85, 0.7], radiance: 0.5 },
];

/// What lights a scene beside its own light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DefaultLight {
    /// A studio where the scene's own light reaches less than half of what its first camera sees; in closed rooms, which it cannot
    /// come into, a lamp under the ceiling.
    #[default]
    Auto,
    /// Nothing.
    None,
    /// A studio ([`Environment::studio`]), in any case.
    Studio,
}

impl Environment {
    /// A photographer's studio: a grey dome, a soft key light to the left above a camera that looks along `forward`, and a weaker fill
    /// light to its right. What faces the key light has an irradiance of about 3 W/m².
    pub fn studio(forward: Vec3) -> Self {
        let pixel = |i: u32| {
            let direction = pixel_direction(i, SIZE).as_vec3();
            let y = direction.y;
            let [ground, horizon, zenith] = DOME;
            let dome = horizon + (if y < 0.0 { ground } else { zenith } - horizon) * y.abs();
            let of = |light: &SoftLight| {
                let [inner, outer] = light.cosines;
                let cosine = light.direction.normalize().dot(direction);
                let t = ((cosine - outer) / (inner - outer)).clamp(0.0, 1.0);
                light.radiance * t * t * (3.0 - 2.0 * t)
            };
            Vec3::splat(dome + LIGHTS.iter().map(of).sum::<f32>())
        };
        let image =
            Image { width: SIZE[0], height: SIZE[1], pixels: (0..SIZE[0] * SIZE[1]).map(pixel).collect() };
        let map = super::EnvironmentMap::of(image);
        Self { map: map.into(), strength: 1.0, rotation: libm::atan2f(-forward.x, -forward.z), visible: true }
    }
}

impl Scene {
    /// Adds light if the scene's own reaches less than half of what its first camera sees, and says so in a warning: a
    /// [studio](Environment::studio), or a lamp under the ceiling of a closed room that gives its middle an irradiance of 3 W/m². Where
    /// neither would reach it, as under a dome or in a shade, it is a lamp elsewhere. If that camera sees nothing but backs, which are
    /// not drawn, all of it is shown from both sides. What does not reflect needs no light.
    pub fn ensure_light(&mut self) {
        complete(self.ensure_light_in_slices(Geometry::new(self)));
    }

    /// The same with pauses.
    pub(super) async fn ensure_light_in_slices(&mut self, mut geometry: Geometry) {
        if self.shows_backs_alone(&geometry) {
            self.warn(format!(
                "what the first camera of `{}` looks at turns its back to it, which is not drawn: all is shown from both sides; turn its normals around",
                self.name
            ));
            self.materials.iter_mut().for_each(|material| material.double_sided = true);
            geometry = Geometry::in_slices(self).await;
        }
        let used: Vec<&Material> = geometry.triangles.iter().map(|t| &self.materials[t.material]).collect();
        if !used.is_empty() && used.iter().all(|material| material.unlit) {
            return;
        }
        let reached = self.reached(&geometry).await;
        let is_little = reached.is_some_and(|share| share < LEAST_REACHED);
        let is_outside = is_little && self.is_seen_from_outside(&geometry).await;
        let what = match reached {
            None if self.shines() => format!("what emits in `{}` has no area, or is cut away", self.name),
            None => format!("`{}` has no light", self.name),
            // What is black from outside is meant to be.
            Some(share) if is_outside => {
                self.warn(format!(
                    "the light of `{}` reaches {:.0} % of what is seen, as the first camera is outside of the room that it lights",
                    self.name,
                    share * 100.0
                ));
                return;
            }
            Some(share) if is_little => {
                let turned = self.is_lit_by_backs(&geometry).await;
                let why = if turned { ", as what emits turns its back to it" } else { "" };
                format!("the light of `{}` reaches {:.0} % of what is seen{why}", self.name, share * 100.0)
            }
            Some(_) => return,
        };
        match self.added_light(&geometry) {
            AddedLight::Studio => {
                self.warn(format!("{what}: a studio lights it"));
                self.add_studio();
            }
            AddedLight::Lamp { position, distance, place } => {
                self.warn(format!("{what}: a lamp {place} lights it"));
                self.add_lamp(&geometry, position, distance);
            }
        }
    }

    /// Puts the scene into a [studio](Environment::studio), set up for its first camera, in place of its environment.
    pub fn add_studio(&mut self) {
        let forward =
            self.cameras.first().map_or(Vec3::NEG_Z, |camera| View::new(self, camera, ASPECT).forward);
        self.environment = Some(Environment::studio(forward));
    }

    fn add_lamp(&mut self, geometry: &Geometry, position: Vec3, distance: f32) {
        let place = Transform::translation(position + geometry.origin.as_vec3());
        let node = self.add_node("default light", place);
        self.lights.push(PunctualLight {
            name: "default light".into(),
            node,
            kind: PunctualKind::Point,
            intensity: Vec3::splat(IRRADIANCE * distance * distance),
        });
    }

    /// Which share of what the first camera sees the scene's own light reaches; `None` where there is none.
    async fn reached(&self, geometry: &Geometry) -> Option<f32> {
        if !self.shines() {
            return None;
        }
        match self.cameras.first() {
            Some(camera) => self.reached_in(geometry, &View::new(self, camera, ASPECT)).await,
            None => Some(1.0),
        }
    }

    /// The same of what a view sees.
    async fn reached_in(&self, geometry: &Geometry, view: &View) -> Option<f32> {
        let settings = LightSettings { count: SAMPLES, candidates: 4, ..LightSettings::default() };
        let tracer = SceneTracer::in_slices(self, geometry).await;
        let lights = LightSet::sample_by(&tracer, &settings, &[], true).await.ok()?;
        pause().await;
        Some(share_reached(&tracer, view, lights.samples()))
    }

    /// Whether the first camera looks from outside at a closed room that the scene's own light does light, without cutting it open.
    async fn is_seen_from_outside(&self, geometry: &Geometry) -> bool {
        let tracer = SceneTracer::of_all_surfaces(self, geometry);
        let (Some(camera), Some(point)) = (self.cameras.first(), inside(&tracer)) else { return false };
        let eye = View::new(self, camera, ASPECT).relative_to(geometry.origin).ray(Vec2::ZERO).0;
        if is_enclosed(&tracer, eye) {
            return false;
        }
        let eye = point.as_dvec3() + geometry.origin;
        let field = FieldOfView::Perspective { degrees: 140.0 };
        let views = [DVec3::Z, DVec3::NEG_Z].map(|along| {
            let clip = ClipPlanes::NONE;
            Viewpoint { eye, target: eye + along, up: DVec3::Y, field, clip }.view(1.0).ok()
        });
        for view in views.into_iter().flatten() {
            if self.reached_in(geometry, &view).await.is_some_and(|share| share >= LEAST_REACHED) {
                return true;
            }
        }
        false
    }

    /// Whether the scene's own light would reach what is seen if what emits did so from both sides.
    async fn is_lit_by_backs(&self, geometry: &Geometry) -> bool {
        let mut turned = self.clone();
        for material in turned.materials.iter_mut().filter(|material| material.emits()) {
            material.double_sided = true;
        }
        turned.reached(geometry).await.is_some_and(|share| share >= LEAST_REACHED)
    }

    /// Whether anything is to emit, of whatever size.
    pub(crate) fn shines(&self) -> bool {
        let emits = |material: MaterialId| self.materials.get(material.index()).is_some_and(Material::emits);
        self.environment.as_ref().is_some_and(Environment::shines)
            || self.lights.iter().any(|l| l.intensity.max_element() > 0.0)
            || self
                .placed_objects()
                .any(|(_, o)| self.meshes[o.mesh].triangles.iter().any(|t| emits(t.material)))
    }
}
