//! What a page chooses, by the names of JavaScript.

use girandole::{Mode, RenderSettings, RendererOptions};
use girandole_core::glam::DVec3;
use girandole_core::illumination::IlluminationSettings;
use girandole_core::lights::LightSettings;
use girandole_core::scene::{FieldOfView, Viewpoint};
use girandole_core::tonemap::{Exposure, Tonemap};
use serde::{Deserialize, Serialize};

/// Settings; what is left out stays as it is.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct Settings {
    /// Light samples.
    pub lights: Option<u32>,
    /// Bounces of light; 0 = direct light alone.
    pub bounces: Option<u32>,
    /// Another seed, other light samples.
    pub seed: Option<u32>,
    /// How much work a frame avoids.
    pub mode: Option<ModeName>,
    /// Samples a pixel along each axis.
    pub antialiasing: Option<u32>,
    /// Rays that follow one another from what mirrors.
    pub mirrors: Option<u32>,
    /// Stops, or automatic.
    pub exposure: Option<ExposureValue>,
    /// Tone curve.
    pub tonemap: Option<TonemapName>,
    /// Texels across each shadow map.
    pub map_size: Option<u32>,
    /// Budget of shadow maps, MiB.
    pub memory: Option<u32>,
}

/// The modes of [`Mode`].
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModeName {
    /// Every light, every shadow map, at every pixel.
    Naive,
    /// Shadow maps only where something may block the light.
    Visibility,
    /// The same, shaded at a low resolution where that is enough.
    LowResolution,
    /// The same, with light maps.
    Full,
}

/// An exposure.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged)]
pub enum ExposureValue {
    /// In stops.
    Stops(f32),
    /// The word `auto`.
    Auto(Auto),
}

/// The word `auto`.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Auto {
    /// So that the picture's mean is middle grey.
    Auto,
}

/// The tone curves of [`Tonemap`].
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TonemapName {
    /// AgX.
    Agx,
    /// ACES.
    Aces,
    /// None.
    None,
}

/// Where one looks from.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct Camera {
    /// The eye, metres.
    pub position: [f64; 3],
    /// What is in the middle of the picture, metres.
    pub target: [f64; 3],
    /// What points to the picture's top; +Y where it is left out.
    #[serde(default = "up")]
    pub up: [f64; 3],
    /// The vertical angle of view, degrees; 60 where it is left out.
    #[serde(default = "fov")]
    pub fov: f64,
}

fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

fn fov() -> f64 {
    60.0
}

impl Camera {
    /// The same as the library has it.
    pub fn viewpoint(&self) -> Viewpoint {
        Viewpoint {
            eye: DVec3::from_array(self.position),
            target: DVec3::from_array(self.target),
            up: DVec3::from_array(self.up),
            field: FieldOfView::Perspective { degrees: self.fov },
            clip: Default::default(),
        }
    }

    /// The same as a page has it. A parallel view has the angle of one from its eye.
    pub fn of(viewpoint: &Viewpoint) -> Self {
        let fov = match viewpoint.field {
            FieldOfView::Perspective { degrees } => degrees,
            FieldOfView::Orthographic { height } => {
                let distance = viewpoint.eye.distance(viewpoint.target);
                2.0 * (0.5 * height / distance).atan().to_degrees()
            }
        };
        let [position, target, up] =
            [viewpoint.eye, viewpoint.target, viewpoint.up].map(|vector| vector.to_array());
        Self { position, target, up, fov }
    }
}

/// All that is chosen.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chosen {
    pub options: RendererOptions,
    pub light: IlluminationSettings,
    pub render: RenderSettings,
}

impl Chosen {
    /// Takes what a page sets.
    pub fn set(&mut self, settings: &Settings) {
        let Self { options, light: IlluminationSettings { lights, .. }, render } = self;
        *lights = LightSettings {
            count: settings.lights.unwrap_or(lights.count),
            bounces: settings.bounces.unwrap_or(lights.bounces),
            seed: settings.seed.unwrap_or(lights.seed),
            dark: true,
            ..*lights
        };
        options.map_size = settings.map_size.or(options.map_size);
        options.memory_mib = settings.memory.unwrap_or(options.memory_mib);
        render.samples_per_axis = settings.antialiasing.unwrap_or(render.samples_per_axis);
        render.mirrors = settings.mirrors.unwrap_or(render.mirrors);
        render.mode = settings.mode.map_or(render.mode, |mode| match mode {
            ModeName::Naive => Mode::Naive,
            ModeName::Visibility => Mode::Visibility,
            ModeName::LowResolution => Mode::LowResolution,
            ModeName::Full => Mode::Full,
        });
        render.exposure = settings.exposure.map_or(render.exposure, |exposure| match exposure {
            ExposureValue::Stops(stops) => Exposure::Ev(stops),
            ExposureValue::Auto(Auto::Auto) => Exposure::Auto,
        });
        render.tonemap = settings.tonemap.map_or(render.tonemap, |curve| match curve {
            TonemapName::Agx => Tonemap::Agx,
            TonemapName::Aces => Tonemap::Aces,
            TonemapName::None => Tonemap::None,
        });
    }
}
