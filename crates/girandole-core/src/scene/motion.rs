//! Transforms, and how a file says they change with time.

use glam::{DAffine3, DMat3, DQuat, DVec3, Quat, Vec3};

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
