//! Cameras, as a scene holds them; a [`View`](super::View) is one in place.

use super::NodeId;

/// How a camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Vertical angle of view, radians, in (0, π).
    Perspective {
        /// The angle.
        yfov: f32,
    },
    /// Parallel; half the height of the view, metres.
    Orthographic {
        /// Half the height.
        ymag: f32,
    },
}

/// What of the world a camera shows, by distance along its axis, metres: what is nearer or farther is not drawn, and what lies
/// behind it is. It blocks and reflects light all the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipPlanes {
    /// 0 = nothing in front of the eye is cut off.
    pub near: f32,
    /// Infinite = nothing is cut off.
    pub far: f32,
}

impl ClipPlanes {
    /// Nothing is cut off.
    pub const NONE: Self = Self { near: 0.0, far: f32::INFINITY };

    /// Whether there is anything between them.
    pub fn are_possible(self) -> bool {
        self.near >= 0.0 && self.near.is_finite() && self.far > self.near
    }

    /// How far what is seen reaches beyond the near plane, metres.
    pub fn reach(self) -> f32 {
        self.far - self.near
    }
}

impl Default for ClipPlanes {
    fn default() -> Self {
        Self::NONE
    }
}

/// A camera on a node: it looks along the node's −Z, +Y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The name, as in the file; may be empty.
    pub name: String,
    /// The node that it is on.
    pub node: NodeId,
    /// How it projects.
    pub projection: Projection,
    /// What it cuts off.
    pub clip: ClipPlanes,
}
