//! Objects that are lit by precomputed radiance transfer.

use super::Renderer;
use crate::Result;
use crate::gpu_scene::light_source::LightSource;
use crate::gpu_scene::transfer::Transferred;
use crate::resident::Resident;
use girandole_core::lights::LightSet;
use girandole_core::scene::{Geometry, ObjectId, Scene};
use girandole_core::transfer::{Gathering, ObjectTransfer};
use girandole_core::visibility::VisibilityDatabase;
use std::sync::Arc;

impl Renderer {
    /// Lights an object by its precomputed transfer, or by shadow maps again (`None`), as all objects are at first: from the next
    /// frame on, or where the caller [loads](Renderer::load) light of his own, from the next time that he does. The light
    /// that arrives about the object is [gathered](Gathering) anew in each frame, or with each [`Renderer::update`]; the object moves, turns
    /// and scales with the scene, and casts its shadows as ever. Its surface reflects diffusely, without highlights and
    /// normal maps. While it is stretched, or has become another mesh, shadow maps light it.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) where the transfer is that of another mesh or a grid has too many points,
    /// [`Error::TooLarge`](crate::Error::TooLarge) beyond the device's limits.
    pub fn set_transfer(
        &mut self,
        scene: &Scene,
        object: ObjectId,
        transfer: Option<(Arc<ObjectTransfer>, Gathering)>,
    ) -> Result<()> {
        match transfer {
            Some((transfer, gathering)) => {
                transfer.frame(scene, object)?;
                let transferred = Transferred::new(&self.context, transfer, gathering)?;
                self.transfers.insert(object, transferred);
            }
            None => drop(self.transfers.remove(&object)),
        }
        self.transfer_anew(scene)
    }

    /// The objects that are lit by transfer.
    pub fn transferred(&self) -> impl Iterator<Item = ObjectId> + '_ {
        self.transfers.keys().copied()
    }

    /// Lights objects by transfer, in the scene that is open as it is.
    pub(super) fn transfer_anew(&mut self, scene: &Scene) -> Result<()> {
        let Some(illumination) = self.illumination.take() else { return Ok(()) };
        let (geometry, lights) = (illumination.geometry(), illumination.lights());
        let current = geometry.belongs_to(scene);
        let done = match current {
            Ok(()) => self.transfer_with(scene, geometry, lights, illumination.visibility()),
            Err(error) => Err(error.into()),
        };
        self.illumination = Some(illumination);
        done
    }

    /// The same with this light.
    pub(super) fn transfer_with(
        &mut self,
        scene: &Scene,
        geometry: &Geometry,
        lights: &LightSet,
        visibility: Option<&Arc<VisibilityDatabase>>,
    ) -> Result<()> {
        let is_unused = |resident: &Resident| self.transfers.is_empty() && resident.transfer.is_none();
        if self.scene.as_ref().is_none_or(is_unused) {
            return Ok(());
        }
        self.change();
        let Some(resident) = &mut self.scene else { return Ok(()) };
        let source = LightSource { scene, geometry, lights, visibility, transfers: &self.transfers };
        resident.transfer(&self.context, source)
    }
}
