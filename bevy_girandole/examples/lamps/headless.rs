//! Pictures without a window.

use crate::options::Options;
use crate::{Failure, add_hall, hall, pictures, spawn_camera};
use bevy::app::PluginsState;
use bevy::camera::Exposure;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::gpu_readback::{Readback, ReadbackComplete};
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_resource::{PipelineCache, TextureFormat, TextureUsages};
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_girandole::SceneMirror;
use bevy_girandole::girandole::glam;
use bevy_girandole::girandole::scene;
use std::path::Path;
use std::time::Instant;

const FRAMES_A_SECOND: f32 = 60.0;
/// Frames in which nothing is compiled any more, before time is counted.
const WARM_UP: u32 = 4;

#[derive(Resource, Default)]
struct Picture(Option<Vec<u8>>);

pub fn run(options: &Options) -> Result<(), Failure> {
    let mut app = App::new();
    let windowless =
        WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let plugins = DefaultPlugins.build().disable::<WinitPlugin>().disable::<PipelinedRenderingPlugin>();
    app.add_plugins(plugins.set(windowless)).init_resource::<Picture>();
    add_hall(&mut app, options);
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();

    let [width, height] = options.size;
    let format =
        if options.hdr.is_some() { TextureFormat::Rgba16Float } else { TextureFormat::Rgba8UnormSrgb };
    let mut image = Image::new_target_texture(width, height, format, None);
    image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
    let target = app.world_mut().resource_mut::<Assets<Image>>().add(image);
    spawn_camera(&mut app.world_mut().commands(), options, Some(target.clone()));

    // Everything is made now, and Bevy compiles its pipelines beside the frames.
    let mut ready = 0;
    while ready < WARM_UP {
        app.update();
        let pipelines = app.sub_app(RenderApp).world().resource::<PipelineCache>();
        ready = if pipelines.waiting_pipelines().next().is_none() { ready + 1 } else { 0 };
    }
    let start = Instant::now();
    for frame in 0..options.frames + options.rest {
        let seconds = frame.min(options.frames) as f32 / FRAMES_A_SECOND;
        app.world_mut().run_system_cached_with(put_cubes, seconds).map_err(|error| error.to_string())?;
        app.update();
        if let Some(path) = options.export.as_ref().filter(|_| frame + 1 == options.frames + options.rest) {
            export(&app, path)?;
        }
    }
    app.world_mut().spawn(Readback::texture(target)).observe(
        |done: On<ReadbackComplete>, mut picture: ResMut<Picture>| {
            picture.0.get_or_insert_with(|| done.data.clone());
        },
    );
    while app.world().resource::<Picture>().0.is_none() {
        app.update();
    }
    let counted = options.frames + options.rest;
    println!(
        "{} point lights, {} × {height} pixels: {:.1} ms a frame over {counted} frames",
        options.lamps,
        width,
        start.elapsed().as_secs_f64() * 1e3 / f64::from(counted)
    );
    let bytes = app.world_mut().resource_mut::<Picture>().0.take().ok_or("there is no picture")?;
    match (&options.hdr, &options.picture) {
        (Some(path), _) => {
            pictures::write_exr(path, &bytes, options.size, Exposure { ev100: hall::EV100 }.exposure())
        }
        (None, Some(path)) => pictures::write_png(path, bytes, options.size),
        (None, None) => Ok(()),
    }
}

fn put_cubes(seconds: In<f32>, mut cubes: Query<(&hall::Way, &mut Transform)>) {
    hall::move_cubes(*seconds, &mut cubes);
}

/// Girandole's scene, with the camera.
fn export(app: &App, path: &Path) -> Result<(), Failure> {
    let mirror = app.sub_app(RenderApp).world().get_resource::<SceneMirror>();
    let mut scene =
        mirror.ok_or("without Girandole there is no scene to export; leave --bevy out")?.scene().clone();
    let (eye, target) = (glam::Vec3::from(hall::EYE), glam::Vec3::from(hall::TARGET));
    let node = scene.add_node("camera", scene::Transform::looking_at(eye, target));
    let projection = scene::Projection::Perspective { yfov: hall::FOV };
    scene.cameras.push(scene::Camera { name: "camera".into(), node, projection, clip: Default::default() });
    Ok(std::fs::write(path, scene.export_glb()?.bytes)?)
}
