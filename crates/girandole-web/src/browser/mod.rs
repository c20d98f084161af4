//! Drives Chromium without a screen by its DevTools protocol, as far as the checks need it.
//!
//! Everything waits until it is done, with a limit of time. All trouble that a page reports is collected.

mod connection;
mod input;
mod launch;
mod log;
mod tab;

pub use input::{Button, Key};
pub use launch::find;
pub use tab::{Tab, View};

use anyhow::{Context, Result};
use connection::Connection;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::time::Duration;

/// How long the browser may take for what is asked of it, unless told otherwise: a machine without a GPU is slow.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// How a browser is started.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Width and height of its windows, in pixels of the page.
    pub size: [u32; 2],
    /// What pages have of WebGPU.
    pub webgpu: WebGpu,
    /// Pixels of its screen to one of the page, where that is not each [`View`]'s own: what a `ResizeObserver` is told of pixels
    /// follows the screen alone.
    pub pixel_ratio: Option<f64>,
}

/// What pages have of WebGPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WebGpu {
    /// All of it, by the software device SwiftShader.
    Software,
    /// `navigator.gpu`, which has no adapter: a machine whose GPU the browser does not trust.
    NoAdapter,
    /// Nothing, not even `navigator.gpu`: an old browser.
    Missing,
}

impl Default for Options {
    fn default() -> Self {
        Self { size: [1280, 800], webgpu: WebGpu::Software, pixel_ratio: None }
    }
}

/// A running Chromium, which ends when this is dropped.
pub struct Browser {
    connection: RefCell<Connection>,
    options: Options,
    // After the connection: that is closed first.
    process: launch::Process,
}

impl Browser {
    /// Starts it with a profile of its own.
    pub fn start(options: &Options) -> Result<Self> {
        let process = launch::Process::start(options)?;
        let connection = RefCell::new(Connection::open(&process.address)?);
        Ok(Self { connection, options: *options, process })
    }

    /// Its name and version.
    pub fn version(&self) -> Result<String> {
        let version = self.call(None, "Browser.getVersion", &json!({}), PATIENCE)?;
        Ok(version["product"].as_str().unwrap_or_default().to_string())
    }

    /// A tab, which shares nothing with others, at an address; waits until that is loaded.
    pub fn open(&self, address: &str, view: &View) -> Result<Tab<'_>> {
        let tab = Tab::new(self, view)?;
        tab.go(address)?;
        Ok(tab)
    }

    /// Everything that counts as trouble since it was last asked for, of all tabs.
    pub fn take_troubles(&self) -> Result<Vec<String>> {
        let mut connection = self.connection.borrow_mut();
        connection.listen(Duration::ZERO)?;
        Ok(connection.logs.values_mut().flat_map(|log| std::mem::take(&mut log.troubles)).collect())
    }

    /// What a method of the protocol returns, of a tab's session or of the browser.
    fn call(&self, session: Option<&str>, method: &str, arguments: &Value, limit: Duration) -> Result<Value> {
        self.connection
            .borrow_mut()
            .call(session, method, arguments, limit)
            .with_context(|| format!("Chromium did not do {method}"))
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It answers, or is killed.
        let _ = self.call(None, "Browser.close", &json!({}), Duration::from_secs(2));
        self.process.end(Duration::from_secs(3));
    }
}
