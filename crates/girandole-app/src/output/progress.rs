//! Progress of long work.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A progress bar on a terminal, nothing elsewhere and within the work of another one.
pub struct Progress {
    bar: ProgressBar,
    is_outer: bool,
}

/// Whether there is one.
static IN_PROGRESS: AtomicBool = AtomicBool::new(false);

impl Progress {
    /// A bar for work whose finished share is known.
    pub fn bar(what: &str) -> Self {
        Self::new(what, "{msg} {wide_bar} {percent:>3} % {eta}")
    }

    /// A spinner for work whose finished share is not known.
    pub fn spinner(what: &str) -> Self {
        let spinner = Self::new(what, "{spinner} {msg} {elapsed}");
        if !spinner.bar.is_hidden() {
            spinner.bar.enable_steady_tick(Duration::from_millis(100));
        }
        spinner
    }

    fn new(what: &str, template: &str) -> Self {
        let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_message(what.to_owned());
        let is_outer = !IN_PROGRESS.swap(true, Ordering::Relaxed);
        if is_outer && io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        Self { bar, is_outer }
    }

    /// Shows the finished share, 0 to 1.
    pub fn set(&self, done: f32) {
        self.bar.set_position((done.clamp(0.0, 1.0) * 1000.0) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        if self.is_outer {
            IN_PROGRESS.store(false, Ordering::Relaxed);
        }
    }
}
