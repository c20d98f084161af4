//! No light through walls, however thin and however they stand.

use crate::common::{Context, Stage, Test, camera, lamp, mean, room, sun};
use girandole::{Mode, RenderSettings, RendererOptions, ShadowMap};
use girandole_core::glam::{Quat, UVec2, Vec3};
use girandole_core::lights::LightSettings;
use girandole_core::scene::{Material, MaterialId, Mesh, Scene, Transform};

pub fn tests() -> Vec<Test> {
    vec![
        ("closed_rooms_stay_dark", closed_rooms),
        ("joints_of_walls_stay_dark", joints),
        ("the_sun_enters_no_joint_of_walls", room_in_the_sun),
        ("the_sun_shines_through_no_roof_into_joints_of_tiles", tiles_under_a_roof),
    ]
}

const ROOM: Vec3 = Vec3::new(6.0, 3.0, 5.0);

/// A closed room, halved at x = 0 by a wall so thick, if any; the lamp hangs on the side of +x. The whole is turned by `turn`.
fn halves(thickness: Option<f32>, turn: Quat) -> Stage {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.7)));
    room(&mut scene, ROOM, white, None);
    if let Some(thickness) = thickness {
        let mut wall = Mesh::default();
        let half = Vec3::new(thickness * 0.5, 0.0, ROOM.z * 0.5);
        if thickness > 0.0 {
            wall.add_box(-half, half + Vec3::Y * ROOM.y, white);
        } else {
            let both = Material { double_sided: true, ..Material::diffuse("wall", Vec3::splat(0.7)) };
            let both = scene.add_material(both);
            let corner = |up: f32, side: f32| Vec3::new(0.0, up * ROOM.y, side * half.z);
            wall.add_polygon(
                &[corner(0.0, -1.0), corner(0.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)],
                both,
            );
        }
        scene.add_object("wall", wall, Transform::IDENTITY);
    }
    lamp(&mut scene, 0.8, 15.0, Quat::IDENTITY, Vec3::new(1.4, 2.98, 0.3));
    // Two cameras: one in the lit half, one in the dark half, mirrored.
    camera(&mut scene, Vec3::new(2.8, 1.6, 2.2), Vec3::new(0.0, 1.0, -0.6), 1.2);
    camera(&mut scene, Vec3::new(-2.8, 1.6, 2.2), Vec3::new(0.0, 1.0, -0.6), 1.2);
    let turned = scene.add_node("turn", Transform::rigid(turn, Vec3::new(3.0, 7.0, -2.0)));
    for node in 0..turned.index() {
        scene.nodes[node].parent = Some(turned);
    }
    Stage::new(scene, &LightSettings { count: 200, bounces: 3, ..Default::default() })
}

/// Share of the lit half's mean that the dark half's mean has, and the farthest from a wall's foot, in texels of the map
/// (projected on what is lit), that a pixel above a thousandth of the lit half's mean lies.
fn leak(context: &Context, stage: &Stage, shadow_map: ShadowMap, thickness: f32, turn: Quat) -> (f32, f32) {
    let size = [200, 150];
    let mut renderer = context.renderer(RendererOptions { shadow_map, ..Default::default() });
    renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
    let frame =
        |renderer: &mut _, i| context.frame(renderer, &stage.view(i, size), size, &crate::common::exact());
    let lit = mean(&frame(&mut renderer, 0));
    let dark = frame(&mut renderer, 1);
    let texels = context.wait(renderer.stats()).expect("stats").map_size as f32;
    let (tracer, view) = (stage.tracer(), stage.local(&stage.view(1, size)));
    let mut farthest = 0f32;
    for (i, pixel) in dark.pixels.iter().enumerate() {
        if pixel.element_sum() / 3.0 <= lit * 1e-3 {
            continue;
        }
        let at =
            girandole_core::glam::Vec2::new((i as u32 % size[0]) as f32, (i as u32 / size[0]) as f32) + 0.5;
        let (origin, direction) = view.pixel_ray(at, size);
        let Some(hit) = tracer.closest_visible(origin, direction) else { continue };
        let s = stage.geometry.surface(&stage.scene, hit.triangle, hit.barycentric, -direction.normalize());
        // Distance from the foot of the nearest wall, in the footprints of the sample whose texels are largest here.
        let local =
            turn.inverse() * (s.position + stage.geometry.origin.as_vec3() - Vec3::new(3.0, 7.0, -2.0));
        let footprint = stage
            .lights
            .samples()
            .iter()
            .filter_map(|l| {
                let d = l.position - s.position;
                let cosine = s.geometric_normal.dot(d.normalize());
                (cosine > 0.0 && l.normal.dot(d) < 0.0).then(|| d.length() * 2.0 / texels / cosine.max(0.1))
            })
            .fold(2.0 / texels, f32::max);
        let walls = [
            local.x.abs() - thickness * 0.5,
            local.x + ROOM.x * 0.5,
            local.y,
            local.y - ROOM.y,
            local.z - ROOM.z * 0.5,
            local.z + ROOM.z * 0.5,
        ];
        let mut distances = walls.map(f32::abs);
        // The nearest is the wall that the pixel lies on; the next one's foot is what counts.
        distances.sort_by(f32::total_cmp);
        farthest = farthest.max(distances[1] / footprint);
    }
    (mean(&dark) / lit, farthest)
}

fn closed_rooms(context: &Context) {
    let turns = [
        Quat::IDENTITY,
        Quat::from_rotation_y(0.6),
        Quat::from_rotation_z(std::f32::consts::FRAC_PI_2) * Quat::from_rotation_x(0.3),
    ];
    for thickness in [0.001, 0.01, 0.1] {
        for turn in turns {
            let stage = halves(Some(thickness), turn);
            let (share, farthest) = leak(context, &stage, ShadowMap::Octahedral, thickness, turn);
            eprintln!(
                "wall of {thickness} m: dark half {share:.2e} of the lit half, farthest leak {farthest:.2} texels"
            );
            assert!(share <= 1e-3, "a wall of {thickness} m lets {share} of the light through");
            assert!(farthest <= 2.0, "light {farthest} texels from a wall of {thickness} m");
        }
    }
    // The controls: without the wall it is not dark, and the parabolic map leaks (Barczak's figure 4-3).
    let open = halves(None, Quat::IDENTITY);
    let (share, farthest) = leak(context, &open, ShadowMap::Octahedral, 0.0, Quat::IDENTITY);
    assert!(share > 0.1 && farthest > 2.0, "{share} {farthest}");
    let thin = halves(Some(0.01), Quat::IDENTITY);
    assert!(leak(context, &thin, ShadowMap::Parabolic, 0.01, Quat::IDENTITY).0 > 1e-3);
}

/// Walls without thickness: where they meet the room's own, no pixel is lit from the other half but what is within rounding of it.
fn joints(context: &Context) {
    let size = [200, 150];
    for turn in
        [Quat::IDENTITY, Quat::from_rotation_z(std::f32::consts::FRAC_PI_2) * Quat::from_rotation_x(0.3)]
    {
        let stage = halves(Some(0.0), turn);
        let options = RendererOptions { map_size: Some(128), ..Default::default() };
        let mut renderer = context.loaded(&stage, options);
        let mut share = |mode| {
            let settings = RenderSettings { mode, ..crate::common::exact() };
            let [lit, dark] =
                [0, 1].map(|i| mean(&context.frame(&mut renderer, &stage.view(i, size), size, &settings)));
            dark / lit
        };
        let control = share(Mode::Naive);
        for mode in [Mode::Full, Mode::Visibility] {
            let asked = share(mode);
            eprintln!(
                "without thickness, {mode:?}: {asked:.2e} of the lit half, {control:.2e} with one look alone"
            );
            assert!(asked * 20.0 < control && asked < 1e-5, "{mode:?}: {asked} {control}");
        }
    }
}

/// The sun over a closed room whose walls have no thickness: within, nothing is lit that lies farther from the next wall than depths are
/// rounded, 2e-5 of the scene's extent.
fn room_in_the_sun(context: &Context) {
    let farthest =
        |left_out| lit_by_the_sun(context, (left_out, 128), |_, _| {}).into_iter().fold(0.0, f32::max);
    let (closed, open) = (farthest(None), farthest(Some(3)));
    assert!(closed < 2e-5 * ROOM.length(), "{closed}");
    assert!(open > 0.5, "negative control: without its ceiling, the room is lit {open} m from its walls");
}

/// Tiles whose bevelled edges end close below a roof that is flat: what is wide about the room does not make it thinner.
fn tiles_under_a_roof(context: &Context) {
    let tiles = |scene: &mut Scene, material| {
        let mut mesh = Mesh::default();
        let (half, inner, low, high) = (0.5, 0.485, ROOM.y - 0.03, ROOM.y - 0.004);
        for (x, z) in (-2..3).flat_map(|x| (-2..2).map(move |z| (x as f32, z as f32 + 0.5))) {
            let corner = |i: usize, by: f32, y: f32| {
                Vec3::new(x + by * [-1.0, 1.0, 1.0, -1.0][i % 4], y, z + by * [-1.0, -1.0, 1.0, 1.0][i % 4])
            };
            mesh.add_polygon(&[0, 1, 2, 3].map(|i| corner(i, inner, low)), material);
            for i in 0..4 {
                let bevel = [(i, half, high), (i + 1, half, high), (i + 1, inner, low), (i, inner, low)];
                mesh.add_polygon(&bevel.map(|(i, by, y)| corner(i, by, y)), material);
            }
        }
        scene.add_object("tiles", mesh, Transform::IDENTITY);
        let far = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
        let mut ground = Mesh::default();
        ground.add_polygon(&far.map(|(x, z)| Vec3::new(100.0 * x, -0.1, 100.0 * z)), material);
        scene.add_object("ground", ground, Transform::IDENTITY);
    };
    // A few texels from where the roof ends.
    let away = |left_out| {
        lit_by_the_sun(context, (left_out, 512), tiles).into_iter().filter(|far| *far > 0.5).count()
    };
    let (closed, open) = (away(None), away(Some(3)));
    assert!(closed < 1, "{closed}");
    assert!(open > 1000, "negative control: without the roof {open} pixels are lit");
}

/// Of each pixel that is lit in a room, with something more in it, how far it is from the next wall, m.
fn lit_by_the_sun(
    context: &Context,
    (left_out, map_size): (Option<usize>, u32),
    furnish: impl FnOnce(&mut Scene, MaterialId),
) -> Vec<f32> {
    let size = [800, 600];
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.7)));
    room(&mut scene, ROOM, white, left_out);
    furnish(&mut scene, white);
    camera(&mut scene, Vec3::new(-2.8, 2.5, 2.3), Vec3::new(0.5, 2.9, -0.6), 1.0);
    sun(&mut scene, Vec3::new(-0.87, 0.42, -0.26));
    let stage = Stage::new(scene, &LightSettings { count: 1, bounces: 0, ..Default::default() });
    let options = RendererOptions { map_size: Some(map_size), ..Default::default() };
    let view = stage.view(0, size);
    let picture = context.picture(&stage, options, &view, size);
    let (tracer, view) = (stage.tracer(), stage.local(&view));
    let lit = (0..picture.pixels.len()).filter(|&i| picture.pixels[i] != Vec3::ZERO);
    let from_wall = |i: usize| {
        let at = UVec2::new(i as u32 % size[0], i as u32 / size[0]).as_vec2() + 0.5;
        let (origin, direction) = view.pixel_ray(at, size);
        let hit = tracer.closest_visible(origin, direction)?;
        let s = stage.geometry.surface(&stage.scene, hit.triangle, hit.barycentric, -direction.normalize());
        let at = s.position + stage.geometry.origin.as_vec3() - ROOM.with_x(0.0).with_z(0.0) * 0.5;
        let mut walls = (ROOM * 0.5 - at.abs()).to_array();
        walls.sort_by(f32::total_cmp);
        Some(walls[1])
    };
    lit.filter_map(from_wall).collect()
}
