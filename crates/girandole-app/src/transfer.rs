//! Precomputed transfer of a scene's objects: which have it, and where it is kept.

use crate::args::TransferArgs;
#[cfg(not(target_arch = "wasm32"))]
use crate::output::Progress;
use crate::output::say;
use anyhow::{Context, Result, bail};
use girandole::Renderer;
use girandole_core::scene::{NodeId, Object, ObjectId, Scene};
use girandole_core::transfer::{self, Cached, Gathering, ObjectTransfer};
use std::path::PathBuf;
use std::sync::Arc;

/// An object with its transfer.
#[derive(Clone)]
pub struct Transferred {
    pub object: ObjectId,
    pub transfer: Arc<ObjectTransfer>,
    pub gathering: Gathering,
}

/// The transfer of those objects that the options name: simulated, or read where that was done before.
pub fn load(scene: &Scene, args: &TransferArgs) -> Result<Vec<Transferred>> {
    let Some(gathering) = args.gathering() else {
        if !args.transfer_nodes.is_empty() {
            bail!("--transfer-nodes names nodes, and --transfer is off; give --transfer grid or centre");
        }
        return Ok(Vec::new());
    };
    let objects = marked(scene, &args.transfer_nodes)?;
    let transferred = |object: ObjectId| {
        #[cfg(not(target_arch = "wasm32"))]
        let bar = {
            let name = &scene.objects[object.index()].name;
            Progress::bar(&format!("simulating the light transfer of {name}"))
        };
        of_object(scene, object, args, gathering, &|_share| {
            #[cfg(not(target_arch = "wasm32"))]
            bar.set(_share);
        })
    };
    objects.into_iter().map(transferred).collect()
}

/// The same for one object; `done` is told the finished share, 0 to 1.
pub fn of_object(
    scene: &Scene,
    object: ObjectId,
    args: &TransferArgs,
    gathering: Gathering,
    done: &(dyn Fn(f32) + Sync),
) -> Result<Transferred> {
    let name = &scene.objects[object.index()].name;
    let settings = args.settings();
    let folder = cache("transfer");
    let (transfer, cached) = match &folder {
        Some(folder) => transfer::cached(scene, object, &settings, folder, done),
        None => ObjectTransfer::simulate(scene, object, &settings, done).map(|t| (t, Cached::Computed)),
    }
    .with_context(|| format!("`{name}` cannot have transfer"))?;
    match cached {
        Cached::Found | Cached::Computed => {}
        Cached::Recomputed { why } => say(&format!("simulated the light transfer of {name} again: {why}")),
        Cached::NotKept { why } => say(&format!("warning: the light transfer of {name} is not kept: {why}")),
    }
    if !transfer.error().has_enough_rays() {
        say(&format!(
            "warning: {} rays a vertex are few for {name}: raise --transfer-rays",
            settings.directions
        ));
    }
    if let Some(compressed) = transfer.compressed() {
        let [mean, worst] = [compressed.error.mean, compressed.error.worst].map(|share| share * 100.0);
        say(&format!(
            "the light transfer of {name} is compressed: wrong by {mean:.2} % in the mean, {worst:.2} % at most"
        ));
    }
    Ok(Transferred { object, transfer: Arc::new(transfer), gathering })
}

/// Lights these objects by transfer, and no others.
pub fn light_by(renderer: &mut Renderer, scene: &Scene, transfers: &[Transferred]) -> Result<()> {
    let before: Vec<ObjectId> = renderer.transferred().collect();
    for object in before.into_iter().filter(|object| !transfers.iter().any(|t| t.object == *object)) {
        renderer.set_transfer(scene, object, None)?;
    }
    for Transferred { object, transfer, gathering } in transfers {
        renderer.set_transfer(scene, *object, Some((transfer.clone(), *gathering)))?;
    }
    Ok(())
}

/// Variable that names the folder of what is kept from call to call, in place of one in the user's cache folder.
#[cfg(not(target_arch = "wasm32"))]
pub const CACHE: &str = "GIRANDOLE_CACHE";

/// Where something is kept from call to call.
#[cfg(not(target_arch = "wasm32"))]
pub fn cache(what: &str) -> Option<PathBuf> {
    let named = std::env::var_os(CACHE).filter(|folder| !folder.is_empty()).map(PathBuf::from);
    Some(named.or_else(|| Some(dirs::cache_dir()?.join("girandole")))?.join(what))
}

/// Browsers have no folders.
#[cfg(target_arch = "wasm32")]
fn cache(_what: &str) -> Option<PathBuf> {
    None
}

/// The objects with transfer: those on nodes of these names, or below; without names those that the scene marks, or in a built-in room
/// what moves.
fn marked(scene: &Scene, names: &[String]) -> Result<Vec<ObjectId>> {
    let unknown = names.iter().find(|name| !scene.nodes.iter().any(|node| node.name == **name));
    if let Some(name) = unknown {
        let mut known: Vec<&str> = scene.objects.iter().map(|o| scene.nodes[o.node].name.as_str()).collect();
        known.retain(|name| !name.is_empty());
        known.dedup();
        known.truncate(20);
        bail!("there is no node `{name}`; those with objects are {}", known.join(", "));
    }
    let is_named = |node: NodeId| names.contains(&scene.nodes[node].name);
    let is_marked = |node: NodeId| if names.is_empty() { scene.nodes[node].transfer } else { is_named(node) };
    let is_below = |mut node: NodeId| loop {
        if is_marked(node) {
            return true;
        }
        match scene.nodes[node].parent {
            Some(parent) => node = parent,
            None => return false,
        }
    };
    let of = |is_one: &dyn Fn(&Object) -> bool| -> Vec<ObjectId> {
        scene.placed_objects().filter(|(_, object)| is_one(object)).map(|(id, _)| id).collect()
    };
    let mut objects = of(&|object| is_below(object.node));
    let is_builtin = girandole_core::scene::builtin::NAMES.contains(&scene.name.as_str());
    if objects.is_empty() && names.is_empty() && is_builtin {
        objects = of(&|object| object.dynamic);
    }
    if objects.is_empty() {
        let where_from = if is_builtin {
            "choose one with --object"
        } else {
            "name nodes with --transfer-nodes, or mark them in the file with extras {\"transfer\": true}"
        };
        bail!("no object is to have transfer; {where_from}");
    }
    Ok(objects)
}
