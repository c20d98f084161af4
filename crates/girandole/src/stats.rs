//! What a frame did: counts and times.

use crate::maps::cache::StaleCounts;
use std::collections::BTreeMap;

/// What a frame did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Light samples.
    pub lights: u32,
    /// Texels across a shadow map of the regular size.
    pub map_size: u32,
    /// What these would be with all the memory that there may be.
    pub map_size_wanted: u32,
    /// Pages of the atlas.
    pub atlas_pages: u32,
    /// Bytes of the atlas, and of what is beside it while maps are drawn.
    pub atlas_bytes: u64,
    /// Triangles left out of the shadow maps because they cannot block.
    pub non_blockers: usize,
    /// Shadow maps of which some part was drawn.
    pub maps_drawn: u32,
    /// Texels that were drawn when shadow maps were last drawn.
    pub texels_drawn: u64,
    /// Shadow maps that the frame looked up and left stale or missing.
    pub stale: StaleCounts,
    /// Pairs of a light map and a light that was added to it or taken away.
    pub light_map_changes: u32,
    /// Points shaded, by pixels from point to point: 1, 2, 4, 8; and further samples of pixels at edges. All other
    /// pixels were interpolated.
    pub points: [u64; 5],
    /// Pairs of point and light.
    pub pairs: PairCounts,
    /// Multipass shading: passes for each set of points, and how many it would take without optimisation.
    pub passes: [u32; 2],
    /// Objects lit by precomputed transfer.
    pub transfer: TransferCounts,
    /// Leaf receivers, and how many of them have a light map.
    pub leaves: [u32; 2],
    /// Milliseconds on the device by pass, where it has timestamps and [`Renderer::time_passes`](crate::Renderer::time_passes) asked for them; names
    /// end in `_gpu_ms`.
    pub gpu_ms: BTreeMap<&'static str, f64>,
}

/// What became of the pairs of shaded point and light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PairCounts {
    /// Summed by what a shadow map says.
    pub looked_up: u64,
    /// Summed without a look, because nothing can block.
    pub unshadowed: u64,
    /// Taken from a light map.
    pub mapped: u64,
    /// Left out, because the light cannot arrive.
    pub skipped: u64,
}

/// What objects cost that are lit by precomputed transfer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TransferCounts {
    /// Objects.
    pub objects: u32,
    /// Their vertices.
    pub vertices: u32,
    /// Points at which the device gathers light in each frame.
    pub points: u32,
    /// Rays traced with the last update, to gather light at the centres of objects.
    pub rays: u64,
    /// Milliseconds that took.
    pub gather_ms: f64,
}

impl PairCounts {
    /// Pairs that were evaluated one by one.
    pub fn evaluated(&self) -> u64 {
        self.looked_up + self.unshadowed
    }
}
