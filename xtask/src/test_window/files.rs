//! Files: scenes that are opened beside, dialogs, edits that are saved and loaded, scenes that are written; and small screens.

use super::{Display, MIDDLE, PATIENCE, Session, TORUS, pixels_of, png_size};
use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// A triangle that shines.
const TRIANGLE: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
    "materials":[{"emissiveFactor":[1,1,1],"doubleSided":true}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,
    "uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

pub(super) fn run(program: &Path, display: &Display) -> Result<()> {
    misses_no_input(program, display).context("input while a scene opens")?;
    opens_and_saves(program, display).context("opening and saving")?;
    fits_small_screens(program).context("small screens")
}

/// The window is there before its scene, and what is done to it meanwhile counts.
fn misses_no_input(program: &Path, display: &Display) -> Result<()> {
    let start = Instant::now();
    let session = Session::start_with(program, display, "table", &["--slow-opening", "8"])?;
    // Two debug views on, and a picture: all of it long before there is a scene.
    session.xdotool("key v key v key F12")?;
    ensure!(start.elapsed() < Duration::from_secs(8), "the window waits for its scene");
    ensure!(!session.path("shot.png").exists(), "there is a picture before there is a scene");
    let early = pixels_of(&session.wait_for("shot.png")?)?;
    ensure!(start.elapsed() > Duration::from_secs(8), "the scene did not open slowly");
    let debug = session.shot("shot-2.png")?;
    ensure!(early == debug, "what was pressed while the scene opened is not what is shown");
    session.xdotool(&"key v sleep 0.3 ".repeat(super::DEBUG_VIEWS - 2))?;
    ensure!(
        session.shot("shot-3.png")? != debug,
        "the control: the picture is another one without the debug view"
    );
    session.quit()?;
    // Whoever wants no scene any more does not wait for it.
    let session = Session::start_with(program, display, "table", &["--slow-opening", "600"])?;
    session.xdotool("sleep 1")?;
    session.quit()
}

/// Moves the torus; saves that; opens another scene by the dialog; loads the edits again in another window, and writes the scene.
fn opens_and_saves(program: &Path, display: &Display) -> Result<()> {
    let session = Session::start(program, display, "pillars")?;
    let before = session.shot("shot.png")?;
    session.xdotool(&format!("mousemove {} {} sleep 0.2 click 1 sleep 1", TORUS[0], TORUS[1] - 23))?;
    session.drag("1", TORUS, [60, 10])?;
    session.xdotool("key Escape")?;
    let moved = session.shot("shot-2.png")?;
    ensure!(moved != before, "nothing was moved");
    let edits = session.path("moved.json");
    answer(&session, "ctrl+s", &edits)?;
    let text = String::from_utf8(session.wait_for("moved.json")?)?;
    ensure!(text.contains("set_transform"), "{text}");
    // Saved once more, where it was.
    std::fs::remove_file(&edits)?;
    session.xdotool("key ctrl+s")?;
    ensure!(session.wait_for("moved.json")? == text.as_bytes(), "other edits are saved the second time");
    let written = session.path("moved.glb");
    answer(&session, "ctrl+e", &written)?;
    session.wait_for("moved.glb")?;
    // Escape leaves a dialog, and the scene as it is.
    session.xdotool("key ctrl+o sleep 0.5 key Escape sleep 0.5")?;
    ensure!(session.shot("shot-3.png")? == moved, "a dialog that is left changes the picture");
    let triangle = session.path("triangle.gltf");
    std::fs::write(&triangle, TRIANGLE)?;
    answer(&session, "ctrl+o", &triangle)?;
    session.wait_for_title("triangle")?;
    session.xdotool("key F12")?;
    let opened = pixels_of(&session.wait_for("shot-4.png")?)?;
    ensure!(opened != moved, "the scene that was opened is not shown");
    let recent = std::fs::read_to_string(session.path("settings/girandole/recent.json"))?;
    ensure!(recent.contains("triangle.gltf"), "it is not remembered: {recent}");
    session.close()?;

    // The edits make the same picture again, and so does the file, but for its light samples: the path tracer has none.
    let size = format!("{}x{}", super::SIZE[0], super::SIZE[1]);
    let run = |arguments: &[&str]| -> Result<()> {
        let done = Command::new(program).args(arguments).current_dir(&session.folder).output()?;
        let said = [done.stdout, done.stderr].concat();
        ensure!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&said));
        Ok(())
    };
    let edited = ["render", "pillars", "--edits", "moved.json"];
    run(&[&edited[..], &["--lights", "48", "--size", &size, "-o", "edited.png"]].concat())?;
    ensure!(
        pixels_of(&std::fs::read(session.path("edited.png"))?)? == moved,
        "the edits that were saved make another picture"
    );
    let traced = ["--engine", "path", "--paths", "4", "--size", "96x72", "-o"];
    run(&[&edited[..], &traced, &["edited.exr"]].concat())?;
    run(&[&["render", "moved.glb"], &traced[..], &["written.exr"]].concat())?;
    run(&["compare", "edited.exr", "written.exr", "--max-flip", "0.01", "--max-energy-error", "0.001"])?;

    let again = Session::start(program, display, "pillars")?;
    again.shot("shot.png")?;
    answer(&again, "ctrl+l", &edits)?;
    again.xdotool("sleep 3")?;
    ensure!(again.shot("shot-2.png")? == moved, "edits that are loaded make another picture");
    again.quit()
}

/// Answers the dialog that a shortcut opens by a path.
fn answer(session: &Session, shortcut: &str, path: &Path) -> Result<()> {
    session.xdotool(&format!("key {shortcut} sleep 0.7 key ctrl+a"))?;
    session.xdotool(&format!("type --delay 12 {}", path.display()))?;
    session.xdotool("key Return sleep 0.3")
}

/// The picture is as large as the screen has room for.
fn fits_small_screens(program: &Path) -> Result<()> {
    for [width, height] in [[1024, 600], [800, 600]] {
        let display = Display::with_screen(&format!("{width}x{height}x24"))?;
        let session = Session::start_with(program, &display, "table", &["--size", "1024x768"])?;
        session.xdotool(&format!("mousemove {} {}", MIDDLE[0], MIDDLE[1]))?;
        let start = Instant::now();
        session.xdotool("key F12")?;
        let picture = png_size(&session.wait_for("shot.png")?)?;
        ensure!(start.elapsed() < PATIENCE, "no picture in time");
        let fits =
            picture[0] + 320 <= width && picture[1] + 26 <= height && picture[0] > 300 && picture[1] > 300;
        ensure!(fits, "on {width}x{height} the picture is {picture:?}");
        sleep(Duration::from_millis(100));
        session.quit()?;
    }
    Ok(())
}
