//! Which objects of the window's scene are lit by precomputed transfer.

use super::Session;
use crate::args::TransferArgs;
use crate::transfer::{self, Transferred};
use anyhow::Result;
use girandole::Renderer;
use girandole_core::scene::{ObjectId, Scene, builtin};
use girandole_core::transfer::Gathering;

/// Objects with transfer, and how that is simulated.
pub struct Transfers {
    /// The options of the command line, for further objects.
    args: TransferArgs,
    objects: Vec<Transferred>,
    /// Whether the renderer lights these.
    is_applied: bool,
}

impl Transfers {
    pub fn new(args: TransferArgs, objects: Vec<Transferred>) -> Self {
        Self { args, objects, is_applied: false }
    }

    /// Where the light of an object is gathered, if it has transfer.
    pub fn gathering(&self, object: ObjectId) -> Option<Gathering> {
        self.objects.iter().find(|transferred| transferred.object == object).map(|found| found.gathering)
    }

    /// The scene is another one.
    pub fn clear(&mut self) {
        self.objects.clear();
        self.is_applied = false;
    }

    /// The renderer is another one.
    pub fn forget_renderer(&mut self) {
        self.is_applied = false;
    }

    /// Has the renderer light these objects, and no others.
    pub fn apply(&mut self, renderer: &mut Renderer, scene: &Scene) -> Result<()> {
        if !self.is_applied {
            transfer::light_by(renderer, scene, &self.objects)?;
            self.is_applied = true;
        }
        Ok(())
    }

    /// The options of `girandole render` that light the same objects. It knows one way for all of them.
    pub fn arguments(&self, scene: &Scene) -> TransferArgs {
        let gathering = self.objects.first().map(|transferred| transferred.gathering);
        let mut args = self.args.clone().with_gathering(gathering);
        let is_builtin = builtin::NAMES.contains(&scene.name.as_str());
        let node = |t: &Transferred| scene.nodes[scene.objects[t.object.index()].node].name.clone();
        args.transfer_nodes = if is_builtin { Vec::new() } else { self.objects.iter().map(node).collect() };
        args
    }
}

impl Session {
    /// Lights an object by transfer, which is simulated now unless that was done before, or by shadow maps.
    pub fn set_transfer(&mut self, object: ObjectId, gathering: Option<Gathering>) {
        self.attempt(|session| {
            let Transfers { args, objects, is_applied } = &mut session.transfers;
            let known = objects.iter().position(|transferred| transferred.object == object);
            match (known, gathering) {
                (Some(index), Some(gathering)) => objects[index].gathering = gathering,
                (Some(index), None) => drop(objects.remove(index)),
                (None, Some(gathering)) => {
                    objects.push(transfer::of_object(&session.scene, object, args, gathering)?);
                }
                (None, None) => return Ok(()),
            }
            *is_applied = false;
            session.forget_picture();
            Ok(())
        });
    }
}
