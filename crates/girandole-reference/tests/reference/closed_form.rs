//! Scenes with a closed-form solution.

use crate::common::{Stage, assert_constant, look, trace};
use girandole_core::glam::{DVec3, Vec3};
use girandole_core::scene::{
    ColorSpace, Filter, Geometry, Material, MaterialId, Mesh, MeshTriangle, PunctualKind, Texture,
    TextureRef, Wrap,
};
use girandole_reference::PathSettings;
use std::f32::consts::PI;

const RED: Vec3 = Vec3::new(0.8, 0.5, 0.2);
const GLOW: Vec3 = Vec3::new(0.5, 2.0, 1.0);

fn settings(paths: u32, bounces: Option<u32>) -> PathSettings {
    PathSettings { paths, bounces, seed: 1 }
}

/// The unit sphere, seen from inside; its triangles' own normals, or the sphere's.
fn sphere(material: MaterialId, smooth: bool) -> Mesh {
    let (rings, segments) = (64, 128);
    let mut mesh = Mesh::default();
    let point = |ring: u32, segment: u32| {
        let (theta, phi) = (PI * ring as f32 / rings as f32, 2.0 * PI * segment as f32 / segments as f32);
        Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    for (ring, segment) in (0..rings).flat_map(|r| (0..segments).map(move |s| (r, s))) {
        let (a, b) = (point(ring, segment), point(ring, segment + 1));
        let (c, d) = (point(ring + 1, segment), point(ring + 1, segment + 1));
        for corners in [[a, c, d], [a, d, b]] {
            let flat = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            if flat.length() > 1e-9 {
                let inwards =
                    if flat.dot(corners[0]) < 0.0 { corners } else { [corners[0], corners[2], corners[1]] };
                let first = mesh.positions.len() as u32;
                mesh.positions.extend(inwards);
                let flat = -flat * flat.dot(corners[0]).signum();
                mesh.normals.extend(inwards.map(|p| if smooth { -p } else { flat.normalize() }));
                mesh.triangles.push(MeshTriangle { vertices: [first, first + 1, first + 2], material });
            }
        }
    }
    mesh
}

#[test]
fn furnace() {
    for round in [false, true] {
        let mut stage = Stage::default();
        let glowing = Material { emission: GLOW, ..Material::diffuse("", RED) };
        let material = stage.material(glowing);
        if round {
            let mesh = sphere(material, false);
            stage.mesh(mesh);
        } else {
            stage.room(Vec3::new(-1.0, -2.0, -1.5), Vec3::new(2.0, 1.0, 3.0), material);
            let mut mesh = Mesh::default();
            mesh.add_box(Vec3::new(0.4, -0.5, 1.0), Vec3::new(0.9, 0.5, 1.4), material);
            stage.mesh(mesh);
        }
        let geometry = stage.geometry();
        let view = look(Vec3::new(0.1, 0.2, -0.3), Vec3::new(0.2, 0.1, 1.0), 0.9);
        for bounces in [Some(0), Some(1), Some(4), None] {
            let estimate = trace(&stage.scene, &geometry, &view, 16, settings(64, bounces));
            let power = |n: u32| Vec3::new(RED.x.powi(n as i32), RED.y.powi(n as i32), RED.z.powi(n as i32));
            let rest = bounces.map_or(Vec3::ZERO, |b| power(b + 2));
            let expected = GLOW * (Vec3::ONE - rest) / (Vec3::ONE - RED);
            assert_constant(&estimate, expected, &format!("furnace, round {round}, bounces {bounces:?}"));
        }
    }
}

#[test]
fn point_light_in_a_sphere() {
    let mut stage = Stage::default();
    let material = stage.material(Material::diffuse("", RED));
    let mesh = sphere(material, true);
    stage.mesh(mesh);
    stage.punctual(PunctualKind::Point, Vec3::new(3.0, 2.0, 1.0), Vec3::ZERO, Vec3::Z);
    let geometry = stage.geometry();
    let view = look(Vec3::new(0.1, -0.2, 0.3), Vec3::new(1.0, 0.5, 0.4), 1.0);
    let direct = RED / PI * Vec3::new(3.0, 2.0, 1.0);
    // Facets lie within the sphere: up to 1 − cos²(ring's half) cos²(segment's half) nearer, squared.
    let slack = 1.0 - ((PI / 128.0).cos() * (PI / 128.0).cos()).powi(2);
    for bounces in [Some(0), Some(2), None] {
        let estimate = trace(&stage.scene, &geometry, &view, 16, settings(200, bounces));
        let series = |albedo: f32| {
            let rest = bounces.map_or(0.0, |b| albedo.powi(b as i32 + 1));
            (1.0 - rest) / (1.0 - albedo)
        };
        let expected = direct * Vec3::from(RED.to_array().map(series));
        let found = estimate.mean.mean();
        let variance: DVec3 = estimate.variance.pixels.iter().map(|v| v.as_dvec3()).sum();
        let noise = (variance.as_vec3() / 65536.0).map(f32::sqrt);
        let error = (found - expected).abs();
        let bound = expected * slack + 4.0 * noise;
        assert!(error.cmplt(bound).all(), "{bounces:?}: {found} for {expected}, noise {noise}");
        // Negative control: three per cent more are told apart.
        assert!((found - expected * 1.03).abs().cmpgt(bound).all());
        if bounces == Some(0) {
            for pixel in &estimate.mean.pixels {
                assert!(((*pixel / expected) - 1.0).abs().max_element() < slack, "{pixel} for {expected}");
            }
        }
    }
}

#[test]
fn parallel_plates() {
    let mut stage = Stage::default();
    let grey = stage.material(Material::diffuse("", RED));
    let lamp = stage.material(Material { emission: GLOW, ..Material::diffuse("", Vec3::splat(0.4)) });
    let side = 1000.0;
    stage.quad(Vec3::new(-side, 0.0, -side), Vec3::Z * 2.0 * side, Vec3::X * 2.0 * side, grey);
    stage.quad(Vec3::new(-side, 1.0, -side), Vec3::X * 2.0 * side, Vec3::Z * 2.0 * side, lamp);
    let geometry = stage.geometry();
    let down = look(Vec3::new(0.0, 0.5, 0.0), Vec3::new(0.1, 0.0, 0.0), 0.5);
    let up = look(Vec3::new(0.0, 0.5, 0.0), Vec3::new(0.1, 1.0, 0.0), 0.5);
    let both = RED * 0.4;
    let limited = trace(&stage.scene, &geometry, &down, 16, settings(400, Some(0)));
    assert_constant(&limited, RED * GLOW, "plates, direct");
    let limited = trace(&stage.scene, &geometry, &down, 16, settings(400, Some(2)));
    assert_constant(&limited, RED * GLOW * (Vec3::ONE + both), "plates, two bounces");
    let all = trace(&stage.scene, &geometry, &down, 16, settings(400, None));
    assert_constant(&all, RED * GLOW / (Vec3::ONE - both), "plates, below");
    let all = trace(&stage.scene, &geometry, &up, 16, settings(400, None));
    assert_constant(&all, GLOW / (Vec3::ONE - both), "plates, above");
}

/// Irradiance of a polygon of unit radiance (Lambert 1760): the mean of its edges' angles, projected.
fn polygon_irradiance(corners: &[Vec3], point: Vec3, normal: Vec3) -> f32 {
    let to: Vec<DVec3> = corners.iter().map(|c| (*c - point).as_dvec3().normalize()).collect();
    let sum: f64 = (0..to.len())
        .map(|i| {
            let (a, b) = (to[i], to[(i + 1) % to.len()]);
            a.cross(b).normalize().dot(normal.as_dvec3()) * a.dot(b).clamp(-1.0, 1.0).acos()
        })
        .sum();
    (sum.abs() * 0.5) as f32
}

/// A floor and a wall that is perpendicular to it, under a rectangular lamp that faces down and is `lamp`.
fn under_a_rectangle(lamp: Material, texture: Option<Texture>, corners: [Vec3; 4], factor: f32) {
    let mut stage = Stage::default();
    let grey = stage.material(Material::diffuse("", Vec3::splat(0.6)));
    stage.scene.textures.extend(texture);
    let lamp = stage.material(lamp);
    stage.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, grey);
    stage.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Y * 8.0, Vec3::Z * 8.0, grey);
    // Texture coordinates run from 0 to 1 along X.
    stage.quad(Vec3::new(-1.0, 2.0, -0.5), Vec3::X * 2.0, Vec3::Z, lamp);
    let geometry = stage.geometry();
    for (point, normal) in [
        (Vec3::new(0.3, 0.0, 0.2), Vec3::Y),
        (Vec3::new(2.0, 0.0, -1.5), Vec3::Y),
        (Vec3::new(-4.0, 0.7, 0.4), Vec3::X),
    ] {
        let view = look(point + normal + Vec3::new(0.3, 0.2, 0.1), point, 1e-4);
        let estimate = trace(&stage.scene, &geometry, &view, 16, settings(1000, Some(0)));
        let irradiance = polygon_irradiance(&corners, point, normal);
        assert!(irradiance > 0.01);
        assert_constant(&estimate, Vec3::splat(0.6 / PI * 3.0 * factor * irradiance), "rectangle");
    }
}

const LAMP: [Vec3; 4] = [
    Vec3::new(-1.0, 2.0, -0.5),
    Vec3::new(1.0, 2.0, -0.5),
    Vec3::new(1.0, 2.0, 0.5),
    Vec3::new(-1.0, 2.0, 0.5),
];

#[test]
fn rectangular_light() {
    under_a_rectangle(Material::emitter("", Vec3::splat(3.0)), None, LAMP, 1.0);
}

#[test]
fn textured_and_masked_lights() {
    let halves = |texels| Texture {
        name: String::new(),
        width: 2,
        height: 1,
        texels,
        color_space: ColorSpace::Srgb,
        wrap: [Wrap::Clamp; 2],
        filter: Filter::Nearest,
    };
    let mut half = LAMP;
    (half[0].x, half[3].x) = (0.0, 0.0);
    // The half at small X is black.
    let lamp =
        Material { emission_texture: Some(TextureRef::new(0)), ..Material::emitter("", Vec3::splat(3.0)) };
    under_a_rectangle(lamp, Some(halves(vec![[0, 0, 0, 255], [255; 4]])), half, 1.0);
    // It is cut out.
    let lamp = Material {
        base_color_texture: Some(TextureRef::new(0)),
        alpha_cutoff: Some(0.5),
        ..Material::emitter("", Vec3::splat(3.0))
    };
    under_a_rectangle(lamp, Some(halves(vec![[0; 4], [0, 0, 0, 255]])), half, 1.0);
}

/// Direct light of `light` on a floor at the origin, seen from an angle; `blocker` may be in the way.
fn floor_under(light: impl Fn(&mut Stage), blocker: impl Fn(&mut Stage)) -> (Vec3, Vec3) {
    let mut stage = Stage::default();
    let grey = stage.material(Material::diffuse("", Vec3::splat(PI / 4.0)));
    stage.quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, grey);
    light(&mut stage);
    blocker(&mut stage);
    let geometry: Geometry = stage.geometry();
    let view = look(Vec3::new(3.0, 1.0, 0.0), Vec3::ZERO, 1e-4);
    let estimate = trace(&stage.scene, &geometry, &view, 8, settings(64, Some(0)));
    (estimate.mean.mean() * 4.0, estimate.variance.mean().map(|v| 4.0 * (v / 64.0).sqrt()))
}

#[test]
fn punctual_lights() {
    let nothing = |_: &mut Stage| ();
    let intensity = Vec3::new(8.0, 4.0, 2.0);
    let at =
        |kind, from: Vec3, towards: Vec3| move |s: &mut Stage| s.punctual(kind, intensity, from, towards);
    let near = |found: (Vec3, Vec3), expected: Vec3| {
        assert!((found.0 - expected).abs().max_element() < 1e-4, "{found:?} for {expected}");
    };
    let above = Vec3::new(0.0, 2.0, 0.0);
    near(floor_under(at(PunctualKind::Point, above, Vec3::ZERO), nothing), intensity / 4.0);
    let aside = Vec3::new(0.0, 2.0, 2.0);
    near(floor_under(at(PunctualKind::Point, aside, Vec3::ZERO), nothing), intensity / 8.0 * 0.5f32.sqrt());
    near(floor_under(at(PunctualKind::Directional, aside, Vec3::ZERO), nothing), intensity * 0.5f32.sqrt());
    // A spot whose axis passes the point at 45°: inside of its inner angle, between, outside of its outer.
    let spot = |inner: f32, outer: f32| {
        let kind = PunctualKind::Spot { inner: inner.to_radians(), outer: outer.to_radians() };
        floor_under(at(kind, above, Vec3::new(2.0, 0.0, 0.0)), nothing).0
    };
    near((spot(50.0, 60.0), Vec3::ZERO), intensity / 4.0);
    near((spot(20.0, 40.0), Vec3::ZERO), Vec3::ZERO);
    let (full, zero) = (30f32.to_radians().cos(), 60f32.to_radians().cos());
    let falloff = ((0.5f32.sqrt() - zero) / (full - zero)).powi(2);
    near((spot(30.0, 60.0), Vec3::ZERO), intensity / 4.0 * falloff);
    // Of many lights some are drawn.
    let many = |s: &mut Stage| {
        for i in 0..20 {
            s.punctual(PunctualKind::Point, intensity * (i % 3) as f32, above, Vec3::ZERO);
        }
    };
    let (found, noise) = floor_under(many, nothing);
    let expected = intensity / 4.0 * 19.0;
    assert!((found - expected).abs().cmplt(4.0 * noise).all(), "{found} ± {noise} for {expected}");
    assert!((found - expected * 1.1).abs().cmpgt(4.0 * noise).all());
}

#[test]
fn sides_of_surfaces() {
    let nothing = |_: &mut Stage| ();
    let emitter = |double_sided: bool, down: bool| {
        move |stage: &mut Stage| {
            let lamp = Material { double_sided, ..Material::emitter("", Vec3::ONE) };
            let lamp = stage.material(lamp);
            let (u, v) = if down { (Vec3::X, Vec3::Z) } else { (Vec3::Z, Vec3::X) };
            stage.quad(Vec3::new(-0.5, 1.0, -0.5), u, v, lamp);
        }
    };
    // An emitter shines from its front only, unless it is double-sided.
    let (front, noise) = floor_under(emitter(false, true), nothing);
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, z)| Vec3::new(x, 1.0, z));
    let expected = polygon_irradiance(&corners, Vec3::ZERO, Vec3::Y);
    assert!((front - expected).abs().cmplt(4.0 * noise).all(), "{front} ± {noise} for {expected}");
    assert_eq!(floor_under(emitter(false, false), nothing).0, Vec3::ZERO);
    for down in [false, true] {
        let (both, noise) = floor_under(emitter(true, down), nothing);
        assert!((both - expected).abs().cmplt(4.0 * noise).all(), "{both} ± {noise}");
    }
    // A single-sided surface blocks whichever way it faces.
    for down in [false, true] {
        let screen = move |stage: &mut Stage| {
            let black = stage.material(Material::diffuse("", Vec3::ZERO));
            let (u, v) = if down { (Vec3::X, Vec3::Z) } else { (Vec3::Z, Vec3::X) };
            stage.quad(Vec3::new(-1.5, 0.3, -1.5), u * 3.0, v * 3.0, black);
        };
        let sun = |s: &mut Stage| s.punctual(PunctualKind::Directional, Vec3::ONE, Vec3::Y, Vec3::ZERO);
        let point = |s: &mut Stage| s.punctual(PunctualKind::Point, Vec3::ONE, Vec3::Y, Vec3::ZERO);
        assert_eq!(floor_under(emitter(false, true), screen).0, Vec3::ZERO);
        assert_eq!(floor_under(sun, screen).0, Vec3::ZERO);
        assert_eq!(floor_under(point, screen).0, Vec3::ZERO);
        assert!(floor_under(sun, nothing).0.x > 0.9);
    }
}
