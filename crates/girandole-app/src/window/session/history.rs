//! What was done to the scene, step by step, to be taken back and done again.
//!
//! A drag, or what is done to one control until it is let go, is one step: edits go on with the open step where they
//! [override](Edit::overrides) its first one, until it is sealed. Time that passes is one step, however often it is
//! stopped.

use crate::args::LoadArgs;
use girandole_core::scene::{Edit, Edits, Scene, Snapshot, Step};

/// Older ones are forgotten.
const MOST: usize = 1000;

/// What is exchanged where a step is taken back or made again.
pub enum Entry {
    /// What is in the scene.
    Scene(Box<Step>),
    /// What is around it.
    Around(Box<LoadArgs>),
}

/// A step that may go on.
enum Open {
    Scene { first: Box<Edit>, before: Box<Snapshot>, sealed: bool },
    Around { before: Box<LoadArgs>, sealed: bool },
}

/// Steps that can be taken back, and those that were.
#[derive(Default)]
pub struct History {
    done: Vec<Entry>,
    undone: Vec<Entry>,
    open: Option<Open>,
}

impl History {
    /// Whether there is a step to take back.
    pub fn can_undo(&self) -> bool {
        self.open.is_some() || !self.done.is_empty()
    }

    /// Whether there is a step to make again.
    pub fn can_redo(&self) -> bool {
        !self.undone.is_empty()
    }

    /// Called before an edit is made.
    pub fn begin(&mut self, edit: &Edit, scene: &Scene, edits: &Edits, load: &LoadArgs) {
        let is_time = matches!(edit, Edit::SetTime { .. });
        if let Some(Open::Scene { first, sealed, .. }) = &mut self.open {
            let is_all_time = is_time && matches!(**first, Edit::SetTime { .. });
            if is_all_time || !*sealed && (is_time || edit.overrides(first)) {
                *sealed = false;
                return;
            }
        }
        self.close(scene, edits, load);
        let before = Box::new(Snapshot::of(scene, edits));
        self.open = Some(Open::Scene { first: Box::new(edit.clone()), before, sealed: false });
    }

    /// Called before something else is around the scene.
    pub fn begin_around(&mut self, scene: &Scene, edits: &Edits, load: &LoadArgs) {
        if matches!(self.open, Some(Open::Around { sealed: false, .. })) {
            return;
        }
        self.close(scene, edits, load);
        self.open = Some(Open::Around { before: Box::new(load.clone()), sealed: false });
    }

    /// What was taken back cannot be made again after something else was done.
    pub fn forget_undone(&mut self) {
        self.undone.clear();
    }

    /// What comes next is another step.
    pub fn seal(&mut self) {
        if let Some(Open::Scene { sealed, .. } | Open::Around { sealed, .. }) = &mut self.open {
            *sealed = true;
        }
    }

    /// Whether a step goes on.
    pub fn is_open(&self) -> bool {
        matches!(self.open, Some(Open::Scene { sealed: false, .. } | Open::Around { sealed: false, .. }))
    }

    /// Ends the open step: it is a step where anything changed.
    fn close(&mut self, scene: &Scene, edits: &Edits, load: &LoadArgs) {
        let entry = match self.open.take() {
            None => None,
            Some(Open::Scene { before, .. }) => {
                before.step(scene, edits).map(|step| Entry::Scene(Box::new(step)))
            }
            Some(Open::Around { before, .. }) => (*before != *load).then_some(Entry::Around(before)),
        };
        self.done.extend(entry);
        if self.done.len() > MOST {
            self.done.remove(0);
        }
    }

    /// The last step, to be taken back.
    pub fn last(&mut self, scene: &Scene, edits: &Edits, load: &LoadArgs) -> Option<Entry> {
        self.close(scene, edits, load);
        self.done.pop()
    }

    /// The last step that was taken back, to be made again.
    pub fn next(&mut self, scene: &Scene, edits: &Edits, load: &LoadArgs) -> Option<Entry> {
        self.close(scene, edits, load);
        self.undone.pop()
    }

    /// Keeps a step that was exchanged; `undone` tells where.
    pub fn keep(&mut self, entry: Entry, undone: bool) {
        if undone { self.undone.push(entry) } else { self.done.push(entry) }
    }
}
