//! The times of all frames of a session, for `--stats`.

use super::clock::{Instant, milliseconds};
use super::frames::FrameTimes;
use crate::output::Stats;

/// Times of frames with a new picture.
pub struct FrameLog {
    started: Instant,
    all: Vec<FrameTimes>,
    /// From the start of the program to the first picture, milliseconds.
    first_picture: Option<f64>,
    /// The same to the first one with all light.
    first_full: Option<f64>,
    /// When the last frame was shown while things moved, until there is one of full quality.
    hurried_at: Option<Instant>,
    /// From the last frame while things moved to the first one of full quality, milliseconds.
    sharpened: Vec<f64>,
}

impl FrameLog {
    /// Of a program that started then.
    pub fn new(started: Instant) -> Self {
        Self {
            started,
            all: Vec::new(),
            first_picture: None,
            first_full: None,
            hurried_at: None,
            sharpened: Vec::new(),
        }
    }

    pub fn add(&mut self, times: &FrameTimes) {
        self.first_picture.get_or_insert_with(|| milliseconds(self.started));
        if times.is_full {
            self.first_full.get_or_insert_with(|| milliseconds(self.started));
        }
        self.all.push(*times);
        if times.hurried {
            self.hurried_at = Some(Instant::now());
        } else if let Some(at) = self.hurried_at.take_if(|_| times.is_full) {
            self.sharpened.push(milliseconds(at));
        }
    }

    /// One flat object; `budget` in milliseconds.
    pub fn stats(&self, budget: Option<f64>) -> Stats {
        let mut stats = Stats::new();
        stats.insert("frames".into(), self.all.len().into());
        if let Some(ms) = self.first_picture {
            stats.insert("first_picture_ms".into(), ms.into());
        }
        if let Some(ms) = self.first_full {
            stats.insert("first_full_picture_ms".into(), ms.into());
        }
        let hurried: Vec<f64> =
            self.all.iter().filter(|times| times.hurried).map(FrameTimes::total).collect();
        let of = |part: fn(&FrameTimes) -> f64| self.all.iter().map(part).collect::<Vec<f64>>();
        for (name, times) in [
            ("frame", &of(FrameTimes::total)),
            ("panel", &of(|times| times.panel)),
            ("update", &of(|times| times.update)),
            ("record", &of(|times| times.record)),
            ("device", &of(|times| times.device)),
            ("moving_frame", &hurried),
            ("full_quality_after", &self.sharpened),
        ] {
            for (suffix, share) in [("median_ms", 0.5), ("p95_ms", 0.95)] {
                if let Some(ms) = quantile(times, share) {
                    stats.insert(format!("{name}_{suffix}"), ms.into());
                }
            }
        }
        if let Some(budget) = budget.filter(|_| !hurried.is_empty()) {
            let kept = hurried.iter().filter(|&&ms| ms <= budget).count();
            stats.insert("interactive_budget_ms".into(), budget.into());
            stats.insert("within_budget_share".into(), (kept as f64 / hurried.len() as f64).into());
        }
        stats
    }
}

/// What so large a share of the values does not exceed.
fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let rank = (sorted.len() as f64 * share).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nineteen_of_twenty_keep() {
        let mut log = FrameLog::new(Instant::now());
        for i in 1..=20 {
            log.add(&FrameTimes { device: f64::from(i) * 10.0, hurried: i <= 10, ..FrameTimes::default() });
        }
        let stats = log.stats(Some(95.0));
        let number = |name: &str| stats[name].as_f64().unwrap();
        assert_eq!((number("frame_median_ms"), number("frame_p95_ms")), (100.0, 190.0));
        assert_eq!((number("moving_frame_p95_ms"), number("within_budget_share")), (100.0, 0.9));
        assert!(!log.stats(None).contains_key("within_budget_share"));
        assert_eq!(FrameLog::new(Instant::now()).stats(Some(1.0)).len(), 1);
    }
}
