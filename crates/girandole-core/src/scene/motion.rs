//! Transforms, and how they change with time: glTF 2.0, §3.11 and appendix C.

use super::{NodeId, Scene};
use crate::{Error, Result};
use glam::{DAffine3, DMat3, DQuat, DVec3, Quat, Vec3, Vec4};
use std::ops::{Add, Mul};

/// A node's transform: scale, then rotation, then translation; or any affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transform {
    /// The parts that animations drive.
    Parts {
        /// Metres.
        translation: Vec3,
        /// Unit quaternion.
        rotation: Quat,
        /// Factor along each axis.
        scale: Vec3,
    },
    /// A map given as a matrix.
    Affine(DAffine3),
}

impl Default for Transform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Transform {
    /// Its parts; those of a matrix as far as there are any (shear is lost).
    fn parts(self) -> [Vec4; 3] {
        let (translation, rotation, scale) = match self {
            Self::Parts { translation, rotation, scale } => (translation, rotation, scale),
            Self::Affine(affine) => {
                let (scale, rotation, translation) = affine.to_scale_rotation_translation();
                (translation.as_vec3(), rotation.as_quat(), scale.as_vec3())
            }
        };
        [translation.extend(0.0), rotation.into(), scale.extend(0.0)]
    }

    fn from_parts([translation, rotation, scale]: [Vec4; 3]) -> Self {
        let rotation = Quat::from_vec4(rotation);
        Self::Parts { translation: translation.truncate(), rotation, scale: scale.truncate() }
    }

    /// Nothing changes.
    pub const IDENTITY: Self =
        Self::Parts { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };

    /// A shift.
    pub fn translation(translation: Vec3) -> Self {
        Self::Parts { translation, rotation: Quat::IDENTITY, scale: Vec3::ONE }
    }

    /// A rotation, then a shift.
    pub fn rigid(rotation: Quat, translation: Vec3) -> Self {
        Self::Parts { translation, rotation, scale: Vec3::ONE }
    }

    /// The transform of something at `eye` whose −Z points to `target`, +Y up.
    pub fn looking_at(eye: Vec3, target: Vec3) -> Self {
        let back = (eye - target).as_dvec3().normalize_or(DVec3::Z);
        let up = if back.y.abs() > 0.9999 { DVec3::Z } else { DVec3::Y };
        let right = up.cross(back).normalize();
        let rotation = DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back));
        Self::rigid(rotation.as_quat(), eye)
    }

    /// As an affine map.
    pub fn affine(&self) -> DAffine3 {
        match *self {
            Self::Parts { translation, rotation, scale } => DAffine3::from_scale_rotation_translation(
                scale.as_dvec3(),
                rotation.as_dquat().normalize(),
                translation.as_dvec3(),
            ),
            Self::Affine(affine) => affine,
        }
    }
}

/// How values between two keys are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight (spherical for rotations).
    Linear,
    /// The earlier key's value.
    Step,
    /// Cubic Hermite; keys hold in-tangent, value, out-tangent.
    CubicSpline,
}

/// The values of a channel, one entry (or for cubic splines three) a key.
#[derive(Clone, Debug, PartialEq)]
pub enum Keyframes {
    /// Metres.
    Translation(Vec<Vec3>),
    /// Unit quaternions.
    Rotation(Vec<Quat>),
    /// Factors.
    Scale(Vec<Vec3>),
    /// Of all morph targets, one after another for each entry.
    MorphWeights(Vec<f32>),
}

/// One property of one node over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The node that moves.
    pub node: NodeId,
    /// Seconds, ascending.
    pub times: Vec<f32>,
    /// Values at those times.
    pub keyframes: Keyframes,
    /// Between keys.
    pub interpolation: Interpolation,
}

/// A named set of channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Animation {
    /// The name, as in the file; may be empty.
    pub name: String,
    /// What it drives.
    pub channels: Vec<Channel>,
}

/// What animations make of a node at a moment.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pose {
    pub node: NodeId,
    /// `None` where it stays.
    pub local: Option<Transform>,
    /// `None` where they stay.
    pub morph_weights: Option<Vec<f32>>,
}

/// Where a moment is among keys.
#[derive(Clone, Copy)]
enum Between {
    Key(usize),
    /// A share of the span, seconds, after this key.
    Keys(usize, f32, f32),
}

impl Channel {
    /// Sets what it drives of a node, that is elsewhere `local`.
    pub(super) fn add_to(&self, pose: &mut Pose, local: Transform, seconds: f64) {
        if let Some((part, value)) = self.value(seconds) {
            let mut parts = pose.local.unwrap_or(local).parts();
            parts[part] = value;
            pose.local = Some(Transform::from_parts(parts));
        }
        pose.morph_weights = self.morph_weights(seconds).or(pose.morph_weights.take());
    }

    /// Which of [`Transform::parts`] it drives.
    pub(super) fn part(&self) -> Option<usize> {
        match self.keyframes {
            Keyframes::Translation(_) => Some(0),
            Keyframes::Rotation(_) => Some(1),
            Keyframes::Scale(_) => Some(2),
            Keyframes::MorphWeights(_) => None,
        }
    }

    /// `None` without keys.
    fn between(&self, seconds: f64) -> Option<Between> {
        let time = |i: usize| f64::from(self.times[i]);
        let after = self.times.partition_point(|&t| f64::from(t) <= seconds);
        let last = self.times.len().checked_sub(1)?;
        if after == 0 || after > last || self.interpolation == Interpolation::Step {
            return Some(Between::Key(after.saturating_sub(1)));
        }
        let before = after - 1;
        if time(before) == seconds {
            return Some(Between::Key(before));
        }
        let span = time(after) - time(before);
        Some(Between::Keys(before, ((seconds - time(before)) / span) as f32, span as f32))
    }

    /// The value there, of these entries; straight lines by `lerp`.
    fn blend<T>(&self, at: Between, entry: impl Fn(usize) -> T, lerp: impl Fn(T, T, f32) -> T) -> T
    where
        T: Copy + Add<Output = T> + Mul<f32, Output = T>,
    {
        let is_spline = self.interpolation == Interpolation::CubicSpline;
        let key = |i: usize| entry(if is_spline { 3 * i + 1 } else { i });
        match at {
            Between::Key(i) => key(i),
            Between::Keys(before, t, span) if is_spline => {
                let (after, t2, t3) = (before + 1, t * t, t * t * t);
                key(before) * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + entry(3 * before + 2) * (span * (t3 - 2.0 * t2 + t))
                    + key(after) * (3.0 * t2 - 2.0 * t3)
                    + entry(3 * after) * (span * (t3 - t2))
            }
            Between::Keys(before, t, _) => lerp(key(before), key(before + 1), t),
        }
    }

    /// Its value at a moment, of a part of a transform; before the first key that of the first, after the last that of the
    /// last. `None` without keys, or of morph weights.
    fn value(&self, seconds: f64) -> Option<(usize, Vec4)> {
        let (part, at) = (self.part()?, self.between(seconds)?);
        let entry = |i: usize| match &self.keyframes {
            Keyframes::Translation(entries) | Keyframes::Scale(entries) => entries[i].extend(0.0),
            Keyframes::Rotation(entries) => entries[i].into(),
            Keyframes::MorphWeights(_) => Vec4::ZERO,
        };
        let is_rotation = part == 1;
        let value = self.blend(at, entry, if is_rotation { slerp } else { Vec4::lerp });
        let value = match at {
            Between::Keys(before, ..) if is_rotation => {
                let key = || self.blend(Between::Key(before), entry, slerp);
                value.try_normalize().unwrap_or_else(key)
            }
            _ => value,
        };
        Some((part, value))
    }

    /// The same of morph weights.
    fn morph_weights(&self, seconds: f64) -> Option<Vec<f32>> {
        let Keyframes::MorphWeights(weights) = &self.keyframes else { return None };
        let at = self.between(seconds)?;
        let entries = self.times.len() * if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let targets = weights.len() / entries;
        let lerp = |a: f32, b: f32, t: f32| a * (1.0 - t) + b * t;
        let weight = |target: usize| self.blend(at, |i| weights[i * targets + target], lerp);
        Some((0..targets).map(weight).collect())
    }
}

/// Spherical interpolation along the shorter arc, the same on every machine.
fn slerp(a: Vec4, b: Vec4, t: f32) -> Vec4 {
    let cosine = f64::from(a.dot(b));
    let b = if cosine < 0.0 { -b } else { b };
    let angle = libm::acos(cosine.abs().min(1.0));
    if angle < 1e-3 {
        return a.lerp(b, t);
    }
    let weight = |share: f64| (libm::sin(share * angle) / libm::sin(angle)) as f32;
    a * weight(1.0 - f64::from(t)) + b * weight(f64::from(t))
}

/// Motion by animations, see [`Scene::playing_clips`].
impl Scene {
    /// Puts everything where the animations have it that play, and writes down what moved, as [`Scene::set_transform`] does. Beyond
    /// [`Scene::duration`] they repeat.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the time is not finite, and as [`Scene::set_transform`]; then nothing moves.
    pub fn set_time(&mut self, seconds: f64) -> Result<()> {
        if !seconds.is_finite() {
            return Err(Error::Invalid(format!("there is no time {seconds}; give a number of seconds")));
        }
        self.remember_rest();
        self.set_poses(self.poses(seconds))
    }

    /// Whether animations, playing or not, drive what the place or shape of each object depends on.
    pub(super) fn animated_objects(&self) -> Vec<bool> {
        let (mut is_posed, mut is_morphed) = (vec![false; self.nodes.len()], vec![false; self.nodes.len()]);
        for channel in self.animations.iter().flat_map(|a| &a.channels) {
            match channel.part() {
                Some(_) => is_posed[channel.node.index()] = true,
                None => is_morphed[channel.node.index()] = true,
            }
        }
        let is_posed = self.at_or_below(|node| is_posed[node.index()]);
        self.objects.iter().map(|o| self.is_moved_by(o, &is_posed) || is_morphed[o.node.index()]).collect()
    }
}
