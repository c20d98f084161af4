//! PLY files, ASCII or binary.

use super::polygons::{Corner, Polygons, Smoothing};
use super::{MaterialId, Model, Parsed, named};
use crate::scene::NONE;
use crate::tonemap::srgb_decode;
use glam::{Vec2, Vec3};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Header, Property, PropertyAccess, PropertyAccessResult};
use std::io::Cursor;

/// A vertex, a face or a strip of triangles.
struct Element {
    position: [f64; 3],
    normal: [f32; 3],
    uv: [f32; 2],
    /// Red, green, blue, alpha, 0 to 1.
    color: [f32; 4],
    corners: Vec<i64>,
    /// Texture coordinates of the corners.
    corner_uvs: Vec<f32>,
}

impl PropertyAccess for Element {
    fn new() -> Self {
        let (position, normal, uv) = Default::default();
        Self { position, normal, uv, color: [1.0; 4], corners: Vec::new(), corner_uvs: Vec::new() }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match name {
            "vertex_indices" | "vertex_index" => {
                let Some(corners) = integers(&property) else { return PropertyAccessResult::UnsupportedType };
                self.corners = corners;
                return PropertyAccessResult::Set;
            }
            "texcoord" => {
                match property {
                    Property::ListFloat(list) => self.corner_uvs = list,
                    Property::ListDouble(list) => {
                        self.corner_uvs = list.into_iter().map(|x| x as f32).collect()
                    }
                    _ => return PropertyAccessResult::UnsupportedType,
                }
                return PropertyAccessResult::Set;
            }
            _ => {}
        }
        let Some((value, largest)) = scalar(&property) else { return PropertyAccessResult::Ignored };
        let short = value as f32;
        let share = (value / largest) as f32;
        match name {
            "x" => self.position[0] = value,
            "y" => self.position[1] = value,
            "z" => self.position[2] = value,
            "nx" | "normal_x" => self.normal[0] = short,
            "ny" | "normal_y" => self.normal[1] = short,
            "nz" | "normal_z" => self.normal[2] = short,
            _ if U.contains(&name) => self.uv[0] = short,
            "v" | "t" | "texture_v" | "texture_t" => self.uv[1] = short,
            _ if RED.contains(&name) => self.color[0] = share,
            "green" | "g" | "diffuse_green" => self.color[1] = share,
            "blue" | "b" | "diffuse_blue" => self.color[2] = share,
            "alpha" | "a" | "diffuse_alpha" => self.color[3] = share,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

const U: [&str; 4] = ["u", "s", "texture_u", "texture_s"];
const RED: [&str; 3] = ["red", "r", "diffuse_red"];

/// A number, and what stands for one if it is a share.
fn scalar(property: &Property) -> Option<(f64, f64)> {
    Some(match *property {
        Property::Char(x) => (x.into(), 255.0),
        Property::UChar(x) => (x.into(), 255.0),
        Property::Short(x) => (x.into(), 65535.0),
        Property::UShort(x) => (x.into(), 65535.0),
        Property::Int(x) => (x.into(), 255.0),
        Property::UInt(x) => (x.into(), 255.0),
        Property::Float(x) => (x.into(), 1.0),
        Property::Double(x) => (x, 1.0),
        _ => return None,
    })
}

fn integers(property: &Property) -> Option<Vec<i64>> {
    Some(match property {
        Property::ListChar(list) => list.iter().copied().map(i64::from).collect(),
        Property::ListUChar(list) => list.iter().copied().map(i64::from).collect(),
        Property::ListShort(list) => list.iter().copied().map(i64::from).collect(),
        Property::ListUShort(list) => list.iter().copied().map(i64::from).collect(),
        Property::ListInt(list) => list.iter().copied().map(i64::from).collect(),
        Property::ListUInt(list) => list.iter().copied().map(i64::from).collect(),
        _ => return None,
    })
}

/// Reads a PLY file.
///
/// # Errors
/// What is wrong, after "the file is not usable: ".
pub(super) fn read(bytes: &[u8]) -> Parsed<Model> {
    let broken = |e: &dyn std::fmt::Display| {
        let message: String = e.to_string().lines().next().unwrap_or_default().chars().take(120).collect();
        format!("it is not a PLY file or broken ({message}); fetch or export it again")
    };
    let parser = Parser::<Element>::new();
    let mut reader = Reader::new(Cursor::new(bytes));
    let header = parser.read_header(&mut reader).map_err(|e| broken(&e))?;
    for (name, element) in &header.elements {
        // Each element takes a byte at least: no count can make the parser take more memory than the file deserves.
        if element.count > bytes.len() || (element.count > 0 && element.properties.is_empty()) {
            return Err(format!(
                "it promises {} of element `{}` and is too short for them",
                element.count,
                named(name)
            ));
        }
    }
    let mut payload = parser.read_payload(&mut reader, &header).map_err(|e| broken(&e))?;
    let mut warnings = Vec::new();
    let mut polygons = vertices(payload.swap_remove("vertex").unwrap_or_default(), &header, &mut warnings);
    // Corners have the coordinates of their vertices, or of their own.
    let coordinates: fn(u32) -> u32 = if polygons.uvs.is_empty() { |_| NONE } else { |vertex| vertex };
    for face in payload.swap_remove("face").unwrap_or_default() {
        add_face(&mut polygons, &face, coordinates)?;
    }
    for strip in payload.swap_remove("tristrips").unwrap_or_default() {
        add_strips(&mut polygons, &strip.corners, coordinates)?;
    }
    if has_property(&header, "face", &RED) {
        warnings.push("colours of faces of PLY files are left out: give them to vertices".into());
    }
    if polygons.faces.is_empty() && !polygons.positions.is_empty() {
        return Err("it has no faces, only points; make a surface of them first".into());
    }
    let file = |comment: &String| {
        let (key, name) = comment.trim().split_once(char::is_whitespace)?;
        key.eq_ignore_ascii_case("TextureFile").then(|| name.trim().to_owned())
    };
    let texture = header.comments.iter().find_map(file);
    Ok(Model { polygons, texture, warnings, ..Model::default() })
}

fn has_property(header: &Header, element: &str, names: &[&str]) -> bool {
    let element = header.elements.get(element);
    element.is_some_and(|element| names.iter().any(|name| element.properties.contains_key(*name)))
}

/// What the vertices say; each has its own normal and coordinates.
fn vertices(vertices: Vec<Element>, header: &Header, warnings: &mut Vec<String>) -> Polygons {
    let mut polygons = Polygons::default();
    polygons.positions = vertices.iter().map(|v| Vec3::from(v.position.map(|x| x as f32))).collect();
    if has_property(header, "vertex", &["nx", "normal_x"]) {
        polygons.normals = vertices.iter().map(|v| Vec3::from(v.normal)).collect();
    }
    if has_property(header, "vertex", &U) {
        polygons.uvs = vertices.iter().map(|v| Vec2::from(v.uv)).collect();
    }
    if has_property(header, "vertex", &RED) {
        let decode = |x: f32| if x.is_nan() { 1.0 } else { srgb_decode(x.clamp(0.0, 1.0)) };
        let color = |v: &Element| Vec3::new(decode(v.color[0]), decode(v.color[1]), decode(v.color[2]));
        polygons.colors = vertices.iter().map(color).collect();
        if vertices.iter().any(|v| v.color[3] < 1.0) {
            warnings.push("the alpha of vertices of PLY files is left out".into());
        }
    }
    polygons
}

fn add_face(polygons: &mut Polygons, face: &Element, coordinates: fn(u32) -> u32) -> Parsed<()> {
    let vertices = polygons.positions.len();
    let uvs = &face.corner_uvs;
    let has_uvs = !uvs.is_empty() && uvs.len() == face.corners.len() * 2;
    let first = polygons.uvs.len() as u32;
    if has_uvs {
        polygons.uvs.extend(uvs.as_chunks().0.iter().map(|&uv: &[f32; 2]| Vec2::from(uv)));
    }
    let corner = |(i, &index): (usize, &i64)| {
        let position = corner_index(index, vertices)?;
        let uv = if has_uvs { first + i as u32 } else { coordinates(position) };
        Ok(Corner { position, uv, normal: position })
    };
    let corners = face.corners.iter().enumerate().map(corner).collect::<Parsed<Vec<_>>>()?;
    polygons.add_face(corners, MaterialId(NONE), Smoothing::ByAngle)?;
    Ok(())
}

/// Strips of triangles, every other one of which is turned; −1 ends one.
fn add_strips(polygons: &mut Polygons, strips: &[i64], coordinates: fn(u32) -> u32) -> Parsed<()> {
    let vertices = polygons.positions.len();
    for strip in strips.split(|&index| index == -1) {
        for (i, corners) in strip.windows(3).enumerate() {
            let [a, b, c] = [corners[0], corners[1], corners[2]];
            let mut corners =
                [corner_index(a, vertices)?, corner_index(b, vertices)?, corner_index(c, vertices)?];
            if i % 2 == 1 {
                corners.swap(0, 1);
            }
            let corners = corners.map(|v| Corner { position: v, uv: coordinates(v), normal: v });
            polygons.add_face(corners, MaterialId(NONE), Smoothing::ByAngle)?;
        }
    }
    Ok(())
}

fn corner_index(index: i64, vertices: usize) -> Parsed<u32> {
    u32::try_from(index).map_err(|_| format!("a face has vertex {index} of {vertices}; export it again"))
}
