//! Starts Chromium and ends it.

use super::{Options, PATIENCE, WebGpu};
use crate::toolchain::path_folders;
use anyhow::{Context, Result, bail};
use std::fs::File;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// What it may be called, the first that is there.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// It does nothing by itself, and is driven.
const ALWAYS: [&str; 13] = [
    "--headless",
    "--no-sandbox",
    "--no-first-run",
    "--no-default-browser-check",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--mute-audio",
    "--remote-debugging-port=0",
];

/// WebGPU on the processor. Canvases have its pictures only if Chromium draws its pages with the same device.
const SOFTWARE_WEBGPU: [&str; 7] = [
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--enable-unsafe-swiftshader",
    "--use-vulkan=swiftshader",
    "--enable-features=Vulkan",
    "--use-gl=angle",
    "--use-angle=swiftshader",
];

/// Pages may ask for an adapter, and get none.
const NO_ADAPTER: [&str; 2] = ["--disable-features=WebGPUService", "--disable-gpu"];

/// Its process.
pub struct Process {
    child: Child,
    /// Where it listens.
    pub address: String,
    // Its profile and its output, until it has ended.
    folder: TempDir,
}

impl Process {
    /// Starts it, and waits until it listens.
    pub fn start(options: &Options) -> Result<Self> {
        let program = find()?;
        let folder = tempfile::tempdir().context("there is no temporary folder for Chromium's profile")?;
        let output = File::create(folder.path().join("output"))?;
        let [width, height] = options.size;
        let child = Command::new(&program)
            .args(ALWAYS)
            .args(if options.webgpu == WebGpu::Software { &SOFTWARE_WEBGPU[..] } else { &NO_ADAPTER })
            .arg(format!("--window-size={width},{height}"))
            .args(options.pixel_ratio.map(|ratio| format!("--force-device-scale-factor={ratio}")))
            .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
            .arg("about:blank")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(output)
            .spawn()
            .with_context(|| format!("{} does not start", program.display()))?;
        let mut process = Self { child, address: String::new(), folder };
        process.address = process.listens()?;
        Ok(process)
    }

    /// Where it listens, as soon as it does. Its profile says so in two lines: a port and a path.
    fn listens(&mut self) -> Result<String> {
        let file = self.folder.path().join("profile/DevToolsActivePort");
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            let text = std::fs::read_to_string(&file).unwrap_or_default();
            if let Some((port, path)) = text.split_once('\n').filter(|(_, path)| !path.is_empty()) {
                return Ok(format!("ws://127.0.0.1:{port}{}", path.trim_end()));
            }
            if let Some(status) = self.child.try_wait()? {
                bail!("Chromium ended at its start ({status}): {}", self.output());
            }
            sleep(Duration::from_millis(20));
        }
        bail!("Chromium did not listen within {} s: {}", PATIENCE.as_secs(), self.output());
    }

    /// The end of what it printed.
    fn output(&self) -> String {
        let text = std::fs::read(self.folder.path().join("output")).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        let lines: Vec<&str> = text.lines().rev().take(5).collect();
        lines.into_iter().rev().collect::<Vec<_>>().join("\n")
    }

    /// Waits until it ends by itself, and kills it if it does not.
    pub fn end(&mut self, limit: Duration) {
        let start = Instant::now();
        while start.elapsed() < limit {
            if !matches!(self.child.try_wait(), Ok(None)) {
                return;
            }
            sleep(Duration::from_millis(10));
        }
        // It may have ended meanwhile.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.end(Duration::ZERO);
    }
}

/// Where the browser is.
pub fn find() -> Result<PathBuf> {
    let folders = path_folders();
    let paths = NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    paths
        .into_iter()
        .find(|path| path.is_file())
        .context("Chromium is not in PATH; install it, on Debian with `apt-get install chromium`")
}
