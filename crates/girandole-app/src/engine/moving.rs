//! Frames of a scene in which things move, timed part by part.

use super::gpu::{Device, FORMAT, median, milliseconds, statistics};
use crate::args::{BenchArgs, Mode, RewalkArg, UpdatesArg};
use crate::output::Stats;
use anyhow::Result;
use girandole::{MapUpdates, RenderSettings, Renderer, Viewport};
use girandole_core::illumination::{Illumination, IlluminationSettings};
use girandole_core::lights::{LightSettings, Pace};
use girandole_core::scene::{Scene, View};
use girandole_core::visibility::VisibilityDatabase;
use std::time::Instant;

/// A scene with something that moves.
pub struct MovingTrial<'a> {
    pub scene: Scene,
    pub view: View,
    pub lights: u32,
    pub updates: UpdatesArg,
    pub args: &'a BenchArgs,
}

/// What is timed, frame by frame.
const TIMES: [&str; 5] =
    ["frame_ms", "static_frame_ms", "update_ms", "illumination_update_ms", "visibility_ms"];
/// What is counted, frame by frame.
const COUNTS: [&str; 6] = [
    "maps_drawn",
    "maps_stale",
    "oldest_map_frames",
    "stale_map_error",
    "map_texels_drawn",
    "light_maps_changed",
];

impl Device {
    /// Times frames of mode full along a scene's motion: each after an update, and once more with
    /// nothing changed.
    pub fn time_moving(&self, mut trial: MovingTrial, progress: &dyn Fn(f32)) -> Result<Stats> {
        let args = trial.args;
        let (device, queue) = self.handles();
        let mut renderer = Renderer::new(device, queue, args.quality.options())?;
        let target = self.target(args.size);
        let lights = LightSettings {
            count: trial.lights,
            seed: args.seed,
            walk_dynamic: args.rewalk != RewalkArg::Off,
            ..LightSettings::default()
        };
        let views = vec![trial.view];
        let rewalk = args.rewalk.with_fade(Pace::default().fade);
        let light = IlluminationSettings { lights, views, rewalk, ..Default::default() };
        trial.scene.take_changes();
        renderer.open(&trial.scene, &light)?;
        // A second one, to time by itself what the renderer does within its update.
        let mut beside = Illumination::new(&trial.scene, &light)?;
        let still = RenderSettings {
            exposure: girandole_core::tonemap::Exposure::Ev(0.0),
            updates: MapUpdates { most: Some(0), ..MapUpdates::default() },
            ..args.quality.settings(Mode::Full, args.quality.clamp.0, args.aa)
        };
        let most = trial.updates.most(None);
        let moving = RenderSettings { updates: MapUpdates { most, ..MapUpdates::default() }, ..still };
        let mut viewport = Viewport::default();
        let frame =
            |renderer: &mut Renderer, viewport: &mut Viewport, settings: &RenderSettings| -> Result<f64> {
                let start = Instant::now();
                renderer.render(viewport, &trial.view, args.size, settings)?;
                renderer.show(viewport, settings, &target, FORMAT)?;
                self.wait()?;
                Ok(milliseconds(start))
            };
        frame(&mut renderer, &mut viewport, &RenderSettings { updates: MapUpdates::default(), ..moving })?;
        let all = self.stats(&renderer, &viewport)?;
        let mut result = statistics(&all, u64::from(args.size[0]) * u64::from(args.size[1]));
        let mut times = [const { Vec::new() }; TIMES.len()];
        let mut counts = [const { Vec::new() }; COUNTS.len()];
        // The first two warm up, and in the last one passes are timed, which slows the others down.
        let last = args.repeat + 2;
        for round in 0..=last {
            renderer.time_passes(round == last);
            trial.scene.set_time(f64::from(round + 1) / args.fps)?;
            let changes = trial.scene.take_changes();
            let start = Instant::now();
            beside.update(&trial.scene, &changes)?;
            let illumination_ms = milliseconds(start);
            let start = Instant::now();
            renderer.update(&trial.scene, &changes)?;
            self.wait()?;
            let update_ms = milliseconds(start);
            let frame_ms = frame(&mut renderer, &mut viewport, &moving)?;
            let stats = self.stats(&renderer, &viewport)?;
            let stale_error = self.stale_error(&renderer, &viewport)?;
            if round == last {
                for (pass, ms) in stats.gpu_ms {
                    result.insert(pass.into(), ms.into());
                }
                break;
            }
            let static_ms = frame(&mut renderer, &mut viewport, &still)?;
            let start = Instant::now();
            if let Some(database) = beside.visibility().filter(|_| round % 4 == 2) {
                let (geometry, lights) = (beside.geometry(), beside.lights());
                VisibilityDatabase::build(&trial.scene, geometry, lights, database.settings())?;
            }
            let build_ms = milliseconds(start);
            progress(round as f32 / last as f32);
            if round < 2 {
                continue;
            }
            let values = [frame_ms, static_ms, update_ms, illumination_ms];
            for (times, value) in times.iter_mut().zip(values) {
                times.push(value);
            }
            if round % 4 == 2 {
                times[4].push(build_ms);
            }
            let drawn = [
                f64::from(stats.maps_drawn),
                f64::from(stats.stale.maps),
                f64::from(stats.stale.oldest),
                stale_error,
                if stats.maps_drawn == 0 { 0.0 } else { stats.texels_drawn as f64 },
                f64::from(stats.light_map_changes),
            ];
            for (counts, value) in counts.iter_mut().zip(drawn) {
                counts.push(value);
            }
        }
        for (key, values) in TIMES.iter().zip(&mut times) {
            result.insert((*key).into(), median(values).into());
        }
        for (key, values) in COUNTS.iter().zip(&counts) {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            result.insert((*key).into(), mean.into());
        }
        let drawn = result["map_texels_drawn"].as_f64().unwrap_or(0.0);
        result.insert("share_map_texels_drawn".into(), (drawn / all.texels_drawn.max(1) as f64).into());
        Ok(result)
    }
}
