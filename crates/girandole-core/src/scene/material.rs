//! Materials and textures, in glTF's terms.

use crate::tonemap::srgb_decode;
use glam::{Affine2, Vec2, Vec3, Vec4};

/// Roughness from which on light samples show all that is reflected, however few there are.
const MIRROR_ROUGHNESS: f32 = 0.75;

/// How a texture's bytes encode values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// RGB by the sRGB transfer function, alpha linear.
    Srgb,
    /// All channels linear.
    Linear,
}

/// What lies beyond a texture's edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The texture again.
    #[default]
    Repeat,
    /// The texture mirrored, then again.
    Mirror,
    /// Its border texel.
    Clamp,
}

/// How a texture is read between texel centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// Bilinear.
    #[default]
    Linear,
    /// The nearest texel.
    Nearest,
}

/// A texture image: 8-bit RGBA, rows from the top (v = 0) down.
#[derive(Clone, Debug)]
pub struct Texture {
    /// The name, as in the file; may be empty.
    pub name: String,
    /// Texels in x, at least 1.
    pub width: u32,
    /// Texels in y, at least 1.
    pub height: u32,
    /// `width × height` texels.
    pub texels: Vec<[u8; 4]>,
    /// How the bytes encode values.
    pub color_space: ColorSpace,
    /// Beyond the edge in u and v.
    pub wrap: [Wrap; 2],
    /// Between texel centres.
    pub filter: Filter,
}

/// A use of a texture: which one, by which coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into the scene's textures.
    pub texture: u32,
    /// Which set of texture coordinates: 0 or 1.
    pub uv_set: u32,
    /// Texture from vertex coordinates (`KHR_texture_transform`).
    pub transform: Affine2,
}

impl TextureRef {
    /// Texture `texture` by coordinate set 0, untransformed.
    pub fn new(texture: u32) -> Self {
        Self { texture, uv_set: 0, transform: Affine2::IDENTITY }
    }
}

/// A tangent-space normal map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalTexture {
    /// The texture.
    pub texture: TextureRef,
    /// Scales x and y of the normal before it is normalised.
    pub scale: f32,
}

/// A surface in glTF's metallic-roughness terms. Factors multiply their textures.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name, as in the file; may be empty.
    pub name: String,
    /// Linear RGB; reflection of a dielectric's diffuse part is this / π.
    pub base_color: Vec3,
    /// Whether vertices' colours multiply it.
    pub vertex_colors: bool,
    /// Opacity factor; counts for an alpha mask, and where the material is [`blended`](Self::blended).
    pub alpha: f32,
    /// sRGB colour and alpha.
    pub base_color_texture: Option<TextureRef>,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// Perceptual roughness; GGX α is its square.
    pub roughness: f32,
    /// Roughness in G, metallic in B; linear.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Strength of the dielectric specular lobe (`KHR_materials_specular`): 0 makes it exactly Lambertian.
    pub specular: f32,
    /// Strength in A; linear.
    pub specular_texture: Option<TextureRef>,
    /// Tint of the dielectric specular lobe at normal incidence, linear RGB.
    pub specular_color: Vec3,
    /// sRGB tint.
    pub specular_color_texture: Option<TextureRef>,
    /// Tangent-space normal map.
    pub normal_texture: Option<NormalTexture>,
    /// Emitted radiance from the front side, W/(sr·m²), linear RGB.
    pub emission: Vec3,
    /// sRGB factor of the emission.
    pub emission_texture: Option<TextureRef>,
    /// Where alpha is below this there is no surface; `None` = opaque.
    pub alpha_cutoff: Option<f32>,
    /// Whether alpha is how much of what lies behind is covered. Emission is what is seen, and not weakened by it.
    pub blended: bool,
    /// Share of the light that enters a dielectric and passes straight through, tinted by the base colour, instead of being
    /// diffusely reflected: a thin wall (`KHR_materials_transmission`), clear however rough it is.
    pub transmission: f32,
    /// Factor of the transmission in R; linear.
    pub transmission_texture: Option<TextureRef>,
    /// Whether it shades (and emits) from its back too.
    pub double_sided: bool,
    /// Whether the eye sees its base colour as radiance, W/(sr·m²), and light is lost on it (`KHR_materials_unlit`). It casts
    /// shadows, and does not emit.
    pub unlit: bool,
}

impl Default for Material {
    /// A white Lambertian surface of reflectance 0.8.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec3::splat(0.8),
            vertex_colors: false,
            alpha: 1.0,
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            specular: 0.0,
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
            normal_texture: None,
            emission: Vec3::ZERO,
            emission_texture: None,
            alpha_cutoff: None,
            blended: false,
            transmission: 0.0,
            transmission_texture: None,
            double_sided: false,
            unlit: false,
        }
    }
}

impl Material {
    /// A Lambertian surface of this reflectance (linear RGB).
    pub fn diffuse(name: &str, base_color: Vec3) -> Self {
        Self { name: name.into(), base_color, ..Self::default() }
    }

    /// A black surface that emits this radiance, W/(sr·m²).
    pub fn emitter(name: &str, emission: Vec3) -> Self {
        Self { name: name.into(), base_color: Vec3::ZERO, emission, ..Self::default() }
    }

    /// Whether it can emit at all.
    pub fn emits(&self) -> bool {
        !self.unlit && self.emission.max_element() > 0.0
    }

    /// Whether what lies behind is seen through it. Such surfaces cast no shadows: light samples shine through them undiminished,
    /// and the random walk passes them.
    pub fn is_transparent(&self) -> bool {
        self.blended || self.transmission > 0.0
    }

    /// Whether some of what it reflects is sharper than light samples can show, so that it takes mirrored rays.
    pub fn is_smooth(&self) -> bool {
        let reflects = self.specular > 0.0 || self.metallic > 0.0;
        reflects && (self.roughness < MIRROR_ROUGHNESS || self.metallic_roughness_texture.is_some())
    }

    /// Whether it may throw light on others in a lobe about where it mirrors it: smooth metal, or what reflects as much.
    pub fn throws_lobes(&self) -> bool {
        let f0 = 0.04 * self.specular_color.max_element() * self.specular;
        self.is_smooth() && (self.metallic > 0.0 || f0 > crate::brdf::METAL)
    }

    /// Every texture that the material uses.
    pub fn textures(&self) -> impl Iterator<Item = TextureRef> + '_ {
        [
            self.base_color_texture,
            self.metallic_roughness_texture,
            self.specular_texture,
            self.specular_color_texture,
            self.normal_texture.map(|n| n.texture),
            self.emission_texture,
            self.transmission_texture,
        ]
        .into_iter()
        .flatten()
    }
}

impl Texture {
    /// The linear value at texture coordinates `uv`, level 0, filtered as the texture asks.
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        let size = Vec2::new(self.width as f32, self.height as f32);
        let at = uv * size;
        match self.filter {
            Filter::Nearest => self.texel(at.x.floor() as i64, at.y.floor() as i64),
            Filter::Linear => {
                let corner = (at - 0.5).floor();
                let f = at - 0.5 - corner;
                let (x, y) = (corner.x as i64, corner.y as i64);
                let (x1, y1) = (x.saturating_add(1), y.saturating_add(1));
                let top = self.texel(x, y).lerp(self.texel(x1, y), f.x);
                let bottom = self.texel(x, y1).lerp(self.texel(x1, y1), f.x);
                top.lerp(bottom, f.y)
            }
        }
    }

    /// The linear value of a texel; coordinates beyond the edge are wrapped.
    pub fn texel(&self, x: i64, y: i64) -> Vec4 {
        let x = wrap(x, self.width, self.wrap[0]);
        let y = wrap(y, self.height, self.wrap[1]);
        let [r, g, b, a] = self.texels[(y * self.width + x) as usize];
        let decode = |byte: u8| match self.color_space {
            ColorSpace::Srgb => srgb_decode(f32::from(byte) / 255.0),
            ColorSpace::Linear => f32::from(byte) / 255.0,
        };
        Vec4::new(decode(r), decode(g), decode(b), f32::from(a) / 255.0)
    }
}

fn wrap(i: i64, size: u32, wrap: Wrap) -> u32 {
    let n = i64::from(size);
    (match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let m = i.rem_euclid(2 * n);
            if m < n { m } else { 2 * n - 1 - m }
        }
    }) as u32
}
