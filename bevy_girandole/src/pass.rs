//! Where Girandole's renderer is called: once a frame for the scene, once a camera for its picture.

use crate::extract::LitCamera;
use crate::mirror::SceneMirror;
use crate::units;
use bevy::core_pipeline::core_3d::{AlphaMask3d, CORE_3D_DEPTH_FORMAT, Opaque3d};
use bevy::ecs::prelude::*;
use bevy::log::error;
use bevy::pbr::{ExtractedDirectionalLight, ExtractedPointLight};
use bevy::render::camera::{DirtySpecializations, ExtractedCamera};
use bevy::render::render_phase::ViewBinnedRenderPhases;
use bevy::render::render_resource::StoreOp;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::view::{ExtractedView, RetainedViewEntity, ViewDepthStencilTexture, ViewTarget};
use girandole::{Renderer, RendererOptions, Target, Viewport, wgpu};
use girandole_core::Generation;
use girandole_core::glam::DAffine3;
use girandole_core::illumination::{IlluminationSettings, Rewalk};
use girandole_core::scene::{Scene, View};
use std::collections::{HashMap, HashSet};

/// Girandole's renderer, in the render world, with the scene that it has.
#[derive(Resource)]
pub struct Lighting {
    options: RendererOptions,
    illumination: IlluminationSettings,
    renderer: Option<Renderer>,
    /// Whether the renderer has the scene.
    is_open: bool,
    /// The version of the scene that was asked for last.
    latest: Option<Generation>,
    /// The version of a scene that could not be lit or drawn: it is not tried again.
    refused: Option<Generation>,
    /// Views whose meshes Bevy does not draw, with their pictures.
    views: HashMap<RetainedViewEntity, Viewport>,
}

impl Lighting {
    pub fn new(options: RendererOptions, illumination: IlluminationSettings) -> Self {
        let (latest, refused, views) = (None, None, HashMap::new());
        Self { options, illumination, renderer: None, is_open: false, latest, refused, views }
    }

    /// Nothing is lit until the scene changes.
    fn refuse(&mut self, problem: &dyn std::fmt::Display) {
        error!("Girandole leaves everything to Bevy until the scene changes: {problem}");
        self.is_open = false;
        self.refused = self.latest;
    }

    /// Brings the renderer up to the scene, with light for these views.
    fn follow(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        scene: &mut Scene,
        views: &[View],
    ) -> girandole::Result<()> {
        let renderer = match &mut self.renderer {
            Some(renderer) => renderer,
            none => none.insert(Renderer::new(device, queue, self.options)?),
        };
        // Samples that are held serve any view.
        let views =
            if self.illumination.rewalk == Rewalk::Off { &self.illumination.views[..] } else { views };
        if !self.is_open {
            scene.open();
            scene.take_changes();
            renderer
                .open(scene, &IlluminationSettings { views: views.to_vec(), ..self.illumination.clone() })?;
            self.is_open = true;
            return Ok(());
        }
        let changes = scene.take_changes();
        renderer.follow(scene, &changes, views)
    }
}

/// The view of a camera.
fn view_of(view: &ExtractedView) -> girandole_core::Result<View> {
    let (_, rotation, translation) = view.world_from_view.to_scale_rotation_translation();
    let unscaled = bevy::math::Affine3A::from_rotation_translation(rotation.normalize(), translation);
    let world_from_view: DAffine3 = units::affine(&unscaled);
    View::from_matrices(world_from_view.inverse(), units::matrix(&view.clip_from_view))
}

/// Follows the scene's changes.
pub fn light_scene(
    mut mirror: ResMut<SceneMirror>,
    mut lighting: ResMut<Lighting>,
    (device, queue): (Res<RenderDevice>, Res<RenderQueue>),
    cameras: Query<&ExtractedView, With<LitCamera>>,
) {
    let views: Vec<View> = cameras.iter().filter_map(|view| view_of(view).ok()).collect();
    let is_refused = lighting.refused == Some(mirror.scene.generation());
    if views.is_empty() || is_refused || mirror.scene.placed_objects().next().is_none() {
        return;
    }
    let followed = lighting.follow((device.wgpu_device(), &queue), &mut mirror.scene, &views);
    lighting.latest = Some(mirror.scene.generation());
    if let Err(problem) = followed {
        lighting.refuse(&problem);
    }
}

/// Notes which views Girandole lights, and gives what it draws back to views that Girandole does not light any more.
pub fn share_out(
    mut lighting: ResMut<Lighting>,
    cameras: Query<&ExtractedView, With<LitCamera>>,
    mut dirty: ResMut<DirtySpecializations>,
) {
    let lit: HashSet<RetainedViewEntity> = match lighting.is_open {
        true => cameras.iter().map(|view| view.retained_view_entity).collect(),
        false => HashSet::new(),
    };
    dirty.views.extend(lighting.views.keys().filter(|view| !lit.contains(view)));
    lighting.views.retain(|view, _| lit.contains(view));
    for view in lit {
        lighting.views.entry(view).or_default();
    }
}

/// Empties Bevy's opaque phases of what Girandole draws.
pub fn take_from_bevy(
    mirror: Res<SceneMirror>,
    lighting: Res<Lighting>,
    mut opaque: ResMut<ViewBinnedRenderPhases<Opaque3d>>,
    mut masked: ResMut<ViewBinnedRenderPhases<AlphaMask3d>>,
) {
    for view in lighting.views.keys() {
        for entity in mirror.taken() {
            if let Some(phase) = opaque.get_mut(view) {
                phase.remove(entity.into());
            }
            if let Some(phase) = masked.get_mut(view) {
                phase.remove(entity.into());
            }
        }
    }
}

/// Spares Bevy's shadow maps while Girandole lights every 3D view: nothing opaque looks them up.
pub fn spare_shadow_maps(
    lighting: Res<Lighting>,
    views: Query<Has<LitCamera>, (With<ExtractedCamera>, With<bevy::camera::Camera3d>)>,
    mut points: Query<(Entity, &mut ExtractedPointLight)>,
    mut suns: Query<(Entity, &mut ExtractedDirectionalLight)>,
    mut spared: Local<HashSet<Entity>>,
) {
    let is_spared = lighting.is_open && views.iter().all(|is_lit| is_lit);
    let mut spare = |entity: Entity, has_shadows: &mut bool| {
        if is_spared && *has_shadows {
            *has_shadows = false;
            spared.insert(entity);
        } else if !is_spared && spared.remove(&entity) {
            *has_shadows = true;
        }
    };
    for (entity, mut light) in &mut points {
        let mut has_shadows = light.shadow_maps_enabled;
        spare(entity, &mut has_shadows);
        light.shadow_maps_enabled = has_shadows;
    }
    for (entity, mut light) in &mut suns {
        let mut has_shadows = light.shadow_maps_enabled;
        spare(entity, &mut has_shadows);
        light.shadow_maps_enabled = has_shadows;
    }
}

/// Lights a camera's opaque things, between Bevy's opaque pass (which clears, and draws what is left to it) and the transparent one.
pub fn draw(
    view: ViewQuery<(&ExtractedView, &ViewTarget, &ViewDepthStencilTexture, &LitCamera)>,
    mut lighting: ResMut<Lighting>,
    mut context: RenderContext,
) {
    let (extracted, target, depth, camera) = view.into_inner();
    let lighting = &mut *lighting;
    let viewport = lighting.views.get_mut(&extracted.retained_view_entity);
    let (true, Some(renderer), Some(viewport)) = (lighting.is_open, &mut lighting.renderer, viewport) else {
        return;
    };
    let texture = target.main_texture();
    let attachment = depth.get_attachment(StoreOp::Store);
    let recorded = view_of(extracted).map_err(girandole::Error::from).and_then(|view| {
        let target = Target {
            color: target.main_texture_view(),
            format: target.main_texture_format(),
            size: [texture.width(), texture.height()],
            keep_background: true,
            depth_in: (!camera.has_prepass).then_some(attachment.view),
            depth_out: Some((attachment.view, CORE_3D_DEPTH_FORMAT)),
        };
        renderer.record(viewport, context.command_encoder(), &view, &target, &camera.settings)
    });
    if let Err(problem) = recorded {
        lighting.refuse(&problem);
    }
}
