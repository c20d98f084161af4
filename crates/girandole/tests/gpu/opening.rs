//! A scene that is opened slice by slice, and lit by more and more of its samples.

use super::common::{Context, Test};
use girandole::core::illumination::{Illumination, IlluminationSettings, Opening, Rewalk, Stage};
use girandole::core::lights::LightSettings;
use girandole::core::scene::{View, builtin};
use girandole::{Mode, RenderSettings, RendererOptions};

const SIZE: [u32; 2] = [96, 72];

pub fn tests() -> Vec<Test> {
    vec![("a_picture_grows_from_few_samples_to_all", grows)]
}

fn grows(context: &Context) {
    let scene = builtin::build("table", builtin::MovingObject::Torus).expect("a room");
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let lights = LightSettings { count: 150, candidates: 2, ..LightSettings::default() };
    let settings = IlluminationSettings { lights, rewalk: Rewalk::Off, ..IlluminationSettings::default() };
    let options = RendererOptions { map_size: Some(64), ..Default::default() };
    let naive = RenderSettings { mode: Mode::Naive, ..RenderSettings::default() };
    let full = RenderSettings::default();

    // What a renderer makes of so many at once.
    let whole = Illumination::new(&scene, &settings).expect("opens");
    let fresh = |most: usize, settings: &RenderSettings| {
        let mut renderer = context.renderer(options);
        let mut lit = whole.clone();
        lit.light(&scene, Some(most)).expect("light");
        renderer.open_with(&scene, lit).expect("open");
        context.frame(&mut renderer, &view, SIZE, settings)
    };

    let mut renderer = context.renderer(options);
    let mut opening = Opening::new(settings.clone());
    let drawn = |renderer: &girandole::Renderer| context.wait(renderer.stats()).expect("stats").maps_drawn;
    loop {
        match opening.step(&scene).expect("a slice") {
            Stage::Lights(mut illumination) => {
                illumination.light(&scene, Some(16)).expect("light");
                renderer.open_with(&scene, *illumination).expect("open");
                let picture = context.frame(&mut renderer, &view, SIZE, &naive);
                assert_eq!(drawn(&renderer), 16, "maps of dark samples wait");
                assert!(picture == fresh(16, &naive), "16 of 150, naive");
                renderer.light(&scene, Some(40)).expect("light");
                let picture = context.frame(&mut renderer, &view, SIZE, &naive);
                assert_eq!(drawn(&renderer), 24, "those that are there stay");
                assert!(picture == fresh(40, &naive), "40 of 150, naive");
            }
            Stage::Slice => {}
            Stage::Visibility(database) => renderer.set_visibility(&scene, database).expect("visibility"),
            Stage::Done => break,
        }
    }
    let picture = context.frame(&mut renderer, &view, SIZE, &full);
    assert_eq!(drawn(&renderer), 0, "visibility changes no map");
    assert!(picture == fresh(40, &full), "40 of 150, full");
    renderer.light(&scene, None).expect("light");
    let picture = context.frame(&mut renderer, &view, SIZE, &full);
    assert_eq!(drawn(&renderer), 110);
    let mut other = context.renderer(options);
    other.open(&scene, &settings).expect("open");
    assert!(picture == context.frame(&mut other, &view, SIZE, &full), "all of them");
}
