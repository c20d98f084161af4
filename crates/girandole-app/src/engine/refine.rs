//! `girandole render --refine`: the pictures of many light sets, averaged.

use super::gpu::{Device, milliseconds, picture_settings, statistics};
use super::windows::Window;
use super::{Job, Picture};
use crate::args::Mode;
use crate::output::Progress;
use anyhow::Result;
use girandole::RenderSettings;
use girandole_core::illumination::IlluminationSettings;
use girandole_core::image::{Image, Region};
use girandole_core::visibility::VisibilitySettings;
use girandole_reference::PictureSum;
use std::time::Instant;

impl Device {
    /// Renders the light sets of the options; times are those of all.
    pub(super) fn refine(&mut self, job: &Job) -> Result<Picture> {
        let args = job.args;
        let progress = Progress::bar(&format!("refining on {}", self.name()));
        let start = Instant::now();
        let light = IlluminationSettings {
            lights: args.light_settings(),
            visibility: (args.mode != Mode::Naive).then(VisibilitySettings::default),
            views: args.lights.placement.views(&[job.view]).to_vec(),
            ..IlluminationSettings::default()
        };
        self.open_scene(job.scene, &light, job.transfers, args)?;
        self.wait()?;
        let setup_ms = milliseconds(start);
        let asked = args.piece.region.unwrap_or(Region::whole(args.size));
        let mut sum = PictureSum::new(asked.size[0], asked.size[1]);
        let mut stats = None;
        let [first, last] = args.piece.sets.unwrap_or([0, args.refine - 1]);
        for set in first..=last {
            let radiance = if set == 0 {
                // The ordinary picture.
                let picture = self.picture(&job.view, args)?;
                stats = Some(picture.stats);
                picture.radiance
            } else {
                self.set(job, set, asked)?
            };
            sum.add(&radiance);
            progress.set((set - first + 1) as f32 / (last - first + 1) as f32);
        }
        let pixels = u64::from(args.size[0]) * u64::from(args.size[1]);
        let mut stats = match stats {
            Some(stats) => stats,
            None => {
                let (renderer, viewport) = self.with_viewport()?;
                let frame = renderer.stats(viewport);
                statistics(&self.block_on(frame)?, pixels)
            }
        };
        stats.insert("setup_ms".into(), setup_ms.into());
        stats.insert("estimated_rel_mse".into(), sum.relative_error().into());
        Ok(Picture { radiance: sum.mean(), frame_ms: milliseconds(start), stats, sum: Some(sum) })
    }

    /// One light set, but for the first.
    fn set(&mut self, job: &Job, set: u32, asked: Region) -> Result<Image> {
        let args = job.args;
        let mut picture = Image::new(asked.size[0], asked.size[1]);
        for window in Window::all(args.size, args.piece.region) {
            let settings = RenderSettings { region: window.part(), ..picture_settings(args) };
            let view = window.view(&job.view, args.size);
            let (renderer, viewport) = self.with_viewport()?;
            renderer.render_set(viewport, job.scene, &view, window.size(), &settings, set)?;
            let radiance = renderer.radiance(viewport);
            window.put(&self.block_on(radiance)?, asked, &mut picture);
        }
        Ok(picture)
    }
}
