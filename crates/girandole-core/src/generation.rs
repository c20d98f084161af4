//! Which version of a scene something was derived from.

use crate::{Error, Result};
use std::sync::atomic::{AtomicU64, Ordering};

/// A version of a scene, or of what is derived from one. Each fresh one differs from all others of the process, so
/// equal generations mean the same contents; copies keep theirs. It is not meant to be stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Generation(u64);

impl Generation {
    /// One that nothing else has.
    pub fn fresh() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }

    /// Whether both are the same.
    ///
    /// # Errors
    /// [`Error::Invalid`] with this sentence.
    pub(crate) fn expect(self, other: Self, sentence: &str) -> Result<()> {
        if self == other { Ok(()) } else { Err(Error::Invalid(sentence.into())) }
    }
}

impl Default for Generation {
    /// A fresh one.
    fn default() -> Self {
        Self::fresh()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fresh_ones_differ_on_all_threads() {
        let many = || (0..1000).map(|_| Generation::fresh().0).collect::<Vec<_>>();
        let threads: Vec<_> = (0..4).map(|_| std::thread::spawn(many)).collect();
        let mut all: Vec<u64> = threads.into_iter().flat_map(|t| t.join().unwrap_or_default()).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 4000);
        let one = Generation::fresh();
        assert!(one.expect(one, "").is_ok() && one.expect(Generation::default(), "it").is_err());
    }
}
