//! `girandole render --refine`: the pictures of many light sets, averaged.

use super::gpu::{Device, milliseconds, picture_settings, statistics};
use super::{Job, Picture};
use crate::args::Mode;
use crate::output::Progress;
use anyhow::Result;
use girandole_core::illumination::IlluminationSettings;
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
        let settings = picture_settings(args);
        let [width, height] = settings.region.map_or(args.size, |region| region.size);
        let mut sum = PictureSum::new(width, height);
        let mut stats = None;
        let [first, last] = args.piece.sets.unwrap_or([0, args.refine - 1]);
        for set in first..=last {
            let radiance = if set == 0 {
                // The ordinary picture.
                let picture = self.picture(&job.view, args)?;
                stats = Some(picture.stats);
                picture.radiance
            } else {
                self.opened()?.render_set(job.scene, &job.view, args.size, &settings, set)?;
                let radiance = self.opened()?.radiance();
                self.block_on(radiance)?
            };
            sum.add(&radiance);
            progress.set((set - first + 1) as f32 / (last - first + 1) as f32);
        }
        let pixels = u64::from(args.size[0]) * u64::from(args.size[1]);
        let mut stats = match stats {
            Some(stats) => stats,
            None => {
                let frame = self.opened()?.stats();
                statistics(&self.block_on(frame)?, pixels)
            }
        };
        stats.insert("setup_ms".into(), setup_ms.into());
        stats.insert("estimated_rel_mse".into(), sum.relative_error().into());
        Ok(Picture { radiance: sum.mean(), frame_ms: milliseconds(start), stats, sum: Some(sum) })
    }
}
