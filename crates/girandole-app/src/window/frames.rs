//! How long frames took, and what the last one did.

use super::clock::{Duration, Instant, milliseconds};
use super::pending::{self, Pending};
use crate::output::say;
use girandole::{FrameStats, Renderer, Result, Viewport, wgpu};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// How many frames are remembered.
pub const REMEMBERED: usize = 120;
/// Pictures of so long a time, seconds, are counted.
const COUNTED: f64 = 2.0;
/// Where there was none for so long, seconds, nothing moves any more.
pub const AT_REST: f64 = 1.0;
/// The least time between two estimates of the error that stale maps make.
const BETWEEN_ESTIMATES: Duration = Duration::from_secs(1);

/// Milliseconds of a frame with a new picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameTimes {
    /// Laying out and painting the panel, on the CPU.
    pub panel: f64,
    /// Following the scene, on the CPU.
    pub update: f64,
    /// Recording the picture, on the CPU.
    pub record: f64,
    /// From submitting it until the device is done.
    pub device: f64,
    /// Whether things moved, and a budget counted.
    pub hurried: bool,
    /// Whether nothing of it is left out or out of date.
    pub is_full: bool,
}

impl FrameTimes {
    pub fn total(&self) -> f64 {
        self.panel + self.update + self.record + self.device
    }
}

/// A picture that the device is at.
struct InFlight {
    /// Of a picture; none, of other work.
    times: Option<FrameTimes>,
    submitted: Instant,
    done: Arc<AtomicBool>,
}

/// The last frames.
#[derive(Default)]
pub struct Frames {
    pub history: VecDeque<FrameTimes>,
    /// When those were done.
    ends: VecDeque<Instant>,
    /// What the last picture took and did, where somebody looks.
    pub stats: Option<FrameStats>,
    /// An estimate of the error that stale shadow maps make, of a picture of the last seconds.
    pub stale_error: Option<f64>,
    pub wants_stats: bool,
    pub times_passes: bool,
    in_flight: Option<InFlight>,
    /// Whether there was a picture since.
    has_news: bool,
    pending: Option<Pending<Result<FrameStats>>>,
    pending_error: Option<Pending<Result<Option<f64>>>>,
    /// When the error was last asked for.
    estimated: Option<Instant>,
}

impl Frames {
    /// Whether the device is still at a picture: another one would only queue up.
    pub fn is_busy(&self) -> bool {
        self.in_flight.is_some()
    }

    /// Whether something is on its way.
    pub fn is_waiting(&self) -> bool {
        self.is_busy() || self.pending.is_some() || self.pending_error.is_some()
    }

    /// A picture was submitted.
    pub fn submitted(&mut self, queue: &wgpu::Queue, times: FrameTimes) {
        self.wait(queue, Some(times));
        self.has_news = true;
    }

    /// Other work was submitted.
    pub fn submitted_work(&mut self, queue: &wgpu::Queue) {
        self.wait(queue, None);
    }

    fn wait(&mut self, queue: &wgpu::Queue, times: Option<FrameTimes>) {
        let done = Arc::<AtomicBool>::default();
        let flag = done.clone();
        queue.on_submitted_work_done(move || flag.store(true, Ordering::Relaxed));
        self.in_flight = Some(InFlight { times, submitted: Instant::now(), done });
    }

    /// Asks what the last picture did, if somebody looks and it is not known yet; where there is no `hurry`, now and then also how
    /// wrong it is for its shadow maps, which takes as long as a small frame.
    pub fn ask(&mut self, shown_by: Option<(&Renderer, &Viewport)>, hurry: bool) {
        let wanted = shown_by.filter(|_| self.wants_stats && self.has_news && self.pending.is_none());
        let Some((renderer, viewport)) = wanted else { return };
        self.has_news = false;
        self.pending = Some(Pending::new(renderer.stats(viewport)));
        let is_due = self.estimated.is_none_or(|at| at.elapsed() >= BETWEEN_ESTIMATES);
        if renderer.stale().maps == 0 {
            self.stale_error = Some(0.0);
        } else if is_due && !hurry && self.pending_error.is_none() {
            self.estimated = Some(Instant::now());
            self.pending_error = Some(Pending::new(renderer.stale_error(viewport)));
        }
    }

    /// Milliseconds of a picture, the mean of the last ones; and how many there were a second, unless nothing moves.
    pub fn rate(&self, now: Instant) -> Option<(f64, Option<f64>)> {
        let age = |end: &Instant| now.saturating_duration_since(*end).as_secs_f64();
        let counted = self.ends.iter().rev().take_while(|end| age(end) <= COUNTED).count();
        let some = counted.max(1).min(self.history.len());
        let mean = self.history.iter().rev().take(some).map(FrameTimes::total).sum::<f64>() / some as f64;
        let last = self.ends.back().map(age)?;
        let first = counted.checked_sub(1).and_then(|before| self.ends.iter().rev().nth(before)).map(age);
        let rate = first.filter(|first| *first > last && last < AT_REST);
        Some((mean, rate.map(|first| (counted - 1) as f64 / (first - last))))
    }

    /// Takes what is there by now. Returns whether anything is, and the times of a picture that is done.
    pub fn collect(&mut self) -> (bool, Option<FrameTimes>) {
        let (mut any, mut times) = (false, None);
        if let Some(done) = self.in_flight.take_if(|picture| picture.done.load(Ordering::Relaxed)) {
            any = true;
            let device = milliseconds(done.submitted);
            times = done.times.map(|times| FrameTimes { device, ..times });
        }
        if let Some(times) = times {
            if self.history.len() == REMEMBERED {
                self.history.pop_front();
                self.ends.pop_front();
            }
            self.history.push_back(times);
            self.ends.push_back(Instant::now());
        }
        if let Some(error) = pending::take(&mut self.pending_error) {
            self.stale_error = error.ok().flatten();
            any = true;
        }
        match pending::take(&mut self.pending) {
            Some(Ok(stats)) => self.stats = Some(stats),
            Some(Err(error)) => say(&format!("warning: {error}")),
            None => return (any, times),
        }
        any = true;
        (any, times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_counted_while_there_are_any() {
        let start = Instant::now();
        let mut frames = Frames::default();
        assert_eq!(frames.rate(start), None);
        let after = |seconds: f64| start + Duration::from_secs_f64(seconds);
        for i in 0..40 {
            frames.history.push_back(FrameTimes { device: 10.0 + f64::from(i % 2), ..FrameTimes::default() });
            frames.ends.push_back(after(f64::from(i) * 0.1));
        }
        let (mean, rate) = frames.rate(after(3.95)).unwrap();
        assert!((mean - 10.5).abs() < 0.1 && (rate.unwrap() - 10.0).abs() < 1e-6, "{mean} {rate:?}");
        let (mean, rate) = frames.rate(after(6.5)).unwrap();
        assert_eq!((mean, rate), (11.0, None), "at rest the last one counts");
    }
}
