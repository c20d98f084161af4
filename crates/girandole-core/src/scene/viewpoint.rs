//! Cameras that are given by numbers instead of a node: what a person steers, and what is written down.

use super::{Camera, ClipPlanes, MAX_EXTENT, Projection, Scene, View};
use crate::{Error, Result};
use glam::{DVec3, Vec2};

/// Sine of the least angle between where one looks and what is up.
const LEAST_SINE: f64 = 1e-6;

/// A camera that stands at a point and looks at another one. Whoever keeps these numbers in full has the same [`View`]
/// again, to the bit. Mirrored and off-axis views have none: those are made by [`View::new`] and
/// [`View::from_matrices`].
///
/// ```
/// use girandole_core::glam::DVec3;
/// use girandole_core::scene::{ClipPlanes, FieldOfView, Viewpoint};
///
/// let viewpoint = Viewpoint {
///     eye: DVec3::new(0.0, 1.7, 4.0),
///     target: DVec3::new(0.0, 1.7, 0.0),
///     up: DVec3::Y,
///     field: FieldOfView::Perspective { degrees: 60.0 },
///     clip: ClipPlanes::NONE,
/// };
/// let view = viewpoint.view(4.0 / 3.0)?;
/// assert_eq!(view.forward, girandole_core::glam::Vec3::NEG_Z);
/// # Ok::<(), girandole_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Where the eye is, world metres.
    pub eye: DVec3,
    /// What is in the middle of the picture, world metres.
    pub target: DVec3,
    /// What points to the picture's top: any vector that is not along the line of sight.
    pub up: DVec3,
    /// How much is seen.
    pub field: FieldOfView,
    /// What is cut off.
    pub clip: ClipPlanes,
}

/// How much of the world is between the bottom and the top of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldOfView {
    /// What is within an angle.
    Perspective {
        /// The vertical angle of view, degrees, between 0 and 180.
        degrees: f64,
    },
    /// What is within a distance; rays are parallel.
    Orthographic {
        /// The height of the view, metres, above 0.
        height: f64,
    },
}

impl FieldOfView {
    /// See [`View::half_extent`]; `None` for what no view has.
    fn half_height(self) -> Option<f32> {
        let half = match self {
            Self::Perspective { degrees } if 0.0 < degrees && degrees < 180.0 => {
                libm::tan((degrees * 0.5).to_radians())
            }
            Self::Orthographic { height } if 0.0 < height && height <= MAX_EXTENT => height * 0.5,
            _ => return None,
        };
        Some(half as f32).filter(|&half| half.is_normal())
    }
}

impl From<Projection> for FieldOfView {
    fn from(projection: Projection) -> Self {
        match projection {
            Projection::Perspective { yfov } => Self::Perspective { degrees: f64::from(yfov).to_degrees() },
            Projection::Orthographic { ymag } => Self::Orthographic { height: 2.0 * f64::from(ymag) },
        }
    }
}

impl From<FieldOfView> for Projection {
    fn from(field: FieldOfView) -> Self {
        match field {
            FieldOfView::Perspective { degrees } => Self::Perspective { yfov: degrees.to_radians() as f32 },
            FieldOfView::Orthographic { height } => Self::Orthographic { ymag: (height * 0.5) as f32 },
        }
    }
}

impl Viewpoint {
    /// Where a camera of `scene` is, with a target `distance` metres in front of it. Its view is that of [`View::new`] but
    /// for rounding, and but for what mirrors or skews the camera's node.
    pub fn of(scene: &Scene, camera: &Camera, distance: f64) -> Self {
        let place = scene.world_from_node(camera.node);
        let axis = |v: DVec3| place.transform_vector3(v).normalize_or_zero();
        let eye = place.translation;
        let target = eye + axis(DVec3::NEG_Z) * distance;
        Self { eye, target, up: axis(DVec3::Y), field: camera.projection.into(), clip: camera.clip }
    }

    /// Where a view is seen from, with a target `distance` metres in front of it. What a mirrored or off-axis view has besides
    /// is lost.
    pub fn from_view(view: &View, distance: f64) -> Self {
        let half = f64::from(view.half_extent.y);
        let field = if view.orthographic {
            FieldOfView::Orthographic { height: 2.0 * half }
        } else {
            FieldOfView::Perspective { degrees: 2.0 * libm::atan(half).to_degrees() }
        };
        let target = view.eye + view.forward.as_dvec3() * distance;
        Self { eye: view.eye, target, up: view.up.as_dvec3(), field, clip: view.clip }
    }

    /// What is seen from here; `aspect` is width / height.
    ///
    /// # Errors
    /// [`Error::Invalid`] where eye, target and up span no plane, or a number is not finite or out of its range.
    pub fn view(&self, aspect: f32) -> Result<View> {
        let refuse = |what: &str| Err(Error::Invalid(format!("this view cannot be shown: {what}")));
        let Self { eye, target, up, field, clip } = *self;
        if ![eye, target].iter().all(|p| p.abs().max_element() <= MAX_EXTENT) {
            return refuse("its eye or its target is not finite or too far away; scale it to metres");
        }
        let Some(forward) = (target - eye).try_normalize() else {
            return refuse("its eye and its target are the same point; take them apart");
        };
        let across = up.try_normalize().map(|up| forward.cross(up));
        let Some(right) = across.filter(|v| v.length() >= LEAST_SINE).and_then(DVec3::try_normalize) else {
            return refuse("what is up is not a direction, or the one that it looks in; take another one");
        };
        let Some(half) = field.half_height() else {
            return refuse("give it an angle between 0 and 180 degrees, or a height in metres");
        };
        if !clip.are_possible() {
            return refuse(
                "its near plane is not between the eye and its far plane; give 0 or more, and less than far",
            );
        }
        Ok(View {
            eye,
            right: right.as_vec3(),
            up: right.cross(forward).as_vec3(),
            forward: forward.as_vec3(),
            half_extent: Vec2::new(half * aspect, half),
            center: Vec2::ZERO,
            orthographic: matches!(field, FieldOfView::Orthographic { .. }),
            depth: None,
            clip,
        })
    }
}
