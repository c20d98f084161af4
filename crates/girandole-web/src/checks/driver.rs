//! The driver itself: what it does arrives, and what goes wrong is seen.

use crate::browser::{Button, Key, Tab, View, WebGpu};
use crate::difference::{Picture, difference};
use crate::serve::Site;
use crate::test::{Bench, Check};
use anyhow::{Context, Result, ensure};
use base64::Engine as _;
use serde_json::{Value, json};
use std::time::Duration;

/// All of them.
pub const CHECKS: &[Check] = &[
    Check { name: "driver/a-webgpu-canvas-has-its-colour", needs: &[], run: webgpu },
    Check { name: "driver/screenshots-have-the-view's-size", needs: &[], run: screenshots },
    Check { name: "driver/exceptions-are-seen", needs: &[], run: exceptions },
    Check { name: "driver/validation-of-webgpu-is-seen", needs: &[], run: validation },
    Check { name: "driver/crashes-are-seen", needs: &[], run: crashes },
    Check { name: "driver/mouse-and-wheel-arrive", needs: &[], run: mouse },
    Check { name: "driver/keys-arrive", needs: &[], run: keys },
    Check { name: "driver/touches-arrive", needs: &[], run: touches },
    Check { name: "driver/files-arrive", needs: &[], run: files },
    Check { name: "driver/webgpu-can-be-missing", needs: &[], run: missing },
];

const CANVAS: &str = "driver/canvas.html";
pub const EVENTS: &str = "driver/events.html";
/// What the canvas is cleared to, in linear steps of 1/255.
const COLOR: [u8; 3] = [51, 102, 204];
const SOON: Duration = Duration::from_secs(10);

/// The site with the pages of these checks.
pub fn pages(site: Site) -> Site {
    site.with(CANVAS, include_str!("driver/canvas.html")).with(EVENTS, include_str!("driver/events.html"))
}

fn webgpu(bench: &Bench) -> Result<()> {
    let tab = bench.open(CANVAS, &View::default())?;
    let picture = cleared(&tab, COLOR)?;
    let decoded = Picture::decode(&picture)?;
    ensure!(decoded.size == [64, 48], "the canvas has {:?} pixels", decoded.size);
    ensure!(
        decoded.pixels.iter().all(|pixel| *pixel == COLOR),
        "{:?} is not {COLOR:?}",
        decoded.pixel([0, 0])
    );
    // Another colour is another picture.
    let [r, g, b] = COLOR;
    let other = cleared(&tab, [r, g, b + 30])?;
    let found = difference(&picture, &other)?;
    ensure!(found.max == 30 && (found.mean - 10.0).abs() < 1e-9, "{found:?}");
    Ok(())
}

/// The canvas's picture after it was cleared to a colour.
fn cleared(tab: &Tab<'_>, color: [u8; 3]) -> Result<Vec<u8>> {
    let data = tab.evaluate(&format!("picture({})", json!(color)))?;
    let data = data.as_str().context("there is no picture")?;
    Ok(base64::engine::general_purpose::STANDARD.decode(data)?)
}

fn screenshots(bench: &Bench) -> Result<()> {
    let view = View { size: [320, 200], pixel_ratio: 2.0, mobile: false };
    let tab = bench.open(EVENTS, &view)?;
    let shot = Picture::decode(&tab.screenshot()?)?;
    ensure!(shot.size == [640, 400], "the picture has {:?} pixels", shot.size);
    ensure!(shot.pixel([639, 399]) == Some([0, 128, 0]), "{:?} is not green", shot.pixel([639, 399]));
    tab.set_view(&View { size: [200, 320], pixel_ratio: 3.0, mobile: true })?;
    tab.wait_until("innerWidth == 200 && devicePixelRatio == 3 && navigator.maxTouchPoints == 5", SOON)?;
    let shot = Picture::decode(&tab.screenshot()?)?;
    ensure!(shot.size == [600, 960], "the picture has {:?} pixels", shot.size);
    Ok(())
}

fn exceptions(bench: &Bench) -> Result<()> {
    let tab = bench.open(EVENTS, &View::default())?;
    ensure!(tab.take_troubles()?.is_empty(), "there is trouble before it was made");
    let error = tab.evaluate("Promise.reject(new Error('refused'))").err().context("no error")?;
    ensure!(format!("{error:#}").contains("refused"), "{error:#}");
    ensure!(tab.take_troubles()?.is_empty(), "an error that was returned is no trouble of the page");
    let makers = [
        ("setTimeout(() => { throw new Error('thrown') }, 0); 1", "thrown"),
        ("setTimeout(() => Promise.reject(new Error('unhandled')), 0); 1", "unhandled"),
        ("console.error('said', { a: 1 }); 1", "error: said"),
        ("console.warn('warned'); 1", "warning: warned"),
        ("fetch('/missing').then(() => 1)", "/missing"),
    ];
    for (expression, words) in makers {
        tab.evaluate(expression)?;
        let trouble = tab.wait_for_trouble(SOON)?;
        ensure!(trouble.len() == 1 && trouble[0].contains(words), "{expression} gave {trouble:?}");
    }
    let late = tab.wait_until("window.never === 1", Duration::from_millis(200)).err().context("no error")?;
    let late = format!("{late:#}");
    ensure!(late.contains("window.never") && late.contains("warned"), "{late}");
    Ok(())
}

fn validation(bench: &Bench) -> Result<()> {
    let tab = bench.open(CANVAS, &View::default())?;
    tab.evaluate("(async () => { const gpu = await device(); gpu.createBuffer({ size: 16, usage: 0 }); await gpu.queue.onSubmittedWorkDone() })()")?;
    let troubles = tab.wait_for_trouble(SOON)?;
    ensure!(troubles.iter().any(|trouble| trouble.to_lowercase().contains("buffer")), "{troubles:?}");
    Ok(())
}

fn crashes(bench: &Bench) -> Result<()> {
    let tab = bench.open(EVENTS, &View::default())?;
    ensure!(tab.go("chrome://crash").is_err(), "the page of a tab that crashed was loaded");
    ensure!(tab.wait_for_trouble(SOON)? == ["the tab crashed"], "the crash is no trouble");
    let error = tab.evaluate("1").err().context("a tab that crashed answers")?;
    ensure!(format!("{error:#}").contains("crashed"), "{error:#}");
    Ok(())
}

fn mouse(bench: &Bench) -> Result<()> {
    let tab = bench.open(EVENTS, &View::default())?;
    tab.mouse_move([10.0, 20.0])?;
    tab.mouse_press([10.0, 20.0], Button::Left)?;
    tab.mouse_move([110.0, 220.0])?;
    tab.mouse_release([110.0, 220.0], Button::Left)?;
    tab.mouse_press([110.0, 220.0], Button::Right)?;
    tab.mouse_release([110.0, 220.0], Button::Right)?;
    tab.wheel([50.0, 60.0], [0.0, 120.0])?;
    let expected = [
        "pointermove 10 20 0",
        "pointerdown 10 20 1",
        "pointermove 110 220 1",
        "pointerup 110 220 0",
        "pointerdown 110 220 2",
        "pointerup 110 220 0",
        "wheel 50 60 0 120",
    ];
    arrive(&tab, &expected)
}

fn keys(bench: &Bench) -> Result<()> {
    let tab = bench.open(EVENTS, &View::default())?;
    tab.press(Key::Character('w'))?;
    tab.press(Key::Named("ArrowLeft"))?;
    tab.key_down(Key::Named("Control"))?;
    tab.press(Key::Character('z'))?;
    tab.key_up(Key::Named("Control"))?;
    let expected = [
        "keydown w KeyW",
        "keyup w KeyW",
        "keydown ArrowLeft ArrowLeft",
        "keyup ArrowLeft ArrowLeft",
        "keydown Control ControlLeft +control",
        "keydown z KeyZ +control",
        "keyup z KeyZ +control",
        "keyup Control ControlLeft",
    ];
    arrive(&tab, &expected)
}

fn touches(bench: &Bench) -> Result<()> {
    let tab = bench.open(EVENTS, &View { size: [400, 800], pixel_ratio: 2.0, mobile: true })?;
    tab.touch_start(&[[30.0, 40.0]])?;
    tab.touch_move(&[[130.0, 140.0]])?;
    tab.touch_end()?;
    tab.touch_start(&[[100.0, 300.0], [200.0, 300.0]])?;
    tab.touch_move(&[[50.0, 310.0], [250.0, 320.0]])?;
    tab.touch_end()?;
    let expected = [
        "touchstart 30,40",
        "touchmove 130,140",
        "touchend",
        // Fingers come and go one after the other.
        "touchstart 100,300",
        "touchstart 100,300 200,300",
        "touchmove 50,310 250,320",
        "touchend 250,320",
        "touchend",
    ];
    arrive(&tab, &expected)
}

fn files(bench: &Bench) -> Result<()> {
    let tab = bench.open(EVENTS, &View::default())?;
    let (one, two) = (bench.file("one.glb", "first")?, bench.file("two.obj", "second one")?);
    tab.drop_files([70.0, 80.0], &[&one, &two])?;
    arrive(&tab, &["drop 70 80 one.glb=first two.obj=second one"])?;
    tab.evaluate("events.length = 0")?;
    tab.choose_files("#chosen", &[&two])?;
    arrive(&tab, &["chosen two.obj=second one"])?;
    ensure!(tab.choose_files("#none", &[&two]).is_err(), "files were chosen in what is not there");
    Ok(())
}

fn missing(bench: &Bench) -> Result<()> {
    let state = "isSecureContext ? typeof navigator.gpu : 'insecure'";
    let adapter = "navigator.gpu.requestAdapter().then(adapter => adapter?.info.architecture ?? 'none')";
    let tab = bench.open(EVENTS, &View::default())?;
    ensure!(tab.evaluate(adapter)? == "swiftshader", "the adapter is {}", tab.evaluate(adapter)?);
    let tab = bench.open_with(WebGpu::Missing, EVENTS, &View::default())?;
    ensure!(tab.evaluate(state)? == "undefined", "navigator.gpu is {}", tab.evaluate(state)?);
    let tab = bench.open_with(WebGpu::NoAdapter, EVENTS, &View::default())?;
    ensure!(tab.evaluate(state)? == "object", "navigator.gpu is {}", tab.evaluate(state)?);
    ensure!(tab.evaluate(adapter)? == "none", "the adapter is {}", tab.evaluate(adapter)?);
    Ok(())
}

/// Whether the page's events are these, soon and in this order.
fn arrive(tab: &Tab<'_>, expected: &[&str]) -> Result<()> {
    let enough = tab.wait_until(&format!("events.length >= {}", expected.len()), SOON);
    let events = tab.evaluate("events")?;
    ensure!(events == Value::from(expected), "the page has {events:#}, not {expected:#?}");
    enough
}
