//! The renderer on wgpu: the only file of the program that knows it.

use super::{Job, Picture, Stats};
use crate::args;
use crate::output::Progress;
use anyhow::Result;
use girandole::{FrameStats, Gpu, RenderSettings, Renderer, RendererOptions, ShadowMap};
use pollster::block_on;
use std::time::Instant;

pub use girandole::{AdapterReport, Error};

/// All adapters of this machine, the best first.
pub fn adapters() -> Vec<AdapterReport> {
    block_on(girandole::adapters())
}

/// An opened adapter.
pub struct Device(Gpu);

impl Device {
    /// Opens the adapter whose name contains `name`, or the best one.
    pub fn open(name: Option<&str>) -> Result<Self, Error> {
        block_on(Gpu::new(name)).map(Self)
    }

    /// The adapter's name, and how it is reached.
    pub fn name(&self) -> String {
        format!("{} ({:?})", self.0.info.name, self.0.info.backend)
    }

    /// Renders with shadow maps.
    pub fn render(&self, job: &Job) -> Result<Picture> {
        let _progress = Progress::spinner(&format!("rendering on {}", self.name()));
        let start = Instant::now();
        let quality = &job.args.quality;
        let options = RendererOptions {
            shadow_map: match quality.shadow_map {
                args::ShadowMap::Octahedral => ShadowMap::Octahedral,
                args::ShadowMap::Parabolic => ShadowMap::Parabolic,
                args::ShadowMap::Cube => ShadowMap::Cube,
            },
            map_size: quality.map_size,
            memory_mib: quality.memory,
            pcf: quality.pcf.0,
            ..RendererOptions::default()
        };
        let settings = RenderSettings {
            clamp: job.clamp,
            samples_per_axis: job.args.aa.samples_per_axis(),
            exposure: job.args.exposure,
            tonemap: job.args.tonemap.into(),
            ..RenderSettings::default()
        };
        let mut renderer = Renderer::new(&self.0.device, &self.0.queue, options)?;
        renderer.load(job.scene, job.geometry, job.lights)?;
        self.0.wait()?;
        let setup_ms = milliseconds(start);

        // The two halves of a frame, each by the clock around submitting and waiting.
        let start = Instant::now();
        renderer.draw_shadow_maps()?;
        self.0.wait()?;
        let shadow_maps_ms = milliseconds(start);
        let maps = self.0.block_on(renderer.stats())??;
        let start = Instant::now();
        renderer.render(&job.view, job.args.size, &settings)?;
        self.0.wait()?;
        let shading_ms = milliseconds(start);

        let mut stats = statistics(&self.0.block_on(renderer.stats())??);
        for (pass, ms) in maps.gpu_ms {
            stats.insert(pass.into(), ms.into());
        }
        stats.insert("setup_ms".into(), setup_ms.into());
        stats.insert("shadow_maps_ms".into(), shadow_maps_ms.into());
        stats.insert("shading_ms".into(), shading_ms.into());
        Ok(Picture {
            radiance: self.0.block_on(renderer.radiance())??,
            frame_ms: shadow_maps_ms + shading_ms,
            stats,
        })
    }
}

fn statistics(frame: &FrameStats) -> Stats {
    let mut stats = Stats::new();
    for (key, value) in [
        ("maps", u64::from(frame.lights)),
        ("map_size_texels", frame.map_size.into()),
        ("atlas_pages", frame.atlas_pages.into()),
        ("atlas_bytes", frame.atlas_bytes),
        ("triangles_that_cannot_block", frame.non_blockers as u64),
        ("faces_drawn", frame.culling.faces_drawn),
        ("faces_culled", frame.culling.faces_culled),
        ("clusters_drawn", frame.culling.clusters_drawn),
        ("clusters_culled", frame.culling.clusters_culled),
    ] {
        stats.insert(key.into(), value.into());
    }
    for (pass, ms) in &frame.gpu_ms {
        stats.insert((*pass).into(), (*ms).into());
    }
    stats
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
