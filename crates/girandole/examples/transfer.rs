//! An object lit by shadow maps and by precomputed radiance transfer, beside a path tracer (Barczak, figures 4-13 and 4-14): a strip of
//! pictures, how far each is from the truth over the object's pixels, and what each costs.
//!
//! ```text
//! cargo run --release -p girandole --example transfer -- [room] [torus|teapot|FILE] [lights] [paths] [where the eye is from the object, as 0.4,0.3,1]
//! ```

use girandole::core::glam::{DVec3, Vec2, Vec3};
use girandole::core::illumination::{Illumination, IlluminationSettings, Rewalk};
use girandole::core::image::Image;
use girandole::core::lights::LightSettings;
use girandole::core::scene::builtin::{self, MovingObject};
use girandole::core::scene::{Camera, Geometry, ObjectId, Projection, Scene, Transform, View, load_model};
use girandole::core::tonemap::{Exposure, Tonemap, to_srgb8};
use girandole::core::trace::SceneTracer;
use girandole::core::transfer::{Gathering, ObjectTransfer, TransferSettings};
use girandole::{Gpu, RenderSettings, Renderer, RendererOptions};
use girandole_reference::metrics::{CompareOptions, compare};
use girandole_reference::{PathSettings, image_file, path_trace};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

const SIZE: [u32; 2] = [320, 240];
const FRAMES: usize = 15;
/// Metres from the eye to the object, in units of its radius.
const DISTANCE: f64 = 3.2;

/// How the object is lit.
type Lit = Option<Gathering>;
const WAYS: [(&str, Lit); 3] =
    [("shadow maps", None), ("centre", Some(Gathering::Center)), ("grid", Some(Gathering::GRID))];

fn scene(room: &str, object: &str) -> Result<Scene> {
    let object = match object {
        "torus" => MovingObject::Torus,
        "teapot" => MovingObject::Teapot,
        file => MovingObject::Model(Box::new(load_model(Path::new(file))?)),
    };
    Ok(builtin::build(room, object)?)
}

/// A view of the object.
fn view(scene: &Scene, object: ObjectId, transfer: &ObjectTransfer, from: DVec3) -> Result<View> {
    let frame = transfer.frame(scene, object)?.world_from_transfer;
    let center = frame.transform_point3(transfer.center().as_dvec3());
    let radius = frame.transform_vector3(DVec3::X).length() * f64::from(transfer.radius());
    let mut posed = scene.clone();
    let eye = center + from.normalize() * radius * DISTANCE;
    let node = posed.add_node("eye", Transform::looking_at(eye.as_vec3(), center.as_vec3()));
    let camera = Camera {
        name: String::new(),
        node,
        projection: Projection::Perspective { yfov: 0.6 },
        clip: Default::default(),
    };
    Ok(View::new(&posed, &camera, SIZE[0] as f32 / SIZE[1] as f32))
}

/// Leaves out all pixels but those of the object.
fn mask(tracer: &SceneTracer, object: ObjectId, view: &View) -> Image {
    let view = view.relative_to(tracer.geometry().origin);
    let pixel = |i: u32| {
        let (origin, direction) =
            view.pixel_ray(Vec2::new((i % SIZE[0]) as f32, (i / SIZE[0]) as f32) + 0.5, SIZE);
        let hit = tracer.closest_visible(origin, direction);
        let of = hit.map(|hit| tracer.geometry().triangles[hit.triangle as usize].object);
        if of == Some(object.0) { Vec3::ZERO } else { Vec3::X }
    };
    Image { width: SIZE[0], height: SIZE[1], pixels: (0..SIZE[0] * SIZE[1]).map(pixel).collect() }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or_default()
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |i: usize, other: &'static str| arguments.get(i).map_or(other, String::as_str).to_owned();
    let (room, name) = (argument(0, "table"), argument(1, "torus"));
    let (lights, paths) = (argument(2, "300").parse()?, argument(3, "256").parse()?);
    let from = argument(4, "0.4,0.35,1");
    let from: Vec<f64> = from.split(',').map(str::parse).collect::<std::result::Result<_, _>>()?;
    let from: [f64; 3] = from.try_into().map_err(|_| "give three numbers, as 0.4,0.3,1")?;

    // The scene, and the object's transfer.
    let mut scene = scene(&room, &name)?;
    let object = scene.objects.iter().position(|o| o.dynamic).ok_or("the room has no object")?.into();
    let start = Instant::now();
    let transfer = Arc::new(ObjectTransfer::simulate(&scene, object, &TransferSettings::default(), &|_| ())?);
    println!(
        "{} vertices, simulated in {:.1} s: error {:?}",
        transfer.vertex_count(),
        start.elapsed().as_secs_f64(),
        transfer.error()
    );
    let view = view(&scene, object, &transfer, DVec3::from_array(from))?;
    scene.take_changes();
    let settings = IlluminationSettings {
        lights: LightSettings { count: lights, ..LightSettings::default() },
        views: vec![view],
        rewalk: Rewalk::Off,
        ..IlluminationSettings::default()
    };

    // The truth.
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let settings_of_paths = PathSettings { paths, bounces: Some(5), seed: 0 };
    let truth = path_trace(&tracer, &view, SIZE, &settings_of_paths, &|_| ()).mean;
    let options = CompareOptions { mask: Some(mask(&tracer, object, &view)), ..CompareOptions::default() };

    // The same by each way, in turn.
    let gpu = pollster::block_on(Gpu::new(None))?;
    let open = |scene: &Scene| -> Result<Renderer> {
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, RendererOptions::default())?;
        renderer.open_with(scene, Illumination::new(scene, &settings)?)?;
        Ok(renderer)
    };
    let mut renderer = open(&scene)?;
    let (mut times, mut pictures) = ([const { Vec::new() }; WAYS.len()], Vec::new());
    let frame = |renderer: &mut Renderer| -> Result<()> {
        renderer.render(&view, SIZE, &RenderSettings::default())?;
        Ok(gpu.wait()?)
    };
    for round in 0..FRAMES + 2 {
        for ((_, lit), times) in WAYS.iter().zip(&mut times) {
            // Choosing it gathers the light anew where the CPU does so, as an update does.
            if lit.is_none() {
                renderer.set_transfer(&scene, object, None)?;
            }
            let start = Instant::now();
            if let Some(gathering) = lit {
                renderer.set_transfer(&scene, object, Some((transfer.clone(), *gathering)))?;
            }
            frame(&mut renderer)?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
            if round == 0 {
                pictures.push(gpu.block_on(renderer.radiance())??);
            }
        }
    }
    let medians = times.map(|mut times| {
        times.drain(..2);
        median(times)
    });
    let mut parts = Vec::new();
    for (_, lit) in WAYS {
        renderer.time_passes(true);
        let lit = lit.map(|gathering| (transfer.clone(), gathering));
        let mut samples = [const { Vec::new() }; 2];
        for _ in 0..FRAMES {
            renderer.set_transfer(&scene, object, lit.clone())?;
            frame(&mut renderer)?;
            let stats = gpu.block_on(renderer.stats())??;
            let sum =
                |names: &[&str]| -> f64 { names.iter().filter_map(|name| stats.gpu_ms.get(name)).sum() };
            samples[0].push(sum(&["select_gpu_ms", "sort_gpu_ms", "shade_gpu_ms"]));
            let by_transfer = ["incident_light_gpu_ms", "transfer_vertices_gpu_ms", "transfer_gpu_ms"];
            samples[1].push(sum(&by_transfer) + stats.transfer.gather_ms);
        }
        parts.push(samples.map(median));
    }
    for (((way, lit), picture), (ms, part)) in WAYS.iter().zip(&pictures).zip(medians.into_iter().zip(&parts))
    {
        let c = compare(&truth, picture, &options)?;
        // The other passes shade the rest of the picture alone where transfer lights the object.
        let by_maps = parts[0][0] - part[0];
        let cost = match lit {
            Some(_) => format!(
                "{:.2} ms for the object, {:.2} of shadow maps' {by_maps:.2}",
                part[1],
                part[1] / by_maps
            ),
            None => String::new(),
        };
        println!(
            "{way:11}: energy {:.3}, relMSE {:.4}, FLIP {:.4} over the object; {ms:6.2} ms a frame; {cost}",
            c.energy_ratio, c.rel_mse, c.flip
        );
    }

    // Side by side.
    let ev = Exposure::Auto.ev(&truth);
    let all: Vec<&Image> = std::iter::once(&truth).chain(&pictures).collect();
    let mut strip = Vec::new();
    for row in 0..SIZE[1] {
        let of = |image: &&Image| image.pixels[(row * SIZE[0]) as usize..][..SIZE[0] as usize].to_vec();
        strip.extend(all.iter().flat_map(of));
    }
    let strip = Image { width: SIZE[0] * all.len() as u32, height: SIZE[1], pixels: strip };
    let file = Path::new("transfer.png");
    image_file::write_png(file, strip.width, strip.height, &to_srgb8(&strip, ev, Tonemap::Agx))?;
    println!("wrote {}: the path tracer, shadow maps, centre, grid", file.display());
    Ok(())
}
