//! Whether anything moves: what is at rest may take its time.

use girandole_core::Generation;
use girandole_core::scene::View;

/// Seconds without motion after which all is at rest.
pub const REST: f64 = 0.4;

/// For how long nothing has moved.
#[derive(Default)]
pub struct Rest {
    last: Option<(Generation, View)>,
    seconds: f64,
}

impl Rest {
    /// So many seconds have passed, and this is what the picture shows now.
    pub fn pass(&mut self, seconds: f64, now: (Generation, View)) {
        self.seconds = if self.last == Some(now) { self.seconds + seconds } else { 0.0 };
        self.last = Some(now);
    }

    pub fn is_resting(&self) -> bool {
        self.seconds >= REST
    }

    /// Seconds until all is at rest, if nothing moves; `None` when it is.
    pub fn left(&self) -> Option<f64> {
        (!self.is_resting()).then_some(REST - self.seconds)
    }
}
