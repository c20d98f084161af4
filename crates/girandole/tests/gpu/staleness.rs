//! What is said of the error that shadow maps make which are not up to date.

use crate::common::{Context, OneView, Test, camera, lamp, room};
use girandole::{MapUpdates, Mode, RenderSettings, RendererOptions, Shading, ShadowMap};
use girandole_core::glam::{Quat, Vec2, Vec3};
use girandole_core::illumination::{IlluminationSettings, Rewalk};
use girandole_core::image::{Image, luminance};
use girandole_core::lights::LightSettings;
use girandole_core::scene::builtin::{self, MovingObject, shapes};
use girandole_core::scene::{
    ColorSpace, Filter, Material, Mesh, PunctualKind, PunctualLight, Scene, Texture, TextureRef, Transform,
    View, Wrap,
};
use girandole_core::trace::SceneTracer;

pub fn tests() -> Vec<Test> {
    vec![
        ("the_error_of_stale_maps_is_as_estimated_within_a_factor_of_two", error_estimate),
        ("the_estimate_knows_masks_textures_and_all_lights", masks_and_profiles),
        ("the_estimate_is_of_the_last_frame", last_frame),
        ("what_moves_is_not_dark_where_stale_maps_show_it_elsewhere", movers_in_stale_maps),
    ]
}

const SIZE: [u32; 2] = [96, 72];
/// Errors below this are not compared.
const LEAST: f64 = 1e-3;

/// The mean difference of luminance, as a share of the mean.
fn difference(shown: &Image, up_to_date: &Image) -> f64 {
    let mean = |values: &mut dyn Iterator<Item = f32>| values.map(f64::from).sum::<f64>();
    let pairs = shown.pixels.iter().zip(&up_to_date.pixels);
    mean(&mut pairs.map(|(a, b)| (luminance(*a) - luminance(*b)).abs()))
        / mean(&mut shown.pixels.iter().map(|pixel| luminance(*pixel)))
}

fn agree(estimate: f64, measured: f64) -> bool {
    measured < LEAST || (0.5..=2.0).contains(&(estimate / measured))
}

fn held(count: u32) -> IlluminationSettings {
    let lights = LightSettings { count, candidates: 4, walk_dynamic: false, ..Default::default() };
    IlluminationSettings { lights, rewalk: Rewalk::Off, ..Default::default() }
}

/// Pictures of a scene along its motion with a budget of maps, the estimates of their errors, and what the errors are.
struct Motion<'a> {
    context: &'a Context,
    scene: Scene,
    lights: IlluminationSettings,
    settings: RenderSettings,
    renderers: [OneView; 2],
}

impl<'a> Motion<'a> {
    fn new(context: &'a Context, scene: Scene, lights: u32, mode: Mode, shadow_map: ShadowMap) -> Self {
        let options = RendererOptions { map_size: Some(64), shadow_map, ..Default::default() };
        let settings = RenderSettings { mode, ..RenderSettings::default() };
        let renderers = [context.renderer(options), context.renderer(options)];
        Self { context, scene, lights: held(lights), settings, renderers }
    }

    /// Estimated and measured errors of frames, between which `advance` moves things.
    fn errors(&mut self, most: u32, steps: u32, advance: impl Fn(&mut Scene, u32)) -> Vec<[f64; 2]> {
        let Self { context, lights, settings, renderers: [shown, up_to_date], .. } = self;
        let mut scene = self.scene.clone();
        let view = View::new(&scene, &scene.cameras[0], SIZE[0] as f32 / SIZE[1] as f32);
        scene.take_changes();
        for renderer in [&mut *shown, &mut *up_to_date] {
            renderer.open(&scene, lights).expect("open");
            renderer.render(&view, SIZE, settings).expect("render");
        }
        let few =
            RenderSettings { updates: MapUpdates { most: Some(most), ..MapUpdates::default() }, ..*settings };
        let step = |step| {
            advance(&mut scene, step);
            let changes = scene.take_changes();
            let [(estimate, picture), (none, truth)] = [(&mut *shown, &few), (&mut *up_to_date, &*settings)]
                .map(|(renderer, settings)| {
                    renderer.update(&scene, &changes).expect("update");
                    let picture = context.frame(renderer, &view, SIZE, settings);
                    let stats = context.wait(renderer.stats()).expect("stats");
                    assert_eq!(stats.stale.maps == 0, settings.updates.most.is_none());
                    let error = context.wait(renderer.stale_error()).expect("an estimate");
                    (error.expect("a frame was rendered"), picture)
                });
            assert_eq!(none, 0.0, "all maps are up to date");
            [estimate, difference(&picture, &truth)]
        };
        (1..=steps).map(step).collect()
    }
}

fn error_estimate(context: &Context) {
    for (name, lights, mode, shadow_map) in
        [("pillars", 60, Mode::Full, ShadowMap::Octahedral), ("table", 36, Mode::Naive, ShadowMap::Parabolic)]
    {
        let scene = builtin::build(name, MovingObject::Torus).expect("a room");
        let mut motion = Motion::new(context, scene, lights, mode, shadow_map);
        let advance =
            |scene: &mut Scene, step: u32| scene.set_time(f64::from(step) * 0.15).expect("a moment");
        let errors = [0, lights / 6, lights / 3].map(|most| motion.errors(most, 5, advance));
        for [estimate, measured] in errors.iter().flatten() {
            assert!(agree(*estimate, *measured), "{name}: {errors:?}");
        }
        // Those of the smallest budget are large; the control: other frames' estimates fail.
        assert!(errors[0].iter().all(|[_, measured]| *measured > 5.0 * LEAST), "{name}: {errors:?}");
        let mut swapped = errors[0].iter().zip(&errors[2]);
        assert!(swapped.any(|([_, measured], [other, _])| !agree(*other, *measured)), "{name}: {errors:?}");
    }
}

/// A grating that moves across light of all kinds, over a glossy floor.
fn masks_and_profiles(context: &Context) {
    let build = |cutoff: Option<f32>| {
        let mut scene = Scene::default();
        let [open, closed] = [[200, 200, 200, 0], [200, 200, 200, 255]];
        scene.textures.push(Texture {
            name: "grating".into(),
            width: 2,
            height: 2,
            texels: vec![open, open, open, closed],
            color_space: ColorSpace::Linear,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Nearest,
        });
        let glossy = Material { roughness: 0.5, ..Material::diffuse("glossy", Vec3::splat(0.6)) };
        let glossy = scene.add_material(Material { specular: 1.0, ..glossy });
        room(&mut scene, Vec3::new(4.0, 3.0, 4.0), glossy, Some(3));
        lamp(&mut scene, 0.4, 6.0, Quat::IDENTITY, Vec3::new(-0.8, 2.8, 0.3));
        for (kind, eye, intensity) in [
            (PunctualKind::Directional, Vec3::new(0.6, 3.0, 0.4), 0.3),
            (PunctualKind::Spot { inner: 0.4, outer: 0.8 }, Vec3::new(0.9, 2.6, -0.6), 3.0),
        ] {
            let node = scene.add_node("light", Transform::looking_at(eye, Vec3::new(0.0, 0.5, 0.0)));
            let intensity = Vec3::splat(intensity);
            scene.lights.push(PunctualLight { name: String::new(), node, kind, intensity });
        }
        let grating = scene.add_material(Material {
            base_color_texture: Some(TextureRef::new(0)),
            alpha_cutoff: cutoff,
            double_sided: true,
            ..Material::diffuse("grating", Vec3::splat(0.5))
        });
        let mut mesh = Mesh::default();
        let corners = [[-0.6, -0.6], [-0.6, 0.6], [0.6, 0.6], [0.6, -0.6]].map(|[x, z]| Vec3::new(x, 0.0, z));
        mesh.add_polygon(&corners, grating);
        scene.add_object("grating", mesh, Transform::translation(Vec3::new(-0.6, 0.9, 0.0)));
        scene.objects.last_mut().expect("it was added").dynamic = true;
        camera(&mut scene, Vec3::new(1.8, 2.2, 1.8), Vec3::new(0.0, 0.2, 0.0), 1.0);
        scene
    };
    let advance = |scene: &mut Scene, step: u32| {
        let node = scene.objects.last().expect("the grating").node;
        let at = Vec3::new(-0.6 + 0.3 * step as f32, 0.9, 0.1);
        scene.set_transform(node, Transform::translation(at)).expect("a place");
    };
    let [masked, solid] = [Some(0.5), None].map(|cutoff| {
        Motion::new(context, build(cutoff), 24, Mode::Full, ShadowMap::Cube).errors(0, 5, advance)
    });
    for [estimate, measured] in masked.iter().chain(&solid) {
        assert!(*measured > LEAST && agree(*estimate, *measured), "{masked:?} {solid:?}");
    }
    // The control: with the mask closed the error is another one.
    assert!(masked.iter().zip(&solid).any(|(m, s)| !agree(s[0], m[1])), "{masked:?} {solid:?}");
}

/// There is an estimate as long as what the frame shows is there.
fn last_frame(context: &Context) {
    let mut scene = builtin::build("block", MovingObject::Torus).expect("a room");
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let mut renderer = context.renderer(RendererOptions { map_size: Some(32), ..Default::default() });
    let estimate = |renderer: &OneView| context.wait(renderer.stale_error()).expect("an estimate");
    assert_eq!(estimate(&renderer), None);
    renderer.open(&scene, &held(20)).expect("open");
    assert_eq!(estimate(&renderer), None);
    let few = MapUpdates { most: Some(0), ..MapUpdates::default() };
    let settings = RenderSettings { samples_per_axis: 2, updates: few, ..RenderSettings::default() };
    renderer.render(&view, SIZE, &settings).expect("render");
    assert_eq!(estimate(&renderer), Some(0.0));
    scene.set_time(0.8).expect("a moment");
    let changes = scene.take_changes();
    renderer.update(&scene, &changes).expect("update");
    assert_eq!(estimate(&renderer), None, "the frame shows what was there before");
    let picture = context.frame(&mut renderer, &view, SIZE, &settings);
    let first = estimate(&renderer);
    assert!(first.is_some_and(|error| error > LEAST), "{first:?}");
    // It leaves the picture as it is, and comes again.
    let again = context.wait(renderer.radiance()).expect("radiance");
    assert!(first == estimate(&renderer) && picture.pixels == again.pixels);
    renderer.draw_shadow_maps(&MapUpdates::default()).expect("maps");
    assert_eq!(estimate(&renderer), None);
    renderer.render(&view, SIZE, &settings).expect("render");
    assert_eq!(estimate(&renderer), Some(0.0));
}

/// Two objects that move and turn, of which no map is drawn again.
fn movers_in_stale_maps(context: &Context) {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("a room");
    let gray = scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
    let ring = shapes::torus(0.3, 0.12, 24, 12, gray);
    scene.add_object("ring", ring, Transform::translation(Vec3::new(-0.8, 1.3, 0.5)));
    scene.objects.last_mut().expect("it was added").dynamic = true;
    let node = scene.objects.last().expect("it was added").node;
    let view = View::new(&scene, &scene.cameras[0], SIZE[0] as f32 / SIZE[1] as f32);
    scene.take_changes();
    let options = RendererOptions { map_size: Some(128), ..Default::default() };
    let [mut few, mut all] = [context.renderer(options), context.renderer(options)];
    for renderer in [&mut few, &mut all] {
        renderer.open(&scene, &held(60)).expect("open");
        renderer.render(&view, SIZE, &RenderSettings::default()).expect("render");
    }
    scene.set_time(0.15).expect("a moment");
    let at = Transform::rigid(Quat::from_rotation_x(0.2), Vec3::new(-0.75, 1.27, 0.54));
    scene.set_transform(node, at).expect("a place");
    let changes = scene.take_changes();
    few.update(&scene, &changes).expect("update");
    all.update(&scene, &changes).expect("update");
    let truth = context.frame(&mut all, &view, SIZE, &RenderSettings::default());
    let geometry = all.illumination().expect("it is open").geometry();
    let (tracer, local) = (SceneTracer::new(&scene, geometry), view.relative_to(geometry.origin));
    let shows = |pixel: usize, object: usize| {
        let at = Vec2::new((pixel as u32 % SIZE[0]) as f32 + 0.5, (pixel as u32 / SIZE[0]) as f32 + 0.5);
        let (origin, direction) = local.pixel_ray(at, SIZE);
        let hit = tracer.closest_visible(origin, direction);
        hit.is_some_and(|hit| geometry.triangles[hit.triangle as usize].object as usize == object)
    };
    let updates = MapUpdates { most: Some(0), ..MapUpdates::default() };
    let movers: Vec<usize> =
        (0..scene.objects.len()).filter(|&object| scene.objects[object].dynamic).collect();
    assert_eq!(movers.len(), 2);
    // The control: multipass shading looks shadows up where things are now.
    let [then, now] = [Shading::Fused, Shading::Multipass { lights_per_pass: 20 }].map(|shading| {
        let settings = RenderSettings { shading, updates, ..RenderSettings::default() };
        let shown = context.frame(&mut few, &view, SIZE, &settings);
        movers
            .iter()
            .map(|&object| {
                let pixels: Vec<usize> = (0..shown.pixels.len()).filter(|&i| shows(i, object)).collect();
                assert!(pixels.len() > 80, "{} pixels", pixels.len());
                let part = |image: &Image| Image {
                    width: pixels.len() as u32,
                    height: 1,
                    pixels: pixels.iter().map(|&i| image.pixels[i]).collect(),
                };
                difference(&part(&shown), &part(&truth))
            })
            .collect::<Vec<f64>>()
    });
    for (then, now) in then.iter().zip(&now) {
        assert!(*now > 0.05 && then * 2.0 < *now, "{then} {now}");
    }
}
