//! What a frame needs before it can be recorded: kernels, textures of its size, lists of points.

mod order;

use crate::device::context::Context;
use crate::device::kernel::Shared;
use crate::gpu_scene::light_maps::LightMapChanges;
use crate::gpu_scene::previous_transforms::{GpuPreviousTransforms, PreviousTransforms};
use crate::gpu_scene::receivers::Receivers;
use crate::gpu_scene::transfer::GpuTransfer;
use crate::maps::cache::MapUpdate;
use crate::passes::Compiler;
use crate::passes::append_all_points::AppendAllPoints;
use crate::passes::average::Averaging;
use crate::passes::background::Background;
use crate::passes::caller_depth::CallerDepth;
use crate::passes::debug::Debug;
use crate::passes::edges::Edges;
use crate::passes::exposure::Exposure;
use crate::passes::first_samples::FirstSamples;
use crate::passes::layers::Layers;
use crate::passes::light_maps::LightMaps;
use crate::passes::mirrors::Mirrors;
use crate::passes::multipass::Multipass;
use crate::passes::refine::Refine;
use crate::passes::resolve::Resolve;
use crate::passes::shade_naive::ShadeNaive;
use crate::passes::shade_points::ShadePoints;
use crate::passes::shadow_maps::ShadowMaps;
use crate::passes::sort_points::SortPoints;
use crate::passes::stale_error::StaleError;
use crate::passes::transfer::Transfer;
use crate::passes::visibility_buffer::VisibilityBuffer;
use crate::points::lists::PointLists;
use crate::points::multipass_plan::{MultipassKey, MultipassPlan};
use crate::points::targets::{Drawn, Targets};
use crate::rays::RayHierarchies;
use crate::resident::{Resident, SceneFeatures};
use crate::settings::{DebugView, Mode, RenderSettings, Shading};
use crate::viewport::Viewport;
use crate::{Error, Result};
use girandole_core::scene::LocalView;
use std::sync::OnceLock;

/// The passes that every frame may have, whatever the scene.
pub(crate) struct Passes {
    pub shadow_maps: ShadowMaps,
    pub visibility_buffer: VisibilityBuffer,
    pub caller_depth: CallerDepth,
    pub exposure: Exposure,
    /// Compiled when a picture is refined for the first time.
    averaging: OnceLock<Averaging>,
    /// Compiled for a scene with an environment.
    background: OnceLock<Background>,
}

impl Passes {
    pub fn new(context: &Context) -> Self {
        let (device, shared) = (&context.device, &context.shared);
        Self {
            shadow_maps: ShadowMaps::new(device, shared, &context.options),
            visibility_buffer: VisibilityBuffer::new(device, shared),
            caller_depth: CallerDepth::new(device, shared),
            exposure: Exposure::new(device, shared),
            averaging: OnceLock::new(),
            background: OnceLock::new(),
        }
    }

    /// What puts an environment behind pictures.
    fn background(&self, context: &Context) -> &Background {
        self.background.get_or_init(|| Background::new(&context.device, &context.shared))
    }

    /// What averages pictures.
    pub fn averaging(&self, context: &Context) -> &Averaging {
        self.averaging.get_or_init(|| Averaging::new(&context.device, &context.shared))
    }
}

/// The passes that are compiled for what a scene needs, each when it is first used.
pub(crate) struct ScenePasses {
    pub features: SceneFeatures,
    naive: OnceLock<ShadeNaive>,
    adaptive: OnceLock<AdaptivePasses>,
    multipass: OnceLock<Multipass>,
    resolve: OnceLock<Resolve>,
    layers: OnceLock<Layers>,
    mirrors: OnceLock<Mirrors>,
    /// The passes over the ends of mirrored rays.
    naive_mirrored: OnceLock<ShadeNaive>,
    adaptive_mirrored: OnceLock<AdaptivePasses>,
    multipass_mirrored: OnceLock<Multipass>,
    transfer_mirrored: OnceLock<Transfer>,
    debug: OnceLock<Debug>,
    transfer: OnceLock<Transfer>,
    /// Without lists of lights, and with them.
    stale_error: [OnceLock<StaleError>; 2],
}

impl ScenePasses {
    pub fn new(features: SceneFeatures) -> Self {
        Self {
            features,
            naive: OnceLock::new(),
            adaptive: OnceLock::new(),
            multipass: OnceLock::new(),
            resolve: OnceLock::new(),
            layers: OnceLock::new(),
            mirrors: OnceLock::new(),
            naive_mirrored: OnceLock::new(),
            adaptive_mirrored: OnceLock::new(),
            multipass_mirrored: OnceLock::new(),
            transfer_mirrored: OnceLock::new(),
            debug: OnceLock::new(),
            transfer: OnceLock::new(),
            stale_error: [const { OnceLock::new() }; 2],
        }
    }

    /// What compares a frame of a mode with one whose shadow maps are all up to date.
    pub fn stale_error(&self, context: &Context, mode: Mode) -> &StaleError {
        let listed = mode != Mode::Naive;
        let compiler = Compiler::new(context, self.features);
        self.stale_error[usize::from(listed)].get_or_init(|| StaleError::new(&compiler, listed))
    }
}

/// The passes of all modes but the naive one.
pub(crate) struct AdaptivePasses {
    pub light_maps: LightMaps,
    pub append_all_points: AppendAllPoints,
    pub sort_points: SortPoints,
    to_irradiance: PointPasses,
    /// For the last grid, whose points are the picture's pixels. Only without textures, and where no environment is reflected.
    to_radiance: Option<RadiancePasses>,
}

/// The passes that store the picture's radiance.
pub(crate) struct RadiancePasses {
    points: PointPasses,
    /// For first samples, where those that follow store radiance.
    pub first_samples: FirstSamples,
}

/// The passes that store points of a grid.
pub(crate) struct PointPasses {
    pub refine: Refine,
    pub edges: Edges,
    shade_points: ShadePoints,
    /// For frames with stale shadow maps of what moves.
    shade_points_previous: OnceLock<ShadePoints>,
    /// Whether they store the picture's radiance.
    pub writes_radiance: bool,
}

impl PointPasses {
    /// Compiles what looks shadows on dynamic objects up where these were.
    fn compile_previous(&self, compiler: &Compiler) {
        let compiler = Compiler { writes_radiance: self.writes_radiance, ..*compiler };
        self.shade_points_previous.get_or_init(|| ShadePoints::new(&compiler, true));
    }

    /// What shades points; `then`: with shadows on dynamic objects looked up where these were.
    pub fn shade_points(&self, then: bool) -> &ShadePoints {
        self.shade_points_previous.get().filter(|_| then).unwrap_or(&self.shade_points)
    }
}

impl AdaptivePasses {
    fn new(compiler: &Compiler) -> Self {
        let points = |writes_radiance| {
            let compiler = Compiler { writes_radiance, ..*compiler };
            PointPasses {
                refine: Refine::new(&compiler),
                edges: Edges::new(&compiler),
                shade_points: ShadePoints::new(&compiler, false),
                shade_points_previous: OnceLock::new(),
                writes_radiance,
            }
        };
        Self {
            light_maps: LightMaps::new(compiler),
            append_all_points: AppendAllPoints::new(compiler),
            sort_points: SortPoints::new(compiler),
            to_irradiance: points(false),
            to_radiance: (!compiler.features.textures && !compiler.features.reflects_environment).then(
                || RadiancePasses {
                    points: points(true),
                    first_samples: FirstSamples::new(&Compiler { writes_radiance: true, ..*compiler }),
                },
            ),
        }
    }
}

/// All that a frame is recorded with.
pub(crate) struct Prepared<'a> {
    pub shared: &'a Shared,
    pub passes: &'a Passes,
    pub scene: &'a Resident,
    pub targets: &'a Targets,
    /// What of the shadow maps this frame draws.
    pub map_updates: &'a [MapUpdate],
    pub mode: PreparedMode<'a>,
    /// What lights objects by transfer, if there are any.
    pub transfer: Option<PreparedTransfer<'a>>,
    pub resolve: &'a Resolve,
    pub debug: Option<(&'a Debug, DebugView)>,
    /// What puts an environment behind the picture, if it is to be there.
    pub background: Option<&'a Background>,
    /// What puts surfaces that let light through before the picture, if there are any.
    pub layers: Option<&'a Layers>,
    /// What adds mirror images, if there are any.
    pub mirrors: Option<PreparedMirrors<'a>>,
}

/// What mirror images need.
pub(crate) struct PreparedMirrors<'a> {
    pub pass: &'a Mirrors,
    pub hierarchies: &'a RayHierarchies,
    /// How the ends of rays are shaded.
    pub mode: PreparedMode<'a>,
    /// What puts objects there that are lit by transfer, if there are any.
    pub transfer: Option<&'a Transfer>,
    /// Rays that follow one another.
    pub count: u32,
}

impl Prepared<'_> {
    /// How many pairs of a light map and a light the frame changes, if it uses light maps.
    pub fn light_map_changes(&self) -> Option<u32> {
        match &self.mode {
            PreparedMode::Adaptive(Adaptive { light_map_changes: Some(changes), .. }) => {
                Some(changes.lights.len() as u32)
            }
            _ => None,
        }
    }
}

/// What objects need that are lit by transfer.
pub(crate) struct PreparedTransfer<'a> {
    pub pass: &'a Transfer,
    pub objects: &'a GpuTransfer,
    /// Where they are in shadow maps that this frame leaves stale.
    pub previous_transforms: GpuPreviousTransforms,
}

/// How a frame is shaded.
pub(crate) enum PreparedMode<'a> {
    /// Every light at every pixel.
    Naive(&'a ShadeNaive),
    /// What the picture needs.
    Adaptive(Adaptive<'a>),
}

/// What the modes need that shade no more than the picture needs.
pub(crate) struct Adaptive<'a> {
    pub passes: &'a AdaptivePasses,
    /// The passes that store radiance, if the frame has any use for them.
    pub to_radiance: Option<&'a RadiancePasses>,
    pub receivers: &'a Receivers,
    pub lists: &'a PointLists,
    pub multipass: Option<(&'a Multipass, &'a MultipassPlan)>,
    /// What light maps lack, if the frame uses them.
    pub light_map_changes: Option<LightMapChanges>,
    /// Where dynamic objects are in shadow maps that this frame leaves stale, if it does.
    pub previous_transforms: Option<GpuPreviousTransforms>,
    /// Whether points are few, so that lanes may share them.
    pub are_few: bool,
}

impl Adaptive<'_> {
    /// The passes that store radiance, if `is_last` and there are any, else those that store what points receive.
    pub fn kernels(&self, is_last: bool) -> &PointPasses {
        self.to_radiance.filter(|_| is_last).map_or(&self.passes.to_irradiance, |passes| &passes.points)
    }
}

/// Allocates what depends on the picture's size, the scene and the settings, and does not exist yet.
///
/// # Errors
/// [`Error::Scene`] where the mode needs a visibility database and none was loaded; [`Error::TooLarge`] beyond the
/// device's limits.
pub(crate) fn allocate(
    context: &Context,
    scene: &mut Resident,
    viewport: &mut Viewport,
    view: &LocalView,
    size: [u32; 2],
    settings: &RenderSettings,
) -> Result<()> {
    let device = &context.device;
    let Viewport { targets, lists, multipass, seen, light_set, .. } = viewport;
    if targets.as_ref().is_none_or(|t| t.size != size) {
        *targets = None;
    }
    let targets = targets.get_or_insert_with(|| Targets::new(device, size));
    targets.drawn = Drawn::new(size, settings.region, scene.mirrors(settings) > 0);
    targets.light_set = *light_set;
    let now = scene.see(seen.take(), Some((view, settings)));
    let seen = seen.insert(now);
    if settings.mode == Mode::Naive {
        return Ok(());
    }
    let Some(receivers) = &scene.receivers else {
        return Err(Error::invalid("load a visibility database before rendering, or choose the naive mode"));
    };
    if let Shading::Multipass { lights_per_pass } = settings.shading {
        let key = MultipassKey {
            version: scene.version(),
            lights_per_pass,
            light_maps: settings.uses_light_maps(),
            optimised: settings.mode == Mode::Full,
            in_view: seen.leaves.clone(),
        };
        if multipass.as_ref().is_none_or(|m| m.key != key) {
            *multipass = Some(MultipassPlan::new(device, receivers, key)?);
        }
    }
    let capacity = PointLists::capacity(targets);
    let offsets = PointLists::offsets_for(receivers, capacity);
    if lists.as_ref().is_none_or(|l| l.key != (capacity, offsets)) {
        *lists = None;
        *lists = Some(PointLists::new(device, capacity, offsets)?);
    }
    Ok(())
}

/// Everything that a frame needs, compiled where it is used for the first time.
///
/// # Errors
/// [`Error::Scene`] where something was not allocated.
pub(crate) fn prepare<'a>(
    context: &'a Context,
    (passes, scene_passes): (&'a Passes, &'a ScenePasses),
    scene: &'a Resident,
    viewport: &'a Viewport,
    settings: &RenderSettings,
) -> Result<Prepared<'a>> {
    let targets = viewport.rendered()?;
    let compiler = Compiler::new(context, scene.features);
    passes.order(&context.shared);
    scene_passes.order(context, settings);
    let map_updates = &scene.map_updates;
    let mode = match (settings.mode, &scene.receivers, &viewport.lists) {
        (Mode::Naive, ..) => {
            PreparedMode::Naive(scene_passes.naive.get_or_init(|| ShadeNaive::new(&compiler)))
        }
        (_, Some(receivers), Some(lists)) => {
            let passes = scene_passes.adaptive.get_or_init(|| AdaptivePasses::new(&compiler));
            // Debug views show what fused shading leaves.
            let multipass = match (settings.shading, settings.debug, &viewport.multipass) {
                (Shading::Multipass { .. }, None, Some(plan)) => {
                    Some((scene_passes.multipass.get_or_init(|| Multipass::new(&compiler)), plan))
                }
                _ => None,
            };
            let to_radiance = passes.to_radiance(settings);
            let previous_transforms = scene.previous_transforms(settings, map_updates);
            if previous_transforms.is_some() {
                passes.to_irradiance.compile_previous(&compiler);
                to_radiance.iter().for_each(|passes| passes.points.compile_previous(&compiler));
            }
            PreparedMode::Adaptive(Adaptive {
                passes,
                to_radiance,
                previous_transforms: previous_transforms
                    .map(|old| GpuPreviousTransforms::new(&context.device, &old)),
                receivers,
                lists,
                multipass,
                light_map_changes: settings
                    .uses_light_maps()
                    .then(|| receivers.light_map_changes(settings.clamp)),
                are_few: settings.mode.has_low_resolution(),
            })
        }
        _ => {
            return Err(Error::invalid(
                "load a visibility database before rendering, or choose the naive mode",
            ));
        }
    };
    let transfer = scene.transfer.as_ref().map(|objects| {
        let old = scene.previous_transforms(settings, map_updates);
        let old = old.unwrap_or_else(|| PreviousTransforms::none(scene.lights.samples.len()));
        let previous_transforms = GpuPreviousTransforms::new(&context.device, &old);
        PreparedTransfer {
            pass: scene_passes.transfer.get_or_init(|| Transfer::new(&compiler)),
            objects,
            previous_transforms,
        }
    });
    let may_show = viewport.seen.as_ref().is_none_or(|seen| seen.has_mirrors);
    let mirrors = prepared_mirrors(&compiler, scene_passes, scene, &mode, settings);
    let mirrors = mirrors.filter(|_| may_show);
    let has_surroundings = settings.debug.is_none_or(|view| view == DebugView::LightPositions);
    let environment = scene.geometry.environment.as_ref();
    let shows_background = environment.is_some_and(|e| e.shown.is_some()) && has_surroundings;
    let has_layers = scene.features.transparent && settings.debug.is_none();
    Ok(Prepared {
        shared: &context.shared,
        passes,
        scene,
        targets,
        map_updates,
        mode,
        transfer,
        resolve: scene_passes.resolve.get_or_init(|| Resolve::new(&compiler)),
        debug: settings.debug.map(|view| (scene_passes.debug.get_or_init(|| Debug::new(&compiler)), view)),
        background: shows_background.then(|| passes.background(context)),
        layers: has_layers.then(|| scene_passes.layers.get_or_init(|| Layers::new(&compiler))),
        mirrors,
    })
}

/// What adds mirror images: the ends of rays are shaded as what the camera sees, by kernels of their own, which
/// are compiled at once, lest the first mirror that comes into view be waited for.
fn prepared_mirrors<'a>(
    compiler: &Compiler,
    passes: &'a ScenePasses,
    scene: &'a Resident,
    mode: &PreparedMode<'a>,
    settings: &RenderSettings,
) -> Option<PreparedMirrors<'a>> {
    let count = scene.mirrors(settings);
    let hierarchies = scene.rays.as_ref().filter(|_| count > 0)?;
    let pass = passes.mirrors.get_or_init(|| Mirrors::new(compiler));
    let compiler = compiler.mirrored();
    let mode = match mode {
        PreparedMode::Naive(_) => {
            PreparedMode::Naive(passes.naive_mirrored.get_or_init(|| ShadeNaive::new(&compiler)))
        }
        PreparedMode::Adaptive(adaptive) => {
            let of_ends = passes.adaptive_mirrored.get_or_init(|| AdaptivePasses::new(&compiler));
            if adaptive.previous_transforms.is_some() {
                of_ends.to_irradiance.compile_previous(&compiler);
            }
            let of_plan = || passes.multipass_mirrored.get_or_init(|| Multipass::new(&compiler));
            PreparedMode::Adaptive(Adaptive {
                passes: of_ends,
                to_radiance: None,
                multipass: adaptive.multipass.map(|(_, plan)| (of_plan(), plan)),
                light_map_changes: None,
                previous_transforms: adaptive.previous_transforms.clone(),
                ..*adaptive
            })
        }
    };
    let transfer = || passes.transfer_mirrored.get_or_init(|| Transfer::new(&compiler));
    let transfer = scene.transfer.is_some().then(transfer);
    Some(PreparedMirrors { pass, hierarchies, mode, transfer, count })
}
