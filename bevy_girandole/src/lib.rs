//! Lights a Bevy world with [Girandole]: hundreds to thousands of shadowed light samples, soft shadows from area lights, and indirect
//! light that is blocked by what stands in its way. No ray-tracing hardware, no bake, no denoiser.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_girandole::{Girandole, GirandolePlugin};
//!
//! App::new()
//!     .add_plugins((DefaultPlugins, GirandolePlugin::default()))
//!     .add_systems(Startup, |mut commands: Commands| {
//!         commands.spawn((Camera3d::default(), Girandole::default()));
//!     })
//!     .run();
//! ```
//!
//! Everything else stays Bevy's: meshes with [`StandardMaterial`](bevy::pbr::StandardMaterial), transforms, lights in lumens and lux,
//! emissive materials and environment maps are taken from the world, and changes are followed. Girandole draws what is opaque or has
//! holes into the camera's HDR target, with depth. Bevy draws the rest as ever: what is blended, custom materials, the sky, gizmos,
//! bloom, tone mapping and the UI. What is not supported is warned of once; the README has a table.
//!
//! Light samples are placed for what the cameras see and follow the world a few paths a frame
//! ([`Rewalk::Paths`](girandole::light::Rewalk::Paths)); [`GirandolePlugin::illumination`] chooses otherwise.
//!
//! [Girandole]: https://github.com/girandole/girandole
#![deny(missing_docs)]

mod environment;
mod extract;
mod lights;
mod materials;
mod meshes;
mod mirror;
mod notices;
mod pass;
mod textures;
mod units;

pub use girandole;
pub use mirror::SceneMirror;

use bevy::app::{App, Plugin, PostUpdate};
use bevy::camera::{Camera3d, Hdr};
use bevy::core_pipeline::core_3d::{main_opaque_pass_3d, main_transparent_pass_3d};
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems};
use bevy::ecs::lifecycle::HookContext;
use bevy::ecs::prelude::*;
use bevy::ecs::world::DeferredWorld;
use bevy::log::warn;
use bevy::pbr::main_transmissive_pass_3d;
use bevy::render::render_asset::AssetExtractionSystems;
use bevy::render::render_resource::TextureUsages;
use bevy::render::view::Msaa;
use bevy::render::{ExtractSchedule, Render, RenderApp, RenderSystems};
use girandole::light::{IlluminationSettings, Rewalk};
use girandole::light::{LightSettings, Pace};
use girandole::{RenderSettings, RendererOptions};

/// Light samples that are there unless [`GirandolePlugin::illumination`] says otherwise.
const LIGHT_SAMPLES: u32 = 1024;

/// Has cameras with [`Girandole`] lit by it.
#[derive(Clone, Debug)]
pub struct GirandolePlugin {
    /// How light is sampled. Default 1024 samples, which follow the world a few paths a frame.
    pub illumination: IlluminationSettings,
    /// What is fixed when the renderer is made.
    pub options: RendererOptions,
}

impl Default for GirandolePlugin {
    fn default() -> Self {
        // A world may be dark for a while.
        let lights = LightSettings { count: LIGHT_SAMPLES, dark: true, ..LightSettings::default() };
        let rewalk = Rewalk::Paths(Pace::default());
        let illumination = IlluminationSettings { lights, rewalk, ..IlluminationSettings::default() };
        Self { illumination, options: RendererOptions::default() }
    }
}

/// Has a 3D camera lit by Girandole. It has to be [`Hdr`], without [`Msaa`]: this component adds the one and turns the other off.
#[derive(Component, Clone, Copy, Debug, Default)]
#[require(Camera3d, Hdr)]
#[component(on_add = turn_msaa_off)]
pub struct Girandole {
    /// How frames are drawn. Exposure and tone curve are Bevy's, whatever they say.
    pub settings: RenderSettings,
}

fn turn_msaa_off(mut world: DeferredWorld, context: HookContext) {
    world.commands().entity(context.entity).insert(Msaa::Off);
}

impl Plugin for GirandolePlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(PostUpdate, let_depth_be_read);
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            warn!("GirandolePlugin lights nothing without a RenderPlugin; add it after DefaultPlugins");
            return;
        };
        render_app
            .init_resource::<SceneMirror>()
            .insert_resource(pass::Lighting::new(self.options, self.illumination.clone()))
            .add_systems(
                ExtractSchedule,
                (extract::follow_cameras, extract::follow_lights, extract::follow_meshes)
                    .chain()
                    .before(AssetExtractionSystems),
            )
            .add_systems(
                Render,
                (
                    (pass::light_scene, pass::share_out, pass::spare_shadow_maps)
                        .chain()
                        .after(RenderSystems::ExtractCommands)
                        .before(RenderSystems::CreateViews),
                    pass::take_from_bevy.after(RenderSystems::QueueMeshes).before(RenderSystems::QueueSweep),
                ),
            )
            .add_systems(
                Core3d,
                pass::draw
                    .in_set(Core3dSystems::MainPass)
                    .after(main_opaque_pass_3d)
                    .before(main_transmissive_pass_3d)
                    .before(main_transparent_pass_3d),
            );
    }
}

/// Girandole reads the depth of what Bevy draws before.
fn let_depth_be_read(mut cameras: Query<&mut Camera3d, With<Girandole>>) {
    for mut camera in &mut cameras {
        let usages = TextureUsages::from(camera.depth_texture_usages) | TextureUsages::TEXTURE_BINDING;
        if TextureUsages::from(camera.depth_texture_usages) != usages {
            camera.depth_texture_usages = usages.into();
        }
    }
}
