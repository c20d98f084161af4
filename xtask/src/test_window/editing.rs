//! Edits by keys and mouse: each is undone and done again to the byte, and fifty of them are.

use super::{Display, MIDDLE, PATIENCE, SIZE, Session, TORUS, pixels_of};
use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// From the torus's middle, which is a hole, to its tube.
const TUBE: u32 = 23;
/// On the back wall, beside the torus.
const WALL: [u32; 2] = [240, 70];
/// From the middle of what is picked to the handle that scales it.
const CORNER: [u32; 2] = [17, 17];
const EDITS: usize = 50;

/// Pictures of one window, numbered.
struct Shots<'a, 'd> {
    session: &'a Session<'d>,
    count: std::cell::Cell<usize>,
}

impl Shots<'_, '_> {
    fn next(&self) -> Result<Vec<u8>> {
        let count = self.count.get() + 1;
        self.count.set(count);
        let name = if count == 1 { "shot.png".into() } else { format!("shot-{count}.png") };
        self.session.shot(&name)
    }

    fn is(&self, expected: &[u8], what: &str) -> Result<()> {
        ensure!(self.next()? == expected, "{what}: it is another picture");
        Ok(())
    }

    fn differs(&self, from: &[u8], what: &str) -> Result<Vec<u8>> {
        let picture = self.next()?;
        ensure!(picture != from, "{what}: the picture is the same");
        Ok(picture)
    }
}

/// All of it, in windows of their own.
pub(super) fn run(program: &Path, display: &Display) -> Result<()> {
    edits(program, display).context("editing")?;
    undoes_fifty(program, display).context("undoing fifty edits")
}

fn edits(program: &Path, display: &Display) -> Result<()> {
    let session = Session::start(program, display, "pillars")?;
    let shots = Shots { session: &session, count: 0.into() };
    let first = shots.next()?;
    // The control: nothing is undone where nothing was done.
    session.xdotool("key ctrl+z sleep 0.5")?;
    shots.is(&first, "nothing")?;
    picks(&session, [TORUS[0], TORUS[1] - TUBE])?;
    screen(&session, "picked")?;
    session.drag("1", TORUS, [60, 10])?;
    undone_and_done(&shots, &first, "a drag")?;
    // A drag that is given up, by the object and by the eye.
    picks(&session, [TORUS[0], TORUS[1] - TUBE])?;
    given_up(&session, TORUS)?;
    shots.is(&first, "a drag that was given up")?;
    session.xdotool("key Escape")?;
    given_up(&session, WALL)?;
    shots.is(&first, "a look that was given up")?;
    picks(&session, [TORUS[0], TORUS[1] - TUBE])?;
    session.drag("1", [TORUS[0] + CORNER[0], TORUS[1] - CORNER[1]], [40, -40])?;
    screen(&session, "scaled")?;
    undone_and_done(&shots, &first, "scaling")?;
    for (key, what) in [("Delete", "deleting"), ("ctrl+d", "duplicating")] {
        picks(&session, [TORUS[0], TORUS[1] - TUBE])?;
        session.xdotool(&format!("key {key} sleep 1"))?;
        screen(&session, what)?;
        undone_and_done(&shots, &first, what)?;
    }
    // A wall is picked, but neither deleted nor dragged, unless it is asked for.
    picks(&session, WALL)?;
    screen(&session, "wall")?;
    session.xdotool("key Delete sleep 0.5")?;
    shots.is(&first, "a wall that was hit by accident")?;
    session.xdotool(&format!("mousemove {} {} click --repeat 2 --delay 60 1 sleep 0.5", WALL[0], WALL[1]))?;
    session.xdotool("key Delete sleep 1")?;
    undone_and_done(&shots, &first, "a wall that was asked for")?;
    lamps(&session, &shots, &first)?;
    bookmarks(&session, &shots)?;
    session.quit()
}

/// Clicks something, without a double click.
fn picks(session: &Session, [x, y]: [u32; 2]) -> Result<()> {
    session.xdotool(&format!("key Escape sleep 0.5 mousemove {x} {y} sleep 0.3 click 1 sleep 0.7"))
}

/// Begins a drag, and gives it up by Escape before the button is let go.
fn given_up(session: &Session, [x, y]: [u32; 2]) -> Result<()> {
    session.xdotool(&format!("mousemove {x} {y} sleep 0.3 mousedown 1"))?;
    (0..4).try_for_each(|_| session.xdotool("mousemove_relative 12 6 sleep 0.1"))?;
    session.xdotool("key Escape sleep 0.3 mousemove_relative 20 5 sleep 0.2 mouseup 1 sleep 0.5")
}

/// What was done changes the picture, Ctrl Z takes it back, Ctrl Y does it again, and it is taken back in the end.
fn undone_and_done(shots: &Shots, first: &[u8], what: &str) -> Result<()> {
    let session = shots.session;
    session.xdotool("key Escape sleep 0.3")?;
    let after = shots.differs(first, what)?;
    session.xdotool("key ctrl+z sleep 0.5")?;
    shots.is(first, &format!("{what}, undone"))?;
    session.xdotool("key ctrl+y sleep 0.5")?;
    shots.is(&after, &format!("{what}, done again"))?;
    session.xdotool("key ctrl+z sleep 0.3 key ctrl+shift+z sleep 0.3 key ctrl+z sleep 0.5")?;
    shots.is(first, &format!("{what}, undone again"))
}

/// Lamps of all kinds shine, can be moved, and are dark when they are switched off.
fn lamps(session: &Session, shots: &Shots, first: &[u8]) -> Result<()> {
    for (key, what) in [("l", "a point lamp"), ("shift+l", "a spot"), ("p", "a panel")] {
        session.xdotool(&format!("key Escape sleep 0.3 key {key} sleep 1"))?;
        let added = shots.differs(first, what)?;
        session.drag("1", MIDDLE, [50, -50])?;
        screen(session, what)?;
        let lit = shots.differs(&added, &format!("{what}, moved"))?;
        session.xdotool("key o sleep 1")?;
        let off = shots.differs(&lit, &format!("{what}, switched off"))?;
        ensure!(what == "a panel" || off == *first, "{what}: it shines though it is off");
        session.xdotool("key o sleep 1")?;
        shots.is(&lit, &format!("{what}, on again"))?;
        session.xdotool("key --repeat 4 --delay 150 ctrl+z sleep 0.5")?;
        shots.is(first, &format!("{what}, undone"))?;
    }
    Ok(())
}

/// A bookmark comes back to the same view, wherever one has gone.
fn bookmarks(session: &Session, shots: &Shots) -> Result<()> {
    session
        .xdotool("key Escape keydown w sleep 0.6 keyup w sleep 0.3 key ctrl+1 sleep 0.3 key 1 sleep 0.3")?;
    let kept = shots.next()?;
    session.xdotool("keydown d sleep 0.6 keyup d sleep 0.3")?;
    shots.differs(&kept, "walking away")?;
    session.xdotool("key 1 sleep 0.3")?;
    shots.is(&kept, "a bookmark")
}

/// Random numbers that are the same each time.
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % end
    }
}

/// Fifty random edits, undone: the first picture, to the byte; and what the copied call renders before that is what
/// was seen.
fn undoes_fifty(program: &Path, display: &Display) -> Result<()> {
    let session = Session::start(program, display, "pillars")?;
    let shots = Shots { session: &session, count: 0.into() };
    let first = shots.next()?;
    let first_file = std::fs::read(session.path("shot.png"))?;
    let mut dice = Dice(34);
    let mut torus = TORUS;
    for _ in 0..EDITS {
        edit(&shots, &mut dice, &mut torus)?;
    }
    session.xdotool("key Escape sleep 1")?;
    let last = shots.differs(&first, "fifty edits")?;
    screen(&session, "fifty")?;
    session.xdotool("key F9 sleep 0.5")?;
    let line = session.wait_for_line("girandole render ")?;
    renders(program, &session, &line, &last)?;
    session.xdotool(&format!("key --repeat {} --delay 60 ctrl+z sleep 1", 2 * EDITS))?;
    screen(&session, "undone")?;
    shots.is(&first, "fifty edits, undone")?;
    // Files also say what scene they show.
    let file = std::fs::read(session.path(&format!("shot-{}.png", shots.count.get())))?;
    ensure!(file == first_file, "fifty edits, undone: the file says that it shows something else");
    session.xdotool(&format!("key --repeat {} --delay 60 ctrl+y sleep 1", 2 * EDITS))?;
    shots.is(&last, "fifty edits, done again")?;
    session.quit()
}

/// The call renders this picture, to the byte, by a list of many edits.
fn renders(program: &Path, session: &Session, line: &str, picture: &[u8]) -> Result<()> {
    let words = shlex::split(line).context("the copied command line is not quoted")?;
    let edits = words.iter().position(|word| word == "--edits").and_then(|at| words.get(at + 1));
    let edits = std::fs::read_to_string(session.path(edits.context("there are no edits")?))?;
    let count = edits.lines().filter(|line| line.starts_with("    {")).count();
    ensure!(count >= EDITS / 2, "there are {count} edits");
    std::fs::remove_file(session.path("shot.png"))?;
    let rendered = Command::new(program).args(&words[1..]).current_dir(&session.folder).output()?;
    ensure!(rendered.status.success(), "{line}: {}", String::from_utf8_lossy(&rendered.stderr));
    ensure!(
        pixels_of(&std::fs::read(session.path("shot.png"))?)? == picture,
        "{line} renders another picture"
    );
    Ok(())
}

fn edit(shots: &Shots, dice: &mut Dice, torus: &mut [u32; 2]) -> Result<()> {
    let session = shots.session;
    let by = [(dice.below(9) as i32 - 4) * 10, (dice.below(7) as i32 - 3) * 10];
    let key = |key: &str| session.xdotool(&format!("key {key} sleep 0.3"));
    match dice.below(8) {
        0 | 1 => {
            picks(session, [torus[0], torus[1] - TUBE])?;
            // What is dragged has to be there: else the view would turn.
            shots.next()?;
            session.drag("1", *torus, by)?;
            *torus = [0, 1].map(|i| torus[i].saturating_add_signed(by[i]));
            Ok(())
        }
        2 => key("ctrl+d"),
        3 => key("o"),
        4 => key("ctrl+3"),
        5 => key("l"),
        6 => key(if dice.below(2) == 0 { "shift+l" } else { "p" }),
        _ => {
            key("l")?;
            shots.next()?;
            session.drag("1", MIDDLE, by)?;
            if dice.below(2) == 0 { key("Delete") } else { Ok(()) }
        }
    }
}

/// Keeps the window as it is seen, for whoever wants to look: in the folder that `SCREENS` names.
fn screen(session: &Session, name: &str) -> Result<()> {
    let Some(folder) = std::env::var_os("SCREENS") else { return Ok(()) };
    std::fs::create_dir_all(&folder)?;
    let path = Path::new(&folder).join(format!("{}.png", name.replace([' ', ','], "-")));
    let start = Instant::now();
    let taken = Command::new("import")
        .args(["-window", &session.window])
        .arg(&path)
        .env("DISPLAY", &session.display.name)
        .status()
        .context("import does not start; it belongs to ImageMagick")?;
    ensure!(taken.success() && start.elapsed() < PATIENCE, "the window of {SIZE:?} cannot be taken");
    Ok(())
}
