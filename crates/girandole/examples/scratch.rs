use girandole::core::glam::*;
use girandole::core::lights::*;
use girandole::core::math::{sequence, warp};
use girandole::core::scene::*;
use girandole::core::trace::*;
use girandole::*;
use girandole_reference as reference;
use std::time::Instant;
fn lights(scene: &Scene, g: &Geometry, n: u32) -> LightSet {
    let tracer = SceneTracer::new(scene, g);
    let em: Vec<u32> = (0..g.triangles.len() as u32).filter(|&t| scene.materials[g.triangles[t as usize].material as usize].emits()).collect();
    let mut set = LightSet::default();
    for i in 0..n {
        let t = em[i as usize % em.len()];
        let b = warp::triangle(vec2(sequence::sample(i, 0, 1), sequence::sample(i, 1, 1)));
        let nn = g.normal(t);
        let p = g.point(t, b);
        let le = g.emission(scene, t, b);
        let area: f32 = g.area(t);
        let pos = p + nn * lift_distance(g, p);
        if i % 4 == 0 {
            set.samples.push(LightSample { position: pos, normal: nn, intensity: le * area * em.len() as f32 / (n as f32 / 4.0), profile: Profile::Cosine, origin: SampleOrigin::Emitter { triangle: t } });
        } else {
            let l = warp::cosine_hemisphere(vec2(sequence::sample(i, 2, 1), sequence::sample(i, 3, 1)));
            let (x, y) = warp::frame(nn);
            let d = x * l.x + y * l.y + nn * l.z;
            if let Some(h) = tracer.closest_hit(pos, d, f32::INFINITY, t) {
                let s = g.surface(scene, h.triangle, h.barycentric, -d);
                set.samples.push(LightSample { position: s.position + s.geometric_normal * lift_distance(g, s.position), normal: s.geometric_normal, intensity: s.albedo * le * area * em.len() as f32 / (n as f32 * 0.75), profile: Profile::Cosine, origin: SampleOrigin::Bounce { path: 0, bounce: 1, triangle: h.triangle } });
            }
        }
    }
    set
}
fn pairs(r: &mut Renderer, gpu: &Gpu, scene: &Scene, g: &Geometry, set: &LightSet, view: &View, size: [u32; 2], step: usize) {
    let tracer = SceneTracer::new(scene, g);
    let hits: Vec<Option<(Hit, girandole::core::brdf::Surface)>> = (0..size[0] * size[1]).map(|i| {
        let (o, d) = view.pixel_ray(vec2((i % size[0]) as f32 + 0.5, (i / size[0]) as f32 + 0.5), size);
        tracer.closest_visible(o, d).map(|h| (h, g.surface(scene, h.triangle, h.barycentric, -d.normalize())))
    }).collect();
    let settings = RenderSettings { clamp: None, ..Default::default() };
    let (mut total, mut leak, mut dark, mut far, mut farleak) = (0, 0, 0, 0, 0);
    let map_size = pollster::block_on(async { 0 });
    let _ = map_size;
    let ms: f32 = std::env::var("MS").map_or(464.0, |v| v.parse().unwrap());
    for (li, light) in set.samples.iter().enumerate().step_by(step) {
        let single = LightSet { samples: vec![LightSample{intensity: Vec3::ONE*1e3, ..*light}], ..Default::default() };
        r.load(scene, g, &single).unwrap();
        r.render(view, size, &settings).unwrap();
        let mut f = Box::pin(r.radiance());
        let mut cx = std::task::Context::from_waker(std::task::Waker::noop());
        let image = loop {
            if let std::task::Poll::Ready(v) = f.as_mut().poll(&mut cx) { break v.unwrap(); }
            gpu.wait().unwrap();
        };
        for (i, hit) in hits.iter().enumerate() {
            let Some((h, s)) = hit else { continue };
            if s.albedo.max_element() <= 0.0 { continue; }
            if light.geometric_factor(s.position, s.geometric_normal, s.shading_normal, f32::MAX).is_none() { continue; }
            total += 1;
            let seen = (image.pixels[i] - s.emission).max_element() > 0.0;
            let truth = reference::visible(&tracer, s, h.triangle, light);
            if seen == truth { continue; }
            if seen { leak += 1 } else { dark += 1 }
            // near a traced edge within 1.5 texels?
            let (t, b) = warp::frame(light.normal);
            let d = s.position - light.position;
            let p = vec3(d.dot(t), d.dot(b), d.dot(light.normal));
            let uv = girandole::core::math::octahedral::encode(p);
            let mut near = false;
            for k in 0..64 {
                let ang = k as f32 * 0.785398;
                let rad = 1.5 * ((k / 8) as f32 + 1.0) / 8.0 / ms;
                let q = (uv + vec2(ang.cos(), ang.sin()) * rad).clamp(Vec2::ZERO, Vec2::ONE);
                let dir = girandole::core::math::octahedral::decode(q);
                let dir = t * dir.x + b * dir.y + light.normal * dir.z;
                let w = s.geometric_normal.dot(d) / s.geometric_normal.dot(dir);
                if !(w > 0.0) { near = true; break; }
                let mut s2 = *s;
                s2.position = light.position + dir * w;
                if reference::visible(&tracer, &s2, h.triangle, light) != truth { near = true; break; }
            }
            if !near { far += 1; if seen { farleak += 1 }; if far < 12 { eprintln!("far: light {li} pixel {} {} seen {seen} obj {}", i as u32 % size[0], i as u32 / size[0], scene.objects[g.triangles[h.triangle as usize].object as usize].name); } }
        }
    }
    eprintln!("pairs {total} leak {leak} ({:.3}%) dark {dark} ({:.3}%) far from edge {far} of which leaks {farleak}", leak as f32 / total as f32 * 100.0, dark as f32 / total as f32 * 100.0);
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let name = &args[1];
    let n: u32 = args[2].parse().unwrap();
    let size = [args[3].parse().unwrap(), args[4].parse().unwrap()];
    let scene = builtin::build(name, builtin::MovingObject::Torus).unwrap();
    let g = Geometry::new(&scene);
    let set = lights(&scene, &g, n);
    let view = View::new(&scene, &g, &scene.cameras[0], size[0] as f32 / size[1] as f32);
    let gpu = pollster::block_on(Gpu::new(None)).unwrap();
    let mut r = Renderer::new(&gpu.device, &gpu.queue, RendererOptions { map_size: args.get(5).and_then(|a| a.parse().ok()), ..Default::default() }).unwrap();
    r.load(&scene, &g, &set).unwrap();
    let t = Instant::now();
    r.draw_shadow_maps().unwrap();
    gpu.wait().unwrap();
    eprintln!("maps {:?}", t.elapsed());
    let settings = RenderSettings { clamp: None, ..Default::default() };
    let mut image = None;
    for _ in 0..2 {
        let t = Instant::now();
        r.render(&view, size, &settings).unwrap();
        gpu.wait().unwrap();
        eprintln!("frame {:?}", t.elapsed());
        let mut f = Box::pin(r.radiance());
        let mut cx = std::task::Context::from_waker(std::task::Waker::noop());
        image = Some(loop {
            if let std::task::Poll::Ready(v) = f.as_mut().poll(&mut cx) { break v.unwrap(); }
            gpu.wait().unwrap();
        });
    }
    let image = image.unwrap();
    let tracer = SceneTracer::new(&scene, &g);
    let t = Instant::now();
    let oracle = reference::oracle(&tracer, &set, &view, size, &reference::OracleSettings { samples_per_axis: 1, clamp: None }, &|_| {});
    eprintln!("oracle {:?}", t.elapsed());
    let c = reference::metrics::compare(&oracle, &image, &reference::metrics::CompareOptions { mask: None, keep_edges: true, trim: 0.0 }).unwrap();
    eprintln!("{c:#?}");
    let dark = oracle.pixels.iter().zip(&image.pixels).filter(|(o, i)| i.max_element() < 0.5 * o.max_element()).count();
    let bright = oracle.pixels.iter().zip(&image.pixels).filter(|(o, i)| i.max_element() > 1.5 * o.max_element() + 1e-3).count();
    eprintln!("below half {dark}, above 1.5 {bright} of {}", oracle.pixels.len());
    if let Ok(step) = std::env::var("PAIRS") { pairs(&mut r, &gpu, &scene, &g, &set, &view, size, step.parse().unwrap()); }
    use girandole::core::tonemap::*;
    let ev = Exposure::Auto.ev(&oracle);
    for (n, i) in [("gpu", &image), ("oracle", &oracle)] {
        reference::image_file::write_png(std::path::Path::new(&format!("/tmp/s_{n}.png")), size[0], size[1], &to_srgb8(i, ev, Tonemap::Agx)).unwrap();
    }
    let mut diff = image.clone();
    for (d, o) in diff.pixels.iter_mut().zip(&oracle.pixels) {
        let e = (d.element_sum() - o.element_sum()) / (o.element_sum() + 0.01);
        *d = if e > 0.0 { vec3(e, 0.0, 0.0) } else { vec3(0.0, 0.0, -e) };
    }
    reference::image_file::write_png(std::path::Path::new("/tmp/s_diff.png"), size[0], size[1], &to_srgb8(&diff, 2.0, Tonemap::None)).unwrap();
}
