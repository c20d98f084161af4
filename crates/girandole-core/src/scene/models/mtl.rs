//! MTL files: what their statements say of materials.

use super::text::{decode, numbers, statements};
use glam::{Affine2, Vec2, Vec3};
use std::collections::{BTreeMap, BTreeSet};

/// What is said of a material.
#[derive(Clone, Debug, Default)]
pub(super) struct Mtl {
    pub name: String,
    /// By statement: `Kd`, `Ns`, ….
    pub numbers: BTreeMap<&'static str, Vec3>,
    /// By statement, in lower case: `map_kd`, `norm`, ….
    pub maps: BTreeMap<&'static str, Map>,
}

/// A use of a picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    /// Relative to the MTL file.
    pub path: String,
    /// Places in the picture from texture coordinates, v counted downwards.
    pub transform: Affine2,
    /// Whether the border goes on beyond it.
    pub clamp: bool,
    /// `-bm`.
    pub strength: f32,
}

impl Map {
    /// A picture as it is.
    pub fn of(path: &str) -> Self {
        Self { path: path.to_owned(), transform: Affine2::IDENTITY, clamp: false, strength: 1.0 }
    }
}

/// All that a file says.
#[derive(Debug, Default)]
pub(super) struct Library {
    pub materials: Vec<Mtl>,
    /// Statements that were not read.
    pub unread: BTreeSet<String>,
}

/// Statements of numbers that are read. `Tr` is 1 − `d`.
const NUMBERS: [&str; 9] = ["Kd", "Ks", "Ke", "Ns", "d", "Tr", "Pr", "Pm", "illum"];

/// Statements of pictures that are read, in lower case.
const MAPS: [&str; 7] = ["map_kd", "map_ks", "map_ke", "map_d", "map_bump", "bump", "norm"];

/// Light from nowhere, its picture, the index of refraction and what else says nothing here.
const WITHOUT_EFFECT: [&str; 6] = ["ka", "map_ka", "ni", "km", "sharpness", "map_aat"];

/// More than anybody reads of.
const MOST_UNREAD: usize = 12;

/// Reads an MTL file. Nothing in it is an error: what is not understood is named.
pub(super) fn read(bytes: &[u8]) -> Library {
    let mut library = Library::default();
    let all: Result<(), std::convert::Infallible> = statements(&decode(bytes), |_, key, rest| {
        if key.eq_ignore_ascii_case("newmtl") {
            library.materials.push(Mtl { name: rest.to_owned(), ..Mtl::default() });
        } else if let Some(material) = library.materials.last_mut()
            && !material.statement(key, rest)
            && library.unread.len() < MOST_UNREAD
        {
            library.unread.insert(super::named(key));
        }
        Ok(())
    });
    let Ok(()) = all;
    library
}

impl Mtl {
    /// Notes a statement; whether it is understood.
    fn statement(&mut self, key: &str, rest: &str) -> bool {
        let lower = key.to_ascii_lowercase();
        if let Some(&known) = NUMBERS.iter().find(|known| known.eq_ignore_ascii_case(key)) {
            return parse_numbers(rest).map(|value| self.numbers.insert(known, value)).is_some();
        }
        if let Some(&known) = MAPS.iter().find(|known| **known == lower) {
            return parse_map(rest).map(|map| self.maps.insert(known, map)).is_some();
        }
        // The colour that passes through: all of it does through glass, and through what is opaque in some programs'
        // files.
        let passes_all = lower == "tf" && parse_numbers(rest) == Some(Vec3::ONE);
        passes_all || WITHOUT_EFFECT.contains(&lower.as_str())
    }

    /// A number, where one is given.
    pub fn number(&self, key: &str) -> Option<f32> {
        self.numbers.get(key).map(|value| value.x)
    }

    /// A colour, where one is given.
    pub fn color(&self, key: &str) -> Option<Vec3> {
        self.numbers.get(key).copied()
    }
}

/// One number, or three; `-halo` before an opacity is left out.
fn parse_numbers(rest: &str) -> Option<Vec3> {
    let rest = rest.strip_prefix("-halo").unwrap_or(rest);
    let ([x, y, z], count) = numbers::<3>(rest).ok()?;
    let value = Vec3::new(x as f32, y as f32, z as f32);
    let value = if count < 3 { Vec3::splat(value.x) } else { value };
    (count > 0 && value.is_finite() && value.min_element() >= 0.0).then_some(value)
}

/// Options, then a path, which may have spaces.
fn parse_map(rest: &str) -> Option<Map> {
    let (mut scale, mut offset) = (Vec2::ONE, Vec2::ZERO);
    let (mut clamp, mut strength) = (false, 1.0);
    let mut rest = rest;
    while let Some((option, values)) = rest.strip_prefix('-').and_then(|r| r.split_once(char::is_whitespace))
    {
        let (words, after): (Vec<&str>, &str) = match option {
            "s" | "o" | "t" => take_words(values, 3, |word| word.parse::<f32>().is_ok()),
            "mm" => take_words(values, 2, |_| true),
            "blendu" | "blendv" | "cc" | "clamp" | "boost" | "texres" | "imfchan" | "type" | "bm" => {
                take_words(values, 1, |_| true)
            }
            // A name that begins so.
            _ => break,
        };
        let number = |i: usize| words.get(i).and_then(|word| word.parse::<f32>().ok());
        let pair = |other: f32| Vec2::new(number(0).unwrap_or(other), number(1).unwrap_or(other));
        match option {
            "s" => scale = pair(1.0),
            "o" => offset = pair(0.0),
            "clamp" => clamp = words.first() == Some(&"on"),
            "bm" => strength = number(0).unwrap_or(1.0),
            _ => {}
        }
        rest = after;
    }
    let path = rest.trim().trim_matches('"');
    let size = scale.abs().max(offset.abs()).max_element();
    let is_sane = !path.is_empty() && size < 1e9 && strength.abs() < 1e9;
    // v is counted upwards in the file: 1 − v of the picture is `scale.y` (1 − v) + `offset.y`.
    let down = Vec2::new(offset.x, 1.0 - scale.y - offset.y);
    let transform = Affine2::from_scale_angle_translation(scale, 0.0, down);
    is_sane.then(|| Map { path: path.to_owned(), transform, clamp, strength })
}

/// Up to so many words that pass a test, and what comes after them.
fn take_words(text: &str, most: usize, is_one: impl Fn(&str) -> bool) -> (Vec<&str>, &str) {
    let (mut words, mut rest) = (Vec::new(), text.trim_start());
    while words.len() < most {
        let (word, after) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        // The last word is the path.
        if after.is_empty() || !is_one(word) {
            break;
        }
        words.push(word);
        rest = after.trim_start();
    }
    (words, rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_are_read_in_any_case_and_what_is_not_is_named() {
        let text = "Kd 9 9 9\nnewmtl a b\n\tkd .5\nKe 1 2 3 # bright\nD -halo .25\nTf 1 1 1\nKa 1 1 1\n\
            Kd spectral x.rfl\nmap_Ns gloss.png\nPr nan\n";
        let library = read(text.as_bytes());
        let material = &library.materials[0];
        assert_eq!((library.materials.len(), material.name.as_str()), (1, "a b"));
        assert_eq!(material.color("Kd"), Some(Vec3::splat(0.5)));
        assert_eq!(material.color("Ke"), Some(Vec3::new(1.0, 2.0, 3.0)));
        assert_eq!((material.number("d"), material.number("Pr")), (Some(0.25), None));
        assert_eq!(library.unread.iter().collect::<Vec<_>>(), ["Kd", "Pr", "map_Ns"]);
    }

    #[test]
    fn no_bytes_are_too_bad() {
        let text = b"newmtl a\nKd .5 .5 .5\nmap_Kd -s 1 2 3 -o 1 -bm .5 -clamp on a b.png\nTr .5\n\
            newmtl \\\n b\nNs 1e3 # x\n";
        let mut state = 1_u32;
        let mut random = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as usize
        };
        let mut read_whole = 0;
        for _ in 0..5000 {
            let mut bytes = text[..text.len() - random() % 20].to_vec();
            for _ in 0..random() % 4 {
                let at = random() % bytes.len();
                bytes[at] = b"-0.e \\#\n\xff\0K"[random() % 11];
            }
            let library = read(&bytes);
            read_whole += usize::from(library.materials.len() == 2);
            let maps = library.materials.iter().flat_map(|m| m.maps.values());
            assert!(maps.into_iter().all(|map| map.transform.is_finite() && !map.path.is_empty()));
        }
        assert!(read_whole > 1000, "{read_whole}");
    }

    #[test]
    fn pictures_have_options_and_names_with_spaces() {
        let map = parse_map("-blendu on -s 2 4 1 -o .25 .5 -bm 0.7 -clamp on my 2 walls.png").expect("a map");
        assert_eq!((map.path.as_str(), map.clamp, map.strength), ("my 2 walls.png", true, 0.7));
        // The upper left corner of the texture, (0, 1) counted upwards, is at 2 · 0 + 0.25, 4 · 1 + 0.5.
        assert_eq!(map.transform.transform_point2(Vec2::ZERO), Vec2::new(0.25, 1.0 - 4.5));
        assert_eq!(parse_map("-s 2 2 2 7").expect("a map").path, "7");
        assert_eq!(parse_map("-wall-.png").map(|map| map.path), Some("-wall-.png".into()));
        assert_eq!(parse_map("\"a b.png\"").map(|map| map.path), Some("a b.png".into()));
        assert_eq!((parse_map(""), parse_map("-s 1e30 1 1 a.png")), (None, None));
    }
}
