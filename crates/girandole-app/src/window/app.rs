//! A window with its device: one frame after the other.

use super::clock::{Duration, Instant, milliseconds};
use super::command;
use super::files::Files;
use super::frame_log::FrameLog;
use super::frames::{FrameTimes, Frames};
use super::gui::{Gui, GuiFrame};
use super::insert::insert;
use super::layout;
use super::opening::{Opened, Opener};
use super::session::Session;
use super::shot::{self, Shots};
use super::surface::WindowSurface;
use super::target::PictureTarget;
use super::tools::Tools;
use super::waits::{Wait, What};
use crate::output::Stats;
use crate::output::say;
use anyhow::Result;
use girandole::Gpu;
use girandole_core::scene::Shape;
use std::path::Path;
use std::sync::Arc;
use winit::event::WindowEvent;
use winit::window::Window;

/// How often what is on its way back from the device is looked for.
const POLL: Duration = Duration::from_millis(4);

/// How often the progress of what is made beside is shown.
const PROGRESS: Duration = Duration::from_millis(100);

/// How often a dialog of the system's is looked for.
const DIALOG: Duration = Duration::from_millis(50);

/// What is made in a frame takes as long, or a little longer.
const SLICE: Duration = Duration::from_millis(15);

/// When to try again where the surface is hidden or was made anew.
const RETRY: Duration = Duration::from_millis(20);

/// What does not depend on a device.
pub struct State {
    pub session: Session,
    pub tools: Tools,
    pub log: FrameLog,
    /// Of the panel: what is open, and how far it is scrolled.
    pub memory: egui::Memory,
    /// What is being opened.
    pub opener: Opener,
    pub files: Files,
}

/// All that is behind a window.
pub struct App {
    window: Arc<Window>,
    gpu: Gpu,
    surface: WindowSurface,
    gui: Gui,
    session: Session,
    tools: Tools,
    target: Option<PictureTarget>,
    frames: Frames,
    log: FrameLog,
    shots: Shots,
    opener: Opener,
    files: Files,
    /// Whether the last frame said that light is being made.
    says_progress: bool,
    /// Whether light was made since a picture was drawn.
    has_made: bool,
    /// What the window is called.
    named: String,
    last_frame: Instant,
    /// When a frame is due though nothing happens.
    due: Option<Instant>,
    /// The picture that the page's address shows.
    #[cfg(target_arch = "wasm32")]
    addressed: (u64, u32),
}

impl App {
    pub fn new(window: Arc<Window>, (surface, gpu): (WindowSurface, Gpu), state: State) -> Self {
        let State { session, tools, log, memory, opener, files } = state;
        let gui = Gui::new(&window, &gpu, &surface, memory);
        let woken = Arc::downgrade(&window);
        gpu.on_loss(move || woken.upgrade().iter().for_each(|window| window.request_redraw()));
        let now = Instant::now();
        Self {
            window,
            gpu,
            surface,
            gui,
            session,
            tools,
            target: None,
            frames: Frames::default(),
            log,
            shots: Shots::default(),
            opener,
            files,
            says_progress: false,
            has_made: false,
            named: String::new(),
            last_frame: now,
            due: Some(now),
            #[cfg(target_arch = "wasm32")]
            addressed: (0, 0),
        }
    }

    /// What is left where the device was lost: all but what was on it.
    pub fn rescue(self) -> State {
        let Self { mut session, mut tools, log, gui, shots, opener, files, .. } = self;
        session.forget_device();
        tools.truth.begin_anew();
        // Pictures on their way are lost, but not that they were asked for.
        tools.saves |= shots.is_waiting();
        State { session, tools, log, memory: gui.memory(), opener, files }
    }

    pub fn window(&self) -> Arc<Window> {
        self.window.clone()
    }

    /// Whether nothing works any more on the device.
    pub fn has_lost_device(&self) -> bool {
        self.gpu.is_lost()
    }

    /// Gives the device up, as a driver does that fails.
    pub fn lose_device(&self) {
        self.gpu.device.destroy();
    }

    /// Takes an event of the window.
    pub fn on_event(&mut self, event: &WindowEvent) -> Result<()> {
        if *event == WindowEvent::RedrawRequested {
            return self.frame();
        }
        if let WindowEvent::Resized(size) = event {
            self.surface.resize(&self.gpu, (*size).into());
        }
        if self.gui.on_event(&self.window, event) {
            self.window.request_redraw();
        }
        Ok(())
    }

    /// What was measured, as one flat object.
    pub fn stats(&self) -> Stats {
        let mut stats = self.log.stats(self.session.budget.milliseconds);
        stats.insert("adapter".into(), self.gpu.info.name.clone().into());
        if let Some(comparison) = &self.tools.truth.comparison {
            stats.insert("truth_rel_mse".into(), comparison.rel_mse.into());
            stats.insert("truth_energy_ratio".into(), comparison.energy_ratio.into());
            #[cfg(not(target_arch = "wasm32"))]
            stats.insert("truth_flip".into(), comparison.flip.into());
        }
        stats
    }

    /// Whether the window is to be closed.
    pub fn quits(&self) -> bool {
        self.tools.quits
    }

    /// Takes what has come back from the device, and asks for a frame if one is due. Returns when to be called again.
    pub fn poll(&mut self) -> Result<Option<Instant>> {
        #[cfg(target_arch = "wasm32")]
        crate::page::save_written();
        self.gpu.poll()?;
        let now = Instant::now();
        let (mut is_there, times) = self.frames.collect();
        is_there |= self.collect_shots()
            | self.collect_opened()?
            | self.session.refinement.collect()
            | self.session.collect_transfer();
        if let Some(times) = times {
            self.log.add(&times);
            if times.hurried {
                self.session.budget.took(times.total());
            }
        }
        if is_there || self.due.is_some_and(|due| due <= now) {
            self.due = None;
            self.window.request_redraw();
        }
        let waits = self.tools.truth.is_waiting()
            || self.frames.is_waiting()
            || self.shots.is_waiting()
            || self.opener.is_waiting()
            || self.session.refinement.is_waiting()
            || self.session.transfers.progress().is_some();
        let poll = waits.then(|| now + POLL);
        if self.files.is_waiting() {
            // Whoever chooses a file takes his time.
            self.due = Some(self.due.map_or(now + DIALOG, |due| due.min(now + DIALOG)));
        }
        Ok(poll.into_iter().chain(self.due).min())
    }

    fn collect_shots(&mut self) -> bool {
        let written = self.shots.collect();
        for result in &written {
            let sentence = match result {
                Ok((path, 1)) => format!("wrote {}", path.display()),
                Ok((path, sets)) => format!("wrote {}, the average of {sets} light sets", path.display()),
                Err(error) => crate::sentence(error),
            };
            say(&sentence);
            self.session.notice = Some(sentence);
        }
        !written.is_empty()
    }

    /// Takes what was opened beside. Without the first scene there is no window.
    fn collect_opened(&mut self) -> Result<bool> {
        let Some((opened, is_first)) = self.opener.take() else { return Ok(false) };
        let Self { session, tools, .. } = self;
        match opened {
            Ok(Opened::First(first)) => {
                session.begin(*first, tools.picture_size);
                self.files.shows(Path::new(&session.source.scene), None);
            }
            Ok(Opened::Scene(another)) => {
                tools.select(None);
                self.files.shows(Path::new(&another.source.scene), another.edits_file.clone());
                session.change_scene(*another, tools.picture_size);
            }
            Ok(Opened::Model(path, mesh)) => {
                let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                insert(session, tools, &name, Shape::File(path), &|_| Ok((*mesh).clone()));
            }
            Ok(Opened::Written(sentence)) => {
                say(&sentence);
                session.notice = Some(sentence);
            }
            Err(error) if is_first => return Err(error),
            Err(error) => session.notice = Some(crate::sentence(&error)),
        }
        Ok(true)
    }

    /// What is being waited for.
    fn waits(&self) -> Vec<Wait> {
        let waits = self.opener.wait().into_iter();
        waits.chain(self.files.wait()).chain(self.session.wait()).collect()
    }

    /// Ends a wait that nobody wants any more. The first scene is all that there is to wait for.
    fn cancel(&mut self) {
        match self.tools.cancels.take() {
            Some(What::Opening) if self.session.is_blank => self.tools.quits = true,
            Some(What::Opening) => self.opener.cancel(),
            Some(What::Choosing) => self.tools.asks = Some(super::files::Ask::TypeInstead),
            Some(What::Compiling) | None => {}
        }
    }

    fn frame(&mut self) -> Result<()> {
        if self.window.inner_size().width == 0 || self.window.inner_size().height == 0 {
            return Ok(());
        }
        let Some(surface) = self.surface.acquire(&self.gpu)? else {
            self.due = Some(Instant::now() + RETRY);
            return Ok(());
        };
        // The panel acts on the session.
        let start = Instant::now();
        let elapsed = start - std::mem::replace(&mut self.last_frame, start);
        if !self.frames.is_busy() || !self.session.is_moving() {
            self.session.advance(elapsed.as_secs_f64());
        } else {
            // Motion waits for the picture of the last moment.
            self.last_frame -= elapsed;
        }
        self.name_window();
        self.tools.waits = self.waits();
        let gui = self.lay_out();
        let panel = milliseconds(start);
        self.take_dropped_files();
        self.cancel();
        self.allocate_target();
        self.session.rest(elapsed.as_secs_f64(), self.tools.picture_size);
        let has_made = self.make();
        self.schedule(&gui);
        if has_made {
            // One thing at a time: the picture comes with the next frame.
            self.window.request_redraw();
        } else {
            self.draw(panel);
        }
        let Self { session, tools, .. } = self;
        tools.truth.step(session, tools.picture_size, self.gui.context());
        self.frames.ask(self.session.shown_by(), self.session.is_hurried());
        self.save();
        #[cfg(target_arch = "wasm32")]
        self.follow_address();
        // The panel is painted over the picture.
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let target = self.target.as_ref();
        self.gui.paint(&self.gpu, &mut encoder, (&surface.texture, target), gui);
        self.window.pre_present_notify();
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.queue.present(surface);
        #[cfg(target_arch = "wasm32")]
        crate::page::ready(self.session.has_picture());
        Ok(())
    }

    /// Lays the panel out and lets it act.
    fn lay_out(&mut self) -> GuiFrame {
        let Self { session, tools, frames, gui, window, files, opener, .. } = self;
        tools.recent = files.recent().to_vec();
        tools.has_dialog = files.has_own_dialog();
        gui.run(window, |ui| {
            layout::show(ui, session, tools, frames);
            files.act((ui, window), (session, tools), opener);
        })
    }

    /// Calls the window by its scene.
    fn name_window(&mut self) {
        let name = &self.session.scene.name;
        if self.named != *name {
            self.window.set_title(&format!("{name} - Girandole"));
            self.named.clone_from(name);
        }
    }

    fn take_dropped_files(&mut self) {
        let dropped = self.gui.take_dropped_files().into_iter().map(|path| (path, false));
        #[cfg(target_arch = "wasm32")]
        let dropped = dropped.chain(crate::page::take_dropped());
        for (path, has_others) in dropped {
            // A model that brings its materials is to be seen with them. Before there is a scene nothing can be put into it.
            if has_others || self.session.is_blank {
                self.opener.open(&path);
            } else {
                self.opener.drop(&path, self.gui.has_shift(), &self.session);
            }
        }
    }

    /// Makes the target as large as the picture.
    fn allocate_target(&mut self) {
        let size = self.tools.picture_size;
        if self.target.as_ref().is_some_and(|target| target.size == size) {
            return;
        }
        self.target =
            Some(PictureTarget::new((&self.gpu.device, &self.gpu.queue), size, self.surface.format()));
        self.session.forget_picture();
    }

    /// Makes a slice of light, once the frame that says so was shown, unless it is time for a picture. Nothing is made anew while a
    /// control is being dragged or typed into. Whether anything was made.
    fn make(&mut self) -> bool {
        let said = std::mem::replace(&mut self.says_progress, self.session.is_making());
        if !said || !self.session.is_making() || self.gui.is_in_use() || self.frames.is_busy() {
            return false;
        }
        let size = self.tools.picture_size;
        let has_made = std::mem::take(&mut self.has_made);
        if has_made && self.session.wants_picture(size) && self.session.is_compiled(size) {
            return false;
        }
        if self.session.make((&self.gpu.device, &self.gpu.queue), Instant::now() + SLICE) {
            self.frames.submitted_work(&self.gpu.queue);
        }
        self.has_made = true;
        true
    }

    /// Finds out when the next frame is due.
    fn schedule(&mut self, gui: &GuiFrame) {
        if self.session.is_making() && !self.gui.is_in_use() && !self.frames.is_busy() {
            self.window.request_redraw();
        }
        self.due = Instant::now().checked_add(gui.repaint_after);
        if self.session.transfers.progress().is_some() {
            let shown = Instant::now() + PROGRESS;
            self.due = Some(self.due.map_or(shown, |due| due.min(shown)));
        }
        if let Some(seconds) = self.session.rests_in(self.tools.picture_size) {
            let rested = Instant::now() + Duration::from_secs_f64(seconds);
            self.due = Some(self.due.map_or(rested, |due| due.min(rested)));
        }
        if gui.repaint_after.is_zero()
            || self.tools.truth.is_waiting()
            || self.session.is_moving() && !self.frames.is_busy()
        {
            self.window.request_redraw();
        }
    }

    /// Draws the picture where it is another one, unless the device is still at the last.
    fn draw(&mut self, panel: f64) {
        let Some(target) = &mut self.target else { return };
        if self.frames.is_busy() {
            return;
        }
        let start = Instant::now();
        self.session.follow(target.size);
        let update = milliseconds(start);
        let start = Instant::now();
        let (hurried, preliminary) = (self.session.is_hurried(), self.session.is_preliminary());
        if self.session.wants_picture(target.size) {
            if !self.session.is_compiled(target.size) {
                // The last picture stays.
                let soon = Instant::now() + PROGRESS;
                self.due = Some(self.due.map_or(soon, |due| due.min(soon)));
                return;
            }
            self.session.draw(target);
        } else if !self.session.may_refine(target.size) {
            return;
        } else if !self.session.refine(target, Instant::now() + SLICE) {
            // The next slice of work, in the next frame.
            return self.window.request_redraw();
        }
        let is_full = !hurried && !preliminary && self.session.stale_maps() == 0;
        let record = milliseconds(start);
        let times = FrameTimes { panel, update, record, device: 0.0, hurried, is_full };
        self.frames.submitted(&self.gpu.queue, times);
    }

    /// Keeps the address of the page to what is seen, once that rests.
    #[cfg(target_arch = "wasm32")]
    fn follow_address(&mut self) {
        let Self { session, tools, .. } = self;
        let (shown, size) = (session.picture_number(), tools.picture_size);
        let is_last = session.is_done() && !session.wants_picture(size) && session.rests_in(size).is_none();
        if self.addressed == shown || !is_last || session.is_moving() || self.gui.is_in_use() {
            return;
        }
        self.addressed = shown;
        if let Ok(address) = command::address(session, size) {
            crate::page::set_address(&address);
        }
    }

    /// Saves the picture, if that was asked for and it is the one that is wanted; and says what call renders it.
    fn save(&mut self) {
        let size = self.tools.picture_size;
        // What is saved has all its pixels, unless motion goes on and on.
        let is_whole = !self.session.is_hurried() || self.session.is_moving();
        let is_there = self.session.is_done() && !self.session.wants_picture(size) && is_whole;
        if self.tools.copies && is_there && self.session.is_ready_to_copy(size) {
            self.tools.copies = false;
            self.copy_command();
        }
        if let Some(shown_by) = self.session.shown_by().filter(|_| self.tools.saves && is_there) {
            self.tools.saves = false;
            let path = Path::new(&self.tools.file);
            match shot::made_by(&self.session, size, path) {
                Ok(made_by) => self.shots.take(shown_by, self.session.shown(), (path, made_by)),
                Err(error) => self.session.notice = Some(crate::sentence(&error)),
            }
        }
    }

    fn copy_command(&mut self) {
        let output = (self.tools.picture_size, Path::new(&self.tools.file));
        // In browsers it is a link that is copied.
        #[cfg(target_arch = "wasm32")]
        let line =
            command::address(&self.session, output.0).map(|address| crate::page::set_address(&address));
        #[cfg(not(target_arch = "wasm32"))]
        let line = command::line(&self.session, output, self.tools.adapter.as_deref());
        self.session.attempt(|session| {
            let line = line?;
            #[cfg(target_arch = "wasm32")]
            crate::page::copy(&line);
            say(&line);
            session.notice = Some(format!("copied: {line}"));
            self.gui.copy(line);
            Ok(())
        });
    }
}
