//! The window: a scene that one walks through and takes apart, with a panel for every setting.
//!
//! | file | what it holds |
//! |---|---|
//! | `session.rs` | the scene, its settings and its renderer; what has to be made anew when one of them changes |
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
//! Nothing here waits, but for the adapter at the start: what takes long is said first, and what comes back from the device
//! is looked for between frames.

mod app;
mod budget;
mod camera;
mod clock;
mod command;
mod controls;
mod drop;
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

use crate::args::{Cli, Command, ViewArgs};
use crate::engine::gpu;
use crate::{output, render, scene};
use anyhow::{Context, Result, bail};
use app::App;
use camera::Eye;
use clap::Parser;
use clock::Instant;
use girandole::RenderSettings;
use girandole_core::illumination::{IlluminationSettings, Rewalk};
use session::{Session, Source, Start};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use surface::WindowSurface;
use tools::Tools;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::window::{Window, WindowId};

/// The default without a command: a window on the room `pillars`, or a picture of it where there is no display or no GPU.
pub fn main_job() -> Result<ExitCode> {
    if !has_display() {
        return render::main_job("there is no display");
    }
    if !gpu::adapters().iter().any(|adapter| adapter.usable) {
        return render::main_job("there is no GPU adapter");
    }
    let Some(Command::View(args)) = Cli::try_parse_from(["girandole", "view"])?.command else {
        bail!("the main job is `girandole view`");
    };
    run(*args)
}

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
    let mut handler = Handler { started, args, start: Some(start), app: None, result: Ok(()) };
    event_loop.run_app(&mut handler).context("the window failed")?;
    handler.result.map(|()| ExitCode::SUCCESS)
}

/// What the options say.
fn start(args: &ViewArgs) -> Result<Start> {
    let source = Source { scene: args.scene.clone(), object: args.object.clone() };
    let (mut scene, edits) =
        scene::load_edited(&args.scene, args.object.as_deref(), args.seen.edits.as_deref())?;
    scene.open();
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
        ..gpu::settings(args.mode, &args.quality, args.quality.clamp.0, args.aa)
    };
    Ok(Start {
        budget: args.interactive_budget,
        source,
        scene,
        edits,
        eye,
        options: gpu::options(&args.quality),
        light,
        settings,
        refine: args.refine,
    })
}

fn write_stats(app: &App, path: &Path) -> Result<()> {
    let text = serde_json::to_string_pretty(&app.stats())?;
    output::write_whole(path, format!("{text}\n").as_bytes())
}

fn has_display() -> bool {
    cfg!(any(windows, target_os = "macos"))
        || ["WAYLAND_DISPLAY", "DISPLAY"].iter().any(|v| std::env::var_os(v).is_some_and(|s| !s.is_empty()))
}

/// What winit calls.
struct Handler {
    started: Instant,
    args: ViewArgs,
    /// Until the window is there.
    start: Option<Start>,
    app: Option<App>,
    /// What ended the window, if not its user.
    result: Result<()>,
}

impl Handler {
    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let Some(start) = self.start.take() else { return Ok(()) };
        let [width, height] = self.args.size;
        let attributes = Window::default_attributes()
            .with_title("Girandole")
            .with_inner_size(PhysicalSize::new(width + layout::PANEL_WIDTH as u32, height));
        let window = Arc::new(event_loop.create_window(attributes).context("the window cannot be opened")?);
        // The panel is as many pixels wide as the display says.
        let panel = (f64::from(layout::PANEL_WIDTH) * window.scale_factor()).round() as u32;
        let _ = window.request_inner_size(PhysicalSize::new(width + panel, height));
        let opened = pollster::block_on(WindowSurface::open(window.clone(), self.args.adapter.as_deref()))?;
        let tools = Tools::new(self.args.output.clone(), self.args.size, self.args.adapter.clone());
        self.app = Some(App::new(self.started, window, opened, (Session::new(start), tools)));
        Ok(())
    }

    /// Gives up all that is behind the window, and says what was measured.
    fn close(&mut self) {
        if let (Some(app), Some(path), Ok(())) = (self.app.take(), &self.args.stats, &self.result) {
            self.result = write_stats(&app, path);
        }
    }

    /// Ends the window where something went wrong for good.
    fn check<T>(&mut self, event_loop: &ActiveEventLoop, result: Result<T>) -> Option<T> {
        result
            .map_err(|error| {
                self.result = Err(error);
                event_loop.exit();
            })
            .ok()
    }
}

impl ApplicationHandler for Handler {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        let opened = self.open(event_loop);
        self.check(event_loop, opened);
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if matches!(event, WindowEvent::CloseRequested | WindowEvent::Destroyed) {
            self.close();
            event_loop.exit();
        } else if let Some(app) = &mut self.app {
            let result = app.on_event(&event);
            let quits = app.quits();
            self.check(event_loop, result);
            if quits {
                self.close();
                event_loop.exit();
            }
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(app) = &mut self.app else { return };
        let next = app.poll();
        let Some(next) = self.check(event_loop, next) else { return };
        event_loop.set_control_flow(next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }
}
