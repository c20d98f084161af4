//! Surfaces that let light through.

use crate::common::{Context, Stage, Test, camera, exact, mean};
use crate::motion::{held, updated};
use crate::selected::{bounded, flip};
use girandole::{Mode, RenderSettings, RendererOptions, Shading};
use girandole_core::glam::{Quat, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSettings};
use girandole_core::scene::builtin::{self, MovingObject, shapes};
use girandole_core::scene::{
    ColorSpace, Environment, Filter, Material, Mesh, ObjectId, Scene, Texture, TextureRef, Transform, View,
    Wrap,
};
use girandole_reference::OracleSettings;
use girandole_reference::metrics::{CompareOptions, compare};

pub fn tests() -> Vec<Test> {
    vec![
        ("what_is_seen_through_is_the_oracles", oracle),
        ("seen_through_selected_points", selected),
        ("panes_that_move", moving),
        ("panes_mirror_what_the_oracle_mirrors", mirroring),
        ("panes_mirror_in_all_modes", mirroring_in_all_modes),
        ("what_few_samples_leave_to_rays_is_not_lost_behind_panes", behind_panes),
    ]
}

fn pane(scene: &mut Scene, material: Material, turn: f32, at: Vec3) -> ObjectId {
    let material = scene.add_material(material);
    let mut mesh = Mesh::default();
    let half = Vec3::new(0.6, 0.5, 0.0);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    mesh.add_polygon(&corners.map(|[x, y]| Vec3::new(x, y, 0.0) * half), material);
    mesh.uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(|uv| [uv.into(); 2]).to_vec();
    scene.add_object("pane", mesh, Transform::rigid(Quat::from_rotation_y(turn), at))
}

/// The room `table`, or a floor under a sky, with panes of all kinds before the camera.
fn scene(is_room: bool, textured: bool) -> Scene {
    let mut scene = if is_room {
        builtin::build("table", MovingObject::Torus).expect("a room")
    } else {
        let mut scene = Scene::default();
        let gray = scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
        let mut floor = Mesh::default();
        floor.add_box(Vec3::new(-3.0, -0.1, -3.0), Vec3::new(3.0, 0.0, 3.0), gray);
        scene.add_object("floor", floor, Transform::IDENTITY);
        scene.environment = Some(Environment::constant(Vec3::new(0.2, 0.4, 0.8)).expect("a sky"));
        camera(&mut scene, Vec3::new(0.0, 1.2, 2.5), Vec3::Y * 0.9, 1.0);
        scene
    };
    let texture = textured.then(|| {
        scene.textures.push(Texture {
            name: String::new(),
            width: 8,
            height: 8,
            texels: (0..64).map(|i| [255, 255, 255, 4 * i]).collect(),
            color_space: ColorSpace::Srgb,
            wrap: [Wrap::Clamp; 2],
            filter: Filter::Linear,
        });
        TextureRef::new(scene.textures.len() as u32 - 1)
    });
    let blended = Material {
        blended: true,
        alpha: 0.6,
        double_sided: true,
        base_color_texture: texture,
        ..Material::diffuse("", Vec3::new(0.9, 0.4, 0.2))
    };
    let glass = Material {
        transmission: 0.8,
        specular: 1.0,
        roughness: 0.4,
        ..Material::diffuse("", Vec3::new(0.5, 0.8, 0.9))
    };
    let glow = Material { unlit: true, ..blended.clone() };
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let turn = f32::atan2(-view.forward.x, -view.forward.z);
    let at = |away: f32, aside: f32| view.eye.as_vec3() + view.forward * away + view.right * aside;
    let ball = scene.add_material(blended.clone());
    scene.add_object("ball", shapes::sphere(0.3, 16, 8, ball), Transform::translation(at(2.4, -0.2)));
    pane(&mut scene, glow, turn, at(2.0, 0.6));
    pane(&mut scene, blended, turn + 0.3, at(1.0, 0.3));
    pane(&mut scene, glass.clone(), turn, at(1.6, 0.1));
    pane(&mut scene, glass, turn + 0.5, at(1.3, -0.3));
    scene
}

fn stage(is_room: bool, textured: bool) -> Stage {
    let settings = LightSettings { count: 150, ..LightSettings::default() };
    Stage::new(scene(is_room, textured), &settings)
}

/// Every light at every pixel, with textures, with samples between pixels, before an environment.
fn oracle(context: &Context) {
    let size = [200, 150];
    for (is_room, textured, samples_per_axis) in [(true, false, 1), (true, true, 2), (false, false, 1)] {
        let mut stage = stage(is_room, textured);
        let view = stage.view(0, size);
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let settings = RenderSettings { samples_per_axis, ..exact() };
        let naive = context.frame(&mut renderer, &view, size, &settings);
        let truth = stage.oracle(&view, size, samples_per_axis);
        let options = CompareOptions { keep_edges: true, trim: 0.001, ..CompareOptions::default() };
        let found = compare(&truth, &naive, &options).expect("comparable");
        eprintln!("{is_room} {textured}: {found:?}");
        assert!((found.energy_ratio - 1.0).abs() < 0.003 && found.rel_mse < 5e-4, "{textured}: {found:?}");
        // The control: all is opaque.
        stage.scene.materials.iter_mut().for_each(|m| (m.blended, m.transmission) = (false, 0.0));
        let other = compare(&stage.oracle(&view, size, 1), &naive, &options).expect("comparable");
        assert!(other.rel_mse > 0.02, "{other:?}");
    }
}

/// Each mode and shading as well as where nothing is seen through.
fn selected(context: &Context) {
    let size = [320, 240];
    let stage = stage(true, true);
    let view = stage.view(0, size);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let naive = context.frame(&mut renderer, &view, size, &bounded(Mode::Naive));
    let vd = context.frame(&mut renderer, &view, size, &bounded(Mode::Visibility));
    let full = context.frame(&mut renderer, &view, size, &bounded(Mode::Full));
    let energy = mean(&full) / mean(&naive);
    eprintln!("FLIP {:.4} and {:.4}, energy {energy:.4}", flip(&naive, &vd), flip(&naive, &full));
    assert!(flip(&naive, &vd) <= 0.005 && flip(&naive, &full) <= 0.02 && (energy - 1.0).abs() < 0.005);
    let multipass =
        RenderSettings { shading: Shading::Multipass { lights_per_pass: 7 }, ..bounded(Mode::Visibility) };
    let multipass = context.frame(&mut renderer, &view, size, &multipass);
    assert!(flip(&vd, &multipass) < 2e-3, "{}", flip(&vd, &multipass));
    let again = context.frame(&mut renderer, &view, size, &bounded(Mode::Full));
    assert_eq!(again.pixels, full.pixels);
}

/// What is known of panes follows them.
fn moving(context: &Context) {
    let mut scene = scene(true, false);
    let pane = scene.objects.len() - 2;
    scene.objects[pane].dynamic = true;
    let (node, view) = (scene.objects[pane].node, View::new(&scene, &scene.cameras[0], 4.0 / 3.0));
    let place = scene.world_from_node(node).translation.as_vec3();
    let options = || RendererOptions { map_size: Some(64), ..Default::default() };
    let [mut renderer, mut other] = [(); 2].map(|()| context.renderer(options()));
    scene.take_changes();
    renderer.open(&scene, &held(60, false)).expect("open");
    let mut pictures: Vec<Vec<Vec3>> = Vec::new();
    for shift in [0.0, 0.25, -0.5] {
        let moved = Transform::translation(place + Vec3::new(shift, 0.4 * shift, 0.0));
        scene.set_transform(node, moved).expect("a place");
        let renderers = [&mut renderer, &mut other];
        let ([after, anew], stats) = updated(context, renderers, (&mut scene, &view), &bounded(Mode::Full));
        assert!(after == anew, "{shift}");
        // It casts no shadows.
        assert_eq!(stats.maps_drawn, if pictures.is_empty() { stats.lights } else { 0 }, "{shift}");
        assert!(pictures.last().is_none_or(|last| *last != after), "it does not move");
        pictures.push(after);
    }
}

/// A built-in room with a dark picture under glass, a pane aside before it, and one of frosted glass.
pub fn glazed(name: &str) -> Scene {
    let mut scene = builtin::build(name, MovingObject::None).expect("a room");
    let dark = Material { double_sided: true, ..Material::diffuse("", Vec3::splat(0.02)) };
    let glass = Material {
        transmission: 0.9,
        specular: 1.0,
        roughness: 0.0,
        double_sided: true,
        ..Material::diffuse("", Vec3::splat(0.9))
    };
    let frosted = Material { roughness: 0.2, ..glass.clone() };
    let view = View::new(&scene, &scene.cameras[0], 4.0 / 3.0);
    let turn = f32::atan2(-view.forward.x, -view.forward.z);
    let at = |away: f32, aside: f32| view.eye.as_vec3() + view.forward * away + view.right * aside;
    pane(&mut scene, dark, turn + 0.4, at(1.7, -0.2));
    pane(&mut scene, glass.clone(), turn + 0.4, at(1.6, -0.2));
    pane(&mut scene, glass, turn - 0.6, at(1.3, 0.2));
    pane(&mut scene, frosted, turn + 0.1, at(1.5, 0.8));
    scene
}

/// What smooth panes mirror, alone and beside other mirrors, with samples between pixels.
fn mirroring(context: &Context) {
    let size = [160, 120];
    let lights = LightSettings { count: 150, bounces: 2, ..LightSettings::default() };
    for (name, samples_per_axis) in [("table", 1), ("table", 2), ("mirrors", 1)] {
        let stage = Stage::new(glazed(name), &lights);
        let view = stage.view(0, size);
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let mut picture = |mirrors| {
            let settings = RenderSettings { samples_per_axis, mirrors, ..bounded(Mode::Naive) };
            context.frame(&mut renderer, &view, size, &settings)
        };
        let settings = OracleSettings { samples_per_axis, clamp: Clamp::Own, ..OracleSettings::default() };
        let sum =
            girandole_reference::oracle(&stage.tracer(), &stage.lights, &view, size, &settings, &|_| {});
        let compared = |picture: &Image| {
            compare(&sum, picture, &CompareOptions { trim: 0.002, ..CompareOptions::default() })
                .expect("comparable")
        };
        let found = compared(&picture(2));
        assert!((found.energy_ratio - 1.0).abs() < 0.01 && found.flip < 0.03, "{name}: {found:?}");
        // The control: blurs of light samples in their place.
        let none = compared(&picture(0));
        assert!(none.flip > 2.0 * found.flip, "{name}: {none:?}");
    }
}

fn mirroring_in_all_modes(context: &Context) {
    let size = [160, 120];
    let lights = LightSettings { count: 150, bounces: 2, ..LightSettings::default() };
    let stage = Stage::new(glazed("table"), &lights);
    let view = stage.view(0, size);
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let mut picture = |settings| context.frame(&mut renderer, &view, size, &settings);
    let naive = picture(bounded(Mode::Naive));
    let passes = Shading::Multipass { lights_per_pass: 7 };
    for (settings, most) in [
        (bounded(Mode::Visibility), 0.003),
        (RenderSettings { shading: passes, ..bounded(Mode::Visibility) }, 0.003),
        (bounded(Mode::Full), 0.02),
    ] {
        let found = picture(settings);
        assert!(flip(&naive, &found) < most, "{settings:?}: {}", flip(&naive, &found));
        // The same bits once more.
        assert_eq!(picture(settings), found, "{settings:?}");
    }
    // The control: without rays.
    let blurred = picture(RenderSettings { mirrors: 0, ..bounded(Mode::Full) });
    assert!(flip(&naive, &blurred) > 0.04, "{}", flip(&naive, &blurred));
}

/// Where lights are few, rays show a part of what rough metals reflect, too: as in a scene that has something smooth beside its panes.
fn behind_panes(context: &Context) {
    let size = [160, 120];
    let pictures = [false, true].map(|has_chrome| {
        let mut scene = glazed("table");
        for material in scene.materials.iter_mut().filter(|m| !m.is_transparent()) {
            (material.specular, material.metallic, material.roughness) = (1.0, 1.0, 0.85);
        }
        if has_chrome {
            scene.add_material(Material { metallic: 1.0, roughness: 0.1, ..Material::default() });
        }
        let stage = Stage::new(scene, &LightSettings { count: 40, bounces: 2, ..LightSettings::default() });
        let view = stage.view(0, size);
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        context.frame(&mut renderer, &view, size, &bounded(Mode::Naive)).pixels
    });
    assert!(pictures[0] == pictures[1]);
}
