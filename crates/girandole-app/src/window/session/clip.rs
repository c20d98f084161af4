//! Which of the scene's animations plays.

use super::Session;
use std::sync::Arc;

impl Session {
    /// Has one animation play alone, or all that drive different things.
    pub fn choose_clip(&mut self, clip: Option<usize>) {
        self.end_step();
        self.attempt(|session| {
            Arc::make_mut(&mut session.scene).choose_clip(clip)?;
            session.source.load.clip = clip.map(|clip| clip.to_string());
            Ok(())
        });
        let duration = self.scene.duration();
        self.seek(if duration > 0.0 { self.playback.seconds % duration } else { 0.0 });
    }
}
