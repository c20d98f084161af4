//! The one place where time comes from: browsers have no `std::time::Instant`.

pub use web_time::{Duration, Instant};

/// Milliseconds since then.
pub fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
