//! Which emission a sample's light comes from in the end, so that it can be dimmed and coloured without another walk: light is
//! linear in what is emitted, in each channel.

use super::{LightId, LightSample, SampleOrigin};
use crate::scene::{Geometry, MaterialId, Scene};
use glam::Vec3;

/// What emits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "import", derive(serde::Serialize, serde::Deserialize))]
pub(super) enum Emission {
    /// Surfaces of a material.
    Material(MaterialId),
    /// A punctual light.
    Punctual(LightId),
    /// What is infinitely far away.
    Environment,
}

/// What of a sample's intensity comes from what emits.
pub(super) type Shares = Vec<(Emission, Vec3)>;

/// How much everything emits.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Emissions {
    materials: Vec<Vec3>,
    punctual: Vec<Vec3>,
    /// What the environment's map is multiplied by.
    environment: Vec3,
}

impl Emission {
    /// Of a sample on an emitter, or for a punctual light; the light of others comes by way of a surface.
    pub fn of_direct(geometry: &Geometry, sample: &LightSample) -> Option<Self> {
        match sample.origin {
            SampleOrigin::Emitter { triangle, .. } => {
                Some(Self::Material(geometry.triangles[triangle as usize].material))
            }
            SampleOrigin::Punctual { light } => Some(Self::Punctual(light)),
            SampleOrigin::Environment { .. } => Some(Self::Environment),
            SampleOrigin::Bounce { .. } => None,
        }
    }
}

impl Emissions {
    pub fn of(scene: &Scene) -> Self {
        Self {
            materials: scene.materials.iter().map(|m| m.emission).collect(),
            punctual: scene.lights.iter().map(|l| l.intensity).collect(),
            environment: Vec3::splat(scene.environment.as_ref().map_or(0.0, |e| e.strength)),
        }
    }

    /// Whether all that emits later did so already, in each channel: then what was sampled holds all of the light.
    pub fn cover(&self, later: &Self) -> bool {
        let covers = |before: &[Vec3], after: &[Vec3]| {
            before.len() == after.len()
                && before.iter().zip(after).all(|(b, a)| (b.cmpgt(Vec3::ZERO) | a.cmpeq(Vec3::ZERO)).all())
        };
        covers(&self.materials, &later.materials)
            && covers(&self.punctual, &later.punctual)
            && covers(&[self.environment], &[later.environment])
    }

    /// How many punctual lights there are.
    pub fn punctual_lights(&self) -> usize {
        self.punctual.len()
    }

    /// Of a material's surfaces, W/(sr·m²).
    pub fn of_material(&self, material: MaterialId) -> Vec3 {
        self.materials[material.index()]
    }

    /// Of a punctual light, W/sr (directional: W/m²).
    pub fn of_punctual(&self, light: LightId) -> Vec3 {
        self.punctual[light.index()]
    }

    /// What the environment's map is multiplied by.
    pub fn of_environment(&self) -> Vec3 {
        self.environment
    }

    fn get(&self, emission: Emission) -> Vec3 {
        match emission {
            Emission::Material(material) => self.of_material(material),
            Emission::Punctual(light) => self.of_punctual(light),
            Emission::Environment => self.environment,
        }
    }

    /// A sample's intensity with what is emitted later; `None` where it is not known where its light comes from. To the bit as it
    /// was where nothing changed.
    pub fn carried(&self, later: &Self, intensity: Vec3, shares: &Shares) -> Option<Vec3> {
        if self == later {
            return Some(intensity);
        }
        if shares.is_empty() {
            return None;
        }
        if shares.iter().all(|(emission, _)| self.get(*emission) == later.get(*emission)) {
            return Some(intensity);
        }
        let of = |(emission, share): &(Emission, Vec3)| {
            let (before, after) = (self.get(*emission), later.get(*emission));
            // In this order a share that is all of what was emitted becomes all of what is, to the bit.
            Vec3::select(before.cmpgt(Vec3::ZERO), *share / before * after, Vec3::ZERO)
        };
        Some(shares.iter().map(of).sum())
    }
}
