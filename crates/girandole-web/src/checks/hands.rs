//! What people do to the page: look, walk, pinch, drop files, come back by a link.

use super::page::{self, PATIENCE, is_shown, settled, settles_again};
use super::{board, called};
use crate::browser::{Button, Key, Tab, View};
use crate::difference::{Picture, difference};
use crate::package::Part;
use crate::test::{Bench, Check};
use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::time::Duration;

/// All of them.
pub const CHECKS: &[Check] = &[
    Check { name: "hands/desktop-and-phone", needs: &[Part::Page], run: sizes },
    Check { name: "hands/the-panel-changes-lights", needs: &[Part::Page], run: panel },
    Check { name: "hands/links-show-the-same", needs: &[Part::Page], run: links },
    Check { name: "hands/fingers-look-and-pinch-and-walk", needs: &[Part::Page], run: fingers },
    Check { name: "hands/files-are-dropped", needs: &[Part::Page], run: files },
    Check { name: "hands/pictures-are-downloads", needs: &[Part::Page], run: downloads },
    Check { name: "hands/a-lost-device-is-opened-again", needs: &[Part::Page], run: loss },
];

/// A frame of a software device takes no longer, as a rule.
const FRAME: Duration = Duration::from_millis(400);
const DESKTOP: View = View { size: [1024, 640], pixel_ratio: 1.0, mobile: false };
/// Of the panel there, where it says `Light samples`; and what is left of the panel, and above the bar.
const KNOB: [f64; 2] = [864.0, 482.0];
const BESIDE_PANEL: [u32; 2] = [700, 610];
const QUICK: &str = "?scene=pillars&lights=16&mode=naive";

fn sizes(bench: &Bench) -> Result<()> {
    let phone = View { size: [390, 700], pixel_ratio: 1.0, mobile: true };
    let dense = View { size: [300, 440], pixel_ratio: 2.0, mobile: true };
    let tabs = [
        ("desktop", DESKTOP, bench.open(QUICK, &DESKTOP)?),
        ("phone", phone, bench.open(QUICK, &phone)?),
        ("dense-phone", dense, bench.open_dense(QUICK, &dense)?),
    ];
    for (name, view, tab) in tabs {
        settled(&tab)?;
        let pixels = view.size.map(|points| f64::from(points) * view.pixel_ratio);
        let canvas = tab
            .evaluate("[document.querySelector('canvas').width, document.querySelector('canvas').height]")?;
        ensure!(
            canvas == serde_json::json!(pixels.map(|pixels| pixels as u32)),
            "the canvas has {canvas} pixels"
        );
        let shot = bench.keep(&format!("{name}.png"), tab.screenshot()?)?;
        let colors: std::collections::BTreeSet<_> = Picture::decode(&shot)?.pixels.into_iter().collect();
        ensure!(colors.len() > 1000, "the {name} shows {} colours", colors.len());
    }
    Ok(())
}

/// The knob of how many there are is drawn to the right.
fn panel(bench: &Bench) -> Result<()> {
    let tab = bench.open(QUICK, &DESKTOP)?;
    settled(&tab)?;
    let before = tab.screenshot()?;
    settles_again(&tab, || {
        tab.mouse_move(KNOB)?;
        tab.mouse_press(KNOB, Button::Left)?;
        std::thread::sleep(FRAME);
        tab.mouse_move([KNOB[0] + 8.0, KNOB[1]])?;
        std::thread::sleep(FRAME);
        tab.mouse_release([KNOB[0] + 8.0, KNOB[1]], Button::Left)
    })?;
    // Without the hint about what is under the pointer.
    tab.mouse_move([20.0, f64::from(DESKTOP.size[1]) - 10.0])?;
    std::thread::sleep(2 * FRAME);
    let shown = bench.keep("more-lights.png", tab.screenshot()?)?;
    let link = tab.evaluate("location.search")?;
    let link = link.as_str().context("the page has no address")?;
    let count = link.split(['?', '&']).find_map(|part| part.strip_prefix("lights=")?.parse::<u32>().ok());
    ensure!(count.is_some_and(|count| count > 16 && count < 100), "after the knob was drawn: {link}");
    let again = bench.open(link, &DESKTOP)?;
    settled(&again)?;
    let of_room = |screenshot: &[u8]| {
        Picture::decode(screenshot)?.cut(BESIDE_PANEL).context("the screenshot is too small")?.encode()
    };
    let shown = of_room(&shown)?;
    ensure!(difference(&of_room(&before)?, &shown)?.mean > 0.5, "more samples change nothing");
    let found = difference(&shown, &of_room(&again.screenshot()?)?)?;
    ensure!(found.max == 0, "the link shows another picture: {found:?}");
    Ok(())
}

fn links(bench: &Bench) -> Result<()> {
    let tab = bench.open(QUICK, &page::view())?;
    settled(&tab)?;
    let before = tab.screenshot()?;
    settles_again(&tab, || {
        tab.mouse_move([200.0, 100.0])?;
        tab.mouse_press([200.0, 100.0], Button::Left)?;
        std::thread::sleep(FRAME);
        tab.mouse_move([230.0, 110.0])?;
        std::thread::sleep(FRAME);
        tab.mouse_move([260.0, 110.0])?;
        std::thread::sleep(FRAME);
        tab.mouse_release([260.0, 110.0], Button::Left)
    })?;
    settles_again(&tab, || {
        tab.key_down(Key::Character('w'))?;
        std::thread::sleep(Duration::from_millis(600));
        tab.key_up(Key::Character('w'))
    })?;
    // Without the name of what is under the pointer.
    tab.mouse_move([20.0, f64::from(page::PICTURE[1]) + 10.0])?;
    std::thread::sleep(2 * FRAME);
    let shown = bench.keep("walked.png", tab.screenshot()?)?;
    ensure!(difference(&before, &shown)?.mean > 2.0, "neither drag nor key changes the picture");
    let link = tab.evaluate("location.search")?;
    let link = link.as_str().context("the page has no address")?;
    ensure!(link.contains("view="), "the address does not tell the view: {link}");
    let again = bench.open(link, &page::view())?;
    settled(&again)?;
    let found = difference(&shown, &bench.keep("linked.png", again.screenshot()?)?)?;
    ensure!(found.max == 0, "the link shows another picture: {found:?}");
    Ok(())
}

fn fingers(bench: &Bench) -> Result<()> {
    let phone = View { size: [390, 500], pixel_ratio: 1.0, mobile: true };
    let tab = bench.open(QUICK, &phone)?;
    settled(&tab)?;
    let mut last = eye_and_target(&tab)?;
    let mut moved = |what: &str, turns: bool, touch: &dyn Fn() -> Result<()>| -> Result<()> {
        settles_again(&tab, touch)?;
        let now = eye_and_target(&tab)?;
        bench.keep(&format!("{what}.png"), tab.screenshot()?)?;
        let has_moved = last.as_ref().is_none_or(|last| last[..3] != now.as_ref().unwrap_or(last)[..3]);
        ensure!(now != last && (turns || has_moved), "{what} leads from {last:?} to {now:?}");
        last = now;
        Ok(())
    };
    moved("one-finger", true, &|| touch(&tab, &[&[[200.0, 200.0]], &[[230.0, 205.0]], &[[260.0, 210.0]]]))?;
    moved("two-fingers", false, &|| {
        let steps = [
            [[150.0, 200.0], [250.0, 200.0]],
            [[130.0, 210.0], [270.0, 210.0]],
            [[110.0, 220.0], [290.0, 220.0]],
        ];
        touch(&tab, &steps.each_ref().map(<[[f64; 2]; 2]>::as_slice))
    })?;
    moved("stick", false, &|| {
        let center = [64.0, 500.0 - 26.0 - 64.0];
        touch(&tab, &[&[center], &[[center[0], center[1] - 20.0]], &[[center[0], center[1] - 40.0]]])
    })
}

/// Fingers that are put down, moved from one place to the next, and lifted.
fn touch(tab: &Tab<'_>, steps: &[&[[f64; 2]]]) -> Result<()> {
    for (index, fingers) in steps.iter().enumerate() {
        if index == 0 {
            tab.touch_start(fingers)?
        } else {
            tab.touch_move(fingers)?
        }
        std::thread::sleep(FRAME);
    }
    tab.touch_end()
}

/// The six numbers of the view in the address; none at first.
fn eye_and_target(tab: &Tab<'_>) -> Result<Option<Vec<f64>>> {
    let view = tab.evaluate("new URLSearchParams(location.search).get('view')")?;
    let Value::String(view) = view else { return Ok(None) };
    Ok(Some(view.split(',').take(6).map(str::parse).collect::<Result<_, _>>()?))
}

fn files(bench: &Bench) -> Result<()> {
    let room = bench.folder.path().join("gap.glb");
    called(bench, &["export", "gap", "-o", &room.to_string_lossy()])?;
    let tab = bench.open(QUICK, &page::view())?;
    settled(&tab)?;
    settles_again(&tab, || tab.drop_files([100.0, 100.0], &[&room]))?;
    let options = ["--lights", "16", "--mode", "naive", "--aa", "off"];
    is_shown(bench, &tab, &[&[&*room.to_string_lossy()], &options[..]].concat())?;

    let files = board::files()?.map(|(name, bytes)| bench.file(name, bytes));
    let [model, materials, texture] = files;
    let (model, materials, texture) = (model?, materials?, texture?);
    settles_again(&tab, || tab.drop_files([100.0, 100.0], &[&texture, &materials, &model]))?;
    let shown = is_shown(bench, &tab, &[&[&*model.to_string_lossy()], &options[..]].concat())?;
    has_texture(&shown)?;

    // With its picture in it.
    let whole = bench.folder.path().join("board.glb");
    called(bench, &["export", &model.to_string_lossy(), "-o", &whole.to_string_lossy()])?;
    settles_again(&tab, || tab.drop_files([100.0, 100.0], &[&whole]))?;
    let shown = is_shown(bench, &tab, &[&[&*whole.to_string_lossy()], &options[..]].concat())?;
    has_texture(&shown)
}

/// Whether the board's texture is seen.
fn has_texture(shown: &[u8]) -> Result<()> {
    let of_texture = |[r, g, b]: &&[u8; 3]| r.abs_diff(*b) > 40 && g < r.max(b);
    let count = Picture::decode(shown)?.pixels.iter().filter(of_texture).count();
    ensure!(count > 500, "{count} pixels have the texture's colours");
    Ok(())
}

fn downloads(bench: &Bench) -> Result<()> {
    let tab = bench.open(QUICK, &page::view())?;
    settled(&tab)?;
    let catch = "(page.save = (name, bytes) => { globalThis.saved = [name, [...bytes.slice(1, 4)]] }, 1)";
    tab.evaluate(catch)?;
    tab.press(Key::Named("F12"))?;
    tab.wait_until("globalThis.saved != null", Duration::from_secs(20))?;
    let saved = tab.evaluate("saved")?;
    ensure!(saved == serde_json::json!(["girandole.png", b"PNG"]), "{saved} is saved");
    Ok(())
}

fn loss(bench: &Bench) -> Result<()> {
    let query = format!("{QUICK}&lose-device=25");
    let tab = bench.open(&query, &page::view())?;
    settled(&tab)?;
    let before = tab.screenshot()?;
    let again = tab.wait_until("performance.getEntriesByName('settled').length > 1", PATIENCE);
    bench.keep("lost.png", tab.screenshot()?)?;
    again?;
    let console = tab.console()?.join("\n");
    ensure!(console.contains("opened again"), "the device was not lost: {console}");
    let found = difference(&before, &tab.screenshot()?)?;
    ensure!(found.max == 0, "the picture is another one: {found:?}");
    Ok(())
}
