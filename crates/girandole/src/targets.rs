//! Textures and buffers that depend on the picture's size alone; resizing makes only these anew.

use crate::passes::visibility;

/// Pixels whose sums are held at once: 48 MiB of them.
const BAND_PIXELS: u32 = 1 << 20;
/// Pixels from point to point of the coarsest grid that is shaded.
pub(crate) const COARSEST: u32 = 8;

/// Format of grids of points.
pub(crate) const GRID: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
/// Format of the picture, see `packed`.
pub(crate) const PICTURE: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;

/// What depends on the picture's size alone.
pub(crate) struct Targets {
    pub size: [u32; 2],
    pub band_rows: u32,
    pub ids: wgpu::TextureView,
    pub depth: wgpu::TextureView,
    /// Two elements a pixel for batches of lights, one for its samples.
    pub sums: wgpu::Buffer,
    /// Keys of surfaces, and materials.
    pub keys: wgpu::TextureView,
    /// The band's grids of points by step, 1, 2, 4 and 8 pixels: irradiance and key; the second element.
    pub grids: [[wgpu::TextureView; 2]; 4],
    /// The same, of a further sample of each pixel.
    pub sample: [wgpu::TextureView; 2],
    pub picture: wgpu::Texture,
    pub picture_view: wgpu::TextureView,
}

impl Targets {
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        // Whole cells of the coarsest grid of points, which goes on to the row below.
        let band_rows = (BAND_PIXELS / size[0] / COARSEST * COARSEST).max(COARSEST).min(size[1]);
        let sized = |label, [width, height]: [u32; 2], format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let texture = |label, format, usage| sized(label, size, format, usage);
        let buffer = |label, elements: u64| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: elements * 16,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        use wgpu::TextureUsages as U;
        let picture = texture("picture", PICTURE, U::STORAGE_BINDING | U::TEXTURE_BINDING | U::COPY_SRC);
        let band = [size[0], band_rows + 1];
        let grid = |level: u32| {
            let points = band.map(|n| (n - 1).div_ceil(1 << level) + 1);
            let usage = U::STORAGE_BINDING | U::TEXTURE_BINDING;
            ["light", "second"]
                .map(|label| sized(label, points, GRID, usage).create_view(&Default::default()))
        };
        let pixels = u64::from(size[0]) * u64::from(band_rows + 1);
        Self {
            size,
            band_rows,
            ids: texture("ids", visibility::IDS, U::RENDER_ATTACHMENT | U::TEXTURE_BINDING)
                .create_view(&Default::default()),
            depth: texture("depth", visibility::DEPTH, U::RENDER_ATTACHMENT).create_view(&Default::default()),
            keys: texture("keys", visibility::KEYS, U::RENDER_ATTACHMENT | U::TEXTURE_BINDING)
                .create_view(&Default::default()),
            grids: std::array::from_fn(|level| grid(level as u32)),
            sample: grid(0),
            sums: buffer("sums", 3 * pixels),
            picture_view: picture.create_view(&Default::default()),
            picture,
        }
    }
}
