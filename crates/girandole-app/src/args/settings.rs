//! From options to the library's settings, and back.

use super::{
    AntiAliasing, Bounces, Clamp, DebugView, DirectShare, LightArgs, Mode, Pcf, Placement, QualityArgs,
    ShadingArg, ShadowMap, Switch, TerminationArg, ToneCurve,
};
use girandole::{RenderSettings, RendererOptions, Shading};
use girandole_core::illumination::IlluminationSettings;
use girandole_core::lights::{self, Termination};
use girandole_core::tonemap::Tonemap;

/// The thesis has as many.
pub(super) const LIGHTS_PER_PASS: u32 = 7;

impl From<&IlluminationSettings> for LightArgs {
    fn from(settings: &IlluminationSettings) -> Self {
        let lights = &settings.lights;
        Self {
            lights: lights.count,
            direct: DirectShare(lights.direct_share),
            placement: if settings.views.is_empty() { Placement::Scene } else { Placement::View },
            bounces: if lights.bounces == u32::MAX {
                Bounces::Unlimited
            } else {
                Bounces::Limit(lights.bounces)
            },
            seed: lights.seed,
            termination: match lights.termination {
                Termination::Throughput => TerminationArg::Throughput,
                Termination::Albedo => TerminationArg::Albedo,
            },
        }
    }
}

impl QualityArgs {
    /// What is fixed when a renderer is made.
    pub fn options(&self) -> RendererOptions {
        RendererOptions {
            shadow_map: match self.shadow_map {
                ShadowMap::Octahedral => girandole::ShadowMap::Octahedral,
                ShadowMap::Parabolic => girandole::ShadowMap::Parabolic,
                ShadowMap::Cube => girandole::ShadowMap::Cube,
            },
            map_size: self.map_size,
            memory_mib: self.memory,
            pcf: self.pcf.0,
            ..RendererOptions::default()
        }
    }

    /// What is said of each frame, but for exposure and tone curve. The bound on the geometric factor may be another one than
    /// that of the options.
    pub fn settings(&self, mode: Mode, clamp: lights::Clamp, aa: AntiAliasing) -> RenderSettings {
        RenderSettings {
            mode: match mode {
                Mode::Naive => girandole::Mode::Naive,
                Mode::Vd => girandole::Mode::Visibility,
                Mode::VdLp => girandole::Mode::LowResolution,
                Mode::Full => girandole::Mode::Full,
            },
            shading: match self.shading {
                ShadingArg::Multipass if mode != Mode::Naive => {
                    Shading::Multipass { lights_per_pass: self.lights_per_pass }
                }
                _ => Shading::Fused,
            },
            light_maps: self.light_maps.map(|s| s == Switch::On && mode != Mode::Naive),
            tolerance: self.tolerance,
            mirrors: self.mirrors,
            clamp,
            samples_per_axis: aa.samples_per_axis(),
            ..RenderSettings::default()
        }
    }
}

impl From<(&RendererOptions, &RenderSettings)> for QualityArgs {
    fn from((options, settings): (&RendererOptions, &RenderSettings)) -> Self {
        let (shading, lights_per_pass) = match settings.shading {
            Shading::Fused => (ShadingArg::Fused, LIGHTS_PER_PASS),
            Shading::Multipass { lights_per_pass } => (ShadingArg::Multipass, lights_per_pass),
        };
        Self {
            clamp: Clamp(settings.clamp),
            shadow_map: match options.shadow_map {
                girandole::ShadowMap::Octahedral => ShadowMap::Octahedral,
                girandole::ShadowMap::Parabolic => ShadowMap::Parabolic,
                girandole::ShadowMap::Cube => ShadowMap::Cube,
            },
            map_size: options.map_size,
            pcf: Pcf(options.pcf),
            memory: options.memory_mib,
            light_maps: settings.light_maps.map(|on| if on { Switch::On } else { Switch::Off }),
            shading,
            lights_per_pass,
            tolerance: settings.tolerance,
            mirrors: settings.mirrors,
        }
    }
}

impl From<girandole::Mode> for Mode {
    fn from(mode: girandole::Mode) -> Self {
        match mode {
            girandole::Mode::Naive => Self::Naive,
            girandole::Mode::Visibility => Self::Vd,
            girandole::Mode::LowResolution => Self::VdLp,
            girandole::Mode::Full => Self::Full,
        }
    }
}

impl From<girandole::DebugView> for DebugView {
    fn from(view: girandole::DebugView) -> Self {
        match view {
            girandole::DebugView::Receivers => Self::Receivers,
            girandole::DebugView::States(light) => Self::States(light),
            girandole::DebugView::LightMaps => Self::LightMaps,
            girandole::DebugView::Levels => Self::Levels,
            girandole::DebugView::LightPositions => Self::Lights,
            girandole::DebugView::Atlas => Self::Atlas,
        }
    }
}

impl From<Tonemap> for ToneCurve {
    fn from(curve: Tonemap) -> Self {
        match curve {
            Tonemap::Agx => Self::Agx,
            Tonemap::Aces => Self::Aces,
            Tonemap::None => Self::None,
        }
    }
}

impl TryFrom<u32> for AntiAliasing {
    type Error = String;

    fn try_from(samples_per_axis: u32) -> Result<Self, String> {
        let all = [Self::Off, Self::Two, Self::Four];
        let found = all.into_iter().find(|aa| aa.samples_per_axis() == samples_per_axis);
        found.ok_or_else(|| format!("there is no --aa {samples_per_axis}; take off, 2 or 4"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::RenderArgs;
    use clap::ValueEnum;
    use girandole_core::lights::LightSettings;

    #[test]
    fn there_and_back_is_the_same() -> anyhow::Result<()> {
        let defaults = RenderArgs::defaults()?;
        let mut quality = defaults.quality;
        for (i, &mode) in Mode::value_variants().iter().filter(|&&mode| mode != Mode::Naive).enumerate() {
            for aa in AntiAliasing::value_variants() {
                let options = quality.options();
                let settings = quality.settings(mode, quality.clamp.0, *aa);
                assert_eq!(QualityArgs::from((&options, &settings)), quality);
                assert_eq!(Mode::from(settings.mode), mode);
                assert_eq!(AntiAliasing::try_from(settings.samples_per_axis), Ok(*aa));
                quality = QualityArgs {
                    clamp: Clamp([lights::Clamp::Off, lights::Clamp::At(0.3)][i % 2]),
                    shadow_map: ShadowMap::value_variants()[i],
                    map_size: Some(64),
                    pcf: Pcf(3),
                    memory: 100,
                    light_maps: Some([Switch::On, Switch::Off][i % 2]),
                    shading: ShadingArg::Multipass,
                    lights_per_pass: 5,
                    tolerance: 0.25,
                    mirrors: 3,
                };
            }
        }
        for curve in ToneCurve::value_variants() {
            assert_eq!(ToneCurve::from(Tonemap::from(*curve)), *curve);
        }
        assert!(AntiAliasing::try_from(3).is_err());
        Ok(())
    }

    #[test]
    fn light_is_there_and_back_the_same() -> anyhow::Result<()> {
        let mut args = RenderArgs::defaults()?.lights;
        args.placement = Placement::Scene;
        let back = |args: &LightArgs| {
            LightArgs::from(&IlluminationSettings { lights: args.settings(), ..Default::default() })
        };
        assert_eq!(back(&args), args);
        let lights = LightSettings { count: 7, bounces: u32::MAX, seed: 3, ..LightSettings::default() };
        let direct_share = Some(0.25);
        let termination = Termination::Throughput;
        let lights = LightSettings { direct_share, termination, ..lights };
        let args = LightArgs::from(&IlluminationSettings { lights, ..Default::default() });
        assert_eq!(args.settings(), lights);
        assert_eq!(back(&args), args);
        Ok(())
    }
}
