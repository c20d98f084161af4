//! Parts of pictures: to the bit what the whole has there, and for less.

use crate::common::{Context, OneView, Stage, Test, with_object};
use crate::layers::glazed;
use girandole::{DebugView, Mode, RenderSettings, RendererOptions, Shading};
use girandole_core::image::{Image, Region};
use girandole_core::lights::LightSettings;
use girandole_core::scene::builtin::MovingObject;

pub fn tests() -> Vec<Test> {
    vec![
        ("parts_of_pictures_are_those_of_the_whole", parts),
        ("parts_across_bands_are_those_of_the_whole", across_bands),
        ("parts_that_cannot_be_are_refused", refused),
    ]
}

const SIZE: [u32; 2] = [320, 240];

/// The pixels of a region.
fn cut(whole: &Image, region: Region) -> Vec<[u32; 3]> {
    let bits = |row: std::ops::Range<usize>| {
        whole.pixels[row].iter().map(|p| p.to_array().map(f32::to_bits)).collect::<Vec<_>>()
    };
    region.rows(whole.width).flat_map(bits).collect()
}

fn points(context: &Context, renderer: &OneView) -> u64 {
    context.wait(renderer.stats()).expect("stats").points.iter().sum()
}

fn parts(context: &Context) {
    let regions = [
        Region { first: [143, 101], size: [31, 27] },
        Region { first: [289, 217], size: [31, 23] },
        Region { first: [200, 0], size: [1, 1] },
    ];
    let full = RenderSettings::default();
    let passes = Shading::Multipass { lights_per_pass: 8 };
    let twice = RenderSettings { samples_per_axis: 2, ..full };
    for (name, settings) in [
        ("table", full),
        ("table", RenderSettings { mode: Mode::Naive, ..full }),
        ("table", twice),
        ("table", RenderSettings { shading: passes, ..full }),
        ("pillars", RenderSettings { mode: Mode::LowResolution, samples_per_axis: 3, ..full }),
        ("mirrors", full),
        ("living-room", twice),
        ("glazed", twice),
    ] {
        let stage = match name {
            "glazed" => Stage::new(glazed("table"), &LightSettings { count: 24, ..Default::default() }),
            name => Stage::builtin(name, 24),
        };
        let mut renderer =
            context.loaded(&stage, RendererOptions { map_size: Some(64), ..Default::default() });
        let view = stage.view(0, SIZE);
        let whole = context.frame(&mut renderer, &view, SIZE, &settings);
        let all = points(context, &renderer);
        // What is left of another picture is not taken for this one's.
        let mut other = view;
        other.center.x += 0.3;
        context.frame(&mut renderer, &other, SIZE, &settings);
        for region in regions {
            let part = RenderSettings { region: Some(region), ..settings };
            let found = context.frame(&mut renderer, &view, SIZE, &part);
            assert_eq!([found.width, found.height], region.size);
            let expected = cut(&whole, region);
            let found = cut(&found, Region::whole(region.size));
            let wrong = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
            assert_eq!(wrong, 0, "{name} {settings:?} {region}");
            let beside = Region { first: region.first.map(|at| at / 2), ..region };
            assert_ne!(cut(&whole, beside), expected, "the control: another part is another one");
            if settings.mode == Mode::Full && name == "table" {
                let some = points(context, &renderer);
                assert!(some * 2 < all, "{name} {region}: {some} of {all} points are shaded");
            }
        }
    }
}

fn across_bands(context: &Context) {
    // Bands of 128 rows.
    let size = [8000, 160];
    let settings = LightSettings { count: 8, ..LightSettings::default() };
    let stage = Stage::new(with_object("pillars", MovingObject::Torus), &settings);
    let mut renderer = context.loaded(&stage, RendererOptions { map_size: Some(64), ..Default::default() });
    let view = stage.view(0, size);
    let settings = RenderSettings { samples_per_axis: 2, ..RenderSettings::default() };
    let whole = context.frame(&mut renderer, &view, size, &settings);
    for region in [[3000, 90, 120, 60], [3990, 128, 9, 32]] {
        let [x, y, width, height] = region;
        let region = Region { first: [x, y], size: [width, height] };
        let part = RenderSettings { region: Some(region), ..settings };
        let found = context.frame(&mut renderer, &view, size, &part);
        let is_same = cut(&found, Region::whole(region.size)) == cut(&whole, region);
        assert!(is_same, "{region}");
    }
}

fn refused(context: &Context) {
    let stage = Stage::builtin("table", 4);
    let mut renderer = context.loaded(&stage, RendererOptions { map_size: Some(64), ..Default::default() });
    let view = stage.view(0, SIZE);
    let part = |first, size| RenderSettings { region: Some(Region { first, size }), ..Default::default() };
    for (settings, says) in [
        (part([479, 0], [2, 1]), "does not lie in a picture"),
        (part([0, 0], [0, 1]), "does not lie in a picture"),
        (RenderSettings { debug: Some(DebugView::Receivers), ..part([0, 0], [8, 8]) }, "leave the part out"),
    ] {
        let error = renderer.render(&view, SIZE, &settings).expect_err("no part").to_string();
        assert!(error.contains(says), "{error}");
    }
    renderer.render(&view, SIZE, &part([8, 8], [8, 8])).expect("a part");
}
