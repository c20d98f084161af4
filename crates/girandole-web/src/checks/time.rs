//! How long the page keeps a browser from anything else.

use super::page::{PATIENCE, settled};
use crate::browser::{Tab, View};
use crate::package::Part;
use crate::serve::Site;
use crate::test::{Bench, Check};
use anyhow::{Context, Result, ensure};
use std::path::PathBuf;

/// All of them.
pub const CHECKS: &[Check] = &[
    Check { name: "time/the-first-picture-takes-two-seconds", needs: &[Part::Page], run: first_picture },
    Check { name: "time/a-room-never-blocks-the-page", needs: &[Part::Page], run: room },
    Check { name: "time/a-building-never-blocks-the-page", needs: &[Part::Page], run: building },
];

const VIEW: View = View { size: [384, 282], pixel_ratio: 1.0, mobile: false };
/// After the first second, milliseconds.
const LONGEST: f64 = 100.0;
/// Until the first picture of 16 samples, seconds of the main thread's work.
const FIRST: f64 = 2.0;
const BUILDING: &str = "test/building.glb";

/// The site with the building, where that lies beside the workspace.
pub fn pages(site: Site) -> Site {
    match std::fs::read(beside()) {
        Ok(bytes) => site.with(BUILDING, bytes),
        Err(_) => site,
    }
}

fn beside() -> PathBuf {
    crate::root().join("../shared/truth/flats/scene.glb")
}

/// Of the processor: a software device takes many more to compile its kernels.
fn first_picture(bench: &Bench) -> Result<()> {
    let building = beside().exists().then_some(BUILDING);
    for scene in [Some("pillars"), building].into_iter().flatten() {
        let tab = bench.open(&format!("?scene={scene}&lights=16"), &VIEW)?;
        tab.wait_until("performance.getEntriesByName('pictured').length > 0", PATIENCE)?;
        let seconds = tab.processor_seconds()?;
        ensure!(seconds < FIRST, "the first picture of {scene} took {seconds:.2} s");
        eprintln!("  {scene}: {seconds:.2} s");
    }
    Ok(())
}

fn room(bench: &Bench) -> Result<()> {
    never_blocks(bench, "pillars")
}

fn building(bench: &Bench) -> Result<()> {
    if !beside().exists() {
        eprintln!("  not run: there is no {}", beside().display());
        return Ok(());
    }
    never_blocks(bench, BUILDING)
}

fn never_blocks(bench: &Bench, scene: &str) -> Result<()> {
    let tab = bench.open(&format!("?scene={scene}"), &VIEW)?;
    settled(&tab)?;
    bench.keep(&format!("{}.png", scene.replace(['/', '.'], "-")), tab.screenshot()?)?;
    let tasks = long_tasks(&tab)?;
    let longest = tasks.iter().map(|(_, duration)| *duration).fold(0.0, f64::max);
    ensure!(longest <= LONGEST, "tasks of the page, begin and milliseconds: {tasks:?}");
    eprintln!("  {scene}: {longest:.0} ms");
    are_seen(&tab)
}

/// The control: what blocks is seen.
fn are_seen(tab: &Tab<'_>) -> Result<()> {
    tab.evaluate(
        "setTimeout(() => { for (const end = performance.now() + 150; performance.now() < end; ); })",
    )?;
    tab.wait_until(
        "new Promise((done) => setTimeout(() => done(true), 300))",
        std::time::Duration::from_secs(5),
    )?;
    ensure!(long_tasks(tab)?.iter().any(|(_, duration)| *duration > 140.0), "long tasks are not seen");
    Ok(())
}

/// When tasks of more than 50 ms began, from a second after the program's bytes were there, and how long they took, milliseconds.
fn long_tasks(tab: &Tab<'_>) -> Result<Vec<(f64, f64)>> {
    let tasks = tab.evaluate(
        "new Promise((done) => {
           const from = performance.getEntriesByName('loaded')[0].startTime;
           const tell = (list) => done(list.map((task) => [task.startTime - from, task.duration]));
           new PerformanceObserver((list) => tell(list.getEntries())).observe({ type: 'longtask', buffered: true });
           setTimeout(() => tell([]), 500);
         })",
    )?;
    let pair = |task: &serde_json::Value| Some((task[0].as_f64()?, task[1].as_f64()?));
    let tasks = tasks.as_array().context("there is no list of tasks")?.iter().filter_map(pair);
    Ok(tasks.filter(|(begin, _)| *begin > 1000.0).collect())
}
