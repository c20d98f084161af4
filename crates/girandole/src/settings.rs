//! What can be chosen: once for a renderer ([`RendererOptions`]), or for each frame ([`RenderSettings`]).

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

impl ShadowMap {
    /// How many faces each map is drawn in.
    pub fn faces(self) -> u32 {
        match self {
            Self::Octahedral => 4,
            Self::Parabolic => 1,
            Self::Cube => 5,
        }
    }
}

/// What is fixed when a renderer is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RendererOptions {
    /// Parameterisation of shadow maps. Default octahedral: no leaks, fewest passes.
    pub shadow_map: ShadowMap,
    /// Texels across each shadow map; `None` (default) = as many as `memory_mib` holds, 512 at most. Larger maps
    /// have sharper shadow edges and take longer to draw; shading costs the same.
    pub map_size: Option<u32>,
    /// Budget of the shadow atlas in MiB. Default 256: a page of 8192², which every WebGPU device can hold.
    pub memory_mib: u32,
    /// Percentage-closer filter: width in texels, 0 (default) = off. N costs (N + 1)² look-ups a pair; with hundreds
    /// of lights, edges average out without it.
    pub pcf: u32,
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
            skip_non_blockers: true,
        }
    }
}

/// What may change from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// Bound of the geometric factor in m⁻²; `None` = exact, which speckles where samples are close. Lower is
    /// smoother and loses more light in corners.
    pub clamp: Option<f32>,
    /// Anti-aliasing: samples per pixel along each axis, 1 to 16. Default 1; time grows with the square.
    pub samples_per_axis: u32,
    /// Lights a dispatch, rounded up to whole groups of 128, 512 at the most; `None` (default) = as many as stay well below a watchdog's
    /// patience. Changes no bit.
    pub lights_per_batch: Option<u32>,
    /// Scale before tone mapping. Default automatic.
    pub exposure: Exposure,
    /// Tone curve. Default AgX.
    pub tonemap: Tonemap,
}

/// Default of [`RenderSettings::clamp`], m⁻²: about the best for 300 samples in a room (relMSE halves, 1 to 2 % of the
/// energy is lost). [`LightSet::suggested_clamp`](girandole_core::lights::LightSet::suggested_clamp) adapts it to the
/// number of samples and the scene's size.
pub const DEFAULT_CLAMP: f32 = 1.0;

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            clamp: Some(DEFAULT_CLAMP),
            samples_per_axis: 1,
            lights_per_batch: None,
            exposure: Exposure::Auto,
            tonemap: Tonemap::Agx,
        }
    }
}
