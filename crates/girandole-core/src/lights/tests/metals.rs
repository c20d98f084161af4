//! Light that leaves shiny surfaces.

use super::*;
use crate::brdf::lobe_albedo;
use crate::scene::builtin::shapes;
use crate::scene::{PunctualKind, PunctualLight};

fn metal(color: Vec3, roughness: f32) -> Material {
    Material { metallic: 1.0, roughness, specular: 1.0, ..Material::diffuse("metal", color) }
}

fn settings(bounces: u32, seed: u32) -> LightSettings {
    LightSettings { count: 64, direct_share: Some(0.0), bounces, seed, candidates: 4, ..Default::default() }
}

/// A hollow sphere about a point light of 1 W/sr.
fn cavity(wall: Material) -> (Scene, Geometry) {
    let mut mesh = shapes::sphere(1.0, 64, 32, MaterialId(0));
    mesh.triangles.iter_mut().for_each(|t| t.vertices.swap(1, 2));
    mesh.normals.iter_mut().for_each(|n| *n = -*n);
    let (mut scene, _) = scene_of(mesh, vec![wall]);
    let node = scene.add_node("lamp", Transform::IDENTITY);
    let kind = PunctualKind::Point;
    scene.lights.push(PunctualLight { name: String::new(), node, kind, intensity: Vec3::ONE });
    let geometry = Geometry::new(&scene);
    (scene, geometry)
}

#[test]
fn a_closed_room_of_white_metal_keeps_all_light_at_every_bounce() {
    let lamp = Material { emission: vec3(3.0, 2.0, 1.0), ..metal(Vec3::ONE, 0.1) };
    let (scene, geometry) = scene_of(closed_box(), vec![lamp, metal(Vec3::ONE, 0.1)]);
    let emitted = DVec3::new(3.0, 2.0, 1.0) * std::f64::consts::PI;
    for bounces in [1, 6] {
        let mean = over_seeds(60, |seed| {
            flux(indirect(&LightSet::sample(&scene, &geometry, &settings(bounces, seed)).unwrap()))
        });
        let expected = emitted * f64::from(bounces);
        assert!(agrees(mean, expected, 0.01), "{bounces}: {mean:?} for {expected}");
        // Negative control: half of a bounce less.
        assert!(!agrees(mean, expected - emitted * 0.5, 0.01), "{bounces}: {mean:?}");
    }
}

#[test]
fn metals_throw_light_of_their_color_by_their_albedo() {
    let gold = vec3(1.0, 0.7, 0.3);
    for roughness in [0.1, 0.5, 1.0] {
        let (scene, geometry) = cavity(metal(gold, roughness));
        let mean = over_seeds(40, |seed| {
            flux(indirect(&LightSet::sample(&scene, &geometry, &settings(1, seed)).unwrap()))
        });
        // Light meets smooth normals head on, and facets nearly so.
        let albedo = lobe_albedo(1.0, gold, 1.0, roughness * roughness).as_dvec3();
        let expected = albedo * 4.0 * std::f64::consts::PI;
        assert!(agrees(mean, expected, 0.01), "{roughness}: {mean:?} for {expected}");
        assert!(
            !agrees(mean, DVec3::new(expected.z, expected.x, expected.y), 0.01),
            "negative control: other colors"
        );
    }
}

#[test]
fn paths_go_on_by_the_lobe() {
    // From the middle of a smooth cavity light comes back to the middle, and goes on to the other side.
    let across = |roughness: f32| {
        let (scene, geometry) = cavity(metal(Vec3::ONE, roughness));
        let settings = LightSettings { direct_share: None, ..settings(2, 3) };
        let (mut count, mut sum) = (0, 0.0);
        let tracer = SceneTracer::new(&scene, &geometry);
        let sampling = complete(Sampling::new(&tracer, &settings, &[]));
        for path in &sampling.indirect.walked.paths {
            if let [first, second] = &path.deposits[..] {
                count += 1;
                sum += first.normal.dot(second.normal);
            }
        }
        assert!(count > 30, "{count}");
        sum / count as f32
    };
    let [smooth, rough] = [across(0.1), across(1.0)];
    assert!(smooth < -0.97 && rough > -0.8, "{smooth} {rough}");
}

#[test]
fn plastic_goes_on_by_either_part_and_holds_what_both_reflect() {
    // A closed room of a dielectric: over many bounces it loses what a single bounce loses in the mean over directions.
    let wall = Material { specular: 1.0, roughness: 0.4, ..Material::diffuse("plastic", Vec3::splat(0.8)) };
    let (scene, geometry) = cavity(wall);
    let reflected = |bounces| {
        over_seeds(40, |seed| {
            flux(indirect(&LightSet::sample(&scene, &geometry, &settings(bounces, seed)).unwrap()))
        })
    };
    let (one, four) = (reflected(1), reflected(4));
    let surface = crate::brdf::Surface::from_metallic_roughness(Vec3::splat(0.8), 0.0, 0.4, 1.0, Vec3::ONE);
    let head_on = lobe_albedo(1.0, surface.f0, 1.0, surface.alpha).x + surface.albedo.x;
    // Diffuse light arrives cosine-weighted from everywhere.
    let steps = 256;
    let specular = |i: i32| {
        let cosine = ((i as f32 + 0.5) / steps as f32).sqrt();
        lobe_albedo(cosine, surface.f0, 1.0, surface.alpha).x
    };
    let mean = (0..steps).map(specular).sum::<f32>() / steps as f32 + surface.albedo.x;
    let [head_on, mean] = [head_on, mean].map(f64::from);
    let emitted = 4.0 * std::f64::consts::PI;
    let after = |first: f64| DVec3::splat(emitted * first * (1.0 + mean + mean * mean + mean.powi(3)));
    assert!(agrees(one, DVec3::splat(emitted * head_on), 0.005), "{one:?}");
    // What was reflected specularly arrives as it did before: a twentieth of a twentieth of the light.
    assert!(agrees(four, after(head_on), 0.015), "{four:?} for {}", after(head_on));
    assert!(!agrees(four, after(f64::from(surface.albedo.x)), 0.015), "negative control");
}
