//! Transforms, and how they change with time: glTF 2.0, §3.11 and appendix C.

use super::Scene;
use crate::{Error, Result};
use glam::{DAffine3, DMat3, DQuat, DVec3, Quat, Vec3, Vec4};
use std::collections::BTreeMap;

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

/// The values of a channel, one (or for cubic splines three) a key.
#[derive(Clone, Debug, PartialEq)]
pub enum Keyframes {
    /// Metres.
    Translation(Vec<Vec3>),
    /// Unit quaternions.
    Rotation(Vec<Quat>),
    /// Factors.
    Scale(Vec<Vec3>),
}

/// One property of one node over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Index into the scene's nodes.
    pub node: usize,
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

impl Channel {
    /// Which of [`Transform::parts`] it drives.
    fn part(&self) -> usize {
        match self.keyframes {
            Keyframes::Translation(_) => 0,
            Keyframes::Rotation(_) => 1,
            Keyframes::Scale(_) => 2,
        }
    }

    fn entry(&self, index: usize) -> Vec4 {
        match &self.keyframes {
            Keyframes::Translation(entries) | Keyframes::Scale(entries) => entries[index].extend(0.0),
            Keyframes::Rotation(entries) => entries[index].into(),
        }
    }

    /// Its value at a moment; before the first key that of the first, after the last that of the last. `None` without keys.
    fn value(&self, seconds: f64) -> Option<Vec4> {
        let is_rotation = self.part() == 1;
        let is_spline = self.interpolation == Interpolation::CubicSpline;
        let key = |i: usize| self.entry(if is_spline { 3 * i + 1 } else { i });
        let time = |i: usize| f64::from(self.times[i]);
        let after = self.times.partition_point(|&t| f64::from(t) <= seconds);
        let last = self.times.len().checked_sub(1)?;
        if after == 0 || after > last || self.interpolation == Interpolation::Step {
            return Some(key(after.saturating_sub(1)));
        }
        let before = after - 1;
        if time(before) == seconds {
            return Some(key(before));
        }
        let span = time(after) - time(before);
        let t = ((seconds - time(before)) / span) as f32;
        let value = if is_spline {
            let (t2, t3, span) = (t * t, t * t * t, span as f32);
            key(before) * (2.0 * t3 - 3.0 * t2 + 1.0)
                + self.entry(3 * before + 2) * (span * (t3 - 2.0 * t2 + t))
                + key(after) * (3.0 * t2 - 2.0 * t3)
                + self.entry(3 * after) * (span * (t3 - t2))
        } else if is_rotation {
            slerp(key(before), key(after), t)
        } else {
            key(before).lerp(key(after), t)
        };
        Some(if is_rotation { value.try_normalize().unwrap_or(key(before)) } else { value })
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

/// Motion by animations. All of them play at once; where two drive the same part of a node's transform, the later one does.
impl Scene {
    /// Seconds after which animations repeat: the last key's time. 0 where nothing is animated.
    pub fn duration(&self) -> f64 {
        let times = self.animations.iter().flat_map(|a| &a.channels).filter_map(|c| c.times.last());
        times.copied().fold(0.0, f32::max).into()
    }

    /// Puts everything where the animations have it, and writes down what moved, as [`Scene::set_transform`] does. Beyond
    /// [`Scene::duration`] they repeat.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the time is not finite, and as [`Scene::set_transform`]; then nothing moves.
    pub fn set_time(&mut self, seconds: f64) -> Result<()> {
        if !seconds.is_finite() {
            return Err(Error::Invalid(format!("there is no time {seconds}; give a number of seconds")));
        }
        let poses = self.poses(seconds);
        let before: Vec<_> = poses.iter().map(|&(node, _)| (node, self.nodes[node].local)).collect();
        let set = |scene: &mut Self, poses: Vec<(usize, Transform)>| {
            poses.into_iter().try_for_each(|(node, local)| scene.set_transform(node, local))
        };
        let result = set(self, poses);
        if result.is_err() {
            set(self, before)?;
        }
        result
    }

    /// Whether an animation drives a node or one above it.
    pub(super) fn is_animated(&self, node: usize) -> bool {
        let mut channels = self.animations.iter().flat_map(|a| &a.channels);
        channels.any(|channel| self.is_below(node, channel.node))
    }

    /// Moments that tell where things come by: keys and the middle between them, or evenly spaced ones where those are many.
    pub(super) fn moments(&self) -> Vec<f64> {
        const MOST: usize = 512;
        let keys = self.animations.iter().flat_map(|a| &a.channels).flat_map(|c| &c.times);
        let mut keys: Vec<f64> = keys.map(|&t| t.into()).collect();
        keys.sort_by(f64::total_cmp);
        keys.dedup();
        if keys.len() > MOST / 2 {
            let (first, last) = (keys[0], keys[keys.len() - 1]);
            return (0..MOST).map(|i| first + (last - first) * i as f64 / (MOST - 1) as f64).collect();
        }
        keys.iter().copied().chain(keys.windows(2).map(|pair| (pair[0] + pair[1]) * 0.5)).collect()
    }

    /// World from node in these [poses](Scene::poses).
    pub(super) fn world_from_posed(&self, node: usize, poses: &[(usize, Transform)]) -> DAffine3 {
        let mut result = DAffine3::IDENTITY;
        let mut next = Some(node);
        while let Some(index) = next {
            let posed = poses.binary_search_by_key(&index, |pose| pose.0);
            result = posed.map_or(self.nodes[index].local, |i| poses[i].1).affine() * result;
            next = self.nodes[index].parent;
        }
        result
    }

    /// Nodes that animations drive, in order, and their transforms at a moment.
    pub(super) fn poses(&self, seconds: f64) -> Vec<(usize, Transform)> {
        let duration = self.duration();
        let seconds = if seconds > duration && duration > 0.0 { seconds % duration } else { seconds };
        let mut driven = BTreeMap::new();
        for channel in self.animations.iter().flat_map(|a| &a.channels) {
            if let Some(value) = channel.value(seconds) {
                let parts =
                    driven.entry(channel.node).or_insert_with(|| self.nodes[channel.node].local.parts());
                parts[channel.part()] = value;
            }
        }
        driven.into_iter().map(|(node, parts)| (node, Transform::from_parts(parts))).collect()
    }
}
