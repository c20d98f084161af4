//! Light samples and what goes with them.

use super::transfer::Transfers;
use girandole_core::lights::LightSet;
use girandole_core::scene::{Geometry, Scene};
use girandole_core::visibility::VisibilityDatabase;
use std::sync::Arc;

/// Light samples for a scene that stays, and their visibility if that is known.
#[derive(Clone, Copy)]
pub(crate) struct LightSource<'a> {
    pub scene: &'a Scene,
    pub geometry: &'a Geometry,
    pub lights: &'a LightSet,
    pub visibility: Option<&'a Arc<VisibilityDatabase>>,
    /// Which objects are lit by transfer.
    pub transfers: &'a Transfers,
}
