//! Materials and pictures of models, in glTF's terms.

use super::mtl::{self, Map, Mtl};
use super::{Parsed, named};
use crate::files;
use crate::scene::gltf::{MAX_TEXELS, decode_picture};
use crate::scene::{ColorSpace, Filter, Material, NormalTexture, Scene, Texture, TextureRef, Wrap};
use glam::Vec3;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

/// What a dielectric reflects head on where `Ks` is 1: half of it, glTF's 4 %, is what programs write for glass and
/// plastic.
const SPECULAR: f32 = 2.0;

/// Materials that reflect so much, and nothing diffusely, are metals.
const METAL: f32 = 0.3;
const BLACK: f32 = 0.04;

/// Where masks cut.
const CUTOFF: f32 = 0.5;

/// Puts what a model's materials are into a scene.
pub(super) struct Materials<'s> {
    scene: &'s mut Scene,
    /// Where the files are that it names; without one, no file is found.
    folder: Option<&'s Path>,
    pictures: BTreeMap<(PathBuf, bool, bool), Option<u32>>,
    texels: usize,
}

impl<'s> Materials<'s> {
    pub fn new(scene: &'s mut Scene, folder: Option<&'s Path>) -> Self {
        Self { scene, folder, pictures: BTreeMap::new(), texels: 0 }
    }

    /// Adds the named materials of MTL files, in order. One that is not found is clay.
    pub fn add_libraries(&mut self, names: &[String], libraries: &[String]) {
        let found = self.find_libraries(libraries);
        // The first of a name.
        let mut by_name: BTreeMap<&str, (&Path, &mtl::Library, &Mtl)> = BTreeMap::new();
        for (folder, library) in &found {
            for material in &library.materials {
                by_name.entry(&material.name).or_insert((folder, library, material));
            }
        }
        let mut unread = BTreeSet::new();
        for name in names {
            match by_name.get(name.as_str()) {
                Some(&(folder, library, mtl)) => {
                    unread.extend(library.unread.iter().cloned());
                    let material = self.material(mtl, folder, &mut unread);
                    self.scene.add_material(material);
                }
                None => {
                    if !found.is_empty() || libraries.is_empty() {
                        self.scene.warn(format!("material `{}` is in no MTL file: it is clay", named(name)));
                    }
                    self.scene.add_material(Material { name: named(name), ..clay() });
                }
            }
        }
        if !unread.is_empty() {
            let words: Vec<String> = unread.iter().map(|word| format!("`{word}`")).collect();
            self.scene.warn(format!("what MTL files say by {} is left out", words.join(", ")));
        }
    }

    /// White clay with a picture.
    pub fn add_textured(&mut self, picture: &str) {
        let folder = self.folder.map(Path::to_owned).unwrap_or_default();
        let map = Map::of(picture);
        let base_color_texture = self.texture(&map, &folder, ColorSpace::Srgb);
        let material = match base_color_texture {
            Some(_) => Material { base_color: Vec3::ONE, base_color_texture, ..clay() },
            None => clay(),
        };
        self.scene.add_material(material);
    }

    /// The MTL files, each with its folder.
    fn find_libraries(&mut self, statements: &[String]) -> Vec<(PathBuf, mtl::Library)> {
        let mut found = Vec::new();
        let mut seen = BTreeSet::new();
        let mut said = BTreeSet::new();
        for statement in statements.iter().filter(|statement| said.insert(*statement)) {
            // A name with spaces, or several names.
            let whole = self.find(Path::new(""), statement).map(|path| vec![(statement.as_str(), Ok(path))]);
            let each = || -> Vec<_> {
                statement.split_whitespace().map(|name| (name, self.find(Path::new(""), name))).collect()
            };
            for (name, path) in whole.unwrap_or_else(|_| each()) {
                let bytes = path.and_then(|path| Ok((read(&path)?, path)));
                match bytes {
                    Ok((_, path)) if !seen.insert(path.clone()) => {}
                    Ok((bytes, path)) => {
                        let folder = path.parent().map(Path::to_owned).unwrap_or_default();
                        found.push((folder, mtl::read(&bytes)));
                    }
                    Err(reason) => self.scene.warn(format!(
                        "the materials of `{}` are left out, and what has them is clay: it {reason}",
                        named(name)
                    )),
                }
            }
        }
        found
    }

    fn material(&mut self, mtl: &Mtl, folder: &Path, unread: &mut BTreeSet<String>) -> Material {
        let mut picture = |key: &str, space| self.texture(mtl.maps.get(key)?, folder, space);
        let base_color_texture = picture("map_kd", ColorSpace::Srgb);
        let specular_color_texture = picture("map_ks", ColorSpace::Srgb);
        let emission_texture = picture("map_ke", ColorSpace::Srgb);
        let mask = picture("map_d", ColorSpace::Linear);
        let normal_texture = self.normal_texture(mtl, folder, unread);
        // Programs write black beside a picture, which nobody means.
        let factor = |key: &str, is_textured: bool| match mtl.color(key) {
            Some(color) if !(is_textured && color == Vec3::ZERO) => Some(color),
            _ => is_textured.then_some(Vec3::ONE),
        };
        let alpha = match (mtl.number("d"), mtl.number("Tr")) {
            (Some(d), _) => d.min(1.0),
            // Some programs mean opacity.
            (None, Some(tr)) if tr < 1.0 => 1.0 - tr,
            _ => 1.0,
        };
        let base_color = factor("Kd", base_color_texture.is_some()).unwrap_or(clay().base_color);
        let mut material = Material {
            name: mtl.name.clone(),
            base_color: base_color.min(Vec3::ONE),
            base_color_texture,
            emission: factor("Ke", emission_texture.is_some()).unwrap_or_default(),
            emission_texture,
            normal_texture,
            alpha,
            blended: alpha < 1.0,
            ..clay()
        };
        add_gloss(&mut material, mtl, specular_color_texture);
        if let Some(mask) = mask {
            material.base_color_texture = Some(self.masked(material.base_color_texture, mask));
            material.alpha_cutoff = (!material.blended).then_some(CUTOFF);
        }
        material
    }

    /// `norm`, or a `bump` that is a map of normals; maps of heights are not read.
    fn normal_texture(
        &mut self,
        mtl: &Mtl,
        folder: &Path,
        unread: &mut BTreeSet<String>,
    ) -> Option<NormalTexture> {
        for key in ["norm", "map_bump", "bump"] {
            let Some(map) = mtl.maps.get(key) else { continue };
            let Some(texture) = self.texture(map, folder, ColorSpace::Linear) else { continue };
            if key == "norm" || is_normal_map(&self.scene.textures[texture.texture as usize]) {
                return Some(NormalTexture { texture, scale: map.strength });
            }
            unread.insert(format!("{key} (of heights)"));
        }
        None
    }

    /// A picture with the colours of one and the alpha of another. The first one's coordinates count.
    fn masked(&mut self, color: Option<TextureRef>, mask: TextureRef) -> TextureRef {
        let used = color.unwrap_or(mask);
        let [below, mask] = [used, mask].map(|at| &self.scene.textures[at.texture as usize]);
        let is_alpha = mask.texels.iter().any(|texel| texel[3] < 255);
        let texels = (0..below.height).flat_map(|y| (0..below.width).map(move |x| (x, y))).map(|(x, y)| {
            let [r, g, b, _] = match color {
                Some(_) => below.texels[(y * below.width + x) as usize],
                None => [255; 4],
            };
            let at = glam::Vec2::new(
                (x as f32 + 0.5) / below.width as f32,
                (y as f32 + 0.5) / below.height as f32,
            );
            let value = mask.sample(at);
            let alpha = if is_alpha { value.w } else { value.truncate().element_sum() / 3.0 };
            [r, g, b, (alpha * 255.0).round() as u8]
        });
        let masked = Texture { texels: texels.collect(), color_space: ColorSpace::Srgb, ..below.clone() };
        self.scene.textures.push(masked);
        TextureRef { texture: (self.scene.textures.len() - 1) as u32, ..used }
    }

    /// A use of a picture; `None`, and a warning, if there is none.
    fn texture(&mut self, map: &Map, folder: &Path, color_space: ColorSpace) -> Option<TextureRef> {
        let file = self.find(folder, &map.path);
        let key = (
            file.clone().unwrap_or_else(|_| PathBuf::from(&map.path)),
            color_space == ColorSpace::Linear,
            map.clamp,
        );
        let texture = match self.pictures.get(&key) {
            Some(known) => *known,
            None => {
                let read = file.and_then(|path| self.read_picture(&path, map, color_space));
                let new = match read {
                    Ok(texture) => Some(texture),
                    Err(reason) => {
                        self.scene
                            .warn(format!("the picture `{}` is left out: it {reason}", named(&map.path)));
                        None
                    }
                };
                self.pictures.insert(key, new);
                new
            }
        };
        Some(TextureRef { texture: texture?, uv_set: 0, transform: map.transform })
    }

    fn read_picture(&mut self, path: &Path, map: &Map, color_space: ColorSpace) -> Parsed<u32> {
        let ([width, height], texels) = decode_picture(&read(path)?, MAX_TEXELS - self.texels)?;
        self.texels += texels.len();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let wrap = if map.clamp { Wrap::Clamp } else { Wrap::Repeat };
        let wrap = [wrap; 2];
        self.scene.textures.push(Texture {
            name,
            width,
            height,
            texels,
            color_space,
            wrap,
            filter: Filter::Linear,
        });
        Ok((self.scene.textures.len() - 1) as u32)
    }

    /// A file that is named relative to a folder, by whatever program on whatever machine: by its path, else by its
    /// last name in the folder, in capitals or not. Nothing else of the machine is looked at.
    fn find(&self, folder: &Path, name: &str) -> Parsed<PathBuf> {
        let Some(base) = self.folder else {
            return Err(
                "is in a file of its own, and there is no folder to look in; load the model from a path"
                    .into(),
            );
        };
        let folder = if folder.as_os_str().is_empty() { base } else { folder };
        let relative = PathBuf::from(name.trim().replace('\\', "/"));
        let is_inside =
            !relative.components().any(|c| matches!(c, Component::Prefix(_) | Component::RootDir));
        let whole = folder.join(&relative);
        if is_inside && files::is_file(&whole) {
            return Ok(whole);
        }
        let last = relative.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
        let entries = std::fs::read_dir(if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
        let mut same: Vec<PathBuf> = entries
            .into_iter()
            .flatten()
            .flatten()
            .filter(|entry| entry.file_name().to_string_lossy().to_lowercase() == last)
            .map(|entry| folder.join(entry.file_name()))
            .filter(|path| path.is_file())
            .collect();
        same.sort();
        let first = same.into_iter().next();
        first.ok_or_else(|| "is not there; put the file beside the model".into())
    }
}

/// What everything is made of that is not said to be of anything.
pub(super) fn clay() -> Material {
    Material { name: "clay".into(), ..Material::default() }
}

/// Specular reflection: `Pr` and `Pm`, else what `Ks` and `Ns` come to (Walter et al. 2007: α² = 2 / (n + 2)).
fn add_gloss(material: &mut Material, mtl: &Mtl, texture: Option<TextureRef>) {
    let illumination = mtl.number("illum").unwrap_or(2.0);
    let (rough, metallic) = (mtl.number("Pr"), mtl.number("Pm"));
    let is_physical = rough.is_some() || metallic.is_some();
    let specular = match mtl.color("Ks") {
        Some(specular) if illumination >= 2.0 || is_physical => specular,
        None if texture.is_some() => Vec3::ONE,
        None if is_physical => Vec3::splat(1.0 / SPECULAR),
        _ => Vec3::ZERO,
    };
    let exponent = mtl.number("Ns").unwrap_or(0.0);
    material.roughness = rough.unwrap_or_else(|| libm::powf(2.0 / (exponent + 2.0), 0.25)).min(1.0);
    material.metallic = metallic.unwrap_or(0.0).min(1.0);
    if specular == Vec3::ZERO && material.metallic == 0.0 {
        material.roughness = 1.0;
        return;
    }
    let is_black = material.base_color_texture.is_none() && material.base_color.max_element() <= BLACK;
    if metallic.is_none() && is_black && specular.max_element() >= METAL && !material.emits() {
        material.metallic = 1.0;
        material.base_color = specular.min(Vec3::ONE);
        material.base_color_texture = texture;
        material.specular = 1.0;
        return;
    }
    material.specular = 1.0;
    material.specular_color = specular * SPECULAR;
    material.specular_color_texture = texture;
}

/// Whether the texels are directions, most of them along z, and not heights.
fn is_normal_map(texture: &Texture) -> bool {
    let sum = texture.texels.iter().fold([0_u64; 3], |sum, t| [0, 1, 2].map(|i| sum[i] + u64::from(t[i])));
    let [x, y, z] = sum.map(|sum| sum as f64 / (texture.texels.len().max(1) as f64 * 255.0));
    z > 0.65 && (x - 0.5).abs() < 0.2 && (y - 0.5).abs() < 0.2
}

/// The bytes of a file beside the model.
fn read(path: &Path) -> Parsed<Vec<u8>> {
    files::bytes(path).map_err(|error| format!("cannot be read ({error})"))
}
