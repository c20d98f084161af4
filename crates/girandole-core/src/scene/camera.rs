//! Cameras, as a scene holds them; a [`View`](super::View) is one in place.

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

/// A camera on a node: it looks along the node's −Z, +Y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The name, as in the file; may be empty.
    pub name: String,
    /// Index into the scene's nodes.
    pub node: usize,
    /// How it projects.
    pub projection: Projection,
}
