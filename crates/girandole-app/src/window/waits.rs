//! What is being waited for, as the bar says it.

use super::clock::{Duration, Instant};

/// Shorter waits are not worth a word.
const WORTH_A_WORD: Duration = Duration::from_millis(250);

/// Kinds of waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// A file is read or written.
    Opening,
    /// The system's dialog is open.
    Choosing,
    /// The device's kernels are compiled.
    Compiling,
}

/// What is being waited for.
#[derive(Clone, Debug)]
pub struct Wait {
    pub what: What,
    /// As in `Opening room.glb`.
    pub text: String,
    pub since: Instant,
    /// What is done of it, 0 to 1, where that is known.
    pub share: Option<f32>,
}

impl Wait {
    /// How long until it is to be said; zero when it is.
    pub fn said_in(&self, now: Instant) -> Duration {
        WORTH_A_WORD.saturating_sub(now.saturating_duration_since(self.since))
    }

    /// What is said, with how long it has taken so far where nothing else says how far it is.
    pub fn sentence(&self, now: Instant) -> String {
        let seconds = now.saturating_duration_since(self.since).as_secs();
        match self.share {
            None if seconds > 0 => format!("{}, {seconds} s", self.text),
            _ => self.text.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_takes_a_moment_is_not_said() {
        let since = Instant::now();
        let wait = Wait { what: What::Opening, text: "Opening a.glb".into(), since, share: None };
        let after = |ms| since + Duration::from_millis(ms);
        assert!(wait.said_in(after(0)) > Duration::ZERO && wait.said_in(after(249)) > Duration::ZERO);
        assert_eq!(wait.said_in(after(300)), Duration::ZERO, "what takes longer than .3 s is");
        assert_eq!(
            (wait.sentence(after(300)), wait.sentence(after(2300))),
            ("Opening a.glb".into(), "Opening a.glb, 2 s".into())
        );
        let half = Wait { share: Some(0.5), ..wait };
        assert_eq!(half.sentence(after(2300)), "Opening a.glb");
    }
}
