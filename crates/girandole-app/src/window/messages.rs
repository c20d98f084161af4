//! What is to be known: one sentence at a time, that goes by itself.

use super::clock::{Duration, Instant};
use std::collections::VecDeque;

/// How long a sentence stays: to notice it, and for each character to read it.
const NOTICED: Duration = Duration::from_secs(3);
const CHARACTER: Duration = Duration::from_millis(60);
/// How many are kept for those who look later.
const KEPT: usize = 30;

/// The sentence that is shown, and those before it.
#[derive(Default)]
pub struct Messages {
    /// Until when it is shown.
    shown: Option<(String, Instant)>,
    said: VecDeque<String>,
}

impl Messages {
    /// Says a sentence in place of the last one.
    pub fn say(&mut self, sentence: String, now: Instant) {
        let until = now + NOTICED + CHARACTER * sentence.chars().count() as u32;
        if self.said.back() != Some(&sentence) {
            self.said.push_back(sentence.clone());
        }
        if self.said.len() > KEPT {
            self.said.pop_front();
        }
        self.shown = Some((sentence, until));
    }

    /// The sentence that is to be shown, and for how long still.
    pub fn shown(&self, now: Instant) -> Option<(&str, Duration)> {
        let (sentence, until) = self.shown.as_ref().filter(|(_, until)| *until > now)?;
        Some((sentence, *until - now))
    }

    /// It is being read: it stays a little longer.
    pub fn hold(&mut self, now: Instant) {
        if let Some((_, until)) = self.shown.as_mut().filter(|(_, until)| *until > now) {
            *until = (*until).max(now + NOTICED);
        }
    }

    /// It was read.
    pub fn dismiss(&mut self) {
        self.shown = None;
    }

    /// The last ones, the latest first.
    pub fn last(&self) -> impl Iterator<Item = &str> {
        self.said.iter().rev().map(String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_shown_at_a_time_and_goes_by_itself() {
        let (mut messages, start) = (Messages::default(), Instant::now());
        let after = |seconds: f64| start + Duration::from_secs_f64(seconds);
        let shown = |messages: &Messages, at| messages.shown(at).map(|(sentence, _)| sentence.to_owned());
        assert_eq!(shown(&messages, start), None);
        messages.say("wrote a.png".into(), start);
        assert_eq!(shown(&messages, after(3.5)).as_deref(), Some("wrote a.png"));
        messages.say("x".repeat(200), after(3.5));
        assert_eq!(shown(&messages, after(3.6)), Some("x".repeat(200)));
        // Longer ones stay longer, and none for ever.
        assert!(
            shown(&messages, after(3.5 + 14.0)).is_some() && shown(&messages, after(3.5 + 16.0)).is_none()
        );
        assert_eq!(messages.last().collect::<Vec<_>>(), ["x".repeat(200).as_str(), "wrote a.png"]);
        messages.say("wrote b.png".into(), after(20.0));
        messages.hold(after(23.5));
        assert!(shown(&messages, after(26.0)).is_some() && shown(&messages, after(26.6)).is_none());
        messages.hold(after(27.0));
        assert_eq!(shown(&messages, after(27.0)), None, "what is gone does not come back");
        messages.say("wrote c.png".into(), after(30.0));
        messages.dismiss();
        assert_eq!(shown(&messages, after(30.0)), None);
        (0..100).for_each(|i| messages.say(i.to_string(), after(40.0)));
        assert_eq!(messages.last().count(), KEPT);
    }
}
