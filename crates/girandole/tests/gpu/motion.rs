//! Scenes in which things move while light samples are held.

use crate::common::{Context, Stage, Test};
use girandole::core::illumination::{IlluminationSettings, Rewalk};
use girandole::core::lights::LightSettings;
use girandole::core::scene::View;
use girandole::core::scene::builtin::{self, MovingObject};
use girandole::{Mode, RenderSettings, RendererOptions};

pub fn tests() -> Vec<Test> {
    vec![("with_held_lights_the_picture_is_that_of_a_fresh_renderer", held_lights)]
}

fn held_lights(context: &Context) {
    let size = [64, 48];
    let options = || RendererOptions { map_size: Some(64), ..Default::default() };
    let mut scene = builtin::build("table", MovingObject::Torus).expect("a room");
    let lights = LightSettings { count: 24, candidates: 4, walk_dynamic: false, ..Default::default() };
    let settings = IlluminationSettings { lights, rewalk: Rewalk::Off, ..Default::default() };
    let mut renderer = context.renderer(options());
    renderer.open(&scene, &settings).expect("open");
    let mut other = context.renderer(options());
    let mut pictures = Vec::new();
    for seconds in [0.3, 1.1, 2.9] {
        scene.set_time(seconds).expect("a moment");
        let changes = scene.take_changes();
        renderer.update(&scene, &changes).expect("update");
        let illumination = renderer.illumination().expect("it is open");
        // Geometry and lights are taken as they are, visibility is determined from scratch.
        let stage = Stage {
            scene: scene.clone(),
            geometry: illumination.geometry().clone(),
            lights: illumination.lights().clone(),
        };
        context.load(&mut other, &stage);
        let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
        for mode in [Mode::Naive, Mode::Full] {
            let settings = RenderSettings { mode, ..RenderSettings::default() };
            let after = context.frame(&mut renderer, &view, size, &settings);
            let anew = context.frame(&mut other, &view, size, &settings);
            assert!(after.pixels == anew.pixels, "{seconds} s, {mode:?}");
            pictures.push(after.pixels);
        }
    }
    // The control: it moves.
    assert!((2..pictures.len()).all(|i| pictures[i] != pictures[i - 2]));
}
