//! What of a file is broken and left out: one sentence for each kind of thing, however many there are.

use super::document::shortened;
use super::{Importer, Parsed};

/// Names in a sentence.
const MOST_NAMES: usize = 3;

/// What is left out, by kind.
#[derive(Default)]
pub(super) struct Omissions(Vec<Omission>);

struct Omission {
    kind: &'static str,
    count: usize,
    names: Vec<String>,
    /// Why the first is.
    reason: String,
}

impl Omissions {
    fn add(&mut self, kind: &'static str, name: String, reason: String) {
        match self.0.iter_mut().find(|omission| omission.kind == kind) {
            Some(omission) => {
                omission.count += 1;
                if omission.names.len() < MOST_NAMES && !omission.names.contains(&name) {
                    omission.names.push(name);
                }
            }
            None => self.0.push(Omission { kind, count: 1, names: vec![name], reason }),
        }
    }

    pub fn sentences(&self) -> impl Iterator<Item = String> {
        self.0.iter().map(|Omission { kind, count, names, reason }| {
            let names = names.join(", ");
            let reason = shortened(reason, 300);
            match count {
                1 => format!("{kind} {names} is left out: {reason}"),
                _ => format!("{kind} is left out {count} times ({names}, …); the first time {reason}"),
            }
        })
    }
}

impl Importer<'_> {
    /// What was read, or `None` for what is broken and left out, as is said in the end.
    ///
    /// # Errors
    /// Where the file is refused as a whole.
    pub(super) fn or_without<T>(
        &mut self,
        kind: &'static str,
        name: impl FnOnce() -> String,
        read: Parsed<T>,
    ) -> Parsed<Option<T>> {
        match read {
            Ok(read) => Ok(Some(read)),
            Err(reason) if self.document.budget.is_refused() => Err(reason),
            Err(reason) => {
                self.omissions.add(kind, shortened(&name(), 60), reason);
                Ok(None)
            }
        }
    }
}
