//! What is not supported is said once.

use bevy::log::warn;
use std::collections::HashSet;

/// Sentences that were said.
#[derive(Default)]
pub struct Notices(HashSet<String>);

impl Notices {
    /// Warns, the first time that it is called with this sentence.
    pub fn say(&mut self, sentence: impl Into<String>) {
        let sentence = sentence.into();
        if !self.0.contains(&sentence) {
            warn!("{sentence}");
            self.0.insert(sentence);
        }
    }

    /// Whether a sentence with these words was said.
    #[cfg(test)]
    pub fn has(&self, words: &str) -> bool {
        self.0.iter().any(|sentence| sentence.contains(words))
    }
}
