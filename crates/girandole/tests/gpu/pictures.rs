//! What a caller's target gets, and what is refused.

use crate::common::{Context, Stage, Test, exact};
use girandole::core::glam::Vec3;
use girandole::core::image::Image;
use girandole::core::tonemap::{Exposure, Tonemap, to_srgb8};
use girandole::{RenderSettings, RendererOptions};

pub fn tests() -> Vec<Test> {
    vec![("shows_what_the_cpu_would_show", shows), ("refuses_with_a_sentence", refuses)]
}

/// The bytes of an 8-bit target after `show`, RGB.
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
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    renderer.show(settings, &target.create_view(&Default::default()), format).expect("show");
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(size[0] * size[1] * 4),
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
                bytes_per_row: Some(size[0] * 4),
                rows_per_image: None,
            },
        },
        wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
    );
    context.gpu.queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |result| result.expect("map"));
    context.gpu.wait().expect("the device");
    let bytes = buffer
        .get_mapped_range(..)
        .expect("mapped")
        .chunks_exact(4)
        .flat_map(|p| [p[0], p[1], p[2]])
        .collect();
    (bytes, image)
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
            let expected = to_srgb8(&image, exposure.ev(&image), tonemap);
            assert!(worst(&bytes, &expected) <= Some(1), "{format:?} {exposure:?} {tonemap:?}");
            // The control: half a stop more is seen.
            let brighter = to_srgb8(&image, exposure.ev(&image) + 0.5, tonemap);
            assert!(worst(&bytes, &brighter) > Some(8));
        }
    }
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
    sentence(renderer.render(&view, [64, 64], &RenderSettings { clamp: Some(f32::NAN), ..exact() }));
    let starved = RendererOptions { memory_mib: 1, map_size: Some(1024), ..Default::default() };
    assert!(
        sentence(context.renderer(starved).load(&stage.scene, &stage.geometry, &stage.lights))
            .contains("--memory")
    );
    // The control: what is right is not refused, and is a picture.
    let image = context.frame(&mut renderer, &view, [64, 64], &exact());
    assert!(image.mean().cmpgt(Vec3::splat(1e-3)).all());
}
