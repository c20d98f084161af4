//! What a caller's target gets, and what is refused.

use crate::common::{Context, Stage, Test, exact};
use girandole::{RenderSettings, RendererOptions};
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::lights::Clamp;
use girandole_core::tonemap::{Exposure, Tonemap, to_srgb8};

pub fn tests() -> Vec<Test> {
    vec![
        ("shows_what_the_cpu_would_show", shows),
        ("floating_point_targets_get_what_is_brighter_than_1", high_range),
        ("refuses_with_a_sentence", refuses),
    ]
}

/// The bytes of a target after `show`, and the picture.
fn shown(
    context: &Context,
    stage: &Stage,
    settings: &RenderSettings,
    format: wgpu::TextureFormat,
) -> (Vec<u8>, Image) {
    let size = [192, 100];
    let mut renderer = context.renderer(RendererOptions::default());
    renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
    let image = context.frame(&mut renderer, &stage.view(0, size), size, settings);
    let device = &context.gpu.device;
    let target = context.target(size, format);
    let bytes = format.block_copy_size(None).expect("a plain format");
    renderer.show(settings, &target.create_view(&Default::default()), format).expect("show");
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(size[0] * size[1] * bytes),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        target.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(size[0] * bytes),
                rows_per_image: None,
            },
        },
        wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
    );
    context.gpu.queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |result| result.expect("map"));
    context.gpu.wait().expect("the device");
    let bytes = buffer.get_mapped_range(..).expect("mapped").to_vec();
    (bytes, image)
}

fn without_alpha(bytes: &[u8]) -> Vec<u8> {
    bytes.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
}

fn shows(context: &Context) {
    let stage = Stage::builtin("table", 30);
    let worst = |bytes: &[u8], expected: &[u8]| bytes.iter().zip(expected).map(|(a, b)| a.abs_diff(*b)).max();
    for format in [wgpu::TextureFormat::Rgba8UnormSrgb, wgpu::TextureFormat::Rgba8Unorm] {
        for (exposure, tonemap) in [
            (Exposure::Auto, Tonemap::Agx),
            (Exposure::Ev(1.0), Tonemap::Aces),
            (Exposure::Ev(0.0), Tonemap::None),
        ] {
            let settings = RenderSettings { exposure, tonemap, ..exact() };
            let (bytes, image) = shown(context, &stage, &settings, format);
            let bytes = without_alpha(&bytes);
            let expected = to_srgb8(&image, exposure.ev(&image), tonemap);
            assert!(worst(&bytes, &expected) <= Some(1), "{format:?} {exposure:?} {tonemap:?}");
            // The control: half a stop more is seen.
            let brighter = to_srgb8(&image, exposure.ev(&image) + 0.5, tonemap);
            assert!(worst(&bytes, &brighter) > Some(8));
        }
    }
}

/// The value of a 16-bit float that is not negative.
fn half(bits: [u8; 2]) -> f32 {
    let bits = u32::from(u16::from_le_bytes(bits));
    f32::from_bits(bits << 13) * 2f32.powi(112)
}

fn high_range(context: &Context) {
    let stage = Stage::builtin("table", 30);
    let ev = 4.0;
    let settings = RenderSettings { exposure: Exposure::Ev(ev), tonemap: Tonemap::None, ..exact() };
    let (bytes, image) = shown(context, &stage, &settings, wgpu::TextureFormat::Rgba16Float);
    let expected = |limit: f32| {
        let exposed = image.pixels.iter().flat_map(move |p| (*p * ev.exp2()).to_array());
        exposed.map(move |c| c.min(limit)).collect::<Vec<_>>()
    };
    let worst = |values: &[f32], expected: &[f32]| {
        assert_eq!(values.len(), expected.len());
        values.iter().zip(expected).map(|(a, b)| (a - b).abs() / b.max(1e-3)).fold(0.0, f32::max)
    };
    let of_halves = |bytes: &[u8]| -> Vec<f32> {
        let pixels = bytes.chunks_exact(8);
        pixels.flat_map(|p| [0, 2, 4].map(|at| half([p[at], p[at + 1]]))).collect()
    };
    let values = of_halves(&bytes);
    assert!(values.iter().filter(|v| **v > 2.0).count() > 1000, "the picture is bright");
    assert!(worst(&values, &expected(65504.0)) < 1e-3, "{}", worst(&values, &expected(65504.0)));
    let (bytes, _) = shown(context, &stage, &settings, wgpu::TextureFormat::Rgba32Float);
    let singles: Vec<f32> = bytes
        .chunks_exact(16)
        .flat_map(|p| [0, 4, 8].map(|at| f32::from_le_bytes([p[at], p[at + 1], p[at + 2], p[at + 3]])))
        .collect();
    assert!(worst(&singles, &expected(3e38)) < 1e-6, "{}", worst(&singles, &expected(3e38)));
    // What 16 bits cannot hold is their largest value, not infinity.
    let glare = RenderSettings { exposure: Exposure::Ev(30.0), ..settings };
    let (bytes, _) = shown(context, &stage, &glare, wgpu::TextureFormat::Rgba16Float);
    assert_eq!(of_halves(&bytes).into_iter().fold(0.0, f32::max), 65504.0);
    // The control: eight bits, and curves, cut off at 1.
    let (bytes, _) = shown(context, &stage, &settings, wgpu::TextureFormat::Rgba8Unorm);
    assert!(without_alpha(&bytes).contains(&255) && worst(&values, &expected(1.0)) > 0.5);
    let curved = RenderSettings { tonemap: Tonemap::Aces, ..settings };
    let (bytes, _) = shown(context, &stage, &curved, wgpu::TextureFormat::Rgba16Float);
    assert!(of_halves(&bytes).into_iter().all(|v| v <= 1.0));
}

fn refuses(context: &Context) {
    let stage = Stage::builtin("table", 20);
    let view = stage.view(0, [64, 64]);
    let mut renderer = context.renderer(RendererOptions::default());
    let sentence = |result: girandole::Result<()>| {
        let text = result.expect_err("refused").to_string();
        assert!(text.len() > 20 && !text.contains('\n'), "{text}");
        text
    };
    sentence(renderer.render(&view, [64, 64], &exact()));
    renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
    sentence(renderer.render(&view, [0, 64], &exact()));
    sentence(renderer.render(&view, [1 << 20, 5], &exact()));
    sentence(renderer.render(&view, [64, 64], &RenderSettings { samples_per_axis: 0, ..exact() }));
    for clamp in [f32::NAN, f32::INFINITY, 0.0] {
        sentence(renderer.render(&view, [64, 64], &RenderSettings { clamp: Clamp::At(clamp), ..exact() }));
    }
    let starved = RendererOptions { memory_mib: 1, map_size: Some(1024), ..Default::default() };
    assert!(
        sentence(context.renderer(starved).load(&stage.scene, &stage.geometry, &stage.lights))
            .contains("memory_mib")
    );
    // The control: what is right is not refused, and is a picture.
    let image = context.frame(&mut renderer, &view, [64, 64], &exact());
    assert!(image.mean().cmpgt(Vec3::splat(1e-3)).all());
    let show = |ev, format| {
        let target = context.target([64, 64], wgpu::TextureFormat::Rgba8Unorm);
        let settings = RenderSettings { exposure: Exposure::Ev(ev), ..exact() };
        renderer.show(&settings, &target.create_view(&Default::default()), format)
    };
    for ev in [f32::NAN, f32::NEG_INFINITY, 65.0] {
        sentence(show(ev, wgpu::TextureFormat::Rgba8Unorm));
    }
    sentence(show(0.0, wgpu::TextureFormat::Rgba8Uint));
    sentence(show(0.0, wgpu::TextureFormat::Depth32Float));
    show(64.0, wgpu::TextureFormat::Rgba8Unorm).expect("the control");
}
