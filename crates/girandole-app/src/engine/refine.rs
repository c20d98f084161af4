//! `girandole render --refine`: the pictures of many light sets, averaged.

use super::gpu::{Device, milliseconds, picture_settings};
use super::{Job, Picture};
use crate::args::Mode;
use crate::output::Progress;
use anyhow::Result;
use girandole_core::illumination::IlluminationSettings;
use girandole_core::visibility::VisibilitySettings;
use std::time::Instant;

impl Device {
    /// Renders so many light sets as the options say; times are those of all.
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
        // Set 0 is the ordinary picture.
        let mut picture = self.picture(&job.view, args)?;
        picture.stats.insert("setup_ms".into(), setup_ms.into());
        let settings = picture_settings(args);
        while self.opened()?.refined_sets() < args.refine {
            if self.opened()?.refine(job.scene, &job.view, args.size, &settings)? {
                // No more than one picture waits for the device.
                self.wait()?;
                progress.set(self.opened()?.refined_sets() as f32 / args.refine as f32);
            }
        }
        let (radiance, error) = (self.opened()?.radiance(), self.opened()?.refined_error());
        picture.radiance = self.block_on(radiance)?;
        picture.stats.insert("estimated_rel_mse".into(), self.block_on(error)?.into());
        picture.frame_ms = milliseconds(start);
        Ok(picture)
    }
}
