//! Which objects of the window's scene are lit by precomputed transfer.

use super::super::pending::{self, Pending};
use super::Session;
use crate::args::TransferArgs;
use crate::transfer::{self, Transferred};
use anyhow::Result;
use girandole::Renderer;
use girandole_core::scene::{ObjectId, Scene, builtin};
use girandole_core::transfer::Gathering;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// Objects with transfer, and how that is simulated.
pub struct Transfers {
    /// The options of the command line, for further objects.
    args: TransferArgs,
    objects: Vec<Transferred>,
    /// Whether the renderer lights these.
    is_applied: bool,
    /// Those that will follow.
    simulated: Vec<Simulated>,
}

/// An object whose transfer is being simulated beside.
struct Simulated {
    object: ObjectId,
    gathering: Gathering,
    /// What is done, 0 to 1, as bits.
    share: Arc<AtomicU32>,
    result: Pending<Result<Transferred>>,
}

impl Transfers {
    pub fn new(args: TransferArgs, objects: Vec<Transferred>) -> Self {
        Self { args, objects, is_applied: false, simulated: Vec::new() }
    }

    /// Where the light of an object is gathered, if it has transfer or will have it.
    pub fn gathering(&self, object: ObjectId) -> Option<Gathering> {
        let there = self.objects.iter().map(|transferred| (transferred.object, transferred.gathering));
        let following = self.simulated.iter().map(|simulated| (simulated.object, simulated.gathering));
        there.chain(following).find(|(other, _)| *other == object).map(|(_, gathering)| gathering)
    }

    /// The share that is done of what is being simulated, 0 to 1.
    pub fn progress(&self) -> Option<f32> {
        let shares = self.simulated.iter().map(|s| f32::from_bits(s.share.load(Ordering::Relaxed)));
        (!self.simulated.is_empty()).then(|| shares.sum::<f32>() / self.simulated.len() as f32)
    }

    /// Lights an object by transfer as soon as this has made it, beside; it is given what to tell the finished share.
    pub(super) fn simulate(
        &mut self,
        object: ObjectId,
        gathering: Gathering,
        make: impl Fn(&(dyn Fn(f32) + Sync)) -> Result<Transferred> + Send + 'static,
    ) {
        let share = Arc::new(AtomicU32::new(0));
        let done = share.clone();
        let result =
            pending::beside(async move || make(&|share: f32| done.store(share.to_bits(), Ordering::Relaxed)));
        self.simulated.push(Simulated { object, gathering, share, result });
    }

    /// Leaves objects whose transfer is not there yet to shadow maps.
    pub fn cancel(&mut self) {
        self.simulated.clear();
    }

    /// Objects of the scene have transfer from the start.
    pub fn hold(&mut self, objects: Vec<Transferred>) {
        (self.objects, self.is_applied) = (objects, false);
    }

    /// The scene is another one.
    pub fn clear(&mut self) {
        self.objects.clear();
        self.simulated.clear();
        self.is_applied = false;
    }

    /// Objects may have gone, and come back.
    pub fn keep_those_in(&mut self, scene: &Scene) {
        let is_there = |id: ObjectId| scene.objects.get(id.index()).is_some_and(|o| !o.removed);
        self.objects.retain(|transferred| is_there(transferred.object));
        self.simulated.retain(|simulated| is_there(simulated.object));
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
    /// Lights an object by shadow maps, or by transfer: as soon as it is there, if it has to be simulated.
    pub fn set_transfer(&mut self, object: ObjectId, gathering: Option<Gathering>) {
        let transfers = &mut self.transfers;
        let known = transfers.objects.iter().position(|transferred| transferred.object == object);
        let following = transfers.simulated.iter().position(|simulated| simulated.object == object);
        match (known, following, gathering) {
            (Some(index), _, Some(gathering)) => transfers.objects[index].gathering = gathering,
            (Some(index), _, None) => drop(transfers.objects.remove(index)),
            (None, Some(index), Some(gathering)) => transfers.simulated[index].gathering = gathering,
            (None, Some(index), None) => drop(transfers.simulated.remove(index)),
            (None, None, Some(gathering)) => {
                let (scene, args) = (self.scene.clone(), transfers.args.clone());
                transfers.simulate(object, gathering, move |progress| {
                    transfer::of_object(&scene, object, &args, gathering, progress)
                });
            }
            (None, None, None) => {}
        }
        if known.is_some() {
            self.transfers.is_applied = false;
            self.forget_picture();
        }
    }

    /// Takes what has been simulated by now. Returns whether there was any.
    pub fn collect_transfer(&mut self) -> bool {
        let Transfers { objects, simulated, is_applied, .. } = &mut self.transfers;
        let mut error = None;
        let before = simulated.len();
        simulated.retain_mut(|simulated| {
            let Some(result) = simulated.result.take() else { return true };
            match result {
                Ok(_) if self.scene.objects[simulated.object.index()].removed => {}
                Ok(transferred) => {
                    objects.push(Transferred { gathering: simulated.gathering, ..transferred });
                    *is_applied = false;
                }
                Err(said) => error = Some(crate::sentence(&said)),
            }
            false
        });
        let is_there = simulated.len() < before;
        if is_there {
            self.notice = error.or(self.notice.take());
            self.forget_picture();
        }
        is_there
    }
}
