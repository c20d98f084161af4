//! The page shows what the program renders, whatever it is set to.

use super::board::{self, ADDRESS};
use super::page::{is_native, is_shown, picture, settled, settles_again, view};
use crate::browser::View;
use crate::difference::difference;
use crate::package::Part;
use crate::test::{Bench, Check};
use anyhow::{Result, ensure};

/// All of them.
pub const CHECKS: &[Check] = &[
    Check { name: "settings/multipass", needs: &[Part::Page], run: multipass },
    Check { name: "settings/anti-aliasing", needs: &[Part::Page], run: anti_aliasing },
    Check { name: "settings/transfer", needs: &[Part::Page], run: transfer },
    Check { name: "settings/textures-under-a-sky", needs: &[Part::Page], run: sky },
    Check { name: "settings/a-dropped-environment", needs: &[Part::Page], run: dropped },
    Check { name: "settings/another-size", needs: &[Part::Page], run: resized },
];

fn multipass(bench: &Bench) -> Result<()> {
    is_native(bench, "pillars", &["--lights", "32", "--shading", "multipass"])
}

fn anti_aliasing(bench: &Bench) -> Result<()> {
    is_native(bench, "pillars", &["--lights", "32", "--aa", "2"])
}

fn transfer(bench: &Bench) -> Result<()> {
    let options =
        ["--object", "torus", "--transfer", "centre", "--transfer-rays", "64", "--transfer-bounces", "0"];
    is_native(bench, "pillars", &[&["--lights", "32"], &options[..]].concat())
}

fn sky(bench: &Bench) -> Result<()> {
    let tab = bench.open(&format!("?scene={ADDRESS}&lights=32&environment=sky"), &view())?;
    settled(&tab)?;
    let scene = native_board(bench)?;
    is_shown(bench, &tab, &[&scene, "--lights", "32", "--environment", "sky", "--aa", "off"])?;
    Ok(())
}

/// A red sky above a dim ground.
fn dropped(bench: &Bench) -> Result<()> {
    let pixels = [[200, 40, 40, 130], [20, 20, 20, 128]].map(|pixel: [u8; 4]| [pixel; 4].concat()).concat();
    let file = [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n", &pixels[..]].concat();
    let file = bench.file("red.hdr", file)?;
    let tab = bench.open(&format!("?scene={ADDRESS}&lights=32"), &view())?;
    settled(&tab)?;
    let before = tab.screenshot()?;
    settles_again(&tab, || tab.drop_files([100.0, 100.0], &[&file]))?;
    let (scene, file) = (native_board(bench)?, file.to_string_lossy());
    let shown = is_shown(bench, &tab, &[&scene, "--lights", "32", "--environment", &file, "--aa", "off"])?;
    let found = difference(&picture(&before)?, &shown)?;
    ensure!(found.mean > 1.0, "the control: the environment changes nothing, {found:?}");
    Ok(())
}

/// The board as a file for the program.
fn native_board(bench: &Bench) -> Result<String> {
    for (name, bytes) in board::files()? {
        bench.file(name, bytes)?;
    }
    Ok(bench.folder.path().join("board.obj").to_string_lossy().into_owned())
}

fn resized(bench: &Bench) -> Result<()> {
    let tab = bench.open("?scene=pillars&lights=16&mode=naive", &View { size: [300, 200], ..view() })?;
    settled(&tab)?;
    settles_again(&tab, || tab.set_view(&view()))?;
    is_shown(bench, &tab, &["pillars", "--lights", "16", "--mode", "naive", "--aa", "off"])?;
    Ok(())
}
