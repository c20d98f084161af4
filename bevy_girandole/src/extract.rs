//! What changed in Bevy's world since the last frame, for the scene.

use crate::Girandole;
use crate::lights::{self, Source};
use crate::mirror::{Kind, Placed, SceneMirror, Stores, Surroundings};
use bevy::asset::{AssetEvent, Assets};
use bevy::camera::visibility::{InheritedVisibility, RenderLayers};
use bevy::camera::{Camera, Camera3d, Exposure, Hdr};
use bevy::core_pipeline::prepass::{DeferredPrepass, DepthPrepass};
use bevy::ecs::prelude::*;
use bevy::ecs::system::SystemParam;
use bevy::image::Image;
use bevy::light::{
    DirectionalLight, EnvironmentMapLight, GeneratedEnvironmentMapLight, NotShadowCaster, PointLight,
    RectLight, SpotLight,
};
use bevy::mesh::morph::MeshMorphWeights;
use bevy::mesh::skinning::SkinnedMesh;
use bevy::mesh::{Mesh, Mesh3d};
use bevy::pbr::{DistanceFog, MeshMaterial3d, StandardMaterial};
use bevy::render::Extract;
use bevy::render::sync_world::RenderEntity;
use bevy::render::view::Msaa;
use bevy::transform::components::GlobalTransform;
use girandole::RenderSettings;
use std::collections::HashSet;

/// A camera that Girandole lights, in the render world.
#[derive(Component, Clone)]
pub struct LitCamera {
    pub settings: RenderSettings,
    /// Whether Bevy draws depth before the main pass, of what is taken too.
    pub has_prepass: bool,
}

type Appearance = (
    Entity,
    &'static Mesh3d,
    &'static MeshMaterial3d<StandardMaterial>,
    &'static GlobalTransform,
    &'static InheritedVisibility,
    Option<&'static RenderLayers>,
    Has<SkinnedMesh>,
    Has<MeshMorphWeights>,
    Has<NotShadowCaster>,
);

type AppearanceChanged = Or<(
    Changed<Mesh3d>,
    Changed<MeshMaterial3d<StandardMaterial>>,
    Changed<GlobalTransform>,
    Changed<InheritedVisibility>,
    Changed<RenderLayers>,
    Added<SkinnedMesh>,
    Added<MeshMorphWeights>,
)>;

/// Where assets are.
#[derive(SystemParam)]
pub struct Held<'w, 's> {
    meshes: Extract<'w, 's, Res<'static, Assets<Mesh>>>,
    materials: Extract<'w, 's, Res<'static, Assets<StandardMaterial>>>,
    images: Extract<'w, 's, Res<'static, Assets<Image>>>,
}

impl Held<'_, '_> {
    fn stores(&self) -> Stores<'_> {
        Stores { meshes: &self.meshes, materials: &self.materials, images: &self.images }
    }
}

/// What became of assets.
#[derive(SystemParam)]
pub struct Events<'w, 's> {
    meshes: Extract<'w, 's, MessageReader<'static, 'static, AssetEvent<Mesh>>>,
    materials: Extract<'w, 's, MessageReader<'static, 'static, AssetEvent<StandardMaterial>>>,
    images: Extract<'w, 's, MessageReader<'static, 'static, AssetEvent<Image>>>,
}

/// Lights of one kind.
#[derive(SystemParam)]
pub struct Lights<'w, 's, L: Component> {
    all: Extract<
        'w,
        's,
        Query<'static, 'static, (Entity, &'static L, &'static GlobalTransform, &'static InheritedVisibility)>,
    >,
    changed: Extract<
        'w,
        's,
        Query<
            'static,
            'static,
            Entity,
            (With<L>, Or<(Changed<L>, Changed<GlobalTransform>, Changed<InheritedVisibility>)>),
        >,
    >,
    removed: Extract<'w, 's, RemovedComponents<'static, 'static, L>>,
}

impl<L: Component> Lights<'_, '_, L> {
    fn follow(
        &mut self,
        mirror: &mut SceneMirror,
        kind: Kind,
        source: impl Fn(&L, &GlobalTransform) -> Source,
    ) {
        for entity in self.removed.read() {
            if self.all.get(entity).is_err() {
                mirror.put_out((entity, kind));
            }
        }
        for entity in &*self.changed {
            if let Ok((_, light, place, visibility)) = self.all.get(entity) {
                let shines = visibility.get().then(|| source(light, place));
                mirror.shine((entity, kind), shines);
            }
        }
    }
}

/// Takes over lights.
pub fn follow_lights(
    mut mirror: ResMut<SceneMirror>,
    mut points: Lights<PointLight>,
    mut spots: Lights<SpotLight>,
    mut suns: Lights<DirectionalLight>,
    mut rectangles: Lights<RectLight>,
) {
    let mirror = &mut *mirror;
    points.follow(mirror, Kind::Point, lights::point);
    spots.follow(mirror, Kind::Spot, lights::spot);
    suns.follow(mirror, Kind::Directional, lights::directional);
    rectangles.follow(mirror, Kind::Rectangle, lights::rect);
}

/// Takes over meshes and materials. Assets are read before Bevy moves them to the render world.
pub fn follow_meshes(
    mut mirror: ResMut<SceneMirror>,
    (held, mut events): (Held, Events),
    all: Extract<Query<Appearance>>,
    changed: Extract<Query<Entity, (With<Mesh3d>, AppearanceChanged)>>,
    cameras: Extract<Query<(&Camera, Option<&RenderLayers>), With<Girandole>>>,
    mut no_mesh: Extract<RemovedComponents<Mesh3d>>,
    mut no_material: Extract<RemovedComponents<MeshMaterial3d<StandardMaterial>>>,
    mut layers_seen: Local<Option<RenderLayers>>,
) {
    let mirror = &mut *mirror;
    let stores = held.stores();
    let mut again: HashSet<Entity> = changed.iter().collect();
    let mut is_new = false;
    for event in events.images.read() {
        match event {
            AssetEvent::Modified { id } => mirror.image_changed(*id, stores),
            AssetEvent::Added { .. } | AssetEvent::LoadedWithDependencies { .. } => is_new = true,
            _ => {}
        }
    }
    for event in events.meshes.read() {
        match event {
            AssetEvent::Modified { id } => again.extend(mirror.mesh_changed(*id, stores)),
            AssetEvent::Added { .. } => is_new = true,
            AssetEvent::Unused { id } => mirror.mesh_unused(*id),
            _ => {}
        }
    }
    for event in events.materials.read() {
        match event {
            AssetEvent::Modified { id } => again.extend(mirror.material_changed(*id, stores)),
            AssetEvent::Added { .. } => is_new = true,
            _ => {}
        }
    }
    if is_new {
        again.extend(mirror.take_pending());
    }
    // One scene for all cameras: what any of them may see.
    let layers = cameras
        .iter()
        .filter(|(camera, _)| camera.is_active)
        .fold(RenderLayers::none(), |seen, (_, layers)| seen.union(layers.unwrap_or_default()));
    if layers_seen.as_ref() != Some(&layers) {
        again.extend(all.iter().map(|item| item.0));
        *layers_seen = Some(layers.clone());
    }
    for entity in no_mesh.read().chain(no_material.read()) {
        if all.get(entity).is_err() {
            mirror.forget(entity);
        }
    }
    for entity in again {
        let Ok((_, mesh, material, place, visibility, own_layers, is_skinned, is_morphed, casts_none)) =
            all.get(entity)
        else {
            continue;
        };
        if casts_none {
            mirror.notices.say("NotShadowCaster is left out: what Girandole draws casts shadows");
        }
        let placed = Placed {
            mesh: mesh.id(),
            material: material.id(),
            place: place.affine(),
            is_visible: visibility.get() && own_layers.unwrap_or_default().intersects(&layers),
            is_deformed: is_skinned || is_morphed,
        };
        mirror.place(entity, &placed, stores);
    }
    mirror.finish();
}

type Cameras = (
    RenderEntity,
    &'static Camera,
    &'static Girandole,
    &'static Msaa,
    Has<Hdr>,
    Option<&'static Exposure>,
    Option<&'static EnvironmentMapLight>,
    Option<&'static GeneratedEnvironmentMapLight>,
    (Has<DepthPrepass>, Has<DeferredPrepass>, Has<DistanceFog>),
);

/// Takes over cameras, and what is all around them.
pub fn follow_cameras(
    mut commands: Commands,
    mut mirror: ResMut<SceneMirror>,
    held: Held,
    cameras: Extract<Query<Cameras, With<Camera3d>>>,
    lit: Query<Entity, With<LitCamera>>,
) {
    let mirror = &mut *mirror;
    let stores = held.stores();
    let mut before: HashSet<Entity> = lit.iter().collect();
    let mut is_first = true;
    for (entity, camera, girandole, msaa, is_hdr, exposure, map, generated, (depth, deferred, fog)) in
        &cameras
    {
        if !camera.is_active {
            continue;
        }
        let unsupported = [
            (!is_hdr, "it is not Hdr; add the component Hdr"),
            (
                *msaa != Msaa::Off,
                "it has Msaa; add Msaa::Off, and set Girandole's samples_per_axis for smooth edges",
            ),
            (camera.viewport.is_some(), "it has a viewport; let it fill its target"),
            (deferred, "it has a DeferredPrepass; remove it"),
        ];
        if let Some((_, why)) = unsupported.into_iter().find(|(applies, _)| *applies) {
            mirror.notices.say(format!("a camera with Girandole is lit by Bevy alone, as {why}"));
            continue;
        }
        if fog {
            mirror.notices.say(
                "DistanceFog lies over what Bevy draws alone, and not over what Girandole lights; remove it",
            );
        }
        if depth {
            mirror.notices.say(
                "a DepthPrepass draws what Girandole lights once more; remove it where nothing needs it",
            );
        }
        let exposure = exposure.copied().unwrap_or_default().exposure();
        if std::mem::take(&mut is_first) {
            mirror.expose(exposure, stores);
            let map = map.map(|m| (m.specular_map.id(), m.intensity, m.rotation));
            let generated = generated.map(|g| (g.environment_map.id(), g.intensity, g.rotation));
            let surroundings = map.or(generated);
            mirror.surround(
                surroundings.map(|(image, nits, rotation)| Surroundings { image, nits, rotation }),
                stores,
            );
        }
        let settings = RenderSettings {
            exposure: girandole_core::tonemap::Exposure::Ev(crate::units::stops(exposure)),
            tonemap: girandole_core::tonemap::Tonemap::None,
            region: None,
            ..girandole.settings
        };
        commands.entity(entity).insert(LitCamera { settings, has_prepass: depth });
        before.remove(&entity);
    }
    for entity in before {
        if let Ok(mut entity) = commands.get_entity(entity) {
            entity.remove::<LitCamera>();
        }
    }
}
