//! The GPU's picture against the exact sum over the very same samples with traced visibility.

use crate::common::{Context, Stage, Test, camera, exact, lamp, room, sun};
use girandole::{RendererOptions, ShadowMap};
use girandole_core::brdf::Surface;
use girandole_core::glam::{Quat, Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSample, LightSet, LightSettings};
use girandole_core::math::{octahedral, warp};
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{
    ColorSpace, Filter, Material, Mesh, PunctualKind, PunctualLight, Scene, Texture, TextureRef, Transform,
    Wrap,
};
use girandole_core::trace::{Hit, SceneTracer};
use girandole_reference::metrics::{CompareOptions, Comparison, compare};

pub fn tests() -> Vec<Test> {
    vec![
        ("oracle_all_built_in_scenes", built_in),
        ("oracle_pair_by_pair", pair_by_pair),
        ("oracle_other_parameterisations", other_parameterisations),
        ("oracle_punctual_lights", punctual),
        ("suns_show_what_is_looked_up", sun_over_a_fence),
        ("oracle_textures_masks_and_gloss", materials),
        ("oracle_anti_aliasing", anti_aliasing),
    ]
}

const SIZE: [u32; 2] = [240, 180];

fn against(oracle: &Image, picture: &Image) -> Comparison {
    compare(oracle, picture, &CompareOptions { mask: None, keep_edges: true, trim: 0.001 })
        .expect("comparable")
}

/// Pixels that are less than half as bright as they should be.
fn too_dark(oracle: &Image, picture: &Image) -> usize {
    let sum = |v: &Vec3| v.element_sum();
    oracle.pixels.iter().zip(&picture.pixels).filter(|(o, p)| sum(p) < 0.5 * sum(o)).count()
}

/// Energy within 0.5 %, relMSE at most 1e-3, and no acne: at most 1e-4 of the pixels below half.
fn agrees(oracle: &Image, picture: &Image) -> bool {
    let c = against(oracle, picture);
    (c.energy_ratio - 1.0).abs() < 0.005
        && c.rel_mse < 1e-3
        && too_dark(oracle, picture) as f64 <= 1e-4 * oracle.pixels.len() as f64
}

fn built_in(context: &Context) {
    for name in builtin::EXPERIMENTS {
        let stage = Stage::builtin(name, 300);
        let view = stage.view(0, SIZE);
        let oracle = stage.oracle(&view, SIZE, 1);
        let picture = context.picture(&stage, RendererOptions::default(), &view, SIZE);
        assert!(
            agrees(&oracle, &picture),
            "{name}: {} dark, {:?}",
            too_dark(&oracle, &picture),
            against(&oracle, &picture)
        );
        // The control: the same lights a hand's breadth away do not agree.
        let mut moved = Stage::builtin(name, 300);
        let mut samples = moved.lights.samples().to_vec();
        for sample in &mut samples {
            sample.position += sample.normal * 0.1;
        }
        moved.lights = LightSet::from_samples(&moved.geometry, samples);
        assert!(
            !agrees(&oracle, &context.picture(&moved, RendererOptions::default(), &view, SIZE)),
            "{name}"
        );
    }
}

/// For each light by itself: where map and traced visibility differ, a traced shadow edge is within 1.5 texels, and
/// that is so for 2 % of the pairs at the most.
fn pair_by_pair(context: &Context) {
    let (size, map_size) = ([160, 120], 256);
    let stage = Stage::builtin("table", 300);
    let view = stage.view(0, size);
    let tracer = stage.tracer();
    let hits: Vec<Option<(Hit, Surface)>> = (0..size[0] * size[1])
        .map(|i| {
            let (origin, direction) = stage
                .local(&view)
                .pixel_ray(Vec2::new((i % size[0]) as f32, (i / size[0]) as f32) + 0.5, size);
            let hit = tracer.closest_visible(origin, direction)?;
            Some((
                hit,
                stage.geometry.surface(&stage.scene, hit.triangle, hit.barycentric, -direction.normalize()),
            ))
        })
        .collect();
    let mut renderer = context.renderer(RendererOptions { map_size: Some(map_size), ..Default::default() });
    let (mut pairs, mut differing, mut stray, mut control) = (0, 0, 0, 0);
    for light in stage.lights.samples().iter().step_by(11) {
        let bright = LightSample { intensity: Vec3::splat(1e3), ..*light };
        let single = LightSet::from_samples(&stage.geometry, vec![bright]);
        renderer.load(&stage.scene, &stage.geometry, &single).expect("load");
        let picture = context.frame(&mut renderer, &view, size, &exact());
        for (i, (pixel, hit)) in picture.pixels.iter().zip(&hits).enumerate() {
            let Some((hit, s)) = hit else { continue };
            let g = light.geometric_factor(s.position, s.geometric_normal, s.shading_normal, Clamp::Off);
            if s.albedo == Vec3::ZERO || g.is_none() || is_geometric_edge(&hits, i, size) {
                continue;
            }
            pairs += 1;
            let traced = girandole_reference::visible(&tracer, s, hit.triangle, light);
            if (pixel.max_element() > 0.0) == traced {
                control +=
                    usize::from(pairs % 97 == 0 && !near_shadow_edge(&tracer, hit, s, light, map_size));
                continue;
            }
            differing += 1;
            stray += usize::from(!near_shadow_edge(&tracer, hit, s, light, map_size));
        }
    }
    assert!(pairs > 50_000, "{pairs}");
    assert!(differing * 50 <= pairs, "{differing} of {pairs} pairs differ");
    assert_eq!(stray, 0, "of {differing} pairs that differ");
    // The control: most places are not near a shadow edge, so the search for one means something.
    assert!(control * 97 * 2 > pairs, "{control}");
}

/// Whether a neighbouring pixel shows another triangle: there the rasteriser and the ray may see different surfaces.
fn is_geometric_edge(hits: &[Option<(Hit, Surface)>], i: usize, size: [u32; 2]) -> bool {
    let (x, y, width) = (i % size[0] as usize, i / size[0] as usize, size[0] as usize);
    let id = |j: usize| hits[j].map(|(h, _)| h.triangle);
    (x > 0 && id(i - 1) != id(i))
        || (x + 1 < width && id(i + 1) != id(i))
        || (y > 0 && id(i - width) != id(i))
        || (y + 1 < size[1] as usize && id(i + width) != id(i))
}

/// Whether traced visibility changes within 1.5 texels, on the plane of the receiver.
fn near_shadow_edge(
    tracer: &SceneTracer,
    hit: &Hit,
    s: &Surface,
    light: &LightSample,
    map_size: u32,
) -> bool {
    let (x, y) = warp::frame(light.normal);
    let d = s.position - light.position;
    let uv = octahedral::encode(Vec3::new(d.dot(x), d.dot(y), d.dot(light.normal)));
    let here = girandole_reference::visible(tracer, s, hit.triangle, light);
    (0..96).any(|k| {
        let (angle, radius) =
            ((k % 16) as f32 * std::f32::consts::TAU / 16.0, (k / 16 + 1) as f32 / 6.0 * 1.5);
        let q = uv + Vec2::from_angle(angle) * radius / map_size as f32;
        let q = octahedral::decode(q.clamp(Vec2::ZERO, Vec2::ONE));
        let direction = x * q.x + y * q.y + light.normal * q.z;
        let t = s.geometric_normal.dot(d) / s.geometric_normal.dot(direction);
        // The receiver's plane is not seen at all there: its horizon is an edge.
        let there = Surface { position: light.position + direction * t, ..*s };
        t <= 0.0
            || !t.is_finite()
            || girandole_reference::visible(tracer, &there, hit.triangle, light) != here
    })
}

fn other_parameterisations(context: &Context) {
    let stage = Stage::builtin("pillars", 60);
    let view = stage.view(0, SIZE);
    let oracle = stage.oracle(&view, SIZE, 1);
    let error = |shadow_map, pcf| {
        let options = RendererOptions { shadow_map, pcf, ..Default::default() };
        against(&oracle, &context.picture(&stage, options, &view, SIZE))
    };
    let cube = error(ShadowMap::Cube, 0);
    assert!((cube.energy_ratio - 1.0).abs() < 0.005 && cube.rel_mse < 2e-3, "{cube:?}");
    let filtered = error(ShadowMap::Octahedral, 2);
    assert!((filtered.energy_ratio - 1.0).abs() < 0.005 && filtered.rel_mse < 2e-3, "{filtered:?}");
    // The parabolic map bends long edges: it is expected to be worse, and to be a picture all the same.
    let parabolic = error(ShadowMap::Parabolic, 0);
    assert!(parabolic.rel_mse > cube.rel_mse && parabolic.rel_mse < 0.5, "{parabolic:?}");
}

/// A room with a box in it, and a camera.
fn boxed_room(material: Material) -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.7)));
    let prop = scene.add_material(material);
    room(&mut scene, Vec3::new(4.0, 3.0, 4.0), white, None);
    let mut mesh = Mesh::default();
    mesh.add_box(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.0, 0.5), prop);
    scene.add_object("box", mesh, Transform::rigid(Quat::from_rotation_y(0.5), Vec3::new(0.3, 0.0, -0.4)));
    camera(&mut scene, Vec3::new(-1.6, 1.9, 1.7), Vec3::new(0.3, 0.6, -0.4), 1.0);
    scene
}

fn punctual(context: &Context) {
    let mut scene = boxed_room(Material::default());
    for (kind, eye, target) in [
        (PunctualKind::Point, Vec3::new(1.2, 2.2, 1.0), Vec3::ZERO),
        (PunctualKind::Spot { inner: 0.2, outer: 0.6 }, Vec3::new(-1.0, 2.6, 1.0), Vec3::new(0.2, 0.3, -0.3)),
    ] {
        let node = scene.add_node("light", Transform::looking_at(eye, target));
        scene.lights.push(PunctualLight {
            name: String::new(),
            node,
            kind,
            intensity: Vec3::new(6.0, 5.0, 4.0),
        });
    }
    let settings = LightSettings { count: 60, ..Default::default() };
    let inside = Stage::new(scene, &settings);
    let view = inside.view(0, SIZE);
    let oracle = inside.oracle(&view, SIZE, 1);
    let picture = context.picture(&inside, RendererOptions::default(), &view, SIZE);
    assert!(agrees(&oracle, &picture), "{:?}", against(&oracle, &picture));

    // Sunshine, through a room whose ceiling is missing.
    let mut open = Scene::default();
    let white = open.add_material(Material::diffuse("white", Vec3::splat(0.7)));
    room(&mut open, Vec3::new(4.0, 3.0, 4.0), white, Some(3));
    let mut mesh = Mesh::default();
    mesh.add_box(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.0, 0.5), white);
    open.add_object("box", mesh, Transform::rigid(Quat::from_rotation_y(0.5), Vec3::new(0.3, 0.0, -0.4)));
    camera(&mut open, Vec3::new(-1.6, 1.9, 1.7), Vec3::new(0.3, 0.6, -0.4), 1.0);
    sun(&mut open, Vec3::new(1.0, 3.0, 0.7));
    let open = Stage::new(open, &settings);
    let oracle = open.oracle(&view, SIZE, 1);
    let picture = context.picture(&open, RendererOptions::default(), &view, SIZE);
    let c = against(&oracle, &picture);
    // One light with hard edges: they count fully.
    assert!((c.energy_ratio - 1.0).abs() < 0.005 && c.rel_mse < 4e-3, "{c:?}");
    // The control: the inside's picture is not the outside's.
    assert!(!agrees(&inside.oracle(&view, SIZE, 1), &picture));
}

/// Shadows of pickets 2 cm wide, in a scene of 80 m: the sun's map shows the part of it that is in view.
fn sun_over_a_fence(context: &Context) {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.7)));
    let mut mesh = Mesh::default();
    let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z) * 30.0;
    mesh.add_polygon(&[corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)], white);
    for i in 0..30 {
        let low = Vec3::new(-0.6 + 0.04 * i as f32, 0.0, -0.01);
        mesh.add_box(low, low + Vec3::new(0.02, 0.5, 0.02), white);
    }
    scene.add_object("fence", mesh, Transform::IDENTITY);
    camera(&mut scene, Vec3::new(0.2, 0.9, 1.3), Vec3::new(0.0, 0.1, 0.3), 0.8);
    camera(&mut scene, Vec3::new(-20.0, 2.0, 20.0), Vec3::new(0.0, 0.1, 0.3), 0.8);
    sun(&mut scene, Vec3::new(0.3, 1.0, -0.8));
    let stage = Stage::new(scene, &LightSettings { count: 1, bounces: 0, ..Default::default() });
    let [near, far] = [0, 1].map(|i| stage.view(i, SIZE));
    let oracle = stage.oracle(&near, SIZE, 1);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let picture = context.frame(&mut renderer, &near, SIZE, &exact());
    let c = against(&oracle, &picture);
    assert!((c.energy_ratio - 1.0).abs() < 0.005 && c.flip < 0.02, "{c:?}");
    // Whatever was in view before, with room for two maps and for one; a camera that rests draws none.
    for (memory_mib, again) in [(RendererOptions::default().memory_mib, 0), (12, 1)] {
        let mut renderer = context.loaded(&stage, RendererOptions { memory_mib, ..Default::default() });
        let mut drawn = |view| {
            let picture = context.frame(&mut renderer, view, SIZE, &exact());
            (context.wait(renderer.stats()).expect("stats").maps_drawn, picture.pixels)
        };
        let (first, picture) = drawn(&near);
        assert_eq!((first, drawn(&far).0), (1, 1), "{memory_mib} MiB");
        assert!(drawn(&near) == (again, picture.clone()) && drawn(&near) == (0, picture), "{memory_mib} MiB");
    }
    // The control: a map of all of the scene.
    let whole = against(&oracle, &context.picture(&stage, RendererOptions::default(), &near, SIZE));
    assert!(whole.flip > 5.0 * c.flip, "{whole:?} {c:?}");
}

fn materials(context: &Context) {
    let mut scene = boxed_room(Material {
        base_color_texture: Some(TextureRef::new(0)),
        specular: 1.0,
        roughness: 0.4,
        ..Material::default()
    });
    let texels =
        (0..64).map(|i| if (i % 8 + i / 8) % 2 == 0 { [255, 255, 255, 255] } else { [200, 90, 40, 0] });
    scene.textures.push(Texture {
        name: "checker".into(),
        width: 8,
        height: 8,
        texels: texels.collect(),
        color_space: ColorSpace::Srgb,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
    });
    let leaf = scene.add_material(Material {
        base_color_texture: Some(TextureRef::new(0)),
        alpha_cutoff: Some(0.5),
        double_sided: true,
        ..Material::default()
    });
    let mut mesh = Mesh::default();
    let corners = [(-0.6, -0.6), (0.6, -0.6), (0.6, 0.6), (-0.6, 0.6)].map(|(x, z)| Vec3::new(x, 0.0, z));
    mesh.add_polygon(&corners, leaf);
    scene.add_object("sieve", mesh, Transform::rigid(Quat::from_rotation_x(0.2), Vec3::new(0.4, 1.9, 0.2)));
    lamp(&mut scene, 0.6, 12.0, Quat::IDENTITY, Vec3::new(0.5, 2.95, 0.3));
    let stage = Stage::new(scene, &LightSettings { count: 120, ..Default::default() });
    let view = stage.view(0, SIZE);
    let oracle = stage.oracle(&view, SIZE, 1);
    let picture = context.picture(&stage, RendererOptions::default(), &view, SIZE);
    let c = against(&oracle, &picture);
    assert!((c.energy_ratio - 1.0).abs() < 0.005 && c.rel_mse < 2e-3, "{c:?}");
    // The control: without its mask the sieve throws another shadow.
    let mut solid = stage;
    if let Some(material) = solid.scene.materials.iter_mut().find(|m| m.alpha_cutoff.is_some()) {
        material.alpha_cutoff = None;
    }
    let c = against(&oracle, &context.picture(&solid, RendererOptions::default(), &view, SIZE));
    assert!(c.rel_mse > 4e-3, "{c:?}");
}

fn anti_aliasing(context: &Context) {
    let size = [120, 90];
    let stage = Stage::new(
        builtin::build("area-lights", MovingObject::None).expect("area-lights"),
        &LightSettings { count: 40, ..Default::default() },
    );
    let view = stage.view(0, size);
    let mut renderer = context.renderer(RendererOptions::default());
    renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
    let settings = |n| girandole::RenderSettings { samples_per_axis: n, ..exact() };
    let smooth = context.frame(&mut renderer, &view, size, &settings(4));
    let oracle = stage.oracle(&view, size, 4);
    assert!(agrees(&oracle, &smooth), "{:?}", against(&oracle, &smooth));
    // The control: one sample a pixel is not the same picture.
    let rough = context.frame(&mut renderer, &view, size, &settings(1));
    assert!(against(&oracle, &rough).rel_mse > 3.0 * against(&oracle, &smooth).rel_mse);
}
