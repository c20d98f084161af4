//! A tab of the browser: a page that is loaded, looked at and asked.

use super::{Browser, PATIENCE, WebGpu, log};
use anyhow::{Context, Result, bail, ensure};
use base64::Engine as _;
use serde_json::{Value, json};
use std::cell::Cell;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// How often a page is asked for what is waited for.
const POLL: Duration = Duration::from_millis(50);

/// How a tab shows its page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Width and height of the page, in its own pixels.
    pub size: [u32; 2],
    /// Pixels of the picture to one of the page.
    pub pixel_ratio: f64,
    /// Whether it is a phone: with touch, and the page's own width.
    pub mobile: bool,
}

impl Default for View {
    fn default() -> Self {
        Self { size: [1280, 800], pixel_ratio: 1.0, mobile: false }
    }
}

/// A tab, which is closed when this is dropped.
pub struct Tab<'a> {
    browser: &'a Browser,
    context: String,
    session: String,
    /// Mouse buttons that are down, a bit each.
    pub(super) buttons: Cell<u32>,
    /// Keys that change others and are down, a bit each.
    pub(super) modifiers: Cell<u32>,
}

impl<'a> Tab<'a> {
    /// An empty one.
    pub(super) fn new(browser: &'a Browser, view: &View) -> Result<Self> {
        let call = |method, arguments: Value| browser.call(None, method, &arguments, PATIENCE);
        let context = call("Target.createBrowserContext", json!({ "disposeOnDetach": true }))?;
        let context = text(&context["browserContextId"])?;
        let [width, height] = view.size;
        let page =
            json!({ "url": "about:blank", "browserContextId": context, "width": width, "height": height });
        let target = text(&call("Target.createTarget", page)?["targetId"])?;
        let attached = call("Target.attachToTarget", json!({ "targetId": target, "flatten": true }))?;
        let session = text(&attached["sessionId"])?;
        let tab = Self { browser, context, session, buttons: Cell::new(0), modifiers: Cell::new(0) };
        tab.call("Performance.enable", json!({ "timeDomain": "threadTicks" }))?;
        for domain in ["Page", "Runtime", "Log", "Inspector", "DOM"] {
            tab.call(&format!("{domain}.enable"), json!({}))?;
        }
        if browser.options.webgpu == WebGpu::Missing {
            // No option of Chromium does it.
            let source = json!({ "source": "delete Navigator.prototype.gpu" });
            tab.call("Page.addScriptToEvaluateOnNewDocument", source)?;
        }
        tab.set_view(view)?;
        Ok(tab)
    }

    /// Loads the page at an address, and waits until it is.
    pub fn go(&self, address: &str) -> Result<()> {
        let before = self.log(|log| log.loads)?;
        let answer = self.call("Page.navigate", json!({ "url": address }))?;
        if let Some(error) = answer["errorText"].as_str() {
            bail!("{address} does not load: {error}");
        }
        let start = Instant::now();
        while self.log(|log| log.loads)? == before {
            ensure!(start.elapsed() < PATIENCE, "{address} is not loaded after {} s", PATIENCE.as_secs());
            self.browser.connection.borrow_mut().listen(Duration::ZERO)?;
        }
        Ok(())
    }

    /// What an expression of JavaScript is, when its promise is kept; exceptions are errors.
    pub fn evaluate(&self, expression: &str) -> Result<Value> {
        self.evaluate_within(expression, PATIENCE)
    }

    /// The same, with a limit of time.
    pub fn evaluate_within(&self, expression: &str, limit: Duration) -> Result<Value> {
        let arguments = json!({
            "expression": expression,
            "awaitPromise": true,
            "returnByValue": true,
            // Pages may do what only users may ask for, such as a full screen.
            "userGesture": true,
        });
        let answer = self.browser.call(Some(&self.session), "Runtime.evaluate", &arguments, limit)?;
        match &answer["exceptionDetails"] {
            Value::Null => Ok(answer["result"]["value"].clone()),
            details => bail!("{}", log::exception(details)),
        }
    }

    /// Waits until an expression is true.
    pub fn wait_until(&self, expression: &str, limit: Duration) -> Result<()> {
        let start = Instant::now();
        let mut last = String::from("not known");
        while let Some(left) = limit.checked_sub(start.elapsed()) {
            match self.evaluate_within(&format!("Promise.resolve({expression})"), left) {
                Ok(Value::Bool(true)) => return Ok(()),
                Ok(value) => last = value.to_string(),
                Err(error) => last = format!("{:#}", error.root_cause()),
            }
            if self.log(|log| log.crashed)? {
                break;
            }
            sleep(POLL.min(left));
        }
        let console = self.console()?.join("\n  ");
        bail!(
            "`{expression}` is not true after {:.1} s, but {last}; the console says:\n  {console}",
            start.elapsed().as_secs_f64()
        )
    }

    /// How the page is shown from now on.
    pub fn set_view(&self, view: &View) -> Result<()> {
        let [width, height] = view.size;
        // 0 leaves the screen's.
        let pixel_ratio = self.browser.options.pixel_ratio.map_or(view.pixel_ratio, |_| 0.0);
        let metrics = json!({
            "width": width, "height": height, "deviceScaleFactor": pixel_ratio, "mobile": view.mobile,
        });
        self.call("Emulation.setDeviceMetricsOverride", metrics)?;
        let touch = if view.mobile {
            json!({ "enabled": true, "maxTouchPoints": 5 })
        } else {
            json!({ "enabled": false })
        };
        self.call("Emulation.setTouchEmulationEnabled", touch)?;
        Ok(())
    }

    /// Seconds that a processor worked on tasks of the page's main thread.
    pub fn processor_seconds(&self) -> Result<f64> {
        let answer = self.call("Performance.getMetrics", json!({}))?;
        let metrics = answer["metrics"].as_array().context("Chromium counts nothing")?;
        let time = metrics.iter().find(|metric| metric["name"] == "TaskDuration");
        let time = time.and_then(|metric| metric["value"].as_f64()).filter(|seconds| *seconds > 0.0);
        time.context("Chromium does not count processor time")
    }

    /// What is seen, as a PNG file.
    pub fn screenshot(&self) -> Result<Vec<u8>> {
        let answer = self.call("Page.captureScreenshot", json!({ "format": "png" }))?;
        let data = answer["data"].as_str().context("Chromium sent no picture")?;
        base64::engine::general_purpose::STANDARD.decode(data).context("Chromium sent a broken picture")
    }

    /// Chooses files in the `<input type=file>` that a CSS selector finds.
    pub fn choose_files(&self, selector: &str, files: &[&Path]) -> Result<()> {
        let expression = format!("document.querySelector({})", json!(selector));
        let found = self.call("Runtime.evaluate", json!({ "expression": expression }))?;
        let object = found["result"]["objectId"].as_str();
        let object = object.with_context(|| format!("the page has no {selector}"))?;
        self.call("DOM.setFileInputFiles", json!({ "files": paths(files)?, "objectId": object }))?;
        Ok(())
    }

    /// All that the console has said.
    pub fn console(&self) -> Result<Vec<String>> {
        self.browser.connection.borrow_mut().listen(Duration::ZERO)?;
        self.log(|log| log.console.clone())
    }

    /// Everything of this tab that counts as trouble since it was last asked for.
    pub fn take_troubles(&self) -> Result<Vec<String>> {
        self.browser.connection.borrow_mut().listen(Duration::ZERO)?;
        self.log(|log| std::mem::take(&mut log.troubles))
    }

    /// The same, as soon as there is any.
    pub fn wait_for_trouble(&self, limit: Duration) -> Result<Vec<String>> {
        let start = Instant::now();
        while start.elapsed() < limit {
            let troubles = self.take_troubles()?;
            if !troubles.is_empty() {
                return Ok(troubles);
            }
        }
        let console = self.console()?.join("\n  ");
        bail!("there was no trouble within {:.1} s; the console says:\n  {console}", limit.as_secs_f64());
    }

    /// What a method of the protocol returns.
    pub fn call(&self, method: &str, arguments: Value) -> Result<Value> {
        self.browser.call(Some(&self.session), method, &arguments, PATIENCE)
    }

    fn log<T>(&self, of: impl FnOnce(&mut log::Log) -> T) -> Result<T> {
        let mut connection = self.browser.connection.try_borrow_mut()?;
        Ok(of(connection.logs.entry(self.session.clone()).or_default()))
    }
}

impl Drop for Tab<'_> {
    fn drop(&mut self) {
        // Trouble up to here is not to be missed; a browser that has gone has closed its tabs.
        let _ = self.console();
        let close = json!({ "browserContextId": self.context });
        let _ = self.browser.call(None, "Target.disposeBrowserContext", &close, Duration::from_secs(5));
    }
}

/// Files as the browser, which has another working folder, finds them.
pub(super) fn paths(files: &[&Path]) -> Result<Vec<String>> {
    let whole = |file: &&Path| {
        let path = file.canonicalize().with_context(|| format!("there is no file {}", file.display()))?;
        Ok(path.to_string_lossy().into_owned())
    };
    files.iter().map(whole).collect()
}

fn text(value: &Value) -> Result<String> {
    Ok(value.as_str().context("Chromium's answer has another form than expected")?.to_string())
}
