//! The window: a scene that one walks through and takes apart, with a panel for every setting.
//!
//! | file | what it holds |
//! |---|---|
//! | `session.rs` | the scene, its settings and its renderer; what has to be made anew when one of them changes |
//! | `event_loop.rs` | the window of the operating system, or of the browser |
//! | `app.rs` | one frame after the other: the session, the panel, the surface |
//! | `refine.rs` | what goes on while everything is at rest |
//! | `layout.rs`, `panel/`, `controls.rs` | what is where, what it edits, what hands do to the picture |
//! | `camera.rs`, `gizmo.rs` | where one looks from; handles of what is picked |
//! | `command.rs` | the call that renders the same picture |
//! | `rest.rs`, `budget.rs` | whether anything moves; what frames may take then |
//! | `surface.rs`, `gui.rs`, `target.rs` | the window's surface, egui on it, the picture beside the panel |
//! | `presets.rs`, `insert.rs` | settings that go together; objects that are put in front of the camera |
//! | `truth.rs` | the truth beside the picture |
//! | `frame_log.rs` | times of all frames |
//! | `frames.rs`, `shot.rs`, `drop.rs`, `pending.rs` | what comes back later: times, pictures, files |
//!
//! Nothing here waits: what takes long is said first, and what comes back from the device is looked for between frames.

mod app;
mod budget;
mod camera;
mod clock;
mod command;
mod controls;
mod drop;
mod event_loop;
mod frame_log;
mod frames;
mod gizmo;
mod gui;
mod insert;
mod layout;
mod panel;
mod pending;
mod presets;
mod refine;
mod rest;
mod session;
mod shot;
mod surface;
mod target;
mod tools;
mod truth;

use crate::args::ViewArgs;
use crate::{output, scene, transfer};
use anyhow::{Context, Result, bail};
use camera::Eye;
use clock::Instant;
use event_loop::Handler;
use girandole::{MapUpdates, RenderSettings};
use girandole_core::illumination::{IlluminationSettings, Rewalk};
use session::{Source, Start, Transfers};
use std::process::ExitCode;
use winit::event_loop::EventLoop;

/// Shadow maps that a frame draws at most, until told otherwise: others wait while things move, and follow once they rest.
const UPDATES: u32 = 100;

/// Opens a window by the options of the command line.
pub fn run(args: ViewArgs) -> Result<ExitCode> {
    let started = Instant::now();
    if !has_display() {
        bail!("there is no display to open a window on; use `girandole render` to make a picture");
    }
    output::check_writable(&args.output, &["exr", "png"])?;
    if let Some(stats) = &args.stats {
        output::check_writable(stats, &["json"])?;
    }
    let start = start(&args)?;
    let event_loop = EventLoop::new().context("there is no display to open a window on")?;
    let mut handler = Handler::new(started, args, start);
    event_loop.run_app(&mut handler).context("the window failed")?;
    handler.result().map(|()| ExitCode::SUCCESS)
}

/// What the options say.
fn start(args: &ViewArgs) -> Result<Start> {
    let (object, load) = (args.object.clone(), args.seen.load.clone());
    let source = Source { scene: args.scene.clone(), object, load };
    let (mut scene, edits) = scene::load_edited(&args.scene, args.object.as_deref(), &args.seen)?;
    scene.open();
    let transfers = transfer::load(&scene, &args.transfer)?;
    let named = scene.camera(args.camera.as_deref().unwrap_or("0"))?;
    let camera = scene.cameras.iter().position(|camera| camera == named).unwrap_or_default();
    let eye = args.seen.view.map_or(Eye::Camera(camera), |view| Eye::Free(view.0));
    let view = eye.view(&scene, args.size[0] as f32 / args.size[1] as f32);
    let light = IlluminationSettings {
        lights: args.lights.settings(),
        views: args.lights.placement.views(&[view]).to_vec(),
        rewalk: Rewalk::Off,
        ..IlluminationSettings::default()
    };
    let settings = RenderSettings {
        exposure: args.exposure,
        tonemap: args.tonemap.into(),
        updates: MapUpdates { most: Some(UPDATES), ..MapUpdates::default() },
        ..args.quality.settings(args.mode, args.quality.clamp.0, args.aa)
    };
    Ok(Start {
        budget: args.interactive_budget,
        source,
        scene,
        edits,
        eye,
        options: args.quality.options(),
        light,
        settings,
        refine: args.refine,
        transfers: Transfers::new(args.transfer.clone(), transfers),
    })
}

/// Whether a window can be opened.
pub fn has_display() -> bool {
    cfg!(any(windows, target_os = "macos", target_arch = "wasm32"))
        || ["WAYLAND_DISPLAY", "DISPLAY"].iter().any(|v| std::env::var_os(v).is_some_and(|s| !s.is_empty()))
}
