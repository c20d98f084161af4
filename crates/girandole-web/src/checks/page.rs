//! The page: the window of the program, in a browser.

use super::native;
use crate::browser::{Tab, View, WebGpu};
use crate::difference::{Picture, difference};
use crate::package::Part;
use crate::test::{Bench, Check};
use anyhow::{Context, Result, ensure};
use std::time::Duration;

/// All of them.
pub const CHECKS: &[Check] = &[
    Check { name: "page/naive-is-the-native-picture", needs: &[Part::Page], run: naive },
    Check { name: "page/full-is-the-native-picture", needs: &[Part::Page], run: full },
    Check { name: "page/says-that-webgpu-is-missing", needs: &[Part::Page], run: missing },
    Check { name: "page/says-what-its-address-asks-for-in-vain", needs: &[Part::Page], run: refused },
];

/// Of the picture in it: the panel is folded where there is so little room, and the bar is below.
pub const PICTURE: [u32; 2] = [384, 256];
const BAR: u32 = 26;
/// Software compiles a pipeline in seconds.
pub const PATIENCE: Duration = Duration::from_secs(90);

/// The page as large as that takes.
pub fn view() -> View {
    View { size: [PICTURE[0], PICTURE[1] + BAR], ..View::default() }
}

fn naive(bench: &Bench) -> Result<()> {
    is_native(bench, "pillars", &["--lights", "16", "--mode", "naive"])
}

fn full(bench: &Bench) -> Result<()> {
    is_native(bench, "pillars", &["--lights", "64"])
}

/// Whether the page at the address with these options shows the picture that they render, each a name and a value.
pub fn is_native(bench: &Bench, scene: &str, options: &[&str]) -> Result<()> {
    let pairs = options.chunks(2).map(|pair| format!("&{}={}", pair[0].trim_start_matches('-'), pair[1]));
    let tab = bench.open(&format!("?scene={scene}{}", pairs.collect::<String>()), &view())?;
    settled(&tab)?;
    let defaults = if options.contains(&"--aa") { &[][..] } else { &["--aa", "off"] };
    is_shown(bench, &tab, &[&[scene], options, defaults].concat())?;
    Ok(())
}

/// Whether a page shows the picture that the program renders by these arguments; the picture.
pub fn is_shown(bench: &Bench, tab: &Tab<'_>, arguments: &[&str]) -> Result<Vec<u8>> {
    let name = arguments.join("").replace("--", "-").replace(['/', '.'], "_");
    let shown = picture(&bench.keep(&format!("{name}.png"), tab.screenshot()?)?)?;
    let found = difference(&shown, &native(bench, arguments, PICTURE)?)?;
    let pixels =
        "[document.querySelector('canvas').width, document.querySelector('canvas').height].join(' x ')";
    ensure!(
        found.mean < 0.1 && found.share_beyond_2 < 0.002,
        "the picture is another one: {found:?}; the canvas has {} pixels",
        tab.evaluate(pixels)?
    );
    Ok(shown)
}

/// Waits until the page has its last picture.
pub fn settled(tab: &Tab<'_>) -> Result<()> {
    let is_settled = "performance.getEntriesByName('settled').length > 0 || document.querySelector('#cover.failed') != null";
    tab.wait_until(is_settled, PATIENCE)?;
    let failure = tab.evaluate("document.querySelector('#cover.failed #said')?.textContent ?? ''")?;
    let failure = failure.as_str().unwrap_or_default();
    ensure!(failure.is_empty(), "the page says: {}", failure.trim());
    Ok(())
}

/// The same after something was done to it.
pub fn settles_again(tab: &Tab<'_>, done: impl FnOnce() -> Result<()>) -> Result<()> {
    tab.evaluate("performance.clearMarks('settled')")?;
    done()?;
    settled(tab)
}

/// The picture in a screenshot of the page.
pub fn picture(screenshot: &[u8]) -> Result<Vec<u8>> {
    Picture::decode(screenshot)?.cut(PICTURE).context("the screenshot is too small")?.encode()
}

fn missing(bench: &Bench) -> Result<()> {
    for (webgpu, word) in [(WebGpu::Missing, "no WebGPU"), (WebGpu::NoAdapter, "no GPU")] {
        let tab = bench.open_with(webgpu, "", &View::default())?;
        says(&tab, word)?;
        let image = "document.querySelector('#cover img').naturalWidth > 100";
        tab.wait_until(image, Duration::from_secs(10))?;
        bench.keep(&format!("{}.png", word.replace(' ', "-")), tab.screenshot()?)?;
    }
    Ok(())
}

fn refused(bench: &Bench) -> Result<()> {
    let tab = bench.open("?lights=many", &View::default())?;
    says(&tab, "many")?;
    let tab = bench.open("?scene=nowhere.glb", &View::default())?;
    says(&tab, "404")
}

/// Whether the page shows a sentence with this word in place of the picture; that is in the console, too.
fn says(tab: &Tab<'_>, word: &str) -> Result<()> {
    tab.wait_until("document.querySelector('#cover.failed') != null", PATIENCE)?;
    let said = tab.evaluate("document.querySelector('#said').textContent")?;
    let said = said.as_str().unwrap_or_default();
    ensure!(said.contains(word), "the page says: {said}");
    let others = tab.take_troubles()?.into_iter().filter(|trouble| !trouble.contains(word));
    let others = others.collect::<Vec<_>>();
    ensure!(others.is_empty(), "there is other trouble: {others:?}");
    Ok(())
}
