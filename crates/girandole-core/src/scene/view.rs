//! Views: cameras in place, and the rays that go through a picture's pixels.
//!
//! A [`View`] stands in the world, in double precision, whatever is derived from the scene. What rays are traced
//! against is relative to an origin: [`View::relative_to`] gives the [`LocalView`] for it.

use super::{Camera, ClipPlanes, Projection, Scene};
use crate::{Error, Result};
use glam::{DAffine3, DMat3, DVec2, DVec3, Mat4, Vec2, Vec3};

/// How far a view's matrix may be from a rotation.
const SKEW: f64 = 1e-4;
/// Entries of a projection that have to be zero are so up to this share of the largest one in their row.
const ZERO: f64 = 1e-6;

/// Where one looks from, and what a picture shows; right-handed, with rectangular pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Where the eye is, in the world.
    pub eye: DVec3,
    /// Unit vector to the picture's right.
    pub right: Vec3,
    /// Unit vector to the picture's top.
    pub up: Vec3,
    /// Unit vector into the picture.
    pub forward: Vec3,
    /// Perspective: tangent of half the angle of view in x and y; orthographic: half the view's size, metres.
    pub half_extent: Vec2,
    /// How far the picture's centre is from where `forward` points, in halves of the picture, +Y up: 0 but for off-axis
    /// views, such as parts of a picture, tilted lenses and jittered frames.
    pub center: Vec2,
    /// Whether rays are parallel.
    pub orthographic: bool,
    /// What the caller's depth buffer holds; `None` = the renderer's own choice. The renderer cuts off at its near and far
    /// plane, as the caller does; rays do not.
    pub depth: Option<ClipDepth>,
    /// What a camera cuts off, and rays too. With a caller's depth, the renderer goes by that.
    pub clip: ClipPlanes,
}

/// How distance along a view's forward axis becomes depth: `offset + factor / d` in perspective, `offset + factor · d` in
/// orthographic views. Depth is 0 to 1, as in WebGPU, Vulkan and Direct3D.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipDepth {
    /// The part that is the same everywhere.
    pub offset: f32,
    /// Metres in perspective views, per metre in orthographic ones. Reversed, that is with greater depth for what is
    /// nearer, if it is positive in perspective and negative in orthographic views.
    pub factor: f32,
}

/// A [`View`] relative to an origin, as [`Geometry`](super::Geometry) is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalView {
    /// Where the eye is.
    pub eye: Vec3,
    /// See [`View::right`].
    pub right: Vec3,
    /// See [`View::up`].
    pub up: Vec3,
    /// See [`View::forward`].
    pub forward: Vec3,
    /// See [`View::half_extent`].
    pub half_extent: Vec2,
    /// See [`View::center`].
    pub center: Vec2,
    /// See [`View::orthographic`].
    pub orthographic: bool,
    /// See [`View::depth`].
    pub depth: Option<ClipDepth>,
    /// See [`View::clip`].
    pub clip: ClipPlanes,
}

impl View {
    /// Puts a camera of `scene` in place; `aspect` is width / height.
    pub fn new(scene: &Scene, camera: &Camera, aspect: f32) -> Self {
        let affine = scene.world_from_node(camera.node);
        let axis = |v: DVec3| affine.transform_vector3(v).normalize_or_zero().as_vec3();
        let half_extent = |y: f32| Vec2::new(y * aspect, y);
        let (half_extent, orthographic) = match camera.projection {
            Projection::Perspective { yfov } => (half_extent(libm::tanf(yfov * 0.5)), false),
            Projection::Orthographic { ymag } => (half_extent(ymag), true),
        };
        Self {
            eye: affine.translation,
            right: axis(DVec3::X),
            up: axis(DVec3::Y),
            forward: axis(DVec3::NEG_Z),
            half_extent,
            center: Vec2::ZERO,
            orthographic,
            depth: None,
            clip: camera.clip,
        }
    }

    /// The view of a program that has matrices: a rotation and shift, and any perspective or orthographic projection
    /// along the view's axes, with depth from 0 to 1: symmetric or not, jittered, reversed or not, with a finite far
    /// plane or without. View space may look along −Z or +Z, if right, up and back are right-handed in the world.
    ///
    /// # Errors
    /// [`Error::Invalid`] for other matrices.
    pub fn from_matrices(view_from_world: DAffine3, clip_from_view: Mat4) -> Result<Self> {
        let refuse = |what: &str| Err(Error::Invalid(format!("this view cannot be shown: {what}")));
        if !(view_from_world.is_finite() && clip_from_view.is_finite()) {
            return refuse("its matrices hold numbers that are not finite; correct them");
        }
        let axes = view_from_world.matrix3.transpose();
        if !(view_from_world.matrix3 * axes).abs_diff_eq(DMat3::IDENTITY, SKEW) {
            return refuse(
                "the matrix from world to view is not a rotation and a shift; take scale and skew out",
            );
        }
        let rows = [0, 1, 2, 3].map(|i| clip_from_view.row(i).as_dvec4());
        let zero = |row: usize, axis: usize| rows[row][axis].abs() <= ZERO * rows[row].abs().max_element();
        let orthographic = zero(3, 2);
        let scale = if orthographic { rows[3].w } else { rows[3].z.abs() };
        let straight =
            |row: usize, axis: usize| zero(row, axis) && zero(row, if orthographic { 2 } else { 3 });
        if !(straight(0, 1) && straight(1, 0) && zero(2, 0) && zero(2, 1) && zero(3, 0) && straight(3, 1))
            || scale.is_nan()
            || scale <= 0.0
        {
            return refuse(
                "its projection is skewed; take a perspective or orthographic one along the view's axes",
            );
        }
        if zero(0, 0) || zero(1, 1) {
            return refuse("its projection has no width or height");
        }
        let [x, y, z] = [0, 1, 2].map(|i| rows[i] / scale);
        let right = (axes.x_axis * x.x.signum()).normalize();
        let up = (axes.y_axis * y.y.signum()).normalize();
        let forward = up.cross(right);
        // Whether view space looks along +Z.
        let along = forward.dot(axes.z_axis).signum();
        if !orthographic && along * rows[3].z < 0.0 {
            return refuse("it is mirrored; turn one axis around");
        }
        // Where the picture's centre is, as seen from the axis; and depth by distance along forward.
        let (center, mut offset, factor) = if orthographic {
            (-DVec2::new(x.w, y.w), z.w, z.z * along)
        } else {
            (-DVec2::new(x.z, y.z) * along, z.z * along, z.w)
        };
        let mut eye = axes * -view_from_world.translation;
        let at_near = if (factor > 0.0) == orthographic { 0.0 } else { 1.0 };
        if orthographic {
            // What is between the eye and a near plane behind it is seen too.
            let near = (at_near - offset) / factor;
            if !near.is_finite() {
                return refuse("its projection gives all distances the same depth");
            }
            if near < 0.0 {
                eye += forward * near;
                offset = at_near;
            }
        } else {
            let near = factor / (at_near - offset);
            if !(near.is_finite() && near > 0.0) {
                return refuse("its near plane is not in front of the eye; depth has to go from 0 to 1");
            }
        }
        Ok(Self {
            eye,
            right: right.as_vec3(),
            up: up.as_vec3(),
            forward: forward.as_vec3(),
            half_extent: Vec2::new((1.0 / x.x.abs()) as f32, (1.0 / y.y.abs()) as f32),
            center: center.as_vec2(),
            orthographic,
            depth: Some(ClipDepth { offset: offset as f32, factor: factor as f32 }),
            clip: ClipPlanes::NONE,
        })
    }

    /// The view of a rectangle of the picture: corners in shares of its width and height, from the top left. Its rays
    /// are the whole picture's; the same bits, where sizes and corners are powers of two.
    pub fn part(&self, [left, top]: [f32; 2], [end, bottom]: [f32; 2]) -> Self {
        let size = Vec2::new(end - left, bottom - top);
        let middle = Vec2::new(left + end - 1.0, 1.0 - (top + bottom));
        Self { half_extent: self.half_extent * size, center: (self.center + middle) / size, ..*self }
    }

    /// The same, relative to an origin.
    pub fn relative_to(&self, origin: DVec3) -> LocalView {
        let Self { right, up, forward, half_extent, center, orthographic, depth, clip, .. } = *self;
        let eye = (self.eye - origin).as_vec3();
        LocalView { eye, right, up, forward, half_extent, center, orthographic, depth, clip }
    }

    /// What the caller's depth buffer holds for what is `distance` metres away along `forward`; `None` without one.
    pub fn clip_depth(&self, distance: f32) -> Option<f32> {
        let ClipDepth { offset, factor } = self.depth?;
        Some(if self.orthographic { offset + factor * distance } else { offset + factor / distance })
    }

    /// Whether nearer things have the greater depth: `true` where the choice is the renderer's.
    pub fn is_reversed(&self) -> bool {
        self.depth.is_none_or(|d| (d.factor > 0.0) != self.orthographic)
    }

    /// Distance of the caller's near plane, metres; `None` where the choice is the renderer's.
    pub fn near(&self) -> Option<f32> {
        self.distance_at(if self.is_reversed() { 1.0 } else { 0.0 })
    }

    /// Distance of the caller's far plane, metres; `None` if there is none.
    pub fn far(&self) -> Option<f32> {
        self.distance_at(if self.is_reversed() { 0.0 } else { 1.0 }).filter(|&d| self.orthographic || d > 0.0)
    }

    fn distance_at(&self, depth: f32) -> Option<f32> {
        let ClipDepth { offset, factor } = self.depth?;
        let distance = if self.orthographic { (depth - offset) / factor } else { factor / (depth - offset) };
        distance.is_finite().then_some(distance)
    }
}

impl LocalView {
    /// Origin and direction (not normalised) of the ray through `ndc` in [−1, 1]², +Y up. It starts on the near plane, and its
    /// parameter is the distance from there along `forward`: it ends at [`ClipPlanes::reach`].
    pub fn ray(&self, ndc: Vec2) -> (Vec3, Vec3) {
        let at = (ndc + self.center) * self.half_extent;
        let offset = self.right * at.x + self.up * at.y;
        let (origin, direction) = if self.orthographic {
            (self.eye + offset, self.forward)
        } else {
            (self.eye, self.forward + offset)
        };
        let start = if self.clip.near > 0.0 { origin + direction * self.clip.near } else { origin };
        (start, direction)
    }

    /// The ray through a pixel: `at` in pixels from the top left corner, pixel centres at halves.
    pub fn pixel_ray(&self, at: Vec2, size: [u32; 2]) -> (Vec3, Vec3) {
        let uv = at / Vec2::new(size[0] as f32, size[1] as f32);
        self.ray(Vec2::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y))
    }

    /// Where a point is in the picture: NDC, +Y up, and its distance along `forward`, metres.
    pub fn project(&self, point: Vec3) -> (Vec2, f32) {
        let to = point - self.eye;
        let distance = to.dot(self.forward);
        let across = Vec2::new(to.dot(self.right), to.dot(self.up)) / self.half_extent;
        (across / if self.orthographic { 1.0 } else { distance } - self.center, distance)
    }
}
