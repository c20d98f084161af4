//! Kernels that the next picture waits for: the last one stays meanwhile, and the window listens.

use super::super::clock::Instant;
use super::super::waits::{Wait, What};
use super::Session;

impl Session {
    /// Whether the next picture's kernels are compiled; where they are not, that is begun.
    pub fn is_compiled(&mut self, size: [u32; 2]) -> bool {
        let picture = self.picture(size);
        let settings = picture.quality.settings(&picture.settings);
        let is_compiled = self.renderer.as_ref().is_none_or(|renderer| renderer.is_compiled_for(&settings));
        if is_compiled && let Some(renderer) = self.renderer.as_ref().filter(|_| self.is_preliminary()) {
            // Those of the picture that comes after the first one.
            renderer.is_compiled_for(&self.settings);
        }
        self.compiling = (!is_compiled).then(|| self.compiling.unwrap_or_else(Instant::now));
        is_compiled
    }

    /// What the next picture waits for.
    pub fn wait(&self) -> Option<Wait> {
        let compilation = self.renderer.as_ref()?.compilation();
        if compilation.is_done() {
            return None;
        }
        let (done, total) = (compilation.done, compilation.total);
        let share = Some(done as f32 / total.max(1) as f32);
        let text = format!("Compiling kernels ({done} of {total})");
        Some(Wait { what: What::Compiling, text, since: self.compiling?, share })
    }
}
