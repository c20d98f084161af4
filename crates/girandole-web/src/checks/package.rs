//! The package: the component on a page of somebody else.

use super::native;
use crate::browser::{Tab, View};
use crate::difference::difference;
use crate::package::Part;
use crate::test::{Bench, Check};
use anyhow::{Context, Result, ensure};
use base64::Engine as _;
use serde_json::json;
use std::time::Duration;

/// All of them.
pub const CHECKS: &[Check] = &[
    Check { name: "package/naive-is-the-native-picture", needs: &[Part::Package], run: naive },
    Check { name: "package/full-is-the-native-picture", needs: &[Part::Package], run: full },
    Check { name: "package/refuses-in-a-sentence", needs: &[Part::Package], run: refusals },
    Check { name: "package/its-example-runs", needs: &[Part::Package], run: example },
];

pub const PAGE: (&str, &str) = ("checks/package.html", include_str!("package/canvas.html"));
const SIZE: [u32; 2] = [384, 256];
/// Software compiles a pipeline in seconds.
const PATIENCE: Duration = Duration::from_secs(300);

fn naive(bench: &Bench) -> Result<()> {
    is_native(
        bench,
        &["pillars", "--lights", "16", "--mode", "naive", "--aa", "off"],
        json!({ "lights": 16, "mode": "naive" }),
    )
}

fn full(bench: &Bench) -> Result<()> {
    is_native(bench, &["pillars", "--lights", "64", "--aa", "off"], json!({ "lights": 64 }))
}

fn is_native(bench: &Bench, options: &[&str], settings: serde_json::Value) -> Result<()> {
    let tab = bench.open(PAGE.0, &View::default())?;
    let shown = shown(&tab, "pillars", &settings)?;
    let shown = bench.keep(&format!("package{}.png", options.join("-").replace("--", "-")), shown)?;
    let found = difference(&shown, &native(bench, options, SIZE)?)?;
    ensure!(found.mean < 0.1 && found.share_beyond_2 < 0.002, "the picture is another one: {found:?}");
    let stats = tab.evaluate("stats()")?;
    ensure!(stats["progress"] == 1.0 && stats["lit"] == stats["lights"], "{stats}");
    Ok(())
}

/// The canvas's last picture of a scene by these settings.
fn shown(tab: &Tab<'_>, scene: &str, settings: &serde_json::Value) -> Result<Vec<u8>> {
    let shown = tab.evaluate_within(&format!("shown({}, {settings})", json!(scene)), PATIENCE)?;
    let data = shown.as_str().context("there is no picture")?;
    Ok(base64::engine::general_purpose::STANDARD.decode(data)?)
}

fn refusals(bench: &Bench) -> Result<()> {
    let tab = bench.open(PAGE.0, &View::default())?;
    for (expression, word) in [
        ("shown('pillars', { lights: -1 })", "-1"),
        ("shown('pillars', { colour: 1 })", "colour"),
        ("shown('pillars', { exposure: NaN })", "exposure"),
        ("shown('nowhere.glb', {})", "404"),
        ("shown('pillars', { mapSize: 7 })", "map"),
    ] {
        let error = tab.evaluate_within(expression, PATIENCE).err();
        let error = error.with_context(|| format!("{expression} is taken"))?;
        ensure!(format!("{error:#}").contains(word), "{expression}: {error:#}");
    }
    // The server's answer is in the console, too.
    let others = tab.take_troubles()?.into_iter().filter(|trouble| !trouble.contains("404"));
    let others = others.collect::<Vec<_>>();
    ensure!(others.is_empty(), "there is other trouble: {others:?}");
    Ok(())
}

fn example(bench: &Bench) -> Result<()> {
    let tab = bench.open("package/example.html", &View::default())?;
    tab.wait_until("/^300 of 300/.test(document.querySelector('output').textContent)", PATIENCE)?;
    bench.keep("example.png", tab.screenshot()?)?;
    Ok(())
}
