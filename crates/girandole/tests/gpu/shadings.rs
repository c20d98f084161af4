//! Multipass shading gives what fused shading gives.

use crate::common::{Context, Stage, Test};
use crate::selected::{bounded, flip, glossy, truth};
use girandole::{Gpu, Mode, RenderSettings, RendererOptions, Shading, WANTED_FEATURES};
use girandole_core::image::Image;
use girandole_core::lights::LightSet;

pub fn tests() -> Vec<Test> {
    vec![("fused_is_about_multipass_in_16_bits", fused_is_about_multipass_in_16_bits)]
}

pub fn with_float_blending() -> (wgpu::Features, Test) {
    (wgpu::Features::FLOAT32_BLENDABLE, ("fused_is_multipass", fused_is_multipass))
}

/// Compares fused with multipass shading in all modes: `check` gets the settings of the latter and both pictures.
fn shadings(context: &Context, check: impl Fn(&Stage, &RenderSettings, [Image; 2])) {
    for stage in [Stage::builtin("table", 40), glossy(40), truth("punctual", 40)] {
        let view = stage.view(0, SHADINGS_SIZE);
        for mode in [Mode::Visibility, Mode::LowResolution, Mode::Full] {
            // In a picture as small as this, cells of points are large: 16 bits must not decide too often.
            let fused = RenderSettings { samples_per_axis: 2, tolerance: 0.05, ..bounded(mode) };
            let several = RenderSettings { shading: Shading::Multipass { lights_per_pass: 7 }, ..fused };
            let mut renderer = context.loaded(&stage, RendererOptions::default());
            let one = context.frame(&mut renderer, &view, SHADINGS_SIZE, &fused);
            let many = context.frame(&mut renderer, &view, SHADINGS_SIZE, &several);
            let passes = context.wait(renderer.stats()).expect("stats").passes;
            assert!(passes[0] > 0 && passes[0] <= passes[1], "{passes:?}");
            assert_eq!(passes[0] < passes[1], mode == Mode::Full, "{mode:?}: {passes:?}");
            check(&stage, &several, [one, many]);
        }
    }
}

const SHADINGS_SIZE: [u32; 2] = [96, 72];

/// The same adapter as a device that cannot blend 32-bit floats.
fn without_float_blending(context: &Context) -> Context {
    let features = WANTED_FEATURES - wgpu::Features::FLOAT32_BLENDABLE;
    let gpu = pollster::block_on(Gpu::with_features(Some(&context.gpu.info.name), features));
    Context::new(gpu.expect("the same adapter"), context.tier)
}

fn largest_share(a: &Image, b: &Image) -> f32 {
    let differences = a.pixels.iter().zip(&b.pixels).map(|(a, b)| (*a - *b).abs().max_element());
    differences.fold(0.0, f32::max) / a.pixels.iter().map(|p| p.max_element()).fold(0.0, f32::max)
}

fn fused_is_multipass(context: &Context) {
    let half = without_float_blending(context);
    shadings(context, |stage, several, [one, many]| {
        let mode = several.mode;
        assert!(largest_share(&one, &many) < 1e-5, "{mode:?}: {}", largest_share(&one, &many));
        // The control: 16 bits are seen at this scale.
        let mut renderer = half.loaded(stage, RendererOptions::default());
        let view = stage.view(0, SHADINGS_SIZE);
        let rough = half.frame(&mut renderer, &view, SHADINGS_SIZE, several);
        assert!(largest_share(&one, &rough) > 1e-5, "{mode:?}");
    });
}

fn fused_is_about_multipass_in_16_bits(context: &Context) {
    let half = without_float_blending(context);
    shadings(&half, |stage, several, [one, rough]| {
        let mode = several.mode;
        let error = flip(&one, &rough);
        assert!(error <= 0.01, "{mode:?}: FLIP {error}");
        // The control: two lights of forty are seen.
        let fewer = LightSet::from_samples(&stage.geometry, stage.lights.samples()[..38].to_vec());
        let fewer = Stage { scene: stage.scene.clone(), geometry: stage.geometry.clone(), lights: fewer };
        let mut renderer = half.loaded(&fewer, RendererOptions::default());
        let view = stage.view(0, SHADINGS_SIZE);
        let darker = half.frame(&mut renderer, &view, SHADINGS_SIZE, several);
        assert!(flip(&one, &darker) > 0.01, "{mode:?}: FLIP {}", flip(&one, &darker));
    });
}
