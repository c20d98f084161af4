//! A hall with 64 shadowed point lights, two cubes that move among its pillars, and Bevy's UI over it.
//!
//! ```text
//! cargo run --release --example lamps                                  a window
//! cargo run --release --example lamps -- --headless lamps.png          a picture
//!     --frames N       frames until the cubes stop (60)
//!     --rest N         frames from then on until the picture is taken (20)
//!     --size WxH       pixels (960x540)
//!     --lamps N        point lights (64)
//!     --samples N      Girandole's light samples (1024)
//!     --bounces N      bounces of indirect light (5)
//!     --anew           all light is sampled anew each frame, as `girandole render` does, instead of a few paths
//!     --bevy           lit by Bevy alone; with --bounces 0 without ambient light
//!     --hdr FILE.exr   linear radiance in place of a .png, before exposure and without the UI
//!     --export FILE.glb  the scene as Girandole has it, for `girandole render`
//! ```

mod hall;
mod headless;
mod options;
mod pictures;

use bevy::camera::{Exposure, Hdr};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::prelude::*;
use bevy_girandole::girandole::light::Rewalk;
use bevy_girandole::{Girandole, GirandolePlugin};
use options::Options;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let options = Options::read(std::env::args().skip(1))?;
    if options.picture.is_some() {
        return headless::run(&options);
    }
    let mut app = App::new();
    app.add_plugins(DefaultPlugins);
    add_hall(&mut app, &options);
    app.add_systems(Update, |time: Res<Time>, mut cubes: Query<(&hall::Way, &mut Transform)>| {
        hall::move_cubes(time.elapsed_secs(), &mut cubes);
    });
    app.add_systems(Startup, |mut commands: Commands, options: Res<Options>| {
        spawn_camera(&mut commands, &options, None);
    });
    app.run();
    Ok(())
}

/// What windows and pictures have in common.
fn add_hall(app: &mut App, options: &Options) {
    app.insert_resource(options.clone())
        .insert_resource(ClearColor(Color::BLACK))
        .add_systems(Startup, hall::build);
    if !options.bevy {
        let mut plugin = GirandolePlugin::default();
        plugin.illumination.lights.count = options.samples;
        plugin.illumination.lights.bounces = options.bounces;
        if options.anew {
            plugin.illumination.rewalk = Rewalk::All;
        }
        app.add_plugins(plugin);
    }
    // Girandole's indirect light takes the place of a guess at it.
    if !options.bevy || options.bounces == 0 {
        app.insert_resource(GlobalAmbientLight::NONE);
    }
}

fn spawn_camera(commands: &mut Commands, options: &Options, target: Option<Handle<Image>>) {
    let mut camera = commands.spawn((
        Camera3d::default(),
        Hdr,
        Msaa::Off,
        Exposure { ev100: hall::EV100 },
        Projection::from(PerspectiveProjection { fov: hall::FOV, ..default() }),
        Transform::from_translation(hall::EYE.into()).looking_at(hall::TARGET.into(), Vec3::Y),
        if options.hdr.is_some() { Tonemapping::None } else { Tonemapping::AgX },
    ));
    if !options.bevy {
        camera.insert(Girandole::default());
    }
    if let Some(target) = target {
        camera.insert(bevy::camera::RenderTarget::from(target));
    }
    let camera = camera.id();
    if options.hdr.is_none() {
        let light = if options.bevy { "Bevy" } else { "Girandole" };
        commands.spawn((
            Text::new(format!("{} point lights, lit by {light}", options.lamps)),
            TextColor(Color::WHITE),
            Node { position_type: PositionType::Absolute, top: px(12), left: px(16), ..default() },
            UiTargetCamera(camera),
        ));
    }
}
