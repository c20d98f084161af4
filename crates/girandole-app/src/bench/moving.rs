//! `girandole bench --moving`: frames after updates beside static ones.

use super::{Column, number};
use crate::args::BenchArgs;
use crate::engine::gpu::Device;
use crate::engine::moving::MovingTrial;
use crate::output::Stats;
use crate::output::{Progress, say};
use crate::scene;
use anyhow::Result;
use girandole_core::scene::Scene;

/// Columns of the table.
pub const COLUMNS: [Column; 11] = [
    ("static ms", "static_frame_ms", 1.0, 1),
    ("moving ms", "moving_frame_ms", 1.0, 1),
    ("update ms", "update_ms", 1.0, 1),
    ("illum. ms", "illumination_update_ms", 1.0, 1),
    ("vis ms", "visibility_ms", 1.0, 0),
    ("maps", "maps_drawn", 1.0, 0),
    ("stale", "maps_stale", 1.0, 0),
    ("oldest", "oldest_map_frames", 1.0, 1),
    ("error %", "stale_map_error", 100.0, 2),
    ("texels %", "share_map_texels_drawn", 100.0, 1),
    ("lightmaps", "light_maps_changed", 1.0, 0),
];

/// A row for each scene, number of lights and budget.
pub fn rows(args: &BenchArgs, scenes: &[(&String, Scene)], device: &Device) -> Result<Vec<Stats>> {
    let mut rows = Vec::new();
    for (name, scene) in scenes {
        if scene.duration() == 0.0 {
            say(&format!("warning: nothing in {name} is animated"));
        }
        let view = scene::view(scene, &args.seen, None, args.size)?;
        for &lights in &args.lights {
            for &updates in &args.updates {
                let progress = Progress::bar(&format!("{name} with {lights} lights, updates {updates}"));
                let trial = MovingTrial { scene: scene.clone(), view, lights, updates, args };
                let mut row = device.time_moving(trial, &|done| progress.set(done))?;
                drop(progress);
                for (key, value) in [
                    ("scene", name.as_str().into()),
                    ("adapter", device.name().into()),
                    ("lights", lights.into()),
                    ("mode", "full".into()),
                    ("updates", updates.to_string().into()),
                    ("rewalk", args.rewalk.to_string().into()),
                    ("width", args.size[0].into()),
                    ("height", args.size[1].into()),
                    ("moving_frame_ms", (number(&row, "frame_ms") + number(&row, "update_ms")).into()),
                ] {
                    row.insert(key.into(), value);
                }
                rows.push(row);
            }
        }
    }
    Ok(rows)
}
