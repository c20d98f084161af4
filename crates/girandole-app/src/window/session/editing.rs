//! Changes of the scene by hand: made, written down, taken back and made again.

use super::history::Entry;
use super::{Session, Source};
use crate::args::{BackgroundArg, LoadArgs};
use anyhow::Result;
use girandole_core::scene::{Edit, ReadModel, load_model};
use std::sync::Arc;

impl Session {
    /// Puts everything where it is at a moment.
    pub fn seek(&mut self, seconds: f64) {
        self.playback.seconds = seconds;
        self.edit(Edit::SetTime { seconds });
    }

    /// Changes the scene, and writes down how.
    pub fn edit(&mut self, edit: Edit) {
        self.edit_with(edit, &load_model);
    }

    /// The same with a model that was read already.
    pub fn edit_with(&mut self, edit: Edit, read_model: &ReadModel) {
        self.edit_all(vec![edit], read_model);
    }

    /// Changes the scene in several ways at once: one step, up to what is refused.
    pub fn edit_all(&mut self, edits: Vec<Edit>, read_model: &ReadModel) {
        let Some(first) = edits.first() else { return };
        self.history.begin(first, &self.scene, &self.edits, &self.source.load);
        for edit in edits {
            let refused = self.edits.record(edit, Arc::make_mut(&mut self.scene), read_model).err();
            if let Some(error) = refused {
                return self.notice = Some(crate::sentence(&error.into()));
            }
            self.history.forget_undone();
        }
    }

    /// Shows the scene with something else around it, by these options.
    pub fn surround(&mut self, load: LoadArgs) {
        self.history.begin_around(&self.scene, &self.edits, &self.source.load);
        self.attempt(|session| {
            session.put_around(load)?;
            session.history.forget_undone();
            Ok(())
        });
    }

    /// What comes next is another step: whatever was dragged or typed into was let go.
    pub fn end_step(&mut self) {
        self.history.seal();
    }

    /// Whether there is a step to take back, and one to make again.
    pub fn can_undo_and_redo(&self) -> [bool; 2] {
        [self.history.can_undo(), self.history.can_redo()]
    }

    /// Takes the last step back.
    pub fn undo(&mut self) {
        let Self { scene, edits, source, .. } = self;
        if let Some(entry) = self.history.last(scene, edits, &source.load) {
            self.exchange(entry, true);
        }
    }

    /// Makes the step again that was taken back last.
    pub fn redo(&mut self) {
        let Self { scene, edits, source, .. } = self;
        if let Some(entry) = self.history.next(scene, edits, &source.load) {
            self.exchange(entry, false);
        }
    }

    /// Takes back what was done in the step that goes on, as if it had never been.
    pub fn cancel_step(&mut self) {
        if !self.history.is_open() {
            return;
        }
        let Self { scene, edits, source, .. } = self;
        if let Some(Entry::Scene(mut step)) = self.history.last(scene, edits, &source.load) {
            step.exchange(Arc::make_mut(&mut self.scene), &mut self.edits);
            self.was_exchanged();
        }
    }

    fn exchange(&mut self, entry: Entry, undone: bool) {
        match entry {
            Entry::Scene(mut step) => {
                step.exchange(Arc::make_mut(&mut self.scene), &mut self.edits);
                self.history.keep(Entry::Scene(step), undone);
                self.was_exchanged();
            }
            Entry::Around(load) => {
                let now = Box::new(self.source.load.clone());
                match self.put_around(*load.clone()) {
                    Ok(()) => self.history.keep(Entry::Around(now), undone),
                    Err(error) => {
                        self.notice = Some(crate::sentence(&error));
                        self.history.keep(Entry::Around(load), !undone);
                    }
                }
            }
        }
    }

    /// What goes along with the scene's edits follows them.
    fn was_exchanged(&mut self) {
        self.playback.playing = false;
        let time = self.edits.0.iter().rev().find_map(|edit| match edit {
            Edit::SetTime { seconds } => Some(*seconds),
            _ => None,
        });
        self.playback.seconds = time.unwrap_or_default();
        self.transfers.keep_those_in(&self.scene);
        if let super::Eye::Camera(index) = self.eye
            && index >= self.scene.cameras.len()
        {
            self.eye = super::Eye::Camera(0);
        }
        self.refused = None;
    }

    fn put_around(&mut self, load: LoadArgs) -> Result<()> {
        // What plays is no part of what is around.
        let clip = self.source.load.clip.clone();
        let source = Source { load: LoadArgs { clip, ..load }, ..self.source.clone() };
        let (before, load) = (&self.source.load, &source.load);
        let (had, has) = (before.environment.is_some(), load.environment.is_some());
        // In a studio, a background comes with a ground.
        if had && has || had == has && before.background == load.background {
            let mut environment = self.scene.environment.clone();
            if let Some(environment) = &mut environment {
                environment.visible = load.background == BackgroundArg::Environment;
            }
            let is_same = before.environment == load.environment
                && before.environment_strength == load.environment_strength
                && before.environment_rotation == load.environment_rotation;
            let environment = if is_same { environment } else { crate::scene::environment(load)?.0 };
            let scene = Arc::make_mut(&mut self.scene);
            scene.environment = environment;
            scene.touch();
        } else {
            // Other light may have been added where there was no environment, and a ground.
            let mut scene = crate::scene::load(&source.scene, source.object.as_deref(), load)?;
            self.edits.apply(&mut scene, &load_model)?;
            scene.open();
            self.scene = Arc::new(scene);
        }
        self.source = source;
        (self.is_open, self.making) = (false, None);
        self.refused = None;
        Ok(())
    }
}
