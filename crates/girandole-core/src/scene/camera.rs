//! Cameras, and the rays that go through their pixels.

use super::{Geometry, Scene};
use glam::{Vec2, Vec3};

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

/// A camera in place, for a picture of a given aspect, relative to [`Geometry::origin`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where the eye is.
    pub eye: Vec3,
    /// Unit vector to the picture's right.
    pub right: Vec3,
    /// Unit vector to the picture's top.
    pub up: Vec3,
    /// Unit vector into the picture.
    pub forward: Vec3,
    /// Perspective: tangent of half the angle of view in x and y; orthographic: half the view's size, metres.
    pub half_extent: Vec2,
    /// Whether rays are parallel.
    pub orthographic: bool,
}

impl View {
    /// Puts a camera of `scene` in place; `aspect` is width / height.
    pub fn new(scene: &Scene, geometry: &Geometry, camera: &Camera, aspect: f32) -> Self {
        let affine = scene.world_from_node(camera.node);
        let axis = |v: glam::DVec3| affine.transform_vector3(v).normalize_or_zero().as_vec3();
        let half_extent = |y: f32| Vec2::new(y * aspect, y);
        let (half_extent, orthographic) = match camera.projection {
            Projection::Perspective { yfov } => (half_extent(libm::tanf(yfov * 0.5)), false),
            Projection::Orthographic { ymag } => (half_extent(ymag), true),
        };
        Self {
            eye: (affine.translation - geometry.origin).as_vec3(),
            right: axis(glam::DVec3::X),
            up: axis(glam::DVec3::Y),
            forward: axis(glam::DVec3::NEG_Z),
            half_extent,
            orthographic,
        }
    }

    /// Origin and direction (not normalised) of the ray through `ndc` in [−1, 1]², +Y up.
    pub fn ray(&self, ndc: Vec2) -> (Vec3, Vec3) {
        let offset = self.right * (ndc.x * self.half_extent.x) + self.up * (ndc.y * self.half_extent.y);
        if self.orthographic { (self.eye + offset, self.forward) } else { (self.eye, self.forward + offset) }
    }

    /// The ray through a pixel: `at` in pixels from the top left corner, pixel centres at halves.
    pub fn pixel_ray(&self, at: Vec2, size: [u32; 2]) -> (Vec3, Vec3) {
        let uv = at / Vec2::new(size[0] as f32, size[1] as f32);
        self.ray(Vec2::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y))
    }
}
