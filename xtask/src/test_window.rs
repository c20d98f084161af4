//! `cargo xtask test-window`: a session in the window, by real keys and mouse buttons, on a display without a screen.

mod editing;
mod files;

use crate::{built, cargo};
use anyhow::{Context, Result, bail, ensure};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Of the panel, and the picture itself.
const DEBUG_VIEWS: usize = 7;
const ROOMS: [&str; 4] = ["area-lights", "table", "block", "gap"];
/// Pixels of the picture.
const SIZE: [u32; 2] = [480, 360];
/// Where the mouse starts: in the middle of the picture.
const MIDDLE: [u32; 2] = [240, 180];
/// The middle of the torus in `pillars`.
const TORUS: [u32; 2] = [234, 206];
/// For what takes long on a machine without a GPU.
const PATIENCE: Duration = Duration::from_secs(120);

/// Runs it, and says what was done.
pub fn run() -> Result<ExitCode> {
    if !cargo().args(["build", "--locked", "-p", "girandole-app"]).status()?.success() {
        bail!("the program does not build");
    }
    let program = built("debug", "girandole")?;
    let display = Display::with_screen("1600x1000x24")?;
    files::run(&program, &display).context("files")?;
    let session = Session::start(&program, &display, "pillars")?;
    let first = session.shot("shot.png")?;
    moves_an_object(&session, &first).context("moving an object")?;
    walks(&session).context("walking")?;
    plays(&session).context("playing")?;
    copies_the_command(&session, &program).context("copying the command")?;
    resizes(&session).context("resizing")?;
    session.quit()?;
    editing::run(&program, &display)?;
    refines(&program, &display).context("refining")?;
    compares(&program, &display).context("comparing")?;
    changes_controls(&program, &display).context("changing controls")?;
    loses_devices(&program, &display).context("losing a device")?;
    for room in ROOMS {
        let session = Session::start(&program, &display, room)?;
        session.shot("shot.png")?;
        session.quit()?;
    }
    let flats = Path::new("../shared/truth/flats/scene.glb");
    if let Ok(flats) = flats.canonicalize() {
        let session = Session::start(&program, &display, &flats.to_string_lossy())?;
        session.shot("shot.png")?;
        session.quit()?;
    } else {
        println!("{} is not there: no scene from a file was opened", flats.display());
    }
    println!(
        "the window opened scenes, moved an object, walked, looked, played, copied its command line, was resized, edited and undone, refined, \
         compared it with the truth, showed each debug view, had each control of its panel touched, lost its device and got another one, \
         missed no input while a scene opened, opened and saved files, fitted small screens, and closed without error"
    );
    Ok(ExitCode::SUCCESS)
}

/// Shows each debug view, then the path tracer's picture beside the other one, then the naive mode's.
fn compares(program: &Path, display: &Display) -> Result<()> {
    let session = Session::start_with(program, display, "table", &["--stats", "times.json"])?;
    let mut shots = vec![session.shot("shot.png")?];
    for view in 2..=DEBUG_VIEWS {
        session.xdotool("key v sleep 0.5")?;
        shots.push(session.shot(&format!("shot-{view}.png"))?);
    }
    for (i, a) in shots.iter().enumerate() {
        ensure!(shots[..i].iter().all(|b| a != b), "debug view {i} shows what another one does");
    }
    session.xdotool("key v sleep 2 key t sleep 10 key t sleep 10")?;
    session.close()?;
    let times: serde_json::Value = serde_json::from_slice(&std::fs::read(session.path("times.json"))?)?;
    let flip = times["truth_flip"].as_f64().context("the picture was compared with nothing")?;
    let energy = times["truth_energy_ratio"].as_f64().unwrap_or_default();
    ensure!(flip < 0.05 && (energy - 1.0).abs() < 0.02, "naive: FLIP {flip}, energy {energy}");
    ensure!(times["first_picture_ms"].as_f64() <= times["first_full_picture_ms"].as_f64(), "{times}");
    Ok(())
}

/// Clicks and drags all over the panel, from top to bottom: nothing that it offers ends the program.
fn changes_controls(program: &Path, display: &Display) -> Result<()> {
    let session = Session::start(program, display, "gap")?;
    session.shot("shot.png")?;
    let [x, height] = [SIZE[0] + 150, SIZE[1]];
    for page in 0..5 {
        for y in (12..height).step_by(18) {
            let at = format!("mousemove {x} {y} sleep 0.05");
            session.xdotool(&format!("{at} mousedown 1 mousemove_relative 6 0 sleep 0.05 mouseup 1"))?;
            session.xdotool("key Escape key Return sleep 0.05")?;
        }
        session.xdotool(&format!("mousemove {x} {} click --repeat 6 5 sleep 0.3", height / 2 + page))?;
    }
    let end = session.close()?;
    ensure!(!end.contains("panicked"), "{end}");
    Ok(())
}

/// At rest, the picture is that of more and more light sets: to the byte what `girandole render` makes of as many.
fn refines(program: &Path, display: &Display) -> Result<()> {
    let session = Session::start_with(program, display, "table", &["--refine"])?;
    let start = Instant::now();
    let mut shots = 0;
    let (bytes, sets) = loop {
        shots += 1;
        let name = if shots == 1 { "shot.png".into() } else { format!("shot-{shots}.png") };
        session.shot(&name)?;
        let bytes = std::fs::read(session.path(&name))?;
        let said = session.said();
        let sets = said.lines().find_map(|line| {
            line.strip_prefix(&format!("wrote {name}, the average of "))?.strip_suffix(" light sets")
        });
        if let Some(sets) = sets {
            break (bytes, sets.to_owned());
        }
        ensure!(start.elapsed() < PATIENCE, "nothing is refined: {said}");
        sleep(Duration::from_secs(1));
    };
    let size = format!("{}x{}", SIZE[0], SIZE[1]);
    let render = |sets: &str, name: &str| -> Result<Vec<u8>> {
        let mut command = Command::new(program);
        command.args(["render", "table", "--lights", "48", "--size", &size, "--refine", sets, "-o", name]);
        let done = command.current_dir(&session.folder).stderr(Stdio::null()).status()?;
        ensure!(done.success(), "girandole render --refine {sets} failed");
        Ok(std::fs::read(session.path(name))?)
    };
    ensure!(render(&sets, "refined.png")? == bytes, "the window's {sets} sets are not those of the program");
    ensure!(render("1", "one.png")? != bytes, "one set is as good as {sets}");
    session.quit()
}

/// After a device was lost there is another one, with the same picture; one that is lost again at once ends the program.
fn loses_devices(program: &Path, display: &Display) -> Result<()> {
    let session = Session::start_with(program, display, "table", &["--lose-device", "8"])?;
    let before = session.shot("shot.png")?;
    let line = session.wait_for_line("the GPU's device was lost")?;
    ensure!(session.shot("shot-2.png")? == before, "another device shows another picture");
    let said = session.close()?;
    let complaint = said.lines().find(|said| !said.starts_with("wrote ") && *said != line);
    ensure!(complaint.is_none(), "the program says: {said}");

    let session = Session::start_with(program, display, "table", &["--lose-device", "4,6"])?;
    let start = Instant::now();
    loop {
        if let Some(status) = session.program.borrow_mut().try_wait()? {
            let said = session.said();
            let is_well =
                status.code() == Some(2) && said.contains("error: the GPU failed: the device was lost");
            ensure!(is_well, "a device that is lost again ends the program with {status}: {said}");
            return Ok(());
        }
        ensure!(start.elapsed() < PATIENCE, "a device that is lost again and again does not end the program");
        sleep(Duration::from_millis(50));
    }
}

fn walks(session: &Session) -> Result<()> {
    // The control: nothing happens by itself.
    let before = session.shot("shot-3.png")?;
    ensure!(session.shot("shot-4.png")? == before, "two pictures of the same differ");
    session.xdotool("keydown w sleep 1 keyup w")?;
    let walked = session.shot("shot-5.png")?;
    ensure!(walked != before, "W leads nowhere");
    session.drag("1", MIDDLE, [60, 20])?;
    let looked = session.shot("shot-6.png")?;
    ensure!(looked != walked, "a drag turns nothing");
    session.drag("3", MIDDLE, [-60, 0])?;
    ensure!(session.shot("shot-7.png")? != looked, "the right button orbits nothing");
    Ok(())
}

fn plays(session: &Session) -> Result<()> {
    let before = session.shot("shot-8.png")?;
    session.xdotool("key space sleep 2 key space sleep 1")?;
    ensure!(session.shot("shot-9.png")? != before, "motion does not play");
    Ok(())
}

/// What is on the screen is what the copied call renders, to the byte, after all that was done so far.
fn copies_the_command(session: &Session, program: &Path) -> Result<()> {
    session.xdotool("key F9 sleep 0.5")?;
    let line = session.wait_for_line("girandole render ")?;
    session.shot("shot-10.png")?;
    let picture = std::fs::read(session.path("shot-10.png"))?;
    let words = shlex::split(&line).context("the copied command line is not quoted")?;
    ensure!(words.iter().any(|w| w == "--view") && words.iter().any(|w| w == "--edits"), "{line}");
    std::fs::remove_file(session.path("shot.png"))?;
    let rendered = Command::new(program).args(&words[1..]).current_dir(&session.folder).output()?;
    ensure!(rendered.status.success(), "{line}: {}", String::from_utf8_lossy(&rendered.stderr));
    ensure!(std::fs::read(session.path("shot.png"))? == picture, "{line} renders another picture");
    Ok(())
}

/// Picks the torus and drags it by the disc in its middle.
fn moves_an_object(session: &Session, before: &[u8]) -> Result<()> {
    session.xdotool(&format!("mousemove {} {} sleep 0.2 click 1 sleep 1", TORUS[0], TORUS[1] - 23))?;
    session.drag("1", TORUS, [60, 10])?;
    session.xdotool("key Escape")?;
    ensure!(session.shot("shot-2.png")? != before, "neither the torus nor the view moves");
    Ok(())
}

fn resizes(session: &Session) -> Result<()> {
    let window = &session.window;
    for size in ["600 300", "1 1", "900 500"] {
        session.xdotool(&format!("windowsize {window} {size} sleep 0.5"))?;
    }
    session.xdotool(&format!(
        "windowunmap {window} sleep 0.5 windowmap {window} sleep 0.5 windowfocus {window}"
    ))?;
    session.xdotool(&format!("mousemove {} {} key F12", MIDDLE[0], MIDDLE[1]))?;
    let bytes = session.wait_for("shot-11.png")?;
    let resized = png_size(&bytes)?;
    // The bar takes the rest.
    ensure!(
        (460..500).contains(&resized[1]) && resized != SIZE,
        "the picture is {resized:?} after the window was resized"
    );
    Ok(())
}

/// A display without a screen.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn with_screen(screen: &str) -> Result<Self> {
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", screen, "-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .context("Xvfb does not start; on Debian or Ubuntu: apt-get install xvfb xdotool")?;
        let mut number = String::new();
        if let Some(out) = server.stdout.take() {
            BufReader::new(out).read_line(&mut number)?;
        }
        ensure!(!number.trim().is_empty(), "Xvfb has no display");
        Ok(Self { server, name: format!(":{}", number.trim()) })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// A window, and what is done in it.
struct Session<'d> {
    program: std::cell::RefCell<Child>,
    display: &'d Display,
    window: String,
    folder: tempfile::TempDir,
}

impl<'d> Session<'d> {
    fn start(program: &Path, display: &'d Display, scene: &str) -> Result<Self> {
        Self::start_with(program, display, scene, &[])
    }

    fn start_with(program: &Path, display: &'d Display, scene: &str, options: &[&str]) -> Result<Self> {
        let folder = tempfile::tempdir()?;
        let size = &format!("{}x{}", SIZE[0], SIZE[1]);
        let program = Command::new(program)
            .args(["view", scene, "--lights", "48", "-o", "shot.png", "--own-dialogs"])
            .args(["--size", size].iter().filter(|_| !options.contains(&"--size")))
            .args(options)
            .env("DISPLAY", &display.name)
            .env("XDG_CONFIG_HOME", folder.path().join("settings"))
            .env_remove("WAYLAND_DISPLAY")
            .current_dir(&folder)
            .stderr(std::fs::File::create(folder.path().join("said"))?)
            .spawn()?;
        let mut session = Self { program: program.into(), display, window: String::new(), folder };
        session.window = session.find()?;
        session.xdotool(&format!(
            "windowfocus --sync {} mousemove {} {}",
            session.window, MIDDLE[0], MIDDLE[1]
        ))?;
        Ok(session)
    }

    /// Waits for the window.
    fn find(&self) -> Result<String> {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            let found = self.tool("search --onlyvisible --name Girandole").output()?;
            if let Some(id) = String::from_utf8_lossy(&found.stdout).split_whitespace().next() {
                return Ok(id.into());
            }
            self.check_alive()?;
            sleep(Duration::from_millis(100));
        }
        bail!("no window opens")
    }

    fn tool(&self, arguments: &str) -> Command {
        let mut command = Command::new("xdotool");
        command.args(arguments.split_whitespace()).env("DISPLAY", &self.display.name);
        command
    }

    fn xdotool(&self, arguments: &str) -> Result<()> {
        let status = self.tool(arguments).status().context("xdotool does not start; install it")?;
        ensure!(status.success(), "xdotool {arguments} failed");
        self.check_alive()
    }

    /// Drags, in steps.
    fn drag(&self, button: &str, from: [u32; 2], by: [i32; 2]) -> Result<()> {
        let step = format!("mousemove_relative -- {} {} sleep 0.05", by[0] / 5, by[1] / 5);
        self.xdotool(&format!("mousemove {} {} sleep 0.3 mousedown {button}", from[0], from[1]))?;
        (0..5).try_for_each(|_| self.xdotool(&step))?;
        self.xdotool(&format!("mouseup {button} sleep 0.5"))
    }

    /// Saves the picture: it has the size that was asked for, and shows something. Returns its pixels, without what it was made by.
    fn shot(&self, name: &str) -> Result<Vec<u8>> {
        self.xdotool("key F12")?;
        let bytes = self.wait_for(name)?;
        ensure!(png_size(&bytes)? == SIZE, "{name} is {:?} instead of {SIZE:?}", png_size(&bytes)?);
        // One colour takes less than a twentieth of a byte a pixel.
        let pixels = SIZE[0] as usize * SIZE[1] as usize;
        ensure!(bytes.len() > pixels / 20, "{name} shows nothing: it has {} bytes", bytes.len());
        pixels_of(&bytes)
    }

    /// A file that is there as a whole.
    fn wait_for(&self, name: &str) -> Result<Vec<u8>> {
        let (start, path) = (Instant::now(), self.path(name));
        while start.elapsed() < PATIENCE {
            if path.exists() {
                return Ok(std::fs::read(path)?);
            }
            self.check_alive()?;
            sleep(Duration::from_millis(50));
        }
        bail!("{name} is not saved")
    }

    /// Waits until the window's title begins so.
    fn wait_for_title(&self, beginning: &str) -> Result<()> {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            let title = self.tool(&format!("getwindowname {}", self.window)).output()?;
            if title.stdout.starts_with(beginning.as_bytes()) {
                return Ok(());
            }
            self.check_alive()?;
            sleep(Duration::from_millis(50));
        }
        bail!("the window is not called {beginning}")
    }

    /// A line that the program says.
    fn wait_for_line(&self, beginning: &str) -> Result<String> {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Some(line) = self.said().lines().find(|line| line.starts_with(beginning)) {
                return Ok(line.into());
            }
            self.check_alive()?;
            sleep(Duration::from_millis(50));
        }
        bail!("the program does not say {beginning}: {}", self.said())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn said(&self) -> String {
        std::fs::read_to_string(self.path("said")).unwrap_or_default()
    }

    fn check_alive(&self) -> Result<()> {
        match self.program.borrow_mut().try_wait()? {
            Some(status) => bail!("the program ended ({status}): {}", self.said()),
            None => Ok(()),
        }
    }

    /// Closes the window: the program ends well, and has nothing to complain of.
    fn quit(self) -> Result<()> {
        let said = self.close()?;
        let complaint =
            said.lines().find(|line| !["wrote ", "girandole render "].iter().any(|b| line.starts_with(b)));
        ensure!(complaint.is_none(), "the program says: {said}");
        Ok(())
    }

    /// Closes the window: the program ends well. Returns what it said.
    fn close(&self) -> Result<String> {
        let _ = self.tool("key ctrl+q").status()?;
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Some(status) = self.program.borrow_mut().try_wait()? {
                let said = self.said();
                ensure!(status.success(), "the program ended with {status}: {said}");
                return Ok(said);
            }
            sleep(Duration::from_millis(50));
        }
        bail!("Ctrl Q does not close the window")
    }
}

impl std::ops::Drop for Session<'_> {
    fn drop(&mut self) {
        let program = self.program.get_mut();
        let _ = program.kill();
        let _ = program.wait();
    }
}

/// Width and height, from a .png's header.
/// The part of a PNG file from its pixels on.
fn pixels_of(bytes: &[u8]) -> Result<Vec<u8>> {
    let start = bytes.windows(4).position(|chunk| chunk == b"IDAT").context("a PNG file without pixels")?;
    Ok(bytes[start..].into())
}

fn png_size(bytes: &[u8]) -> Result<[u32; 2]> {
    let number = |at: usize| Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let is_png = bytes.starts_with(b"\x89PNG\r\n\x1a\n");
    number(16).zip(number(20)).filter(|_| is_png).map(|(w, h)| [w, h]).context("this is no .png")
}
