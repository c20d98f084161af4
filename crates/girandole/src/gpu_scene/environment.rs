//! The environment's map on the GPU.

use girandole_core::brdf;
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::scene::{Disc, Environment};
use wgpu::util::DeviceExt;

/// Pixels across that are kept: a picture of 90° has as many of them as of its own at 1024.
const MOST_COLUMNS: u32 = 4096;

/// What is seen of it.
pub(crate) struct GpuEnvironment {
    /// What backgrounds show, if it is to be seen there.
    pub shown: Option<wgpu::TextureView>,
    /// What surfaces reflect, where any do.
    pub reflected: Option<ReflectedMaps>,
    /// What the maps are multiplied by, and how far they are turned, see `Frame.environment`.
    pub uniform: Vec2,
    /// Before the map.
    pub sun: Option<Disc>,
}

/// What smooth and rough surfaces reflect of an environment.
pub(crate) struct ReflectedMaps {
    /// A mip level for each lobe.
    pub maps: wgpu::TextureView,
    /// Shares of light that lobes reflect.
    pub albedo_table: wgpu::TextureView,
}

impl GpuEnvironment {
    /// `is_reflected`: whether any surface has a specular lobe.
    pub fn new(
        device_queue: (&wgpu::Device, &wgpu::Queue),
        environment: &Environment,
        is_reflected: bool,
    ) -> Self {
        let shown = environment.visible.then(|| reduced(environment.map.image(), MOST_COLUMNS));
        let shown = shown.map(|image| texture(device_queue, "environment", std::slice::from_ref(&image)));
        let reflected = is_reflected.then(|| ReflectedMaps {
            maps: texture(device_queue, "reflected environment", environment.map.prefiltered().levels()),
            albedo_table: texture(device_queue, "albedo table", &[albedo_table()]),
        });
        let uniform = Vec2::new(environment.strength, environment.rotation);
        Self { shown, reflected, uniform, sun: environment.map.disc() }
    }
}

fn albedo_table() -> Image {
    let [width, height] = brdf::ALBEDO_ENTRIES.map(|n| n as u32);
    Image { width, height, pixels: brdf::albedo_table().iter().map(|share| share.extend(0.0)).collect() }
}

/// A texture with these mip levels.
fn texture(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    label: &str,
    levels: &[Image],
) -> wgpu::TextureView {
    let pixels = levels.iter().flat_map(|level| &level.pixels);
    let texels: Vec<[f32; 4]> = pixels.map(|p| [p.x, p.y, p.z, 0.0]).collect();
    let Image { width, height, .. } = levels[0];
    let texture = device.create_texture_with_data(
        queue,
        &wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: levels.len() as u32,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(&texels),
    );
    texture.create_view(&Default::default())
}

/// The picture, halved until it has no more than so many pixels on a side.
fn reduced(image: &Image, most: u32) -> Image {
    let mut image = image.clone();
    while image.width.max(image.height) > most {
        let (width, height) = (image.width.div_ceil(2), image.height.div_ceil(2));
        let mean = |i: u32| {
            let [x, y] = [i % width * 2, i / width * 2];
            let [x2, y2] = [(x + 1).min(image.width - 1), (y + 1).min(image.height - 1)];
            let at = |x: u32, y: u32| image.pixels[(y * image.width + x) as usize];
            (at(x, y) + at(x2, y) + at(x, y2) + at(x2, y2)) * 0.25
        };
        let pixels: Vec<Vec3> = (0..width * height).map(mean).collect();
        image = Image { width, height, pixels };
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_maps_are_halved_and_keep_their_light() {
        let pixels = (0..60 * 31).map(|i| Vec3::splat((i % 7) as f32)).collect();
        let image = Image { width: 60, height: 31, pixels };
        assert_eq!(reduced(&image, 60), image);
        let small = reduced(&image, 20);
        assert_eq!((small.width, small.height), (15, 8));
        assert!(((small.mean() - image.mean()) / image.mean()).abs().max_element() < 0.02);
    }
}
