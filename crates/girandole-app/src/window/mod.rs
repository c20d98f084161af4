//! The window: a scene that one walks through and takes apart, with a panel for every setting.
//!
//! | file | what it holds |
//! |---|---|
//! | `session.rs` | the scene, its settings and its renderer; what has to be made anew when one of them changes |
//! | `event_loop.rs` | the window of the operating system, or of the browser |
//! | `app.rs` | one frame after the other: the session, the panel, the surface |
//! | `refine.rs` | what goes on while everything is at rest |
//! | `layout.rs`, `panel/`, `controls.rs` | what is where, what it edits, what hands do to the picture |
//! | `touch.rs` | what fingers do to it |
//! | `keys.rs`, `messages.rs` | what keys do, in one table; what is to be known, one sentence at a time |
//! | `camera.rs` | where one looks from |
//! | `picking.rs`, `selection.rs`, `outline.rs`, `gizmo.rs` | what is picked, what is done to it, its outline, handles |
//! | `bookmarks.rs`, `lamps.rs` | views to come back to; what shines, and how strong it is |
//! | `command.rs` | the call that renders the same picture |
//! | `rest.rs`, `budget.rs` | whether anything moves; what frames may take then |
//! | `surface.rs`, `gui.rs`, `target.rs` | the window's surface, egui on it, the picture beside the panel |
//! | `presets.rs`, `insert.rs` | settings that go together; objects that are put in front of the camera |
//! | `truth.rs` | the truth beside the picture |
//! | `opening.rs`, `files/`, `waits.rs` | what is opened beside; dialogs and recent files; what is being waited for |
//! | `frame_log.rs` | times of all frames |
//! | `frames.rs`, `shot.rs`, `pending.rs` | what comes back later: times, pictures |
//!
//! Nothing here waits: what takes long is said first, and what comes back from the device is looked for between frames.

mod app;
mod bookmarks;
mod budget;
mod camera;
mod clock;
mod command;
mod controls;
mod event_loop;
mod files;
mod frame_log;
mod frames;
mod gizmo;
mod gui;
mod insert;
mod keys;
mod lamps;
mod layout;
mod messages;
mod opening;
mod outline;
mod panel;
mod pending;
mod picking;
mod presets;
mod refine;
mod rest;
mod selection;
mod session;
mod shot;
mod surface;
mod target;
mod tools;
mod touch;
mod truth;
mod waits;

use crate::args::ViewArgs;
use crate::{output, scene, transfer};
use anyhow::{Context, Result, bail};
use camera::Eye;
use clock::{Duration, Instant};
use event_loop::Handler;
use girandole::{MapUpdates, RenderSettings};
use girandole_core::illumination::{IlluminationSettings, Rewalk};
use girandole_core::lights::LightSettings;
use girandole_core::scene::{Camera, Edits, Projection, Scene, Transform, View};
pub use keys::help;
use opening::First;
use session::{Source, Start, Transfers};
use std::process::ExitCode;
use winit::event_loop::EventLoop;

/// Shadow maps that a frame draws at most, until told otherwise: others wait while things move, and follow once they rest.
const UPDATES: u32 = 100;

/// Opens a window by the options of the command line.
#[cfg(not(target_arch = "wasm32"))]
pub fn run(args: ViewArgs) -> Result<ExitCode> {
    let started = Instant::now();
    if !has_display() {
        bail!("there is no display to open a window on; use `girandole render` to make a picture");
    }
    output::check_writable(&args.output, &["exr", "png"])?;
    if let Some(stats) = &args.stats {
        output::check_writable(stats, &["json"])?;
    }
    let event_loop = EventLoop::new().context("there is no display to open a window on")?;
    let mut handler = Handler::new(started, args);
    event_loop.run_app(&mut handler).context("the window failed")?;
    handler.result().map(|()| ExitCode::SUCCESS)
}

/// Opens a window that fills the page, by the options of its address, and returns at once.
#[cfg(target_arch = "wasm32")]
pub fn run(args: ViewArgs) -> Result<()> {
    use winit::platform::web::EventLoopExtWebSys;
    let handler = Handler::new(Instant::now(), args);
    EventLoop::new().context("this page has no window")?.spawn_app(handler);
    Ok(())
}

/// Of files that were dropped together, the one that the others belong to.
#[cfg(target_arch = "wasm32")]
pub fn main_file(files: &[std::path::PathBuf]) -> Option<std::path::PathBuf> {
    files::Purpose::OpenScene.first(files)
}

/// What the options say, before there is a scene.
fn start(args: &ViewArgs) -> Start {
    let (object, load) = (args.object.clone(), args.seen.load.clone());
    let source = Source { scene: args.scene.clone(), object, load };
    let mut scene = Scene::default();
    scene.name.clone_from(&args.scene);
    let node = scene.add_node("camera", Transform::IDENTITY);
    let projection = Projection::Perspective { yfov: 1.0 };
    scene.cameras.push(Camera { name: "camera".into(), node, projection, clip: Default::default() });
    let view = View::new(&scene, &scene.cameras[0], 1.0);
    let light = IlluminationSettings {
        lights: LightSettings { dark: true, ..args.lights.settings() },
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
    Start {
        budget: args.interactive_budget.filter(|ms| ms.is_finite()),
        source,
        scene,
        edits: Edits::default(),
        eye: Eye::Camera(0),
        options: args.quality.options(),
        light,
        settings,
        refine: args.refine,
        transfers: Transfers::new(args.transfer.clone(), Vec::new()),
    }
}

/// Opens the scene that the options name.
async fn first(args: &ViewArgs) -> Result<First> {
    // Browsers cannot sleep.
    if let Some(seconds) = args.slow_opening {
        std::thread::sleep(Duration::from_secs(seconds));
    }
    let (mut scene, edits) =
        scene::load_edited_in_slices(&args.scene, args.object.as_deref(), &args.seen).await?;
    scene.open();
    let transferred = transfer::load(&scene, &args.transfer)?;
    let named = scene.camera(args.camera.as_deref().unwrap_or("0"))?;
    let camera = scene.cameras.iter().position(|camera| camera == named).unwrap_or_default();
    let eye = args.seen.view.map_or(Eye::Camera(camera), |view| Eye::Free(view.0));
    Ok(First { scene, edits, transferred, eye })
}

/// Whether a window can be opened.
pub fn has_display() -> bool {
    cfg!(any(windows, target_os = "macos", target_arch = "wasm32"))
        || ["WAYLAND_DISPLAY", "DISPLAY"].iter().any(|v| std::env::var_os(v).is_some_and(|s| !s.is_empty()))
}
