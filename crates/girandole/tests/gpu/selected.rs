//! Frames that shade only what the picture needs, beside the naive one.

use crate::common::{Context, Stage, Test, beyond_storage, exact, mean};
use girandole::{DebugView, Mode, RenderSettings, RendererOptions, Shading, Tier};
use girandole_core::glam::Vec2;
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSet, LightSettings};
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{Material, Scene};
use girandole_reference::metrics::{CompareOptions, compare};
use std::path::Path;

pub fn of_both_tiers() -> Vec<Test> {
    vec![("kernels_of_both_tiers_make_the_same_picture", tiers)]
}

pub fn tests() -> Vec<Test> {
    vec![
        ("vd_differs_only_where_a_map_contradicts_a_ray", pair_by_pair),
        ("vd_is_naive_but_for_errors_of_maps", vd_is_naive),
        ("full_is_close_to_naive", full_is_close),
        ("pools_of_light_far_away_are_not_interpolated_over", pools_far_away),
        ("tolerance_0_shades_all_that_differs", no_tolerance),
        ("light_maps_change_little", light_maps),
        ("selected_frames_repeat_bit_for_bit", repeats),
        ("anti_aliasing_shades_edges_only", anti_aliasing),
        ("debug_views_show_what_they_promise", debug_views),
        ("dots_show_lights_of_all_batches", light_dots),
        ("selected_modes_refuse_with_a_sentence", refuses),
    ]
}

fn settings(mode: Mode) -> RenderSettings {
    RenderSettings { mode, ..exact() }
}

/// With the default bound on the geometric factor.
pub fn bounded(mode: Mode) -> RenderSettings {
    RenderSettings { clamp: Clamp::Own, ..settings(mode) }
}

pub fn flip(reference: &Image, test: &Image) -> f64 {
    compare(reference, test, &CompareOptions::default()).expect("comparable").flip
}

pub fn truth(scene: &str, count: u32) -> Stage {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../girandole-reference/tests/truth").join(scene);
    let loaded = Scene::load(&path.join("scene.glb")).expect("a scene");
    Stage::new(loaded, &LightSettings { count, ..Default::default() })
}

/// All built-in rooms and all scenes of the truth.
fn stages(count: u32) -> Vec<(String, Stage)> {
    let builtin = builtin::EXPERIMENTS.iter().map(|n| (n.to_string(), Stage::builtin(n, count)));
    let truth = ["cornell", "table", "punctual"].map(|n| (format!("truth/{n}"), truth(n, count)));
    builtin.chain(truth).collect()
}

/// A hall's floor with lamps above it: far away, a pool of light lies between one point of the coarsest grid and the next.
fn pools_far_away(context: &Context) {
    let size = [320, 240];
    let stage = Stage::builtin("hall", 300);
    let view = stage.view(0, size);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let [naive, full] =
        [Mode::Naive, Mode::Full].map(|mode| context.frame(&mut renderer, &view, size, &bounded(mode)));
    // Rows with the floor from 4 m away to the far wall.
    let floor = (size[0] * size[1] / 2) as usize..(size[0] * size[1] * 13 / 20) as usize;
    let tolerance = RenderSettings::default().tolerance;
    let is_off = |i: &usize| {
        let [a, b] = [naive.pixels[*i], full.pixels[*i]];
        (a - b).abs().max_element() > tolerance * a.max_element()
    };
    let share = floor.clone().filter(is_off).count() as f64 / floor.len() as f64;
    assert!(share < 0.05, "{share} of the floor is off by more than the tolerance");
}

/// One light at a time: where the two modes differ, the naive map says the opposite of a ray, and the other mode says
/// what the ray says.
fn pair_by_pair(context: &Context) {
    let size = [128, 96];
    let (mut pairs, mut differing, mut wrong, mut contradictions) = (0usize, 0usize, 0usize, 0usize);
    for name in ["table", "pillars"] {
        let stage = Stage::builtin(name, 300);
        let view = stage.view(0, size);
        let tracer = stage.tracer();
        let mut renderer = context.renderer(RendererOptions { map_size: Some(464), ..Default::default() });
        for light in stage.lights.samples().iter().step_by(23) {
            let alone = Stage {
                scene: stage.scene.clone(),
                geometry: stage.geometry.clone(),
                lights: LightSet::from_samples(&stage.geometry, vec![*light]),
            };
            context.load(&mut renderer, &alone);
            let naive = context.frame(&mut renderer, &view, size, &settings(Mode::Naive));
            let vd = context.frame(&mut renderer, &view, size, &settings(Mode::Visibility));
            let average = mean(&naive);
            for i in 0..naive.pixels.len() {
                let at = Vec2::new((i % size[0] as usize) as f32, (i / size[0] as usize) as f32) + 0.5;
                let (origin, direction) = stage.local(&view).pixel_ray(at, size);
                let Some(hit) = tracer.closest_visible(origin, direction) else { continue };
                let s = stage.geometry.surface(
                    &stage.scene,
                    hit.triangle,
                    hit.barycentric,
                    -direction.normalize(),
                );
                let g = light.geometric_factor(s.position, s.geometric_normal, s.shading_normal, Clamp::Off);
                if g.is_none() || s.emission.max_element() > 0.0 || s.albedo.max_element() <= 0.0 {
                    continue;
                }
                pairs += 1;
                let traced = girandole_reference::visible(&tracer, &s, hit.triangle, light);
                let lit = |image: &Image| image.pixels[i].max_element() > 0.0;
                contradictions += usize::from(lit(&naive) != traced);
                let largest = naive.pixels[i].max_element().max(average);
                if (naive.pixels[i] - vd.pixels[i]).abs().max_element() > 1e-5 * largest {
                    differing += 1;
                    wrong += usize::from(lit(&naive) == traced || lit(&vd) != traced);
                }
            }
        }
    }
    eprintln!("{differing} of {pairs} pairs differ; maps contradict rays on {contradictions}");
    assert!(pairs > 100_000, "{pairs}");
    assert_eq!(wrong, 0, "of {differing} pairs that differ");
    assert!(differing * 200 <= pairs, "{differing} of {pairs} pairs differ");
    // The control: maps do contradict rays, so the search means something.
    assert!(contradictions >= differing && contradictions > 0);
}

fn vd_is_naive(context: &Context) {
    let size = [256, 192];
    for (name, stage) in stages(120) {
        let view = stage.view(0, size);
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let naive = context.frame(&mut renderer, &view, size, &bounded(Mode::Naive));
        let vd = context.frame(&mut renderer, &view, size, &bounded(Mode::Visibility));
        let error = flip(&naive, &vd);
        eprintln!("{name}: FLIP {error:.5}");
        assert!(error <= 0.005, "{name}: FLIP {error}");
        // The control: without one light in twenty the picture is another one.
        let all = stage.lights.samples().iter().enumerate();
        let fewer = all.filter(|(i, _)| i % 20 != 7).map(|(_, l)| *l).collect();
        let fewer = LightSet::from_samples(&stage.geometry, fewer);
        renderer.load(&stage.scene, &stage.geometry, &fewer).expect("load");
        let other = context.frame(&mut renderer, &view, size, &bounded(Mode::Naive));
        assert!(flip(&naive, &other) > 0.005, "{name}");
    }
}

fn full_is_close(context: &Context) {
    let size = [400, 300];
    for (name, stage) in stages(300) {
        let view = stage.view(0, size);
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let naive = context.frame(&mut renderer, &view, size, &bounded(Mode::Naive));
        let full = context.frame(&mut renderer, &view, size, &bounded(Mode::Full));
        let stats = context.wait(renderer.stats()).expect("stats");
        assert!(stats.gpu_ms.is_empty(), "nobody asked for times");
        let points: u64 = stats.points.iter().sum();
        let share = points as f64 / (f64::from(size[0]) * f64::from(size[1]));
        let error = flip(&naive, &full);
        let energy = f64::from(mean(&full) / mean(&naive));
        eprintln!("{name}: FLIP {error:.4}, energy {energy:.4}, {:.1} % of the pixels shaded", share * 100.0);
        assert!(error <= 0.02, "{name}: FLIP {error}");
        assert!((energy - 1.0).abs() < 0.005, "{name}: energy {energy}");
        assert!(share < 0.2, "{name}: {share} of the pixels shaded");
        // The control: interpolating whatever lies on one plane is seen.
        let careless = RenderSettings { tolerance: 100.0, ..bounded(Mode::Full) };
        let careless = context.frame(&mut renderer, &view, size, &careless);
        let careless = flip(&naive, &careless);
        assert!(careless > 1.2 * error, "{name}: {careless}");
    }
}

fn no_tolerance(context: &Context) {
    let size = [161, 119];
    for stage in [Stage::builtin("table", 60), truth("punctual", 60)] {
        let view = stage.view(0, size);
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let vd = context.frame(&mut renderer, &view, size, &settings(Mode::Visibility));
        let low = |tolerance| RenderSettings { tolerance, ..settings(Mode::LowResolution) };
        let all = context.frame(&mut renderer, &view, size, &low(0.0));
        // Where lanes share points, sums have another order.
        let largest = beyond_storage(&vd, &all);
        assert!(largest < 1e-5, "{largest}");
        // The control: with a tolerance it is not the same.
        let some = context.frame(&mut renderer, &view, size, &low(0.05));
        assert!(beyond_storage(&vd, &some) > 1e-3);
    }
}

fn light_maps(context: &Context) {
    let size = [256, 192];
    for (name, stage) in stages(200) {
        let view = stage.view(0, size);
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let with = |light_maps| RenderSettings { light_maps, ..bounded(Mode::Visibility) };
        let off = context.frame(&mut renderer, &view, size, &with(Some(false)));
        let on = context.frame(&mut renderer, &view, size, &with(Some(true)));
        let stats = context.wait(renderer.stats()).expect("stats");
        let c = compare(&off, &on, &CompareOptions::default()).expect("comparable");
        eprintln!("{name}: FLIP {:.5}, relMSE {:.2e}, {} maps", c.flip, c.rel_mse, stats.leaves[1]);
        assert!(c.flip <= 0.006 && c.rel_mse < 1e-4, "{name}: {c:?}");
        assert!(stats.leaves[1] > 0 && stats.pairs.mapped > 0, "{name}: no light maps");
        assert!(on.pixels.iter().all(|p| p.min_element() >= 0.0), "{name}: below 0");
        // The control: a map made with another bound is another map.
        let other = RenderSettings { clamp: Clamp::At(0.02), ..with(Some(true)) };
        let other = context.frame(&mut renderer, &view, size, &other);
        assert!(flip(&off, &other) > 0.006, "{name}");
        // And it is made anew when the bound changes back.
        assert!(context.frame(&mut renderer, &view, size, &with(Some(true))).pixels == on.pixels, "{name}");
    }
}

/// A room whose things reflect like mirrors, like satin and not at all.
pub fn glossy(count: u32) -> Stage {
    let mut scene = builtin::build("table", MovingObject::Teapot).expect("table");
    for (index, material) in scene.materials.iter_mut().enumerate() {
        let shine = Material { specular: 1.0, roughness: [0.2, 0.7][index % 2], ..material.clone() };
        if index % 3 > 0 {
            *material = shine;
        }
    }
    Stage::new(scene, &LightSettings { count, ..Default::default() })
}

fn repeats(context: &Context) {
    let size = [200, 150];
    let stage = Stage::builtin("area-lights", 150);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let full = RenderSettings { samples_per_axis: 2, ..bounded(Mode::Full) };
    let first = context.frame(&mut renderer, &stage.view(0, size), size, &full);
    // Whatever was drawn in between.
    for mode in [Mode::Visibility, Mode::Naive, Mode::LowResolution] {
        context.frame(&mut renderer, &stage.view(1, [96, 80]), [96, 80], &bounded(mode));
        let again = context.frame(&mut renderer, &stage.view(0, size), size, &full);
        assert!(again.pixels == first.pixels, "after {mode:?}");
    }
    let mut fresh = context.loaded(&stage, RendererOptions::default());
    assert!(context.frame(&mut fresh, &stage.view(0, size), size, &full).pixels == first.pixels);
    // The control: another camera is another picture.
    assert!(context.frame(&mut fresh, &stage.view(1, size), size, &full).pixels != first.pixels);
}

/// What both sets of kernels make of the same. Where lanes share points, sums differ by rounding.
fn tiers(context: &Context) {
    let size = [112, 84];
    let careful = |mode, tolerance| RenderSettings { tolerance, ..bounded(mode) };
    let passes = Shading::Multipass { lights_per_pass: 3 };
    let cases = [
        ("naive", careful(Mode::Naive, 0.0)),
        // Without tolerance, lest rounding decide what is interpolated.
        ("low", careful(Mode::LowResolution, 0.0)),
        ("full", careful(Mode::Full, 0.0)),
        ("passes", RenderSettings { shading: passes, ..careful(Mode::Visibility, 0.0) }),
        ("atlas", RenderSettings { debug: Some(DebugView::Atlas), ..careful(Mode::Naive, 0.0) }),
    ];
    // Pages of many maps, of maps whose rows are no multiple of what copies ask for, and one with a sun.
    for stage in [Stage::builtin("table", 600), glossy(60), truth("punctual", 60)] {
        let view = stage.view(0, size);
        let pictures = |tier, map_size| {
            let options =
                RendererOptions { tier: Some(tier), map_size: Some(map_size), ..RendererOptions::default() };
            let mut renderer = context.loaded(&stage, options);
            let pictures = cases.map(|(_, settings)| context.frame(&mut renderer, &view, size, &settings));
            let tolerant = context.frame(&mut renderer, &view, size, &careful(Mode::Full, 0.05));
            (pictures, tolerant, context.wait(renderer.shadow_map(7)).expect("a map"))
        };
        let [gpu, software] = [Tier::Gpu, Tier::Software].map(|tier| pictures(tier, 96));
        for ((name, _), (a, b)) in cases.iter().zip(gpu.0.iter().zip(&software.0)) {
            assert!(beyond_storage(a, b) < 2e-5, "{name}: {}", beyond_storage(a, b));
        }
        assert!(flip(&gpu.1, &software.1) < 0.005 && gpu.2 == software.2);
        // The controls: light maps make more of a difference, and so do other maps.
        assert!(beyond_storage(&gpu.0[1], &gpu.0[2]) > 2e-5);
        let coarser = pictures(Tier::Gpu, 80);
        assert!(gpu.0.iter().zip(&coarser.0).all(|(a, b)| beyond_storage(a, b) > 2e-5));
    }
}

fn anti_aliasing(context: &Context) {
    let size = [400, 300];
    for name in ["table", "pillars"] {
        let stage = Stage::builtin(name, 300);
        let view = stage.view(0, size);
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let mut frame = |mode, samples_per_axis| {
            let settings = RenderSettings { samples_per_axis, ..bounded(mode) };
            let picture = context.frame(&mut renderer, &view, size, &settings);
            (picture, context.wait(renderer.stats()).expect("stats"))
        };
        let (rough, one) = frame(Mode::Full, 1);
        let (smooth, four) = frame(Mode::Full, 2);
        let (reference, _) = frame(Mode::Naive, 2);
        let ratio = four.pairs.evaluated() as f64 / one.pairs.evaluated() as f64;
        let [smooth_error, rough_error] = [&smooth, &rough]
            .map(|p| compare(&reference, p, &CompareOptions::default()).expect("comparable"));
        eprintln!(
            "{name}: {ratio:.3} × the pairs, FLIP {:.4} and relMSE {:.5}, without {:.4} and {:.5}",
            smooth_error.flip, smooth_error.rel_mse, rough_error.flip, rough_error.rel_mse
        );
        assert!((0.9..=1.6).contains(&ratio), "{name}: {ratio}");
        // Coarse grids stay the same.
        assert_eq!(four.points[3], one.points[3], "{name}");
        assert!(smooth_error.flip < 0.02, "{name}");
        // The control: without it the edges are seen.
        assert!(rough_error.rel_mse > 1.4 * smooth_error.rel_mse, "{name}");
    }
}

fn debug_views(context: &Context) {
    let size = [160, 120];
    let stage = Stage::builtin("table", 50);
    let view = stage.view(0, size);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let mut show = |debug| {
        let settings = RenderSettings { debug: Some(debug), ..bounded(Mode::Full) };
        let picture = context.frame(&mut renderer, &view, size, &settings);
        let mut colors: Vec<[u32; 3]> =
            picture.pixels.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
        assert!(picture.pixels.iter().all(|p| p.is_finite() && p.min_element() >= 0.0), "{debug:?}");
        colors.sort_unstable();
        colors.dedup();
        (picture, colors.len())
    };
    assert!(show(DebugView::Receivers).1 > 50);
    // States: three colours, a little darker where surfaces turn away; another light, another picture.
    let (of_one, _) = show(DebugView::States(Some(0)));
    let green = of_one.pixels.iter().filter(|p| p.y > 4.0 * p.x).count();
    let yellow = of_one.pixels.iter().filter(|p| p.x > p.y && p.y > 0.5 * p.x).count();
    assert!(green > 1000 && yellow > 500, "{green} {yellow}");
    assert!(show(DebugView::States(Some(40))).0.pixels != of_one.pixels);
    assert!(show(DebugView::States(None)).1 > 10);
    let (maps, shades) = show(DebugView::LightMaps);
    assert!(shades > 1000 && maps.pixels.iter().any(|p| p.max_element() == 0.0), "the torus has no map");
    // Levels: as many points in the coarsest grid's colour as it has.
    let (levels, _) = show(DebugView::Levels);
    let coarsest = levels.pixels.iter().filter(|p| p.z == 1.0).count();
    assert_eq!(coarsest, 21 * 16, "points every 8 pixels, and at the last column and row");
    assert!(show(DebugView::LightPositions).0.pixels.iter().any(|p| p.max_element() == 1.0));
    // One map a light, 17 pixels wide with a line between them: 9 × 7 of them have room.
    let atlas = show(DebugView::Atlas).0.pixels;
    let map =
        |light: usize| (0..16 * 16).map(move |i| (light / 9 * 17 + i / 16) * 160 + light % 9 * 17 + i % 16);
    let of_map = |light: usize| map(light).map(|i| atlas[i]).collect::<Vec<_>>();
    assert!((0..50).all(|light| of_map(light).iter().all(|p| p.z > 0.0)), "what is empty is blue");
    let shown = (0..50).filter(|&light| of_map(light).iter().any(|p| p.x > 0.1)).count();
    assert!(shown > 40, "most lights have something before them: {shown} of 50");
    assert!((50..63).all(|light| of_map(light).iter().all(|p| p.max_element() == 0.0)));
    assert!((1..50).all(|light| of_map(light) != of_map(light - 1)), "no two are the same");
}

/// All lights in view have a dot where `view` projects them.
fn light_dots(context: &Context) {
    let size = [640, 480];
    let stage = Stage::builtin("table", 700);
    let view = stage.view(0, size);
    let mut renderer = context.loaded(&stage, RendererOptions { map_size: Some(32), ..Default::default() });
    for mode in [Mode::Naive, Mode::Full] {
        let mut shown = |debug| {
            let picture =
                context.frame(&mut renderer, &view, size, &RenderSettings { debug, ..bounded(mode) });
            let (mut inside, mut dots) = (0, 0);
            let view = stage.local(&view);
            for light in stage.lights.samples() {
                let d = light.position - view.eye;
                let depth = d.dot(view.forward);
                let across = Vec2::new(d.dot(view.right), -d.dot(view.up)) / (view.half_extent * depth);
                let at = ((across * 0.5 + 0.5) * Vec2::new(640.0, 480.0)).floor();
                if depth > 0.0 && at.cmpge(Vec2::ZERO).all() && at.cmplt(Vec2::new(637.0, 480.0)).all() {
                    inside += 1;
                    let beside = picture.pixels[at.y as usize * 640 + at.x as usize + 3];
                    // Devices divide with an error of some units in the last place.
                    dots += usize::from((beside.max_element() - 1.0).abs() < 1e-4);
                }
            }
            (inside, dots)
        };
        let (inside, dots) = shown(Some(DebugView::LightPositions));
        assert!(inside > 150 && dots == inside, "{mode:?}: {dots} of {inside}");
        // The control: without the view there are none.
        let (_, none) = shown(None);
        assert!(none * 20 < inside, "{mode:?}: {none}");
    }
}

fn refuses(context: &Context) {
    let stage = Stage::builtin("table", 20);
    let view = stage.view(0, [64, 64]);
    let sentence = |result: girandole::Result<()>, about: &str| {
        let text = result.expect_err("an error").to_string();
        assert!(text.contains(about) && !text.contains('\n'), "{text}");
    };
    let mut renderer = context.renderer(RendererOptions::default());
    let database = std::sync::Arc::new(stage.visibility());
    let (scene, geometry) = (&stage.scene, &stage.geometry);
    sentence(renderer.load_visibility(scene, geometry, &stage.lights, database.clone()), "load the scene");
    renderer.load(scene, geometry, &stage.lights).expect("load");
    sentence(renderer.render(&view, [64, 64], &settings(Mode::Full)), "visibility database");
    let other = Stage::builtin("table", 21);
    sentence(renderer.load_visibility(scene, geometry, &stage.lights, other.visibility()), "other lights");
    renderer.load_visibility(scene, geometry, &stage.lights, database.clone()).expect("visibility");
    let debug = |mode, view| RenderSettings { debug: Some(view), ..settings(mode) };
    sentence(renderer.render(&view, [64, 64], &debug(Mode::Naive, DebugView::Levels)), "another mode");
    sentence(
        renderer.render(&view, [64, 64], &debug(Mode::Full, DebugView::States(Some(20)))),
        "no light 20",
    );
    let naive_maps = RenderSettings { light_maps: Some(true), ..settings(Mode::Naive) };
    sentence(renderer.render(&view, [64, 64], &naive_maps), "light maps");
    for tolerance in [f32::NAN, f32::INFINITY, -1.0] {
        let wrong = RenderSettings { tolerance, ..settings(Mode::Full) };
        sentence(renderer.render(&view, [64, 64], &wrong), "tolerance");
    }
    let several = |mode, lights_per_pass| RenderSettings {
        shading: Shading::Multipass { lights_per_pass },
        ..settings(mode)
    };
    sentence(renderer.render(&view, [64, 64], &several(Mode::Full, 0)), "lights a pass");
    sentence(renderer.render(&view, [64, 64], &several(Mode::Full, 33)), "lights a pass");
    sentence(renderer.render(&view, [64, 64], &several(Mode::Naive, 7)), "naive");
    // The control: what was refused is possible with other settings.
    renderer.render(&view, [64, 64], &settings(Mode::Full)).expect("a frame");
}
