//! Textures and buffers that depend on the picture's size alone; resizing makes only these anew.

use girandole_core::image::Region;
use std::sync::OnceLock;

/// Pixels whose sums are held at once: 48 MiB of them.
const BAND_PIXELS: u32 = 1 << 20;
/// Pixels from point to point of the coarsest grid that is shaded.
pub(crate) const COARSEST: u32 = 8;

/// Format of grids of points.
pub(crate) const GRID: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
/// Format of the picture, see `packed`.
pub(crate) const PICTURE: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;

/// Format of the triangle ids.
pub(crate) const TRIANGLE_IDS: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
/// Format of surface ids and materials.
pub(crate) const SURFACE_IDS: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
/// Format of the camera's depth.
pub(crate) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A grid of points with what they receive.
#[derive(Clone, Copy)]
pub(crate) struct GridView<'a> {
    /// Irradiance, and the surface's id.
    pub irradiance: &'a wgpu::TextureView,
    /// What depends on direction: specular radiance, or the direction of light.
    pub directional: &'a wgpu::TextureView,
}

/// The part of a picture that is asked for, and what is drawn of it: all that the part depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Drawn {
    pub region: Region,
    /// First column and one past the last, and the same of rows, whole cells of the coarsest grid.
    ranges: [[u32; 2]; 2],
}

/// Pixels from one that is interpolated to those that it depends on, at most: two points away on each grid, and one pixel beyond for
/// further samples.
const REACH: u32 = 32;
/// The same where mirror images are blurred (`put_mirrors.wgsl`).
const MIRROR_REACH: u32 = 96;

impl Drawn {
    /// Of a picture of so many pixels, with mirror images or without.
    pub fn new(size: [u32; 2], region: Option<Region>, mirrors: bool) -> Self {
        let region = region.unwrap_or(Region::whole(size));
        let reach = REACH + if mirrors { MIRROR_REACH } else { 0 };
        let range = |axis: usize| {
            let first = region.first[axis].saturating_sub(reach) / COARSEST * COARSEST;
            let end = region.first[axis] + region.size[axis] + reach;
            [first, end.next_multiple_of(COARSEST).min(size[axis])]
        };
        Self { region, ranges: [range(0), range(1)] }
    }

    /// The pixels that are rasterised: with the column and the row that points of grids lie on beyond it. None where that is all.
    pub fn rasterised(&self, size: [u32; 2]) -> Option<Region> {
        let [first, end] = [0, 1].map(|end| [self.ranges[0][end], self.ranges[1][end]]);
        let all = Region { first, size: [0, 1].map(|axis| (end[axis] + 1).min(size[axis]) - first[axis]) };
        (all != Region::whole(size)).then_some(all)
    }

    /// As kernels have it.
    pub fn columns(&self) -> u32 {
        let [first, end] = self.ranges[0];
        first | end << 16
    }
}

/// What depends on the picture's size alone.
pub(crate) struct Targets {
    pub size: [u32; 2],
    /// By the last frame.
    pub drawn: Drawn,
    /// Which light set of a refinement is rendered; 0 = the picture's own.
    pub light_set: u32,
    pub band_rows: u32,
    pub triangle_ids: wgpu::TextureView,
    /// Surfaces and materials.
    pub surface_ids: wgpu::TextureView,
    pub depth: wgpu::TextureView,
    /// Two elements a pixel for batches of lights, one for its samples.
    pub partial_sums: wgpu::Buffer,
    pub picture: wgpu::Texture,
    pub picture_view: wgpu::TextureView,
    /// The picture with what is behind it or before it, where a scene has an environment or is seen through.
    composite: OnceLock<(wgpu::Texture, wgpu::TextureView)>,
    /// For what is seen through, where a scene has any.
    layers: OnceLock<LayerTargets>,
    /// For mirror images.
    mirrors: OnceLock<MirrorTargets>,
    /// The band's grids of points with steps of 1, 2, 4 and 8 pixels.
    grids: [Grid; 4],
    /// A further sample of each pixel.
    sample: Grid,
}

/// What layers of transparent surfaces need.
pub(crate) struct LayerTargets {
    /// Of a layer and the one before, in turn.
    pub depth: [wgpu::TextureView; 2],
    /// Three elements a pixel of a band.
    pub sums: wgpu::Buffer,
}

/// What mirrored rays need.
pub(crate) struct MirrorTargets {
    /// Where the first ones of first samples end, those of further samples, and those that follow, in turn: each when it is first needed.
    ends: [OnceLock<RayEnds>; 4],
    /// Four elements a pixel of a band.
    pub image: wgpu::Buffer,
    size: wgpu::Extent3d,
}

impl MirrorTargets {
    /// Where ray `index` of a sample ends.
    pub fn ends(&self, device: &wgpu::Device, sample: u32, index: u32) -> &RayEnds {
        let set = match index {
            0 => usize::from(sample > 0),
            _ => 2 + (index as usize - 1) % 2,
        };
        self.ends[set].get_or_init(|| RayEnds::new(device, self.size))
    }
}

/// Where rays end: triangles, surfaces with materials, places with directions.
pub(crate) struct RayEnds {
    pub triangle_ids: wgpu::TextureView,
    pub surface_ids: wgpu::TextureView,
    pub hits: wgpu::TextureView,
}

impl RayEnds {
    fn new(device: &wgpu::Device, size: wgpu::Extent3d) -> Self {
        use wgpu::TextureUsages as U;
        let texture = |label, format| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: U::STORAGE_BINDING | U::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        Self {
            triangle_ids: texture("triangles where rays end", TRIANGLE_IDS),
            surface_ids: texture("surfaces where rays end", SURFACE_IDS),
            hits: texture("ends of rays", wgpu::TextureFormat::Rgba32Uint),
        }
    }
}

/// Textures of a grid of points.
struct Grid {
    irradiance: wgpu::TextureView,
    directional: wgpu::TextureView,
}

impl Grid {
    fn view(&self) -> GridView<'_> {
        GridView { irradiance: &self.irradiance, directional: &self.directional }
    }
}

/// The number or one that is little larger: Mesa's software device compiles a kernel anew for textures whose sizes are powers of two
/// where those before were not, and grids are used in turn.
fn not_a_power_of_two(n: u32) -> u32 {
    (n..).find(|n| !n.is_power_of_two()).unwrap_or(n)
}

impl Targets {
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        let largest = device.limits().max_texture_dimension_2d;
        // Whole cells of the coarsest grid of points, which goes on to the row below.
        let band_rows = (BAND_PIXELS / size[0]).min(largest - 1) / COARSEST * COARSEST;
        let band_rows = band_rows.max(COARSEST).min(size[1]);
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
        let view = |texture: wgpu::Texture| texture.create_view(&Default::default());
        use wgpu::TextureUsages as U;
        let texture = |label, format, usage| sized(label, size, format, usage);
        let attachment =
            |label, format| view(texture(label, format, U::RENDER_ATTACHMENT | U::TEXTURE_BINDING));
        let grid = |level: u32| {
            let points = [size[0], band_rows + 1].map(|n| (n - 1).div_ceil(1 << level) + 1);
            let points = points.map(|n| not_a_power_of_two(n).min(largest));
            let texture = |label| view(sized(label, points, GRID, U::STORAGE_BINDING | U::TEXTURE_BINDING));
            Grid { irradiance: texture("irradiance"), directional: texture("directional") }
        };
        let usage = U::STORAGE_BINDING | U::TEXTURE_BINDING | U::COPY_SRC | U::COPY_DST;
        let picture = texture("picture", PICTURE, usage);
        let pixels = u64::from(size[0]) * u64::from(band_rows + 1);
        Self {
            size,
            drawn: Drawn::new(size, None, false),
            light_set: 0,
            band_rows,
            triangle_ids: attachment("triangle ids", TRIANGLE_IDS),
            surface_ids: attachment("surface ids", SURFACE_IDS),
            depth: view(texture("depth", DEPTH, U::RENDER_ATTACHMENT | U::TEXTURE_BINDING | U::COPY_SRC)),
            grids: std::array::from_fn(|level| grid(level as u32)),
            sample: grid(0),
            partial_sums: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("partial sums"),
                size: 3 * pixels * 16,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            picture_view: picture.create_view(&Default::default()),
            composite: OnceLock::new(),
            layers: OnceLock::new(),
            mirrors: OnceLock::new(),
            picture,
        }
    }

    /// What layers of transparent surfaces need.
    pub fn layers(&self, device: &wgpu::Device) -> &LayerTargets {
        self.layers.get_or_init(|| LayerTargets {
            depth: [(); 2].map(|()| {
                use wgpu::TextureUsages as U;
                let texture = device.create_texture(&wgpu::TextureDescriptor {
                    label: Some("depth of a layer"),
                    size: self.picture.size(),
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format: DEPTH,
                    usage: U::RENDER_ATTACHMENT | U::TEXTURE_BINDING | U::COPY_DST,
                    view_formats: &[],
                });
                texture.create_view(&Default::default())
            }),
            sums: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("sums of layers"),
                size: 3 * u64::from(self.size[0]) * u64::from(self.band_rows) * 16,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            }),
        })
    }

    /// What mirrored rays need.
    pub fn mirrors(&self, device: &wgpu::Device) -> &MirrorTargets {
        self.mirrors.get_or_init(|| MirrorTargets {
            ends: [const { OnceLock::new() }; 4],
            image: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("mirror image"),
                size: 4 * u64::from(self.size[0]) * u64::from(self.band_rows) * 16,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            }),
            size: self.picture.size(),
        })
    }

    /// A texture like the picture.
    pub fn composite(&self, device: &wgpu::Device) -> &(wgpu::Texture, wgpu::TextureView) {
        self.composite.get_or_init(|| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("composite picture"),
                size: self.picture.size(),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: PICTURE,
                usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            });
            let view = texture.create_view(&Default::default());
            (texture, view)
        })
    }

    /// The grid with points every `step` pixels: 1, 2, 4 or 8.
    pub fn grid(&self, step: u32) -> GridView<'_> {
        self.grids[step.ilog2() as usize].view()
    }

    /// The grid of a further sample of each pixel.
    pub fn sample_grid(&self) -> GridView<'_> {
        self.sample.view()
    }

    /// First and last-but-one row of each band that is drawn. Where a band of the whole picture ends, so does one of a part.
    pub fn bands(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        self.bands_of(self.drawn.ranges[1])
    }

    /// First and last-but-one row of what the bands have of the part that is asked for.
    pub fn bands_of_region(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let Region { first: [_, first], size: [_, rows] } = self.drawn.region;
        self.bands_of([first, first + rows])
    }

    fn bands_of(&self, [from, to]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> + use<> {
        let (rows, height) = (self.band_rows, self.size[1]);
        let all = (0..height).step_by(rows as usize).map(move |first| [first, (first + rows).min(height)]);
        all.map(move |[first, end]| [first.max(from), end.min(to)]).filter(|[first, end]| first < end)
    }
}
