//! The file of edits: one JSON object, each edit a line of it.
//!
//! ```json
//! {
//!   "version": 1,
//!   "edits": [
//!     {"set_transform":{"node":{"index":3,"name":"box"},"transform":{"parts":{"translation":[0.5,1.0,0.0]}}}},
//!     {"set_emission":{"material":{"index":1,"name":"lamp"},"emission":[4.0,4.0,3.5]}},
//!     {"insert_object":{"name":"chair","shape":{"file":"models/chair.obj"},"dynamic":true}}
//!   ]
//! }
//! ```
//!
//! Version 2 has the kinds of version 1, and these besides:
//!
//! ```json
//! {"set_shades":{"material":{"index":0,"name":"wall"},"shades":{"base_color":[0.8,0.2,0.1],"roughness":0.4,"specular":1.0}}}
//! {"insert_light":{"name":"bulb","kind":"point","intensity":[8.0,8.0,7.0],"transform":{"parts":{"translation":[0.0,2.0,0.0]}}}}
//! {"insert_light":{"name":"spot","kind":{"spot":{"inner":0.3,"outer":0.5}},"intensity":[20.0,20.0,20.0]}}
//! {"set_cone":{"light":{"index":1,"name":"spot"},"inner":0.2,"outer":0.4}}
//! {"remove_light":{"light":{"index":0,"name":"bulb"}}}
//! {"duplicate_object":{"object":{"index":3,"name":"box"},"name":"box copy","transform":{"parts":{"translation":[1.5,1.0,0.0]}}}}
//! {"set_camera":{"name":"bookmark 1","viewpoint":{"eye":[0.0,1.7,4.0],"target":[0.0,1.0,0.0],"up":[0.0,1.0,0.0],"field":{"perspective":{"degrees":60.0}}}}}
//! ```
//!
//! A file says the lowest version that has what is in it.

use super::{Edit, Edits, Shape};
use crate::scene::{ClipPlanes, FieldOfView, PunctualKind, Shades, Transform, Viewpoint};
use crate::{Error, Result};
use glam::{DAffine3, DVec3, Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What this version of the library reads; the last one is what it writes where the first one has not all that it
/// needs.
const VERSIONS: std::ops::RangeInclusive<u32> = 1..=2;

/// How a [`Transform`] is written: `parts`, of which those that change nothing may be left out, or `affine`, the columns of
/// a matrix of three rows and four columns.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Transform", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum TransformFormat {
    Parts {
        #[serde(default)]
        translation: Vec3,
        #[serde(default)]
        rotation: Quat,
        #[serde(default = "unscaled")]
        scale: Vec3,
    },
    Affine(DAffine3),
}

fn unscaled() -> Vec3 {
    Vec3::ONE
}

/// How [`Shades`] are written.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Shades", deny_unknown_fields)]
pub(super) struct ShadesFormat {
    base_color: Vec3,
    #[serde(default)]
    metallic: f32,
    #[serde(default = "rough")]
    roughness: f32,
    #[serde(default)]
    specular: f32,
}

fn rough() -> f32 {
    1.0
}

/// How a [`PunctualKind`] is written.
#[derive(Serialize, Deserialize)]
#[serde(remote = "PunctualKind", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum KindFormat {
    Point,
    Spot { inner: f32, outer: f32 },
    Directional,
}

/// How a [`Viewpoint`] is written: metres.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Viewpoint", deny_unknown_fields)]
pub(super) struct ViewpointFormat {
    eye: DVec3,
    target: DVec3,
    up: DVec3,
    #[serde(with = "FieldFormat")]
    field: FieldOfView,
    #[serde(default, skip_serializing_if = "cuts_nothing", with = "clip_format")]
    clip: ClipPlanes,
}

fn cuts_nothing(clip: &ClipPlanes) -> bool {
    *clip == ClipPlanes::NONE
}

/// How [`ClipPlanes`] are written: metres; no far plane where nothing is cut off.
mod clip_format {
    use super::ClipPlanes;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Format {
        near: f32,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        far: Option<f32>,
    }

    pub fn serialize<S: Serializer>(clip: &ClipPlanes, serializer: S) -> Result<S::Ok, S::Error> {
        let far = Some(clip.far).filter(|far| far.is_finite());
        Format { near: clip.near, far }.serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<ClipPlanes, D::Error> {
        let Format { near, far } = Format::deserialize(deserializer)?;
        Ok(ClipPlanes { near, far: far.unwrap_or(f32::INFINITY) })
    }
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "FieldOfView", rename_all = "snake_case", deny_unknown_fields)]
enum FieldFormat {
    Perspective { degrees: f64 },
    Orthographic { height: f64 },
}

/// What files of all versions have.
#[derive(Deserialize)]
struct Header {
    version: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Body {
    #[serde(rename = "version")]
    _version: u32,
    edits: Vec<Edit>,
}

impl Edit {
    fn is_finite(&self) -> bool {
        match self {
            Self::SetTransform { transform, .. }
            | Self::InsertObject { transform, .. }
            | Self::DuplicateObject { transform, .. } => transform.affine().is_finite(),
            Self::InsertLight { transform, intensity, .. } => {
                transform.affine().is_finite() && intensity.is_finite()
            }
            Self::SetShades { shades, .. } => {
                let Shades { base_color, metallic, roughness, specular } = shades;
                base_color.is_finite() && (metallic + roughness + specular).is_finite()
            }
            Self::SetCone { inner, outer, .. } => inner.is_finite() && outer.is_finite(),
            Self::SetCamera { viewpoint: Viewpoint { eye, target, up, field, clip: _ }, .. } => {
                let (FieldOfView::Perspective { degrees: size } | FieldOfView::Orthographic { height: size }) =
                    field;
                eye.is_finite() && target.is_finite() && up.is_finite() && size.is_finite()
            }
            Self::SetEmission { emission: light, .. } | Self::SetIntensity { intensity: light, .. } => {
                light.is_finite()
            }
            Self::RemoveObject { .. } | Self::RemoveLight { .. } => true,
            Self::SetTime { seconds } => seconds.is_finite(),
        }
    }
}

impl Edit {
    /// The first version of the format that has it.
    fn version(&self) -> u32 {
        match self {
            Self::InsertObject { shape: Shape::Panel, .. } => 2,
            Self::SetTransform { .. }
            | Self::SetEmission { .. }
            | Self::SetIntensity { .. }
            | Self::InsertObject { .. }
            | Self::RemoveObject { .. }
            | Self::SetTime { .. } => 1,
            Self::SetShades { .. }
            | Self::SetCone { .. }
            | Self::SetCamera { .. }
            | Self::InsertLight { .. }
            | Self::RemoveLight { .. }
            | Self::DuplicateObject { .. } => 2,
        }
    }
}

impl Edits {
    /// Writes them; what is read from it is equal.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a number is not finite, or a path is no Unicode.
    pub fn to_json(&self) -> Result<String> {
        self.check_finite().map_err(Error::Invalid)?;
        let lines: serde_json::Result<Vec<String>> = self.0.iter().map(serde_json::to_string).collect();
        let lines = lines.map_err(|error| Error::Invalid(format!("edits cannot be written: {error}")))?;
        let space = if lines.is_empty() { "" } else { "\n    " };
        let end = if lines.is_empty() { "" } else { "\n  " };
        let lines = lines.join(",\n    ");
        let version = self.0.iter().map(Edit::version).max().unwrap_or(*VERSIONS.start());
        Ok(format!("{{\n  \"version\": {version},\n  \"edits\": [{space}{lines}{end}]\n}}\n"))
    }

    /// Reads what [`Edits::to_json`] wrote.
    ///
    /// # Errors
    /// [`Error::Broken`] for anything else, as are other versions, unknown fields and numbers that are not finite.
    pub fn from_json(text: &str) -> Result<Self> {
        Self::parse(text).map_err(|reason| Error::Broken { path: "the list of edits".into(), reason })
    }

    /// Reads a file of them.
    ///
    /// # Errors
    /// [`Error::Read`] where it cannot be read, and those of [`Edits::from_json`].
    pub fn load(path: &Path) -> Result<Self> {
        let bytes = crate::files::read(path)?;
        let text = String::from_utf8(bytes).map_err(|_| "it is no text; save the edits again".to_owned());
        text.and_then(|text| Self::parse(&text)).map_err(|reason| Error::Broken { path: path.into(), reason })
    }

    fn parse(text: &str) -> std::result::Result<Self, String> {
        let broken = |error| format!("it is no list of edits ({error}); correct it, or save the edits again");
        let Header { version } = serde_json::from_str(text).map_err(broken)?;
        if !VERSIONS.contains(&version) {
            let (first, last) = VERSIONS.into_inner();
            return Err(format!(
                "its version is {version}, and only {first} to {last} are known; save the edits again"
            ));
        }
        let edits = Self(serde_json::from_str::<Body>(text).map_err(broken)?.edits);
        edits.check_finite().map(|()| edits)
    }

    fn check_finite(&self) -> std::result::Result<(), String> {
        match self.0.iter().position(|edit| !edit.is_finite()) {
            Some(i) => Err(format!("edit {} has a number that is not finite; correct it", i + 1)),
            None => Ok(()),
        }
    }
}
