//! What winit calls.

use super::app::{App, State};
use super::budget::Budget;
use super::clock::{Duration, Instant};
use super::files::Files;
use super::frame_log::FrameLog;
#[cfg(not(target_arch = "wasm32"))]
use super::layout;
use super::opening::Opener;
use super::pending::{self, Pending};
use super::session::Session;
use super::surface::WindowSurface;
use super::tools::Tools;
use crate::args::ViewArgs;
use crate::output::say;
use anyhow::{Context, Result};
use girandole::{Error, Gpu};
use std::path::Path;
use std::sync::Arc;
use winit::application::ApplicationHandler;
#[cfg(not(target_arch = "wasm32"))]
use winit::dpi::PhysicalSize;
use winit::error::OsError;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::{Window, WindowId};

/// How often an adapter that is being opened is looked for.
const POLL: Duration = Duration::from_millis(4);

/// A device that is lost again after so short a time is given up.
const LEAST_LIFE: Duration = Duration::from_secs(10);

/// What frames of a software device may take while things move, unless told otherwise, milliseconds.
const SOFTWARE_BUDGET: f64 = 100.0;

/// A program that shows a window.
pub struct Handler {
    started: Instant,
    args: ViewArgs,
    /// Until the window is there.
    state: Option<State>,
    opening: Option<Opening>,
    app: Option<App>,
    /// When the last device was lost.
    lost: Option<Instant>,
    /// What ended the window, if not its user.
    result: Result<()>,
}

/// A window whose adapter is being opened.
struct Opening {
    window: Arc<Window>,
    state: State,
    opened: Option<Pending<Result<(WindowSurface, Gpu)>>>,
    /// What happened meanwhile: keys that are pressed and let go are not to be missed.
    events: Vec<WindowEvent>,
}

impl Handler {
    /// Of a program that started then. The scene is opened from here on, beside all else.
    pub fn new(started: Instant, args: ViewArgs) -> Self {
        let tools = Tools::new(args.output.clone(), args.size, args.adapter.clone());
        let state = State {
            session: Session::blank(super::start(&args)),
            tools,
            log: FrameLog::new(started),
            memory: egui::Memory::default(),
            opener: Opener::first(&args.scene, {
                let args = args.clone();
                async move || super::first(&args).await
            }),
            files: Files::new(args.seen.edits.clone(), args.own_dialogs),
        };
        Self { started, args, state: Some(state), opening: None, app: None, lost: None, result: Ok(()) }
    }

    /// What ended the window, if not its user.
    pub fn result(self) -> Result<()> {
        self.result
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let Some(state) = self.state.take() else { return Ok(()) };
        let window = Arc::new(self.window(event_loop).context("the window cannot be opened")?);
        #[cfg(target_arch = "wasm32")]
        crate::page::tell(window.clone());
        self.open_device(window, state);
        Ok(())
    }

    /// A window that fills the page.
    #[cfg(target_arch = "wasm32")]
    fn window(&self, event_loop: &ActiveEventLoop) -> Result<Window, OsError> {
        use winit::platform::web::WindowAttributesExtWebSys;
        let attributes = Window::default_attributes().with_canvas(crate::page::canvas());
        event_loop.create_window(attributes)
    }

    /// A window with room for a picture of the size that was asked for.
    #[cfg(not(target_arch = "wasm32"))]
    fn window(&self, event_loop: &ActiveEventLoop) -> Result<Window, OsError> {
        let monitor = event_loop.primary_monitor().or_else(|| event_loop.available_monitors().next());
        let (screen, scale) = monitor.map_or((None, 1.0), |m| (Some(m.size().into()), m.scale_factor()));
        let attributes = Window::default_attributes()
            .with_title("Girandole")
            .with_inner_size(physical(layout::window_size(self.args.size, screen, scale)));
        let window = event_loop.create_window(attributes)?;
        // Panel and bar are as many pixels large as the display says that the window came to.
        let screen = window.current_monitor().map(|monitor| monitor.size().into()).or(screen);
        let size = layout::window_size(self.args.size, screen, window.scale_factor());
        let _ = window.request_inner_size(physical(size));
        Ok(window)
    }

    fn open_device(&mut self, window: Arc<Window>, state: State) {
        let opened = WindowSurface::open(window.clone(), self.args.adapter.clone());
        let opened = Some(Pending::new(opened));
        self.opening = Some(Opening { window, state, opened, events: Vec::new() });
    }

    /// Opens a device again where the last one was lost; what came of it says what went wrong otherwise.
    fn reopen<T>(&mut self, result: Result<T>) -> Result<Option<T>> {
        let Some(app) = self.app.take_if(|app| app.has_lost_device()) else { return result.map(Some) };
        let lost = self.lost.replace(Instant::now());
        if lost.is_some_and(|at| at.elapsed() < LEAST_LIFE) {
            return Err(result
                .err()
                .unwrap_or_else(|| Error::Device("the device was lost again".into()).into()));
        }
        say("the GPU's device was lost; it is opened again");
        let window = app.window();
        self.open_device(window, app.rescue());
        Ok(None)
    }

    /// Goes on. Returns when to be called again.
    fn poll(&mut self) -> Result<Option<Instant>> {
        if let Some(app) = &mut self.app {
            let loss = self.args.lose_device.first().map(|s| self.started + Duration::from_secs(*s));
            if loss.is_some_and(|at| at <= Instant::now()) {
                self.args.lose_device.remove(0);
                app.lose_device();
            }
            let next = app.poll();
            let next = self.reopen(next)?.unwrap_or_else(|| Some(Instant::now()));
            return Ok(next.into_iter().chain(loss).min());
        }
        let Some(opening) = &mut self.opening else { return Ok(None) };
        let Some(opened) = pending::take(&mut opening.opened) else {
            return Ok(Some(Instant::now() + POLL));
        };
        let Some(Opening { window, state, events, .. }) = self.opening.take() else { return Ok(None) };
        let (surface, gpu) = opened?;
        let mut state = state;
        if self.args.interactive_budget.is_none() && self.lost.is_none() && is_software(&gpu) {
            state.session.budget = Budget::new(Some(SOFTWARE_BUDGET));
        }
        let app = self.app.insert(App::new(window, (surface, gpu), state));
        events.iter().try_for_each(|event| app.on_event(event))?;
        app.poll()
    }

    /// Gives up all that is behind the window, and says what was measured.
    fn close(&mut self) {
        self.opening = None;
        if let (Some(app), Some(path), Ok(())) = (self.app.take(), &self.args.stats, &self.result) {
            self.result = write_stats(&app, path);
        }
    }

    /// Ends the window where something went wrong for good.
    fn check<T>(&mut self, event_loop: &ActiveEventLoop, result: Result<T>) -> Option<T> {
        result
            .map_err(|error| {
                #[cfg(target_arch = "wasm32")]
                crate::page::fail(&error);
                self.result = Err(error);
                event_loop.exit();
            })
            .ok()
    }
}

#[cfg(not(target_arch = "wasm32"))]
fn physical([width, height]: [u32; 2]) -> PhysicalSize<u32> {
    PhysicalSize::new(width, height)
}

fn is_software(gpu: &Gpu) -> bool {
    gpu.info.device_type == girandole::wgpu::DeviceType::Cpu
}

fn write_stats(app: &App, path: &Path) -> Result<()> {
    let text = serde_json::to_string_pretty(&app.stats())?;
    Ok(girandole_core::files::write(path, format!("{text}\n").as_bytes())?)
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
            let result = self.reopen(result);
            self.check(event_loop, result);
            if quits {
                self.close();
                event_loop.exit();
            }
        } else if let (Some(opening), false) = (&mut self.opening, event == WindowEvent::RedrawRequested) {
            opening.events.push(event);
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let next = self.poll();
        let Some(next) = self.check(event_loop, next) else { return };
        event_loop.set_control_flow(next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
    }
}
