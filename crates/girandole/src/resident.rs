//! A scene with its light on the GPU.

use crate::device::context::Context;
use crate::gpu_scene::geometry::{GpuScene, gpu_lights, reflects_environment};
use crate::gpu_scene::light_source::LightSource;
use crate::gpu_scene::lights::GpuLights;
use crate::gpu_scene::previous_transforms::PreviousTransforms;
use crate::gpu_scene::receivers::{Receivers, Sources};
use crate::gpu_scene::transfer::GpuTransfer;
use crate::layout::Light;
use crate::maps::atlas::Atlas;
use crate::maps::cache::{MapCache, MapUpdate, StaleCounts};
use crate::maps::layout::{AtlasLayout, largest_chosen};
use crate::maps::map_view::ShownSquare;
use crate::maps::non_blockers::NonBlockers;
use crate::maps::occluders::Occluders;
use crate::maps::occlusion_culling::OccludedObjects;
use crate::maps::snapshot::Snapshot;
use crate::parallel::both;
use crate::rays::RayHierarchies;
use crate::settings::{MapUpdates, Mode, RenderSettings, Shading, ShadowMap};
use crate::shader_constants::NO_MAP;
use crate::{Error, Result};
use girandole_core::glam::{DVec3, Vec2, Vec3};
use girandole_core::illumination::Illumination;
use girandole_core::lights::{Clamp, LightSet};
use girandole_core::scene::{Geometry, LocalView, Material, NONE, Scene, SceneChanges};
use girandole_core::{Generation, brdf};

/// What a scene and its lights need of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SceneFeatures {
    /// Some material has a specular lobe.
    pub specular: bool,
    /// All lights fall off with the cosine.
    pub only_cosine_lights: bool,
    /// Some light may have a lobe.
    pub lobes: bool,
    /// Some material has an alpha mask.
    pub masked: bool,
    /// Some material has a texture.
    pub textures: bool,
    /// Some surface has normals that vary.
    pub curved: bool,
    /// Light passes some material.
    pub transparent: bool,
    /// Some material reflects an environment by its own maps.
    pub reflects_environment: bool,
    /// Some material is smooth enough for mirrored rays.
    pub mirrors: bool,
    /// Some transparent material is.
    pub mirrors_in_layers: bool,
    /// With so many lights no opaque one sends any.
    pub only_layers_mirror: bool,
}

/// A scene and its lights on the GPU, with what is derived from both.
pub(crate) struct Resident {
    pub geometry: GpuScene,
    pub features: SceneFeatures,
    pub lights: GpuLights,
    pub atlas: Atlas,
    /// World position that positions are relative to.
    pub origin: DVec3,
    /// What small distances are relative to, metres.
    pub detail: f32,
    /// Smallest and largest corner of all that there is.
    pub bounds: (Vec3, Vec3),
    /// Length of the bounds' diagonal, metres.
    pub extent: f32,
    /// Which version of the scene this is, and which light samples.
    pub generations: [Generation; 2],
    /// What visibility determination says; every mode but the naive one needs it.
    pub receivers: Option<Receivers>,
    /// Dynamic objects that lights cannot see.
    pub hidden: OccludedObjects,
    /// Objects that are lit by precomputed radiance transfer, if there are any.
    pub transfer: Option<GpuTransfer>,
    /// What rays are traced against, once something does.
    pub rays: Option<RayHierarchies>,
    /// Where dynamic objects are.
    transforms: Snapshot,
    /// Another one whenever views may see something else than before.
    version: Generation,
    /// What of the shadow maps the next frame draws.
    pub map_updates: Vec<MapUpdate>,
    /// Surfaces that stay out of shadow maps.
    non_blockers: NonBlockers,
    /// Maps of which the last frame drew some part.
    pub maps_drawn: u32,
    /// Texels that were drawn when shadow maps were last drawn.
    pub texels_drawn: u64,
    /// Pairs of a light map and a light that the last frame added to it or took away.
    pub light_map_changes: u32,
}

impl Resident {
    /// # Errors
    /// [`crate::Error::TooLarge`] where buffers or the atlas exceed the device's limits or the memory budget.
    pub fn new(context: &Context, scene: &Scene, geometry: &Geometry, lights: &LightSet) -> Result<Self> {
        let Context { device, options, shared, .. } = context;
        let radius = geometry.radius();
        let mut samples = gpu_lights(lights, radius);
        let large: Vec<bool> = samples.iter().map(Light::has_large_map).collect();
        let layout = AtlasLayout::new(&large, largest_chosen(&samples), options, &device.limits())?;
        samples.iter_mut().for_each(|light| light.atlas_slot = NO_MAP);
        let features = SceneFeatures::of(scene, geometry, &samples);
        let rays = features.mirrors.then(|| RayHierarchies::new((device, &context.queue), scene, geometry));
        let non_blockers = NonBlockers::new(scene, geometry, &samples, options.skip_non_blockers);
        let occluders = Occluders::new(scene, geometry, &non_blockers, options.shadow_map);
        let transforms = Snapshot::new(0, scene, geometry);
        // Until a frame says which it looks up.
        let mut cache = MapCache::new(&layout, samples.len());
        cache.want(&cache.regular_spans(&samples));
        Ok(Self {
            geometry: GpuScene::new((device, &context.queue), &shared.scene, scene, geometry)?,
            features,
            atlas: Atlas::new(device, &layout, geometry, occluders, cache)?,
            lights: GpuLights::new(device, samples)?,
            origin: geometry.origin,
            detail: geometry.detail(),
            bounds: geometry.bounds,
            extent: geometry.extent(),
            generations: [geometry.generation(), lights.generation()],
            receivers: None,
            transfer: None,
            rays: rays.transpose()?,
            maps_drawn: 0,
            texels_drawn: 0,
            hidden: OccludedObjects::default(),
            transforms,
            version: Generation::fresh(),
            map_updates: Vec::new(),
            non_blockers,
            light_map_changes: 0,
        })
    }

    /// Follows dynamic objects and light samples to where they are now; what does not change stays. `false` where more changed
    /// than that: then nothing was done, and all is to be made anew.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limits.
    pub fn follow(
        &mut self,
        context: &Context,
        scene: &Scene,
        illumination: &Illumination,
        changes: &SceneChanges,
    ) -> Result<bool> {
        let Context { device, queue, options, .. } = context;
        let (geometry, lights) = (illumination.geometry(), illumination.lights());
        let mut samples = gpu_lights(lights, geometry.radius());
        let frame = (geometry.origin, geometry.detail(), geometry.bounds);
        let is_same = geometry.objects == self.geometry.objects
            && scene.materials.len() == self.geometry.material_count
            && frame == (self.origin, self.detail, self.bounds);
        if illumination.light_changes().is_everything()
            || !(self.have_place(&samples) && is_same)
            || SceneFeatures::of(scene, geometry, &samples) != self.features
            || !self.non_blockers.stay(scene, geometry, &samples)
        {
            return Ok(false);
        }
        self.give_places(&mut samples);
        self.geometry.follow(queue, scene, geometry, changes)?;
        if let Some(rays) = &mut self.rays {
            rays.follow((device, queue), scene, geometry, &changes.moved)?;
        }
        let is_octahedral = options.shadow_map == ShadowMap::Octahedral;
        let hidden = OccludedObjects::of(scene, illumination.visibility().map(|v| &**v));
        let light_changes = illumination.light_changes();
        let hidden_then_now = [&self.hidden, &hidden];
        // What a caller may have loaded by himself no longer holds either.
        let held = self.receivers.take();
        let atlas = &mut self.atlas;
        let (_, receivers) = both(
            || {
                let lights = (&samples[..], light_changes.moved());
                atlas.follow(queue, geometry, &changes.moved, lights, hidden_then_now, is_octahedral);
            },
            || match (illumination.visibility(), held) {
                (Some(database), Some(mut held)) => {
                    let sources = Sources { scene, geometry, lights, database };
                    Ok(held.follow((device, queue), sources, light_changes)?.then_some(held))
                }
                _ => Ok::<_, Error>(None),
            },
        );
        self.hidden = hidden;
        self.transforms = Snapshot::new(self.transforms.moment + 1, scene, geometry);
        self.version = Generation::fresh();
        self.lights.follow((device, queue), samples, &light_changes.changed());
        self.receivers = receivers?;
        if let (Some(database), None) = (illumination.visibility(), &self.receivers) {
            let sources = Sources { scene, geometry, lights, database };
            self.receivers = Some(Receivers::new((device, queue), sources)?);
        }
        self.generations = [geometry.generation(), lights.generation()];
        Ok(true)
    }
}

/// What a [`Resident`] holds for its light samples alone, but for their shadow maps.
pub(crate) struct Lighting {
    lights: GpuLights,
    receivers: Option<Receivers>,
    hidden: OccludedObjects,
    transfer: Option<GpuTransfer>,
    generations: [Generation; 2],
}

impl Resident {
    /// A scene with other light samples, and with what visibility determination says of them.
    ///
    /// # Errors
    /// As for [`Resident::new`].
    pub fn lit(context: &Context, source: LightSource) -> Result<Self> {
        let LightSource { scene, geometry, lights, .. } = source;
        let mut resident = Self::new(context, scene, geometry, lights)?;
        resident.receivers = receivers(context, source)?;
        resident.hidden = OccludedObjects::of(scene, source.visibility.map(|v| &**v));
        resident.transfer(context, source)?;
        Ok(resident)
    }

    /// Other light samples of the scene as it is, to be [swapped in](Self::swap_lighting). Nothing where they do not fit the
    /// atlas, the occluders or the kernels that are there.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limits.
    pub fn lighting(&self, context: &Context, source: LightSource) -> Result<Option<Lighting>> {
        let LightSource { scene, geometry, lights, visibility, .. } = source;
        let mut samples = gpu_lights(lights, geometry.radius());
        if !self.have_place(&samples)
            || SceneFeatures::of(scene, geometry, &samples) != self.features
            || !self.non_blockers.stay(scene, geometry, &samples)
        {
            return Ok(None);
        }
        self.give_places(&mut samples);
        Ok(Some(Lighting {
            lights: GpuLights::new(&context.device, samples)?,
            receivers: receivers(context, source)?,
            hidden: OccludedObjects::of(scene, visibility.map(|v| &**v)),
            transfer: GpuTransfer::new(context, source)?,
            generations: [geometry.generation(), lights.generation()],
        }))
    }

    /// Takes other light samples, whose shadow maps are all stale then; returns those before.
    pub fn swap_lighting(&mut self, lighting: Lighting) -> Lighting {
        self.atlas.cache.invalidate_all();
        self.version = Generation::fresh();
        Lighting {
            lights: std::mem::replace(&mut self.lights, lighting.lights),
            receivers: std::mem::replace(&mut self.receivers, lighting.receivers),
            hidden: std::mem::replace(&mut self.hidden, lighting.hidden),
            transfer: std::mem::replace(&mut self.transfer, lighting.transfer),
            generations: std::mem::replace(&mut self.generations, lighting.generations),
        }
    }

    /// Has hierarchies for rays.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limits.
    pub fn trace_with(&mut self, context: &Context, scene: &Scene, geometry: &Geometry) -> Result<()> {
        if self.generations[0] != geometry.generation() {
            return Err(Error::invalid("this geometry belongs to another scene or to another version of it"));
        }
        if self.rays.is_none() {
            self.rays = Some(RayHierarchies::new((&context.device, &context.queue), scene, geometry)?);
        }
        Ok(())
    }

    /// Lights objects by transfer, with the light that is there, and no others.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] beyond the device's limits.
    pub fn transfer(&mut self, context: &Context, source: LightSource) -> Result<()> {
        self.transfer = GpuTransfer::new(context, source)?;
        self.version = Generation::fresh();
        let triangles = self.transfer.iter().flat_map(GpuTransfer::triangles).collect();
        self.geometry.leave_out(&context.queue, triangles);
        Ok(())
    }

    /// Whether the atlas has a place for each of these lights, and no more.
    fn have_place(&self, samples: &[Light]) -> bool {
        let held = &self.lights.samples;
        samples.iter().map(Light::has_large_map).eq(held.iter().map(Light::has_large_map))
            && largest_chosen(samples) == largest_chosen(held)
    }

    fn give_places(&self, samples: &mut [Light]) {
        for (light, held) in samples.iter_mut().zip(&self.lights.samples) {
            light.atlas_slot = held.atlas_slot;
            let frame = |light: &Light| (light.normal, light.tangent, light.offset);
            if light.shows_square() && frame(light) == frame(held) {
                (light.position, light.scale) = (held.position, held.scale);
            }
        }
    }
}

/// What visibility determination says, if it was made.
fn receivers(context: &Context, source: LightSource) -> Result<Option<Receivers>> {
    let LightSource { scene, geometry, lights, visibility, .. } = source;
    let of = |database| {
        Receivers::new((&context.device, &context.queue), Sources { scene, geometry, lights, database })
    };
    visibility.map(of).transpose()
}

/// How a frame looks shadow maps up.
#[derive(Clone, Copy, PartialEq)]
struct Looks {
    /// For the lights of lists alone.
    lists: bool,
    /// For what is seen in mirrors, too.
    mirrors: bool,
}

/// What a frame sees.
pub(crate) struct Seen {
    /// Of which version of the scene.
    version: Generation,
    /// Its view, and whether only leaves look shadow maps up; nothing where all of it is looked up.
    view: Option<(LocalView, Looks)>,
    /// For each leaf, whether it may be in view.
    pub leaves: Vec<bool>,
    /// Whether some surface in view may mirror others.
    pub has_mirrors: bool,
    /// For each light, units across that its map is to have; 0 where it is not looked up.
    spans: Vec<u32>,
    /// Directional lights with maps that show what is looked up in them.
    suns: Vec<(usize, Light)>,
}

impl Resident {
    /// Takes other receivers.
    pub fn set_receivers(&mut self, receivers: Receivers, hidden: OccludedObjects) {
        (self.receivers, self.hidden) = (Some(receivers), hidden);
        self.version = Generation::fresh();
    }

    /// Finds what a frame sees, and which shadow maps it looks up: without a view all of them, and so it is with debug views and with
    /// objects that are lit by transfer. What was found `before` for such a view holds until something changes.
    pub fn see(&mut self, before: Option<Seen>, view: Option<(&LocalView, &RenderSettings)>) -> Seen {
        let is_picture = |settings: &RenderSettings| settings.debug.is_none() && self.transfer.is_none();
        let view = view.filter(|(_, settings)| is_picture(settings) && self.receivers.is_some());
        let view = view.map(|(view, settings)| (*view, self.looks(settings)));
        let is_same = |seen: &Seen| seen.version == self.version && seen.view == view;
        let seen = before.filter(is_same).unwrap_or_else(|| self.look(view));
        for (index, sun) in &seen.suns {
            self.lights.show(*index, sun);
            self.atlas.cache.show(*index, ShownSquare::of(sun));
        }
        self.atlas.cache.want(&seen.spans);
        seen
    }

    /// How many mirrored rays follow one another from a pixel of frames with these settings.
    pub fn mirrors(&self, settings: &RenderSettings) -> u32 {
        let is_possible = settings.clamp == Clamp::Own && settings.debug.is_none() && self.rays.is_some();
        if is_possible && self.features.mirrors { settings.mirrors } else { 0 }
    }

    /// Which version of the scene, its light and what is known of it this is.
    pub fn version(&self) -> Generation {
        self.version
    }

    fn looks(&self, settings: &RenderSettings) -> Looks {
        Looks { lists: settings.mode != Mode::Naive, mirrors: self.mirrors(settings) > 0 }
    }

    fn look(&self, view: Option<(LocalView, Looks)>) -> Seen {
        let Self { lights, atlas: Atlas { cache, .. }, .. } = self;
        let regular = cache.regular_spans(&lights.samples);
        let (Some((of, Looks { lists, mirrors })), Some(receivers)) = (&view, &self.receivers) else {
            let leaves = self.receivers.as_ref().map_or(0, Receivers::leaf_count);
            let suns = lights.samples.iter().enumerate().filter(|(_, light)| light.shows_square());
            let whole = |light: &Light| light.showing(Vec2::ZERO, 1.0 / light.offset);
            let suns = suns.map(|(index, light)| (index, whole(light))).collect();
            let leaves = vec![true; leaves as usize];
            return Seen { version: self.version, view, leaves, has_mirrors: true, spans: regular, suns };
        };
        // What is behind the camera may be seen in a mirror.
        let (leaves, has_mirrors) = receivers.shown(of, *mirrors);
        let suns = receivers.suns(&leaves, (of, has_mirrors), *lists);
        let mut texels = receivers.look_ups(&leaves, of, &suns);
        if !lists {
            let unused = texels.iter_mut().zip(regular).filter(|(texels, _)| **texels == 0.0);
            unused.for_each(|(texels, regular)| *texels = cache.layout().size(regular) as f32);
        }
        let spans = cache.spans(&texels, &lights.samples);
        Seen { version: self.version, view, leaves, has_mirrors, spans, suns }
    }

    /// Decides what of the shadow maps the next frame draws, and where.
    pub fn plan_maps(&mut self, device: &wgpu::Device, updates: &MapUpdates) {
        let cache = &mut self.atlas.cache;
        self.map_updates = cache.plan(updates, &self.lights.samples);
        let updated = self.map_updates.iter().map(|update| update.light);
        self.atlas.occluders.culling.find(&self.lights.samples, updated);
        self.lights.place(device, &cache.words(&self.map_updates));
    }

    /// Takes note that the shadow maps were drawn that a frame was to draw.
    pub fn count_maps(&mut self) {
        let updates = std::mem::take(&mut self.map_updates);
        self.atlas.cache.note(&updates, &self.transforms);
        self.lights.advance();
        self.maps_drawn = updates.len() as u32;
        if !updates.is_empty() {
            self.texels_drawn = updates.iter().map(|update| update.part.texels()).sum();
        }
    }

    /// Shadow maps that the last frame left stale.
    pub fn stale(&self) -> StaleCounts {
        self.atlas.cache.counts(&self.lights.samples)
    }

    /// Counts a frame.
    pub fn advance(&mut self) {
        self.atlas.cache.advance(&self.lights.samples);
    }

    /// Where dynamic objects are in the shadow maps that are stale once these are drawn, for frames that look them up there.
    pub fn previous_transforms(
        &self,
        settings: &RenderSettings,
        updates: &[MapUpdate],
    ) -> Option<PreviousTransforms> {
        let has_leaves = settings.mode != Mode::Naive && settings.shading == Shading::Fused;
        let maps = (&self.atlas.cache, &self.lights.samples[..]);
        has_leaves.then(|| PreviousTransforms::new(&self.transforms, maps, updates))?
    }

    /// Takes note that a frame brought light maps up to date.
    pub fn count_light_maps(&mut self, changes: u32, bound: Clamp) {
        self.light_map_changes = changes;
        if let Some(receivers) = &mut self.receivers {
            receivers.advance_light_maps(bound);
        }
    }
}

impl SceneFeatures {
    /// What they will be, before light is sampled.
    pub fn expected(scene: &Scene, geometry: &Geometry) -> Self {
        let has_other_lights = !scene.lights.is_empty() || scene.environment.is_some();
        Self { only_cosine_lights: !has_other_lights, ..Self::of(scene, geometry, &[]) }
    }

    fn of(scene: &Scene, geometry: &Geometry, lights: &[Light]) -> Self {
        let solid_angle = brdf::mirror_solid_angle(lights.len());
        let sends_rays = |m: &Material| {
            let roughness = if m.metallic_roughness_texture.is_some() { 0.0 } else { m.roughness };
            let reflects = m.specular > 0.0 || m.metallic > 0.0;
            reflects && brdf::mirror_share(roughness * roughness, 1.0, solid_angle) > 0.0
        };
        Self {
            specular: scene.materials.iter().any(|m| m.specular > 0.0 || m.metallic > 0.0),
            only_cosine_lights: lights.iter().all(Light::is_sample),
            // Kernels are not to change with the light: what may throw lobes does so now and then.
            lobes: scene.materials.iter().any(Material::throws_lobes)
                || lights.iter().any(|light| light.lobe.w < 1.0),
            masked: scene.materials.iter().any(|m| m.alpha_cutoff.is_some()),
            textures: !scene.textures.is_empty() || scene.materials.iter().any(|m| m.vertex_colors),
            curved: is_curved(scene, geometry),
            transparent: scene.materials.iter().any(Material::is_transparent),
            reflects_environment: reflects_environment(scene),
            mirrors: scene.materials.iter().any(Material::is_smooth),
            mirrors_in_layers: scene.materials.iter().any(|m| m.is_smooth() && m.is_transparent()),
            only_layers_mirror: scene.materials.iter().all(|m| m.is_transparent() || !sends_rays(m)),
        }
    }
}

/// Whether some surface has normals that vary from point to point.
fn is_curved(scene: &Scene, geometry: &Geometry) -> bool {
    geometry.triangles.iter().any(|t| {
        let [a, b, c] = t.vertices.map(|v| geometry.normals[v as usize]);
        a.dot(b).min(b.dot(c)) < 0.99999
            || scene.materials[t.material].normal_texture.is_some()
            || t.patch == NONE
    })
}
