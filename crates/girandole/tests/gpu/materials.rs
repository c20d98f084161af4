//! Full frames of surfaces that vary: with normal maps, with textures, with reflections.

use crate::common::{Context, Stage, Test, beyond_storage, camera, exact, mean, room};
use crate::selected::{bounded, flip, glossy};
use girandole::{Mode, RenderSettings, RendererOptions};
use girandole_core::glam::{Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::builtin::{self, MovingObject, shapes};
use girandole_core::scene::{
    ColorSpace, Filter, Geometry, Material, NormalTexture, Scene, Texture, TextureRef, Transform, Wrap,
};
use girandole_reference::metrics::{CompareOptions, compare};
use girandole_reference::{PathSettings, path_trace};

pub fn tests() -> Vec<Test> {
    vec![
        ("planes_with_tilted_normals_are_filled", tilted_normals),
        ("normal_mapped_surfaces_are_close_to_naive", normal_maps),
        ("colours_of_vertices_and_unlit_surfaces", vertex_colors),
        ("matte_walls_about_something_glossy", matte_walls),
    ]
}

pub fn with_timestamps() -> (wgpu::Features, Test) {
    (wgpu::Features::TIMESTAMP_QUERY, ("the_last_grid_stores_what_resolving_would", last_grid))
}

fn square(side: u32, texels: Vec<[u8; 4]>) -> Texture {
    Texture {
        name: String::new(),
        width: side,
        height: side,
        texels,
        color_space: ColorSpace::Linear,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Linear,
    }
}

/// A room whose surfaces all have ripples as normal maps, a few to the metre.
fn rippled(name: &str, count: u32, ripples: f32, scale: f32) -> Stage {
    let mut scene = builtin::build(name, MovingObject::Torus).expect("a room");
    let texture = scene.textures.len() as u32;
    let texels = (0..64 * 64).map(|i| {
        let slope = |x: i32| 0.5 * (x as f32 * std::f32::consts::TAU / 64.0).sin();
        let normal = Vec3::new(slope(i % 64), slope(i / 64), 1.0).normalize();
        let byte = |x: f32| ((x * 0.5 + 0.5) * 255.0).round() as u8;
        [byte(normal.x), byte(normal.y), byte(normal.z), 255]
    });
    scene.textures.push(square(64, texels.collect()));
    for material in &mut scene.materials {
        material.normal_texture = Some(NormalTexture { texture: TextureRef::new(texture), scale });
    }
    for mesh in &mut scene.meshes {
        let frames = mesh.normals.iter().map(|n| (n.any_orthonormal_vector(), *n));
        mesh.tangents = frames.clone().map(|(t, _)| t.extend(1.0)).collect();
        let uvs = frames
            .zip(&mesh.positions)
            .map(|((t, n), p)| [Vec2::new(p.dot(t), p.dot(n.cross(t))) * ripples; 2]);
        mesh.uvs = uvs.collect();
    }
    Stage::new(scene, &LightSettings { count, ..Default::default() })
}

fn normal_maps(context: &Context) {
    let size = [400, 300];
    for (name, ripples) in [("table", 0.5), ("table", 3.0), ("pillars", 1.0)] {
        let stage = rippled(name, 200, ripples, 1.0);
        let view = stage.view(0, size);
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let naive = context.frame(&mut renderer, &view, size, &bounded(Mode::Naive));
        let vd = context.frame(&mut renderer, &view, size, &bounded(Mode::Visibility));
        let full = context.frame(&mut renderer, &view, size, &bounded(Mode::Full));
        let points: u64 = context.wait(renderer.stats()).expect("stats").points.iter().sum();
        let share = points as f64 / (f64::from(size[0]) * f64::from(size[1]));
        let energy = f64::from(mean(&full) / mean(&naive));
        let error = flip(&naive, &full);
        eprintln!("{name}, {ripples}/m: FLIP {error:.4}, energy {energy:.4}, {:.1} % shaded", share * 100.0);
        assert!(flip(&naive, &vd) <= 0.005, "{name}: FLIP {}", flip(&naive, &vd));
        assert!(error <= 0.02, "{name}: FLIP {error}");
        assert!((energy - 1.0).abs() < 0.005, "{name}: energy {energy}");
        // They are served from coarse points too.
        assert!(share < 0.3, "{name}: {share} of the pixels shaded");
        // The control: ripples are seen.
        let flat = rippled(name, 200, ripples, 0.0);
        let mut renderer = context.loaded(&flat, RendererOptions::default());
        let flat = context.frame(&mut renderer, &view, size, &bounded(Mode::Naive));
        assert!(flip(&naive, &flat) > 2.0 * error, "{name}: {}", flip(&naive, &flat));
    }
}

/// Without textures the last grid stores radiance; a scene with one, though nothing shows it, is resolved afterwards.
fn last_grid(context: &Context) {
    let size = [161, 119];
    let stage = glossy(60);
    let view = stage.view(0, size);
    let mut textured = stage.scene.clone();
    textured.textures.push(square(1, vec![[255; 4]]));
    let base_color_texture = Some(TextureRef::new(textured.textures.len() as u32 - 1));
    textured.materials.push(Material { base_color_texture, ..Material::default() });
    let textured = Stage { scene: textured, geometry: stage.geometry.clone(), lights: stage.lights.clone() };
    for samples_per_axis in [1, 2] {
        let pictures = [&stage, &textured].map(|stage| {
            let mut renderer = context.loaded(stage, RendererOptions::default());
            renderer.time_passes(true);
            let settings = RenderSettings { samples_per_axis, ..bounded(Mode::Full) };
            let picture = context.frame(&mut renderer, &view, size, &settings);
            // Further samples interpolate between the first ones, which are resolved.
            let passes = context.wait(renderer.stats()).expect("stats").gpu_ms;
            let resolved = passes.iter().any(|(pass, _)| *pass == "resolve_gpu_ms");
            assert!(!passes.is_empty(), "nothing is timed");
            (picture, resolved)
        });
        let [(once, resolved), (after, resolved_after)] = &pictures;
        assert!(beyond_storage(once, after) < 1e-5, "{}", beyond_storage(once, after));
        // The control: two ways were compared.
        assert!(*resolved_after && *resolved == (samples_per_axis > 1));
    }
}

/// Planes whose normals are the same everywhere, but not those of the plane, in scenes without anything curved.
fn tilted_normals(context: &Context) {
    let size = [200, 150];
    for name in ["pillars", "block"] {
        let mut scene = builtin::build(name, MovingObject::None).expect("a room");
        for normal in scene.meshes.iter_mut().flat_map(|m| &mut m.normals) {
            *normal = (*normal + Vec3::new(0.1, 0.05, 0.08)).normalize();
        }
        let stage = Stage::new(scene, &LightSettings { count: 100, ..Default::default() });
        let view = stage.view(0, size);
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let mut picture = |mode| context.frame(&mut renderer, &view, size, &bounded(mode));
        let naive = picture(Mode::Naive);
        let found = flip(&naive, &picture(Mode::Full));
        assert!(found < 0.03, "{name}: FLIP {found}");
        // The control: the normals count.
        let straight = Stage::new(
            builtin::build(name, MovingObject::None).expect("a room"),
            &LightSettings { count: 100, ..Default::default() },
        );
        let mut renderer = context.loaded(&straight, RendererOptions::default());
        let straight = context.frame(&mut renderer, &view, size, &bounded(Mode::Full));
        assert!(flip(&naive, &straight) > 0.03, "{name}: {}", flip(&naive, &straight));
    }
}

/// A block on a table whose walls, floor and block have colours by where they are; one object is unlit.
fn colored(is_colored: bool) -> Stage {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("a room");
    let unlit = scene.add_material(Material {
        unlit: true,
        vertex_colors: is_colored,
        ..Material::diffuse("unlit", Vec3::new(0.9, 0.5, 0.2))
    });
    for material in &mut scene.materials[..unlit.index()] {
        material.vertex_colors = is_colored && !material.emits();
    }
    if is_colored {
        for mesh in &mut scene.meshes {
            let color = |p: &Vec3| (*p * 1.7).map(|x| 0.5 + 0.5 * x.sin());
            mesh.colors = mesh.positions.iter().map(color).collect();
        }
    }
    let last = scene.objects.len() - 1;
    let mesh = scene.objects[last].mesh;
    for triangle in &mut scene.meshes[mesh].triangles {
        triangle.material = unlit;
    }
    Stage::new(scene, &LightSettings { count: 100, ..Default::default() })
}

fn vertex_colors(context: &Context) {
    let size = [240, 180];
    let stage = colored(true);
    let view = stage.view(0, size);
    let oracle = stage.oracle(&view, size, 1);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let naive = context.frame(&mut renderer, &view, size, &exact());
    let options = CompareOptions { keep_edges: true, trim: 0.001, ..CompareOptions::default() };
    let found = compare(&oracle, &naive, &options).expect("comparable");
    assert!((found.energy_ratio - 1.0).abs() < 0.005 && found.rel_mse < 1e-3, "{found:?}");
    // Selected points are as good as without colours.
    let plain = colored(false);
    let [difference, usual] = [&stage, &plain].map(|stage| {
        context.load(&mut renderer, stage);
        let [full, naive] =
            [Mode::Full, Mode::Naive].map(|mode| context.frame(&mut renderer, &view, size, &bounded(mode)));
        flip(&naive, &full)
    });
    assert!(difference < 1.2 * usual, "{difference} for {usual}");
    // The control: without colours it is another picture.
    let without = context.picture(&plain, RendererOptions::default(), &view, size);
    assert!(compare(&oracle, &without, &options).expect("comparable").rel_mse > 0.05);
    // What is unlit is as bright as its colour where no light falls.
    let mut scene = Scene::default();
    let unlit = Material { unlit: true, ..Material::diffuse("", Vec3::new(0.3, 0.6, 0.9)) };
    let unlit = scene.add_material(unlit);
    let white = scene.add_material(Material::diffuse("", Vec3::ONE));
    room(&mut scene, Vec3::splat(3.0), white, None);
    let ball = shapes::sphere(0.5, 32, 16, unlit);
    scene.add_object("ball", ball, Transform::translation(Vec3::Y));
    camera(&mut scene, Vec3::new(0.0, 1.0, 1.4), Vec3::Y, 1.2);
    let geometry = Geometry::new(&scene);
    let dark = Stage { lights: LightSet::from_samples(&geometry, Vec::new()), scene, geometry };
    let view = dark.view(0, size);
    let picture = context.picture(&dark, RendererOptions::default(), &view, size);
    let truth =
        path_trace(&dark.tracer(), &view, size, &PathSettings { paths: 4, ..Default::default() }, &|_| {});
    let at = |image: &Image, x: u32, y: u32| image.pixels[(y * size[0] + x) as usize];
    for image in [&picture, &truth.mean] {
        assert!(at(image, 120, 90).abs_diff_eq(Vec3::new(0.3, 0.6, 0.9), 1e-3), "{}", at(image, 120, 90));
        assert_eq!(at(image, 3, 3), Vec3::ZERO, "it lights nothing");
    }
}

/// Of a room without reflections, one curved object has some: what walls hold besides irradiance is not seen.
fn matte_walls(context: &Context) {
    let size = [240, 180];
    let mut renderer = context.renderer(RendererOptions::default());
    let [usual, glossy] = [false, true].map(|is_glossy| {
        let mut scene = builtin::build("table", MovingObject::Torus).expect("a room");
        let last = scene.objects.len() - 1;
        let material = scene.meshes[scene.objects[last].mesh].triangles[0].material;
        let glossy = scene.add_material(Material {
            specular: if is_glossy { 1.0 } else { 0.0 },
            roughness: 0.6,
            ..scene.materials[material].clone()
        });
        let mesh = scene.objects[last].mesh;
        for triangle in &mut scene.meshes[mesh].triangles {
            triangle.material = glossy;
        }
        let stage = Stage::new(scene, &LightSettings { count: 100, ..Default::default() });
        context.load(&mut renderer, &stage);
        let view = stage.view(0, size);
        let [full, naive] =
            [Mode::Full, Mode::Naive].map(|mode| context.frame(&mut renderer, &view, size, &bounded(mode)));
        flip(&naive, &full)
    });
    assert!(glossy < 1.2 * usual, "{glossy} for {usual}");
}
