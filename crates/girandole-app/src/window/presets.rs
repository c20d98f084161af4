//! Presets: settings of the library that go together. None is kept: the one that matches is found by its settings.

use super::session::Session;
use girandole::{Mode, RenderSettings, RendererOptions, Shading, ShadowMap};
use girandole_core::illumination::IlluminationSettings;

/// What decides how good a picture is and how long it takes.
#[derive(Clone, PartialEq)]
struct Settings {
    options: RendererOptions,
    light: IlluminationSettings,
    settings: RenderSettings,
}

/// Settings under a name.
pub struct Preset {
    pub name: &'static str,
    pub explanation: &'static str,
    lights: u32,
    /// Whether light samples are placed for a view.
    for_view: bool,
    shading: Shading,
    tolerance: f32,
    samples_per_axis: u32,
}

/// From the quickest to the best, and the way of the thesis.
pub const PRESETS: [Preset; 4] = [
    Preset {
        name: "draft",
        explanation: "100 light samples, coarse interpolation, no anti-aliasing: quick, with blotches.",
        lights: 100,
        for_view: true,
        shading: Shading::Fused,
        tolerance: 0.2,
        samples_per_axis: 1,
    },
    Preset {
        name: "balanced",
        explanation: "300 light samples, as girandole render has it.",
        lights: 300,
        for_view: true,
        shading: Shading::Fused,
        tolerance: 0.1,
        samples_per_axis: 1,
    },
    Preset {
        name: "fine",
        explanation: "1024 light samples, fine interpolation, 2 × 2 samples a pixel: some four times as long.",
        lights: 1024,
        for_view: true,
        shading: Shading::Fused,
        tolerance: 0.05,
        samples_per_axis: 2,
    },
    Preset {
        name: "thesis",
        explanation: "As in Barczak's thesis: 300 light samples placed by power, 7 of them a pass, added by blending. Slower.",
        lights: 300,
        for_view: false,
        shading: Shading::Multipass { lights_per_pass: 7 },
        tolerance: 0.1,
        samples_per_axis: 1,
    },
];

impl Preset {
    /// Sets all that it is about; samples that were placed for a view stay so.
    pub fn apply(&self, session: &mut Session, size: [u32; 2]) {
        let Settings { options, light, settings } = self.applied(session, size);
        (session.options, session.light, session.settings) = (options, light, settings);
    }

    /// Whether it would change nothing.
    pub fn matches(&self, session: &Session, size: [u32; 2]) -> bool {
        self.applied(session, size) == Settings::of(session)
    }

    fn applied(&self, session: &Session, size: [u32; 2]) -> Settings {
        let Settings { options, mut light, settings } = Settings::of(session);
        light.lights.count = self.lights;
        match (self.for_view, light.views.is_empty()) {
            (true, true) => light.views = vec![session.view(size)],
            (false, false) => light.views.clear(),
            _ => {}
        }
        let &Self { shading, tolerance, samples_per_axis, .. } = self;
        Settings {
            options: RendererOptions { shadow_map: ShadowMap::Octahedral, map_size: None, pcf: 0, ..options },
            light,
            settings: RenderSettings {
                mode: Mode::Full,
                light_maps: None,
                shading,
                tolerance,
                samples_per_axis,
                ..settings
            },
        }
    }
}

impl Settings {
    fn of(session: &Session) -> Self {
        Self { options: session.options, light: session.light.clone(), settings: session.settings }
    }
}
