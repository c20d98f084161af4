//! What can be chosen: once for a renderer ([`RendererOptions`]), or for each frame ([`RenderSettings`]).

use crate::tier::Tier;
use girandole_core::image::Region;
use girandole_core::lights::Clamp;
use girandole_core::tonemap::{Exposure, Tonemap};

/// How a shadow map covers the hemisphere (Barczak §4.2.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShadowMap {
    /// Four faces of an octahedron unfolded to a square: straight edges stay straight.
    #[default]
    Octahedral,
    /// One paraboloid (Brabec 2002): bends edges, so light leaks unless geometry is finely tessellated.
    Parabolic,
    /// Half a cube, five faces: a quarter of the map's texels lies idle.
    Cube,
}

/// What is fixed when a renderer is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RendererOptions {
    /// Parameterisation of shadow maps. Default octahedral: no leaks, fewest passes.
    pub shadow_map: ShadowMap,
    /// Texels across each shadow map, rounded up to a multiple of 16, for cubes of 32; `None` (default) = as many as `memory_mib` holds,
    /// 512 at most, 256 where there are more than 64 lights and neither a sun nor many samples of a sky (whose few have four times as many),
    /// and less for maps that only what is far from the camera looks up. Larger maps have sharper shadow edges and take longer to draw;
    /// shading costs the same.
    pub map_size: Option<u32>,
    /// Budget of shadow maps in MiB, with what is beside them while they are drawn. Default 256, which every WebGPU device can hold.
    pub memory_mib: u32,
    /// Percentage-closer filter: width in texels, 0 (default) = off. N costs (N + 1)² look-ups a pair; with hundreds
    /// of lights, edges average out without it.
    pub pcf: u32,
    /// Which kernels are compiled; `None` (default) = [as the device is](Tier::for_device).
    pub tier: Option<Tier>,
    /// Leave surfaces out of the shadow maps that have the whole scene on one side (default true). Only tests and
    /// figures want them in.
    pub skip_non_blockers: bool,
}

impl Default for RendererOptions {
    fn default() -> Self {
        Self {
            shadow_map: ShadowMap::default(),
            map_size: None,
            memory_mib: 256,
            pcf: 0,
            tier: None,
            skip_non_blockers: true,
        }
    }
}

/// How much work a frame avoids (Barczak §5.2). Every mode but [`Mode::Naive`] needs a
/// [visibility database](crate::Renderer::load_visibility).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Every light, every shadow map, at every pixel.
    Naive,
    /// Visibility determination: shadow maps are read only where something may block the light. The picture is that
    /// of [`Mode::Naive`], without the errors of shadow maps where nothing can block.
    Visibility,
    /// The same, and shading at a low resolution where that is enough.
    LowResolution,
    /// The same, and light maps.
    #[default]
    Full,
}

impl Mode {
    /// Whether pixels are interpolated where light hardly changes.
    pub fn has_low_resolution(self) -> bool {
        matches!(self, Self::LowResolution | Self::Full)
    }
}

/// A picture of how the picture is made. Colours are linear, from 0 to 1: show them without a tone curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DebugView {
    /// Leaf receivers, each in a colour of its own.
    Receivers,
    /// One light's states: green N, yellow P, dark red F; or how many lights are P (white: all of them).
    States(Option<u32>),
    /// What light maps hold.
    LightMaps,
    /// Where points were shaded: blue every 8 pixels, green 4, yellow 2, red each; the rest was interpolated.
    Levels,
    /// Light samples as dots over the picture; rings where they are hidden.
    LightPositions,
    /// The shadow map of each light, in rows: near blockers bright, dark blue where there are none.
    Atlas,
}

/// How points are shaded, in all modes but [`Mode::Naive`]. Both give the same picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    /// One dispatch: each point walks the lights of its receiver.
    #[default]
    Fused,
    /// A few lights a pass, added by the blending unit, as Barczak's thesis does it (§4.3.4). Slower; where the device
    /// cannot blend 32-bit floats, sums have 16 bits. In [`Mode::Full`] the passes are optimised (§4.3.5).
    Multipass {
        /// Lights a pass, 1 to 32. The thesis has 7: more need fewer passes.
        lights_per_pass: u32,
    },
}

/// Which shadow maps a frame draws, of those that it looks up and that show what moved or are not there. Those of lights that moved
/// themselves always are drawn, and so are all that the first frame after a scene was loaded looks up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MapUpdates {
    /// At most so many, first those that are not there, then those of bright lights and those that have been stale for long; `None`
    /// (default) = all, and each frame stands by itself. Fewer take less time; shadows of what moves lag behind, and lights whose maps
    /// are not there yet light nothing that they might be hidden from.
    pub most: Option<u32>,
    /// No map is shown that has been stale for more frames, whatever [`most`](Self::most) says; `None` (default) = no bound.
    pub oldest: Option<u32>,
    /// Which come first. Default by brightness and extent.
    pub priority: MapPriority,
}

/// Which stale shadow maps are drawn first: those with the largest product.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MapPriority {
    /// The light's brightest channel × frames that the map has been stale (Barczak §4.5.3).
    Brightness,
    /// The same × the extent, in texels, of what is stale: shadows change more where the mover is near to the light. With a sixth
    /// of the maps a frame, pictures are 7 % nearer (FLIP) to those of up-to-date maps.
    #[default]
    BrightnessAndExtent,
}

/// What may change from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// How much work is avoided. Default full.
    pub mode: Mode,
    /// Light maps: `None` (default) = in [`Mode::Full`] only.
    pub light_maps: Option<bool>,
    /// How points are shaded. Default fused.
    pub shading: Shading,
    /// Low resolution: largest difference of the light that neighbouring points receive, as a share of it, for what
    /// lies between to be interpolated. Default 0.1; lower shades more points, above 0.2 shadows blur visibly.
    pub tolerance: f32,
    /// Shows how the picture is made in its place. Default no.
    pub debug: Option<DebugView>,
    /// The geometric factor near light samples. Default the mean over what a sample stands for; without it samples speckle what
    /// is close to them, and a bound loses light in corners, a lower one more.
    pub clamp: Clamp,
    /// Mirror images: how many rays follow one another from each pixel that shows something smooth, 0 to 16. Default 2; with 0 such
    /// surfaces show blurs of the light samples about them. Higher shows mirrors in mirrors; time grows with what mirrors cover of the
    /// picture. They are there with [`Clamp::Own`] alone.
    pub mirrors: u32,
    /// Anti-aliasing: samples per pixel along each axis, 1 to 16. Default 1; time grows with the
    /// square, at low resolution by much less.
    pub samples_per_axis: u32,
    /// [`Mode::Naive`]: lights a dispatch, rounded up to whole groups of 128, 512 at the most; `None` (default) = as
    /// many as stay well below a watchdog's patience. Changes no bit.
    pub lights_per_batch: Option<u32>,
    /// Which shadow maps are drawn anew. Default all that are stale.
    pub updates: MapUpdates,
    /// Scale before tone mapping. Default automatic.
    pub exposure: Exposure,
    /// Tone curve. Default AgX.
    pub tonemap: Tonemap,
    /// The part of the picture that is drawn: to the bit what the whole has there, for [`Renderer::radiance`](crate::Renderer::radiance)
    /// alone. Default all of it.
    pub region: Option<Region>,
}

impl RenderSettings {
    /// Whether light maps are used.
    pub fn uses_light_maps(&self) -> bool {
        self.mode != Mode::Naive && self.light_maps.unwrap_or(self.mode == Mode::Full)
    }
}

impl RenderSettings {
    /// Those of light set `set` of a [refined](crate::Renderer::refine) picture: without what is wrong in all sets alike. From set 1 on
    /// every pixel is shaded, as a [tolerance](Self::tolerance) above 0 lets light leak to points that resemble their neighbours (then
    /// relMSE stays above 8e-4 in `table`, however many sets there are), and all shadow maps are drawn; a bound on the geometric factor rises with the root of
    /// the number of sets, and loses less light. Set 0 has these settings.
    pub fn of_set(&self, set: u32) -> Self {
        if set == 0 {
            return *self;
        }
        let clamp = match self.clamp {
            Clamp::At(bound) => Clamp::At(bound * (set as f32 + 1.0).sqrt()),
            clamp => clamp,
        };
        Self { tolerance: 0.0, clamp, updates: MapUpdates::default(), ..*self }
    }

    /// The same for all settings that have the same radiance, once all shadow maps are drawn.
    pub(crate) fn of_radiance(&self) -> Self {
        let Self { exposure, tonemap, updates, .. } = Self::default();
        Self { exposure, tonemap, updates, ..*self }
    }
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            mode: Mode::default(),
            light_maps: None,
            shading: Shading::default(),
            tolerance: 0.1,
            debug: None,
            clamp: Clamp::Own,
            mirrors: 2,
            samples_per_axis: 1,
            lights_per_batch: None,
            updates: MapUpdates::default(),
            exposure: Exposure::Auto,
            tonemap: Tonemap::Agx,
            region: None,
        }
    }
}

/// Where a frame goes, and what of the caller's is there already.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    /// What is written: a two-dimensional view that can be rendered to, one sample a pixel. Formats with sRGB encode by
    /// themselves, other 8-bit ones get sRGB values, floating-point ones linear values, without a bound where
    /// [`RenderSettings::tonemap`] is none (HDR).
    pub color: &'a wgpu::TextureView,
    /// The view's format.
    pub format: wgpu::TextureFormat,
    /// Pixels in x and y.
    pub size: [u32; 2],
    /// Whether what is there stays where nothing of the scene is seen (blended at its edges, so the format has to be
    /// blendable); default no: there it becomes black.
    pub keep_background: bool,
    /// Depth of the caller's own opaque things: what lies behind it is not seen. A view of the depth aspect that can be
    /// bound, one sample a pixel, drawn with the projection of the frame's view and its planes; the pixel's depth counts
    /// for all its samples. Default none.
    pub depth_in: Option<&'a wgpu::TextureView>,
    /// Where our depth goes, with the format: written where the scene is seen (by the sample next to the pixel's centre),
    /// left alone elsewhere. It may be the texture of [`Target::depth_in`]. Default none.
    pub depth_out: Option<(&'a wgpu::TextureView, wgpu::TextureFormat)>,
}

impl<'a> Target<'a> {
    /// A target that is overwritten whole, without depth.
    pub fn new(color: &'a wgpu::TextureView, format: wgpu::TextureFormat, size: [u32; 2]) -> Self {
        Self { color, format, size, keep_background: false, depth_in: None, depth_out: None }
    }

    /// Whether all views are of the same size, and the device can blend where it has to.
    pub(crate) fn check(&self, features: wgpu::Features) -> crate::Result<()> {
        let allowed = self.format.guaranteed_format_features(features).flags;
        if self.keep_background && !allowed.contains(wgpu::TextureFormatFeatureFlags::BLENDABLE) {
            return Err(crate::Error::invalid(format!(
                "this device cannot blend {:?}, which a target that keeps its background needs; take Rgba16Float",
                self.format
            )));
        }
        let views = [Some(self.color), self.depth_in, self.depth_out.map(|(view, _)| view)];
        for texture in views.into_iter().flatten().map(wgpu::TextureView::texture) {
            let size = [texture.width(), texture.height()];
            // A view may be of a smaller level: then its size is the caller's word.
            if texture.mip_level_count() == 1 && size != self.size || texture.sample_count() != 1 {
                return Err(crate::Error::invalid(format!(
                    "a target of {} × {} pixels got a texture of {} × {} with {} samples; give all the same size and one \
                     sample a pixel",
                    self.size[0],
                    self.size[1],
                    size[0],
                    size[1],
                    texture.sample_count()
                )));
            }
        }
        Ok(())
    }
}
