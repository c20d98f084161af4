//! Wavefront OBJ files: what their statements say.

use super::polygons::{Corner, Polygons, Smoothing};
use super::text::{decode, numbers, statements};
use super::{MaterialId, Model, Parsed, named};
use crate::scene::NONE;
use crate::tonemap::srgb_decode;
use glam::{Vec2, Vec3};
use rustc_hash::FxHashMap;
use std::collections::BTreeSet;

/// Statements about names, pictures of other programs and levels of detail, that say nothing about how a model looks.
const WITHOUT_EFFECT: [&str; 11] =
    ["o", "g", "vp", "mg", "lod", "bevel", "c_interp", "d_interp", "shadow_obj", "trace_obj", "maplib"];

/// Statements of curves and surfaces by formula.
const FREE_FORM: [&str; 14] = [
    "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp", "end",
    "con",
];

/// What is said in the sense of a state.
struct Reader {
    model: Polygons,
    /// By name, in the order of their use.
    materials: FxHashMap<String, u32>,
    names: Vec<String>,
    libraries: Vec<String>,
    material: MaterialId,
    smoothing: Smoothing,
    left_out: BTreeSet<&'static str>,
    unknown: BTreeSet<String>,
}

/// Reads an OBJ file.
///
/// # Errors
/// What is wrong, after "the file is not usable: ".
pub(super) fn read(bytes: &[u8]) -> Parsed<Model> {
    let mut reader = Reader {
        model: Polygons::default(),
        materials: FxHashMap::default(),
        names: Vec::new(),
        libraries: Vec::new(),
        material: MaterialId(NONE),
        smoothing: Smoothing::ByAngle,
        left_out: BTreeSet::new(),
        unknown: BTreeSet::new(),
    };
    statements(&decode(bytes), |line, key, rest| {
        reader.statement(key, rest).map_err(|what| format!("{what} in line {line}; export it again"))
    })?;
    Ok(reader.finish())
}

impl Reader {
    fn statement(&mut self, key: &str, rest: &str) -> Parsed<()> {
        match key {
            "v" => self.vertex(rest)?,
            "vt" => {
                let ([u, v], _) = read_numbers(rest, 1)?;
                self.model.uvs.push(Vec2::new(u, v));
            }
            "vn" => {
                let (normal, _) = read_numbers(rest, 3)?;
                self.model.normals.push(Vec3::from(normal));
            }
            "f" | "fo" => self.face(rest)?,
            "usemtl" => self.material = self.named_material(rest),
            "mtllib" if !rest.is_empty() => self.libraries.push(rest.to_owned()),
            "s" => {
                self.smoothing = match rest {
                    "off" | "0" => Smoothing::Off,
                    "on" => Smoothing::Group(1),
                    number => number.parse().map_or(self.smoothing, Smoothing::Group),
                }
            }
            "l" | "p" => {
                self.left_out.insert("lines and points");
            }
            "usemap" => {
                self.left_out.insert("texture maps by `usemap`");
            }
            "call" | "csh" => {
                self.left_out.insert("other files by `call` and `csh`");
            }
            _ if FREE_FORM.contains(&key) => {
                self.left_out.insert("free-form curves and surfaces");
            }
            _ if WITHOUT_EFFECT.contains(&key) || key == "mtllib" => {}
            _ => {
                const MOST: usize = 4;
                if self.unknown.len() < MOST {
                    self.unknown.insert(named(key));
                }
            }
        }
        Ok(())
    }

    /// A position, and perhaps a weight, which polygons do not have, or a colour.
    fn vertex(&mut self, rest: &str) -> Parsed<()> {
        let ([x, y, z, r, g, b], count) = read_numbers(rest, 3)?;
        let (positions, colors) = (&mut self.model.positions, &mut self.model.colors);
        positions.push(Vec3::new(x, y, z));
        if count == 6 {
            colors.resize(positions.len() - 1, Vec3::ONE);
            colors.push(Vec3::new(r, g, b));
        }
        Ok(())
    }

    fn face(&mut self, rest: &str) -> Parsed<()> {
        let rest = rest.split('#').next().unwrap_or_default();
        let corners = rest.split_whitespace().map(|word| self.corner(word)).collect::<Parsed<Vec<_>>>()?;
        if !self.model.add_face(corners, self.material, self.smoothing)? {
            self.left_out.insert("faces of fewer than three corners");
        }
        Ok(())
    }

    /// One of `1`, `1/2`, `1//3` and `1/2/3`; texture coordinates and normals that do not exist are left out.
    fn corner(&mut self, word: &str) -> Parsed<Corner> {
        let counts = [self.model.positions.len(), self.model.uvs.len(), self.model.normals.len()];
        let mut indices = [NONE; 3];
        for ((slot, text), count) in indices.iter_mut().zip(word.splitn(3, '/')).zip(counts) {
            if !text.is_empty() {
                let number: i64 = text.parse().map_err(|_| no_corner(word))?;
                *slot = index(number, count).ok_or_else(|| no_corner(word))?;
            }
        }
        let [position, uv, normal] = indices;
        if position == NONE {
            return Err(no_corner(word));
        }
        Ok(Corner { position, uv, normal })
    }

    fn named_material(&mut self, name: &str) -> MaterialId {
        if name.is_empty() {
            return MaterialId(NONE);
        }
        let next = self.names.len() as u32;
        let index = *self.materials.entry(name.to_owned()).or_insert(next);
        if index == next {
            self.names.push(name.to_owned());
        }
        MaterialId(index)
    }

    fn finish(self) -> Model {
        let mut polygons = self.model;
        if !polygons.colors.is_empty() {
            polygons.colors.resize(polygons.positions.len(), Vec3::ONE);
            // Of 1 or of 255.
            let most = polygons.colors.iter().fold(1.0_f32, |most, color| most.max(color.max_element()));
            let factor = if most > 1.0 { 1.0 / 255.0 } else { 1.0 };
            let decode = |x: f32| srgb_decode((x * factor).clamp(0.0, 1.0));
            for color in &mut polygons.colors {
                *color = if color.is_finite() { Vec3::from(color.to_array().map(decode)) } else { Vec3::ONE };
            }
        }
        let mut warnings: Vec<String> =
            self.left_out.iter().map(|what| format!("{what} of OBJ files are left out")).collect();
        if !self.unknown.is_empty() {
            let words: Vec<String> = self.unknown.iter().map(|word| format!("`{word}`")).collect();
            warnings.push(format!(
                "statements of an OBJ file that are not known are left out: {}",
                words.join(", ")
            ));
        }
        Model { polygons, materials: self.names, libraries: self.libraries, texture: None, warnings }
    }
}

/// Index from 0 up of what is counted from 1 up, or from the last one down.
fn index(number: i64, count: usize) -> Option<u32> {
    let index = if number > 0 { number - 1 } else { (count as i64).checked_add(number)? };
    if number == 0 { None } else { u32::try_from(index).ok().filter(|&index| index != NONE) }
}

fn no_corner(word: &str) -> String {
    format!("`{}` is no corner of a face", named(word))
}

fn read_numbers<const N: usize>(text: &str, least: usize) -> Parsed<([f32; N], usize)> {
    let (numbers, count) = numbers(text).map_err(|word| format!("`{}` is no number", named(word)))?;
    if count < least {
        return Err(format!("there are {count} numbers instead of {least}"));
    }
    Ok((numbers.map(|x| x as f32), count))
}
