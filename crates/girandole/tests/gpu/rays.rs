//! Rays on the device, against those of the CPU.

use crate::common::{Context, OneView, Test, bending_ball, with_object};
use crate::spheres::{Surroundings, spheres};
use girandole::RendererOptions;
use girandole_core::glam::{DAffine3, DVec3, Vec3};
use girandole_core::illumination::IlluminationSettings;
use girandole_core::lights::LightSettings;
use girandole_core::math::warp;
use girandole_core::scene::builtin::MovingObject;
use girandole_core::scene::{Geometry, MaterialId, NONE, Scene, Transform};
use girandole_core::trace::{Hit, Ray, SceneTracer, ray_offset_distance};

pub fn tests() -> Vec<Test> {
    vec![
        ("rays_meet_what_the_tracer_says", meet_what_the_tracer_says),
        ("rays_meet_what_moved", meet_what_moved),
    ]
}

/// How near to an edge of its triangle a hit has to be where both may disagree.
const NEAR_EDGE: f32 = 1e-4;
/// By how much distances differ at most, as a share; and those of surfaces that lie in one place.
const DISTANCE: f32 = 1e-4;
const SAME_PLACE: f32 = 1e-6;

fn number(i: u32, k: u32) -> f32 {
    let mut x = i.wrapping_mul(0x9e37_79b9) ^ k.wrapping_mul(0x85eb_ca6b);
    for _ in 0..2 {
        x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
        x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    }
    (x ^ (x >> 16)) as f32 / 4_294_967_296.0
}

/// Rays all through the bounds; every other one starts on a surface.
fn random_rays(geometry: &Geometry, count: u32) -> Vec<Ray> {
    let (low, high) = geometry.main_bounds();
    (0..count)
        .map(|i| {
            let n = |k| number(i, k);
            let direction = warp::sphere([n(0), n(1)].into());
            let origin = low + (high - low) * Vec3::new(n(2), n(3), n(4));
            let t_max = if i % 8 == 0 { n(6) * (high - low).length() } else { f32::INFINITY };
            if i % 2 == 0 {
                return Ray { origin, direction, t_max, ignored: NONE };
            }
            let triangle = (n(5) * geometry.triangles.len() as f32) as u32;
            let triangle = triangle.min(geometry.triangles.len() as u32 - 1);
            let (u, v) = (n(2), n(3) * (1.0 - n(2)));
            let (point, normal) = (geometry.point(triangle, [u, v].into()), geometry.normal(triangle));
            let off = normal * ray_offset_distance(geometry, point) * normal.dot(direction).signum();
            Ray { origin: point + off, direction, t_max, ignored: triangle }
        })
        .collect()
}

/// Rays that both answer otherwise, and how many of them not near an edge.
fn disagreements(
    (scene, geometry): (&Scene, &Geometry),
    rays: &[Ray],
    hits: &[Option<Hit>],
) -> (usize, usize) {
    assert_eq!(rays.len(), hits.len());
    let tracer = SceneTracer::new(scene, geometry);
    let is_near_edge = |hit: &Option<Hit>| {
        hit.is_some_and(|hit| {
            let [u, v] = hit.barycentric.to_array();
            u.min(v).min(1.0 - u - v) < NEAR_EDGE
        })
    };
    let (mut all, mut elsewhere) = (0, 0);
    for (ray, found) in rays.iter().zip(hits) {
        let expected = tracer.closest_hit(ray.origin, ray.direction, ray.t_max, ray.ignored);
        let agrees = match (&expected, found) {
            (None, None) => true,
            (Some(a), Some(b)) => {
                // Of two surfaces in one place either will do.
                let is_same = a.triangle == b.triangle && a.barycentric.distance(b.barycentric) <= 1e-2;
                let share = if is_same { DISTANCE } else { SAME_PLACE };
                let grazing = geometry.normal(a.triangle).dot(ray.direction).abs().max(1e-4);
                (a.t - b.t).abs() <= share * a.t + ray_offset_distance(geometry, ray.origin) / grazing
            }
            _ => false,
        };
        all += usize::from(!agrees);
        elsewhere += usize::from(!agrees && !is_near_edge(&expected) && !is_near_edge(found));
    }
    (all, elsewhere)
}

fn traced(
    context: &Context,
    renderer: &mut OneView,
    (scene, geometry): (&Scene, &Geometry),
    rays: &[Ray],
) -> Vec<Option<Hit>> {
    let hits = renderer.closest_hits(scene, geometry, rays).expect("rays");
    context.wait(hits).expect("hits")
}

/// What a renderer answers of the scene that it has opened.
fn compare(
    context: &Context,
    renderer: &mut OneView,
    scene: &Scene,
    rays: u32,
) -> (Vec<Ray>, Vec<Option<Hit>>, usize) {
    let geometry = renderer.illumination().expect("light").geometry().clone();
    let rays = random_rays(&geometry, rays);
    let hits = traced(context, renderer, (scene, &geometry), &rays);
    let (differ, elsewhere) = disagreements((scene, &geometry), &rays, &hits);
    assert_eq!(elsewhere, 0, "{differ}");
    assert!(hits.iter().flatten().count() > rays.len() / 2);
    (rays, hits, differ)
}

fn opened(context: &Context, scene: &Scene) -> OneView {
    let mut renderer = context.renderer(RendererOptions { map_size: Some(16), ..RendererOptions::default() });
    let lights = LightSettings { count: 8, ..LightSettings::default() };
    let settings = IlluminationSettings { lights, visibility: None, ..IlluminationSettings::default() };
    renderer.open(scene, &settings).expect("open");
    renderer
}

fn meet_what_the_tracer_says(context: &Context) {
    let (mut count, mut all) = (0, 0);
    let builtin = |name| with_object(name, MovingObject::Torus);
    let scenes = ["table", "pillars", "living-room"].map(builtin);
    for scene in scenes.into_iter().chain([spheres(Surroundings::Room).0]) {
        let mut renderer = opened(context, &scene);
        let (rays, hits, differ) = compare(context, &mut renderer, &scene, 250_000);
        (count, all) = (count + rays.len(), all + differ);
        // The same bits once more; and what meets anything meets something.
        let geometry = renderer.illumination().expect("light").geometry().clone();
        assert_eq!(traced(context, &mut renderer, (&scene, &geometry), &rays), hits);
        let any = renderer.any_hits(&scene, &geometry, &rays).expect("rays");
        let any = context.wait(any).expect("hits");
        assert_eq!(any.iter().zip(&hits).filter(|(a, b)| a.is_some() != b.is_some()).count(), 0);
    }
    assert!(all <= 10, "{all} of {count}");
}

/// What moves, turns, and bends, is met where it is; the control: where it was it is no more.
fn meet_what_moved(context: &Context) {
    let mut scene = with_object("table", MovingObject::Torus);
    let ball = bending_ball(&mut scene, MaterialId(0), Vec3::new(0.3, 0.4, 0.9));
    let torus = scene.objects.iter().position(|object| object.dynamic).expect("a dynamic object");
    let torus = scene.objects[torus].node;
    scene.take_changes();
    let mut renderer = opened(context, &scene);
    let (rays, mut before, _) = compare(context, &mut renderer, &scene, 20_000);
    for step in 1..4 {
        let turned = DAffine3::from_rotation_y(1.0) * scene.world_from_node(torus);
        let shift = DAffine3::from_translation(DVec3::new(0.1, 0.05, -0.1));
        scene.set_transform(torus, Transform::Affine(shift * turned)).expect("a move");
        scene.set_morph_weights(ball, &[step as f32 * 0.3]).expect("weights");
        let changes = scene.take_changes();
        renderer.update(&scene, &changes).expect("an update");
        let geometry = renderer.illumination().expect("light").geometry().clone();
        let (differ, elsewhere) = disagreements((&scene, &geometry), &rays, &before);
        assert!(elsewhere > 10, "the control: {differ}");
        (_, before, _) = compare(context, &mut renderer, &scene, 20_000);
    }
}
