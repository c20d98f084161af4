//! What visibility depends on of a light.

use super::blockers::BlockerTree;
use super::shapes::Apex;
use super::surfaces::Surfaces;
use crate::lights::LightSample;

/// What visibility depends on of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightPoint {
    pub apex: Apex,
    /// The blocker that it lies on, or [`NONE`](crate::scene::NONE).
    pub own: u32,
    /// See [`BlockerTree::is_outside`].
    pub is_outside: bool,
}

impl LightPoint {
    /// Of all lights; `blockers` are the static ones.
    pub fn of(samples: &[LightSample], surfaces: &Surfaces, blockers: &BlockerTree) -> Vec<Self> {
        let point = |light: &LightSample| {
            let apex = Apex::new(light);
            Self { own: surfaces.blocker_of(light.triangle()), is_outside: blockers.is_outside(&apex), apex }
        };
        samples.iter().map(point).collect()
    }
}
