//! Frames in somebody else's encoder, with his projection, depth and targets; and scenes that change.

use crate::common::{Context, OneView, Stage, Test, camera, exact, lamp};
use crate::selected::bounded;
use girandole::{Mode, RenderSettings, Renderer, RendererOptions, Target};
use girandole_core::glam::camera::rh::proj::directx as proj;
use girandole_core::glam::{DAffine3, Quat, Vec3};
use girandole_core::illumination::IlluminationSettings;
use girandole_core::lights::LightSettings;
use girandole_core::math::sequence;
use girandole_core::scene::builtin::{self, MovingObject, shapes};
use girandole_core::scene::{Material, MaterialId, Scene, Transform, View};
use girandole_core::tonemap::{Exposure, Tonemap};

pub fn tests() -> Vec<Test> {
    vec![
        ("a_recorded_frame_is_the_rendered_one", recorded_is_rendered),
        ("two_views_in_one_encoder_are_both_right", two_views),
        ("an_off_axis_quarter_is_part_of_the_whole", quarter),
        ("the_callers_depth_hides_and_ours_goes_out", depth),
        ("after_updates_the_picture_is_that_of_a_fresh_renderer", updates),
        ("changes_that_do_not_follow_are_refused", wrong_changes),
        ("a_lost_device_is_an_error_and_another_one_works", lost_device),
    ]
}

pub fn with_float_blending() -> (wgpu::Features, Test) {
    (wgpu::Features::FLOAT32_BLENDABLE, ("the_callers_picture_stays_where_nothing_is_seen", background))
}

/// On a device of its own.
fn lost_device(_: &Context) {
    let picture = || -> girandole::Result<Vec<Vec3>> {
        let gpu = pollster::block_on(girandole::Gpu::new(None))?;
        assert!(!gpu.is_lost());
        let mut scene = builtin::build("table", MovingObject::None).expect("a room");
        scene.open();
        let view = View::new(&scene, &scene.cameras[0], 1.0);
        let lights = LightSettings { count: 4, ..LightSettings::default() };
        let light = IlluminationSettings { lights, ..IlluminationSettings::default() };
        let renderer = Renderer::new(&gpu.device, &gpu.queue, RendererOptions::default())?;
        let mut renderer = OneView::new(renderer);
        renderer.open(&scene, &light)?;
        let radiance = |renderer: &mut OneView| {
            renderer.render(&view, [32, 32], &RenderSettings::default())?;
            gpu.block_on(renderer.radiance())?.map(|image| image.pixels)
        };
        let pixels = radiance(&mut renderer)?;
        gpu.device.destroy();
        assert!(radiance(&mut renderer).is_err(), "it renders without a device");
        let error = gpu.poll().expect_err("a lost device").to_string();
        assert!(gpu.is_lost() && error.contains("the device was lost"), "{error}");
        Ok(pixels)
    };
    let (one, another) = (picture().expect("a picture"), picture().expect("a picture"));
    assert!(one == another && one.iter().any(|pixel| *pixel != Vec3::ZERO));
}

const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// What is in a texture of 32-bit channels; widths are multiples of 64.
fn read(context: &Context, texture: &wgpu::Texture) -> Vec<f32> {
    let device = &context.gpu.device;
    let channels = if texture.format() == DEPTH { 1 } else { 4 };
    let row = texture.width() * channels * 4;
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(row * texture.height()),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
    context.gpu.queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |result| result.expect("map"));
    context.gpu.wait().expect("the device");
    let view = buffer.get_mapped_range(..).expect("mapped");
    view.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// Linear radiance as it is.
fn plain(settings: RenderSettings) -> RenderSettings {
    RenderSettings { exposure: Exposure::Ev(0.0), tonemap: Tonemap::None, ..settings }
}

fn rgb(texels: &[f32]) -> Vec<Vec3> {
    texels.chunks_exact(4).map(|p| Vec3::new(p[0], p[1], p[2])).collect()
}

/// Whether two pictures are equal but for the rounding of a scale by 2⁰, which devices approximate.
fn are_close(a: &[Vec3], b: &[Vec3]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| (*a - *b).abs().max_element() <= 1e-5 * b.max_element())
}

fn recorded_is_rendered(context: &Context) {
    let size = [128, 96];
    let stage = Stage::builtin("table", 40);
    let view = stage.view(0, size);
    for (mode, samples_per_axis) in [(Mode::Naive, 1), (Mode::Full, 1), (Mode::Full, 2)] {
        let settings = RenderSettings {
            exposure: Exposure::Ev(4.0),
            ..plain(RenderSettings { samples_per_axis, ..bounded(mode) })
        };
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let target = context.target(size, COLOR);
        let target_view = target.create_view(&Default::default());
        let mut encoder = context.gpu.device.create_command_encoder(&Default::default());
        renderer
            .record(&mut encoder, &view, &Target::new(&target_view, COLOR, size), &settings)
            .expect("record");
        context.gpu.queue.submit([encoder.finish()]);
        let recorded = context.wait(renderer.radiance()).expect("radiance");
        let mut fresh = context.loaded(&stage, RendererOptions::default());
        let rendered = context.frame(&mut fresh, &view, size, &settings);
        assert!(recorded.pixels == rendered.pixels, "{mode:?}");
        // Above 1 as well: nothing is cut off.
        let exposed: Vec<Vec3> = rendered.pixels.iter().map(|p| *p * 16.0).collect();
        assert!(are_close(&rgb(&read(context, &target)), &exposed), "{mode:?}");
        assert!(exposed.iter().any(|p| p.max_element() > 1.0));
        // The control: another number of samples is seen.
        let other = RenderSettings { samples_per_axis: 3 - samples_per_axis, ..settings };
        assert!(context.frame(&mut fresh, &view, size, &other).pixels != recorded.pixels);
    }
}

fn two_views(context: &Context) {
    let stage = Stage::builtin("pillars", 40);
    let sizes = [[128, 96], [64, 64]];
    let views = [stage.view(0, sizes[0]), stage.view(1, sizes[1])];
    let modes = [Mode::Full, Mode::Visibility];
    let settings =
        [0, 1].map(|i| plain(RenderSettings { samples_per_axis: 2 - i as u32, ..bounded(modes[i]) }));
    for order in [[0, 1], [1, 0]] {
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let mut encoder = context.gpu.device.create_command_encoder(&Default::default());
        let targets = sizes.map(|size| context.target(size, COLOR));
        for i in order {
            let target = targets[i].create_view(&Default::default());
            let target = Target::new(&target, COLOR, sizes[i]);
            renderer.record(&mut encoder, &views[i], &target, &settings[i]).expect("record");
        }
        context.gpu.queue.submit([encoder.finish()]);
        for i in order {
            let mut alone = context.loaded(&stage, RendererOptions::default());
            let alone = context.frame(&mut alone, &views[i], sizes[i], &settings[i]);
            assert!(are_close(&rgb(&read(context, &targets[i])), &alone.pixels), "view {i} of {order:?}");
        }
        // The control: the two are not the same picture.
        assert!(read(context, &targets[0])[..64] != read(context, &targets[1])[..64]);
    }
}

fn quarter(context: &Context) {
    let size = [256, 128];
    let stage = Stage::builtin("table", 30);
    let eye = view_of(Vec3::new(0.5, 1.65, 2.85), Vec3::new(0.0, 0.8, -0.7));
    let projection = proj::perspective_infinite_reverse(0.9, 2.0, 0.05);
    let whole = View::from_matrices(eye, projection).expect("a view");
    let mut renderer = context.loaded(&stage, RendererOptions::default());
    let picture = context.frame(&mut renderer, &whole, size, &exact());
    for (left, top) in [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)] {
        let part = whole.part([left, top], [left + 0.5, top + 0.5]);
        assert!(part.center.abs().min_element() > 0.0);
        let part = context.frame(&mut renderer, &part, [128, 64], &exact());
        let differing = |shift: usize| {
            let [x, y] = [(left * 256.0) as usize + shift, (top * 128.0) as usize];
            let same =
                |i: &usize| picture.pixels[(y + i / 128) * 256 + (x + i % 128) % 256] != part.pixels[*i];
            (0..128 * 64).filter(same).count()
        };
        // Rasterisation may decide otherwise where an edge meets a pixel's centre.
        assert!(differing(0) <= 16, "{} of 8192 pixels differ", differing(0));
        // The control: a pixel beside it is another one.
        assert!(differing(1) > 4000);
    }
}

fn view_of(eye: Vec3, target: Vec3) -> DAffine3 {
    Transform::looking_at(eye, target).affine().inverse()
}

fn depth(context: &Context) {
    let size = [128, 96];
    let stage = Stage::builtin("table", 30);
    let eye = view_of(Vec3::new(0.5, 1.65, 2.85), Vec3::new(0.0, 0.8, -0.7));
    let aspect = 128.0 / 96.0;
    // Both conventions, with and without an end.
    for (projection, is_reversed) in [
        (proj::perspective_infinite_reverse(0.9, aspect, 0.05), true),
        (proj::perspective(0.9, aspect, 0.05, 50.0), false),
    ] {
        let view = View::from_matrices(eye, projection).expect("a view");
        for (mode, samples_per_axis) in [(Mode::Naive, 1), (Mode::Naive, 2), (Mode::Full, 1), (Mode::Full, 2)]
        {
            let settings = plain(RenderSettings { samples_per_axis, ..bounded(mode) });
            let color = context.target(size, COLOR);
            let frame = |near: Option<f32>| {
                let depth = context.target(size, DEPTH);
                let depth_view = depth.create_view(&Default::default());
                let color_view = color.create_view(&Default::default());
                let mut encoder = context.gpu.device.create_command_encoder(&Default::default());
                // The caller's wall, parallel to the picture, or nothing.
                let empty = if is_reversed { 0.0 } else { 1.0 };
                let wall = near.map_or(empty, |z| view.clip_depth(z).expect("it has depth"));
                clear(&mut encoder, &depth_view, wall);
                let mut renderer = context.loaded(&stage, RendererOptions::default());
                let target = Target {
                    depth_in: Some(&depth_view),
                    depth_out: Some((&depth_view, DEPTH)),
                    ..Target::new(&color_view, COLOR, size)
                };
                renderer.record(&mut encoder, &view, &target, &settings).expect("record");
                context.gpu.queue.submit([encoder.finish()]);
                (rgb(&read(context, &color)), read(context, &depth), wall)
            };
            let (open, open_depth, _) = frame(None);
            // What went out does not hide what follows: the picture is that of a frame without depth.
            let mut renderer = context.loaded(&stage, RendererOptions::default());
            let alone = context.frame(&mut renderer, &view, size, &settings);
            assert!(are_close(&open, &alone.pixels), "{mode:?}, {samples_per_axis}");
            // The tracer below looks through pixel centres only.
            if samples_per_axis > 1 {
                continue;
            }
            let (walled, walled_depth, wall) = frame(Some(3.0));
            // Our depth is where the scene is.
            let local = stage.local(&view);
            let tracer = stage.tracer();
            let (mut near, mut far, mut differing) = (0, 0, 0.0);
            for i in 0..open.len() {
                let at = girandole_core::glam::Vec2::new((i % 128) as f32, (i / 128) as f32) + 0.5;
                let (origin, direction) = local.pixel_ray(at, size);
                let Some(hit) = tracer.closest_visible(origin, direction) else { continue };
                let point = stage.geometry.point(hit.triangle, hit.barycentric);
                let z = (point - local.eye).dot(local.forward);
                let expected = view.clip_depth(z).expect("it has depth");
                // At edges, traced and rasterised surfaces differ.
                if (open_depth[i] - expected).abs()
                    > 2e-3 * (expected - view.clip_depth(1e9).unwrap_or(0.0)).abs()
                {
                    continue;
                }
                if z < 2.99 {
                    near += 1;
                    assert_eq!(walled_depth[i], open_depth[i], "{mode:?}");
                    let difference = (walled[i] - open[i]).abs().max_element();
                    differing += f64::from(difference / open[i].max_element().max(1e-3));
                } else if z > 3.01 {
                    far += 1;
                    assert_eq!((walled[i], walled_depth[i]), (Vec3::ZERO, wall), "{mode:?}");
                }
            }
            assert!(near > 1500 && far > 3000 && near + far > 12000, "{near} {far}");
            // Beside the wall there are fewer points to interpolate between.
            let most = if mode == Mode::Naive { 0.0 } else { 0.02 };
            assert!(differing <= most * f64::from(near), "{mode:?}: {}", differing / f64::from(near));
        }
    }
}

/// Clears a depth buffer.
fn clear(encoder: &mut wgpu::CommandEncoder, depth: &wgpu::TextureView, value: f32) {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(value),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
}

/// A ball in the open: the caller's colour stays round it, and at its edge there is neither a dark nor a bright rim.
fn background(context: &Context) {
    let size = [128, 96];
    let mut scene = Scene::default();
    let white = scene.add_material(Material::diffuse("white", Vec3::splat(0.8)));
    scene.add_object("ball", shapes::sphere(1.0, 48, 24, white), Transform::IDENTITY);
    lamp(&mut scene, 4.0, 3.0, Quat::IDENTITY, Vec3::new(0.0, 6.0, 0.0));
    camera(&mut scene, Vec3::new(0.0, 1.0, 4.0), Vec3::ZERO, 0.8);
    let stage = Stage::new(scene, &LightSettings { count: 30, bounces: 0, ..Default::default() });
    let view = stage.view(0, size);
    let behind = wgpu::Color { r: 0.2, g: 0.3, b: 0.4, a: 1.0 };
    for (mode, samples_per_axis) in [(Mode::Naive, 2), (Mode::Full, 1), (Mode::Full, 2)] {
        let settings = plain(RenderSettings { samples_per_axis, ..bounded(mode) });
        let target = context.target(size, wgpu::TextureFormat::Rgba32Float);
        let color = target.create_view(&Default::default());
        let mut renderer = context.loaded(&stage, RendererOptions::default());
        let mut encoder = context.gpu.device.create_command_encoder(&Default::default());
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(behind), store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        let kept = Target { keep_background: true, ..Target::new(&color, COLOR, size) };
        renderer.record(&mut encoder, &view, &kept, &settings).expect("record");
        context.gpu.queue.submit([encoder.finish()]);
        let shown = rgb(&read(context, &target));
        let alone = context.wait(renderer.radiance()).expect("radiance").pixels;
        let behind = Vec3::new(0.2, 0.3, 0.4);
        let untouched = shown.iter().filter(|p| p.abs_diff_eq(behind, 1e-6)).count();
        let ours = shown.iter().zip(&alone).filter(|(a, b)| a.abs_diff_eq(**b, 1e-4)).count();
        let mut between = 0;
        for (shown, alone) in shown.iter().zip(&alone) {
            // What the scene adds lies between all and nothing of the background.
            let rest = *shown - *alone;
            let share = rest / behind;
            assert!(share.min_element() > -1e-4 && share.max_element() < 1.0001, "{share}");
            assert!(share.max_element() - share.min_element() < 1e-4, "a share of all channels: {share}");
            between += usize::from(share.x > 0.01 && share.x < 0.99);
        }
        assert!(untouched > 3000 && ours > 1000, "{untouched} {ours}");
        // The control: edges are blended where there are samples for it.
        assert_eq!(between > 50, samples_per_axis == 2, "{mode:?}: {between}");
    }
}

fn illumination(count: u32) -> IlluminationSettings {
    let lights = LightSettings { count, candidates: 4, ..Default::default() };
    IlluminationSettings { lights, ..IlluminationSettings::default() }
}

fn open(context: &Context, scene: &Scene) -> OneView {
    let mut renderer = context.renderer(RendererOptions { map_size: Some(64), ..Default::default() });
    renderer.open(scene, &illumination(24)).expect("open");
    renderer
}

/// Random sequences of moves, emissions, cameras, and objects that come and go.
fn updates(context: &Context) {
    let size = [64, 48];
    for (name, seed) in [("table", 1u32), ("pillars", 2)] {
        let mut scene = builtin::build(name, MovingObject::Torus).expect("a room");
        let mut renderer = open(context, &scene);
        let mut other = context.renderer(RendererOptions { map_size: Some(64), ..Default::default() });
        scene.take_changes();
        let mut random = seed;
        let mut next = |n: u32| {
            random = sequence::hash(random);
            random % n
        };
        let mut added = Vec::new();
        let (mut pictures, mut views) = (Vec::new(), Vec::new());
        const STEPS: usize = 5;
        for step in 0..STEPS {
            for _ in 0..1 + next(2) {
                let place = Vec3::new(next(200) as f32, next(150) as f32, next(200) as f32) * 0.01
                    - Vec3::new(1.0, 0.0, 1.0);
                match next(4) {
                    0 => {
                        let moving = scene.objects.iter().rposition(|o| o.dynamic).expect("a torus");
                        let turn = Quat::from_rotation_y(next(628) as f32 * 0.01);
                        let node = scene.objects[moving].node;
                        scene.set_transform(node, Transform::rigid(turn, place)).expect("a move");
                    }
                    1 => {
                        let lamp = scene.materials.iter().position(Material::emits).expect("a lamp");
                        let emission = Vec3::new(next(20) as f32, next(20) as f32, 1.0 + next(20) as f32);
                        scene.set_emission(lamp.into(), emission).expect("an emission");
                    }
                    2 => {
                        let ball = shapes::sphere(0.1 + next(20) as f32 * 0.01, 12, 8, MaterialId(0));
                        added.push(
                            scene
                                .insert_object("ball", ball, Transform::translation(place), next(2) == 0)
                                .expect("a ball"),
                        );
                    }
                    _ => {
                        if let Some(ball) = added.pop() {
                            scene.remove_object(ball).expect("it is there");
                        }
                    }
                }
            }
            let changes = scene.take_changes();
            let camera = &scene.cameras[next(scene.cameras.len() as u32) as usize];
            let view = View::new(&scene, camera, 4.0 / 3.0);
            // Light samples are placed for the view of some steps, and stay so; or they follow it with what changed.
            match step {
                3 => {
                    renderer.follow(&scene, &changes, &[view]).expect("follow");
                    assert!(views != [view], "{name}: the control is another view");
                    views = vec![view];
                }
                _ => renderer.update(&scene, &changes).expect("update"),
            }
            if step == 1 {
                views = vec![view];
                renderer.place_for(&scene, &views).expect("place");
            }
            // Kernels take long to compile: only the last step has a renderer that never saw another scene.
            if step == STEPS - 1 {
                other = context.renderer(RendererOptions { map_size: Some(64), ..Default::default() });
            }
            let placed = IlluminationSettings { views: views.clone(), ..illumination(24) };
            other.open(&scene, &placed).expect("open");
            for mode in [Mode::Naive, Mode::Full] {
                let settings = RenderSettings { mode, ..RenderSettings::default() };
                let after = context.frame(&mut renderer, &view, size, &settings);
                let anew = context.frame(&mut other, &view, size, &settings);
                assert!(after.pixels == anew.pixels, "{name}, step {step}, {mode:?}");
                pictures.push(after.pixels);
            }
        }
        // The control: the changes are seen.
        let distinct = (1..pictures.len()).filter(|&i| pictures[i] != pictures[i - 1]).count();
        assert!(distinct >= pictures.len() - 2, "{distinct} of {}", pictures.len());
    }
}

fn wrong_changes(context: &Context) {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("a room");
    let mut renderer = context.renderer(RendererOptions::default());
    let refuse = |result: girandole::Result<()>, about: &str| {
        let text = result.expect_err("refused").to_string();
        assert!(text.contains(about) && !text.contains('\n'), "{text}");
    };
    let nothing = scene.take_changes();
    refuse(renderer.update(&scene, &nothing), "open a scene");
    refuse(renderer.place_for(&scene, &[]), "open a scene");
    refuse(renderer.follow(&scene, &nothing, &[]), "open a scene");
    renderer.open(&scene, &illumination(8)).expect("open");
    let node = scene.objects.last().expect("an object").node;
    let mut move_to = |x: f32| {
        scene.set_transform(node, Transform::translation(Vec3::new(x, 1.0, 0.0))).expect("a move");
        (scene.take_changes(), scene.clone())
    };
    let (first, after_first) = move_to(0.1);
    let (second, after_second) = move_to(0.2);
    // One is missing, and one leads elsewhere.
    refuse(renderer.update(&after_second, &second), "changes");
    refuse(renderer.update(&after_second, &first), "changes");
    // Geometry of another version of the scene.
    let stage = Stage::new(after_first.clone(), &LightSettings { count: 8, ..Default::default() });
    refuse(renderer.load(&after_second, &stage.geometry, &stage.lights), "scene");
    // The control: in order they are taken.
    renderer.open(&after_first, &illumination(8)).expect("open");
    renderer.update(&after_second, &second).expect("update");
}
