//! What a picture was made by, in its file: so that frames, or parts of a picture, are told from those of
//! something else.
//!
//! It is one JSON object of words, sorted by key and in ASCII, under the name `girandole`: a tEXt chunk of a PNG
//! file before its pixels, an attribute (`string`) of an OpenEXR file. Values are whatever the maker's pictures
//! depend on. What changes from run to run though the picture does not (dates, paths, machines) does not belong
//! there.

use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use girandole_core::{Error, Result, files};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

/// Of the PNG chunk and of the OpenEXR attribute.
pub(crate) const NAME: &str = "girandole";

/// What a picture was made by: values by key.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Provenance(pub BTreeMap<String, String>);

/// The first key by which two differ, and its value in either.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The key.
    pub key: String,
    /// Here, if it is there at all.
    pub here: Option<String>,
    /// In the other one.
    pub there: Option<String>,
}

impl Provenance {
    /// Sets a value.
    pub fn set(&mut self, key: &str, value: impl ToString) {
        self.0.insert(key.into(), value.to_string());
    }

    /// How the other one differs: by the first of these keys that does, else by the first of all in alphabetical order.
    pub fn difference(&self, other: &Self, first: &[&str]) -> Option<Difference> {
        let keys = first.iter().copied().chain(self.0.keys().chain(other.0.keys()).map(String::as_str));
        let mut rest: Vec<&str> = keys.filter(|key| self.0.get(*key) != other.0.get(*key)).collect();
        let ordered = rest.iter().take_while(|key| first.contains(key)).count();
        rest[ordered..].sort_unstable();
        let key = *rest.first()?;
        let of = |one: &Self| one.0.get(key).cloned();
        Some(Difference { key: key.into(), here: of(self), there: of(other) })
    }

    /// The text that files hold.
    pub fn to_json(&self) -> String {
        let pairs = self.0.iter().map(|(key, value)| (key.clone(), serde_json::Value::from(value.as_str())));
        let json: serde_json::Value = pairs.collect();
        let mut ascii = String::new();
        for unit in json.to_string().encode_utf16() {
            match char::from_u32(unit.into()) {
                Some(c @ ' '..='~') => ascii.push(c),
                _ => ascii.push_str(&format!("\\u{unit:04x}")),
            }
        }
        ascii
    }

    /// The way back; `None` for any other text.
    pub fn from_json(text: &str) -> Option<Self> {
        let serde_json::Value::Object(object) = serde_json::from_str(text).ok()? else { return None };
        object
            .into_iter()
            .map(|(key, value)| Some((key, value.as_str()?.to_owned())))
            .collect::<Option<_>>()
            .map(Self)
    }

    /// That of a picture's file, `.exr` or `.png`, if it holds one; pixels are not looked at.
    ///
    /// # Errors
    /// [`Error::Read`]; [`Error::Broken`] for what is no such file.
    pub fn read(path: &Path) -> Result<Option<Self>> {
        let bytes = files::read(path)?;
        let broken = |reason: String| Error::Broken { path: path.into(), reason };
        let text = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
            of_exr(&bytes).map_err(|e| broken(format!("it is no readable OpenEXR file ({e})")))?
        } else {
            of_png(&bytes).map_err(|e| broken(format!("it is no readable PNG file ({e})")))?
        };
        Ok(text.as_deref().and_then(Self::from_json))
    }
}

fn of_png(bytes: &[u8]) -> std::result::Result<Option<String>, png::DecodingError> {
    let reader = png::Decoder::new(Cursor::new(bytes)).read_info()?;
    let mut chunks = reader.info().uncompressed_latin1_text.iter();
    Ok(chunks.find(|chunk| chunk.keyword == NAME).map(|chunk| chunk.text.clone()))
}

fn of_exr(bytes: &[u8]) -> exr::error::Result<Option<String>> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)?;
    let mut attributes =
        meta.headers.iter().flat_map(|h| h.shared_attributes.other.iter().chain(&h.own_attributes.other));
    Ok(attributes.find_map(|(name, value)| match value {
        AttributeValue::Text(text) if *name == *NAME => Some(text.to_string()),
        _ => None,
    }))
}

/// The attribute of an OpenEXR file.
pub(crate) fn attribute(provenance: &Provenance) -> Option<(Text, AttributeValue)> {
    Some((Text::new_or_none(NAME)?, AttributeValue::Text(Text::new_or_none(provenance.to_json())?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(pairs: &[(&str, &str)]) -> Provenance {
        Provenance(pairs.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect())
    }

    #[test]
    fn text_is_ascii_and_comes_back() {
        for words in ["", "plain", "Lämpchen \"𝕏\"\\\n\u{7f}\0"] {
            let provenance = of(&[("a", words), (words, "b")]);
            let text = provenance.to_json();
            assert!(text.bytes().all(|b| (b' '..=b'~').contains(&b)), "{text}");
            assert_eq!(Provenance::from_json(&text), Some(provenance));
        }
        for other in ["", "{", "[]", "{\"a\":1}"] {
            assert_eq!(Provenance::from_json(other), None, "{other}");
        }
    }

    #[test]
    fn the_first_difference_is_named() {
        let one = of(&[("aa", "1"), ("size", "8x6"), ("seed", "1")]);
        let other = of(&[("aa", "2"), ("size", "8x7")]);
        let key = |first: &[&str]| one.difference(&other, first).map(|d| d.key);
        assert_eq!((key(&[]), key(&["scene", "size"])), (Some("aa".into()), Some("size".into())));
        assert_eq!(one.difference(&one, &["size"]), None);
        let without = one.difference(&other, &["seed"]).expect("a difference");
        assert_eq!((without.here.as_deref(), without.there), (Some("1"), None));
    }
}
