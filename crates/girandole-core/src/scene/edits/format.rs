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

use super::{Edit, Edits};
use crate::scene::Transform;
use crate::{Error, Result};
use glam::{DAffine3, Quat, Vec3};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What this version of the library reads and writes.
const VERSION: u32 = 1;

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
            Self::SetTransform { transform, .. } | Self::InsertObject { transform, .. } => {
                transform.affine().is_finite()
            }
            Self::SetEmission { emission: light, .. } | Self::SetIntensity { intensity: light, .. } => {
                light.is_finite()
            }
            Self::RemoveObject { .. } => true,
            Self::SetTime { seconds } => seconds.is_finite(),
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
        Ok(format!("{{\n  \"version\": {VERSION},\n  \"edits\": [{space}{lines}{end}]\n}}\n"))
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
        if version != VERSION {
            return Err(format!(
                "its version is {version}, and only {VERSION} is known; save the edits again"
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
