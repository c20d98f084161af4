use super::*;
use crate::scene::{ColorSpace, Filter, PunctualKind, PunctualLight, TextureRef, Wrap};
use glam::DVec2;

fn direct_only(count: u32, seed: u32) -> LightSettings {
    LightSettings { count, direct_share: Some(1.0), bounces: 0, seed, ..LightSettings::default() }
}

#[test]
fn a_quad_gives_even_samples_of_its_radiance_times_area_over_n() {
    let mut mesh = Mesh::default();
    square(&mut mesh, vec3(3.0, 2.0, -1.0), 2.0, false, MaterialId(0));
    let (scene, geometry) = scene_of(mesh, vec![Material::emitter("light", vec3(5.0, 3.0, 1.0))]);
    let set = LightSet::sample(&scene, &geometry, &direct_only(64, 3)).unwrap();
    assert_eq!((set.samples.len(), set.direct, set.paths), (64, 64, 0));
    let expected = vec3(5.0, 3.0, 1.0) * 4.0 / 64.0;
    let mut strata = [0; 64];
    for s in &set.samples {
        assert!((s.intensity - expected).length() < 1e-5, "{}", s.intensity);
        assert!((s.normal - Vec3::NEG_Y).length() < 1e-6);
        assert!(s.position.y < 0.0 && s.position.y > -1e-3, "lifted off the surface: {}", s.position);
        let cell = ((s.position + 1.0) * 4.0).floor().as_ivec3();
        strata[(cell.x * 8 + cell.z) as usize] += 1;
        assert!(matches!(s.origin, SampleOrigin::Emitter { triangle, .. } if triangle < 2));
    }
    assert!(strata.iter().all(|&n| n == 1), "each of 8×8 cells has one sample: {strata:?}");
}

#[test]
fn no_emitter_loses_energy_however_small_its_share() {
    let mut mesh = Mesh::default();
    for (i, (size, material)) in [(2.0, 0), (0.1, 1), (1.0, 1)].into_iter().enumerate() {
        square(&mut mesh, vec3(3.0 * i as f32, 0.0, 0.0), size, true, material.into());
    }
    let mut scene = Scene::default();
    scene.add_material(Material::emitter("a", Vec3::new(9.0, 1.0, 1.0)));
    scene.add_material(Material::emitter("b", Vec3::new(0.0, 0.1, 0.0)));
    // Three objects, so three emitters.
    for patch in &mesh.patches {
        let corners: Vec<Vec3> = patch.outline.iter().map(|&v| mesh.positions[v as usize]).collect();
        let mut one = Mesh::default();
        one.add_polygon(&corners, mesh.triangles[patch.triangles.start as usize].material);
        scene.add_object("emitter", one, Transform::IDENTITY);
    }
    let geometry = Geometry::new(&scene);
    let pi = std::f64::consts::PI;
    for count in [3, 4, 7, 100] {
        let set = LightSet::sample(&scene, &geometry, &direct_only(count, 1)).unwrap();
        assert_eq!(set.samples.len() as u32, count);
        for (object, expected) in
            [(0, DVec3::new(9., 1., 1.) * 4.0), (1, DVec3::Y * 0.001), (2, DVec3::Y * 0.1)]
        {
            let on = |s: &&LightSample| geometry.triangles[s.triangle() as usize].object == object;
            let f = flux(set.samples.iter().filter(on)) / pi;
            assert!((f - expected).length() < 1e-5 * expected.length(), "{count} {object}: {f}");
        }
    }
    // Fewer samples than emitters: right on average, and total power still the same each time.
    let total = DVec3::new(36.0, 4.0 + 0.101, 4.0) * pi;
    let mean = over_seeds(4000, |seed| {
        flux(&LightSet::sample(&scene, &geometry, &direct_only(2, seed)).unwrap().samples)
    });
    assert!(agrees(mean, total, 0.0), "{mean:?} against {total}");
    assert!(!agrees(mean, total * 1.03, 0.0), "negative control");
}

/// An 8×8 texture: bright upper left quarter (alpha 1), one bright texel at the lower right, holes by alpha.
fn texture(alpha: impl Fn(u32, u32) -> u8) -> Texture {
    let texel = |i: u32| {
        let (x, y) = (i % 8, i / 8);
        let bright = if x < 4 && y < 4 { 255 } else { 0 };
        let green = if (x, y) == (6, 6) { 255 } else { bright / 2 };
        [bright, green, bright / 4, alpha(x, y)]
    };
    Texture {
        name: String::new(),
        width: 8,
        height: 8,
        texels: (0..64).map(texel).collect(),
        color_space: ColorSpace::Linear,
        wrap: [Wrap::Clamp; 2],
        filter: Filter::Nearest,
    }
}

#[test]
fn textured_and_masked_emitters_keep_their_power_and_black_points_get_no_samples() {
    for masked in [false, true] {
        let mut mesh = Mesh::default();
        square(&mut mesh, Vec3::ZERO, 1.0, true, MaterialId(0));
        let mut material = Material::emitter("screen", Vec3::splat(4.0));
        material.emission_texture = Some(TextureRef::new(0));
        if masked {
            material.alpha_cutoff = Some(0.5);
            material.base_color_texture = Some(TextureRef::new(0));
        }
        let (mut scene, _) = scene_of(mesh, vec![material]);
        // Masked: the left column of the bright quarter is cut out.
        scene.textures.push(texture(|x, _| if x == 0 { 0 } else { 255 }));
        let geometry = Geometry::new(&scene);
        let texel = 4.0 / 64.0;
        let lit = if masked { 12.0 } else { 16.0 };
        let expected = DVec3::new(lit, lit * 127.0 / 255.0 + 1.0, lit * 63.0 / 255.0) * texel;
        let mean = over_seeds(400, |seed| {
            let set = LightSet::sample(&scene, &geometry, &direct_only(16, seed)).unwrap();
            assert_eq!(set.samples.len(), 16);
            assert!(set.samples.iter().all(|s| s.intensity.max_element() > 0.0));
            flux(&set.samples) / std::f64::consts::PI
        });
        assert!(agrees(mean, expected, 0.0), "{mean:?} against {expected}");
        // Negative controls: as if the mask or the lone texel had been forgotten.
        assert!(!agrees(mean, expected * (lit + 1.0) / lit, 0.0));
        assert!(!agrees(mean, expected - DVec3::Y * texel, 0.0));
    }
}

#[test]
fn a_double_sided_emitter_emits_from_both_sides() {
    let mut mesh = Mesh::default();
    square(&mut mesh, Vec3::ZERO, 1.0, true, MaterialId(0));
    let mut material = Material::emitter("sheet", Vec3::ONE);
    material.double_sided = true;
    let (scene, geometry) = scene_of(mesh, vec![material]);
    let set = LightSet::sample(&scene, &geometry, &direct_only(10, 0)).unwrap();
    let up = set.samples.iter().filter(|s| s.normal.y > 0.0);
    assert!(up.clone().all(|s| s.position.y > 0.0));
    assert!((flux(up).x - std::f64::consts::PI).abs() < 1e-5);
    assert!((flux(&set.samples).x - 2.0 * std::f64::consts::PI).abs() < 1e-5);
}

#[test]
fn a_mesh_of_many_triangles_is_covered_evenly() {
    let sphere = crate::scene::builtin::shapes::sphere(1.0, 32, 16, MaterialId(0));
    let (scene, geometry) = scene_of(sphere, vec![Material::emitter("lamp", Vec3::ONE)]);
    let area: f64 = (0..geometry.triangles.len() as u32).map(|t| f64::from(geometry.area(t))).sum();
    let set = LightSet::sample(&scene, &geometry, &direct_only(256, 5)).unwrap();
    assert!((flux(&set.samples).x / std::f64::consts::PI - area).abs() < 1e-4 * area);
    // Better spread than plain random points: the mean position is nearer to the centre than √(1/256).
    let mean = set.samples.iter().map(|s| s.position.as_dvec3()).sum::<DVec3>() / 256.0;
    assert!(mean.length() < 0.25 / 16.0, "{mean}");
}

#[test]
fn punctual_lights_come_first_and_keep_their_profiles() {
    let mut mesh = Mesh::default();
    square(&mut mesh, Vec3::ZERO, 4.0, true, MaterialId(0));
    square(&mut mesh, Vec3::Y * 2.0, 1.0, false, MaterialId(1));
    let (mut scene, _) = scene_of(mesh, vec![Material::default(), Material::emitter("light", Vec3::ONE)]);
    let node = scene.add_node("lamp", Transform::looking_at(vec3(0.5, 1.0, 0.0), vec3(0.5, 0.0, 0.0)));
    for kind in [
        PunctualKind::Point,
        PunctualKind::Spot { inner: 0.3, outer: 0.6 },
        PunctualKind::Directional,
        PunctualKind::Point,
    ] {
        scene.lights.push(PunctualLight { name: String::new(), node, kind, intensity: Vec3::splat(2.0) });
    }
    scene.lights[3].intensity = Vec3::ZERO;
    let geometry = Geometry::new(&scene);
    let settings = LightSettings { count: 40, direct_share: Some(0.25), ..LightSettings::default() };
    let set = LightSet::sample(&scene, &geometry, &settings).unwrap();
    assert_eq!((set.samples.len(), set.direct), (40, 10));
    let kinds: Vec<Profile> = set.samples.iter().map(|s| s.profile).collect();
    assert_eq!(kinds[..2], [Profile::Hemisphere; 2]);
    assert_eq!(set.samples[0].normal, -set.samples[1].normal);
    assert!(matches!(kinds[2], Profile::Spot { .. }) && kinds[3] == Profile::Directional);
    assert!(kinds[4..].iter().all(|&k| k == Profile::Cosine));
    assert!((set.samples[2].normal - Vec3::NEG_Y).length() < 1e-6);
    let at = vec3(0.5, 1.0, 0.0) - geometry.origin.as_vec3();
    assert!((set.samples[2].position - at).length() < 1e-6);
    // The directional sample shines from outside of the bounds.
    let (low, high) = geometry.bounds;
    let p = set.samples[3].position;
    assert!(p.cmplt(low).any() || p.cmpgt(high).any());
    // The spot's profile: full inside, half the ramp squared between, none outside.
    if let Profile::Spot { scale, offset } = kinds[2] {
        let profile = |angle: f32| (libm::cosf(angle) * scale + offset).clamp(0.0, 1.0).powi(2);
        assert!((profile(0.29) - 1.0).abs() < 1e-4 && profile(0.61) < 1e-4);
        let middle = libm::acosf((libm::cosf(0.3) + libm::cosf(0.6)) * 0.5);
        assert!((profile(middle) - 0.25).abs() < 1e-4);
    }
    // Fewer samples than there are lights.
    let few = LightSettings { count: 2, ..settings };
    let set = LightSet::sample(&scene, &geometry, &few).unwrap();
    assert_eq!((set.samples.len(), set.warnings.len()), (2, 1), "{:?}", set.warnings);
}

#[test]
fn a_spots_cone_integrates_and_samples_its_profile() {
    for (inner, outer) in [(0.3_f32, 0.6_f32), (0.0, 1.2), (0.5, std::f32::consts::FRAC_PI_2), (0.2, 0.2)] {
        let cone = punctual::SpotCone::new(inner, outer);
        let n = 100_000;
        let (mut integral, mut mean) = (0.0, 0.0);
        for i in 0..n {
            let c = (f64::from(i) + 0.5) / f64::from(n);
            let x = ((c - cone.cos_outer) / (cone.cos_inner - cone.cos_outer)).clamp(0.0, 1.0);
            integral += x * x;
            mean += x * x * c;
        }
        let numeric = integral * 2.0 * std::f64::consts::PI / f64::from(n);
        assert!((cone.solid_angle() / numeric - 1.0).abs() < 1e-3, "{} {numeric}", cone.solid_angle());
        let sampled: f64 =
            (0..1000).map(|i| cone.cosine((f64::from(i) + 0.5) / 1000.0)).sum::<f64>() / 1000.0;
        assert!((sampled - mean / integral).abs() < 1e-4, "{sampled} {}", mean / integral);
        // Negative control: uniform over the cone is something else.
        let uniform = (1.0 + cone.cos_outer) * 0.5;
        assert!((uniform - mean / integral).abs() > 1e-3 || outer - inner < 0.1);
    }
}

#[test]
fn a_tree_chooses_in_proportion_and_stays_uniform() {
    let mut mesh = Mesh::default();
    for (i, size) in [1.0_f32, 2.0, 0.5, 0.25, 1.5].into_iter().enumerate() {
        square(&mut mesh, vec3(i as f32 * 3.0, 0.0, 0.0), size, true, MaterialId(0));
    }
    let (scene, geometry) = scene_of(mesh, vec![Material::emitter("light", Vec3::ONE)]);
    let tree =
        source_tree::SourceTree::new(emitters::groups(&scene, &geometry, &Emissions::of(&scene)).concat())
            .unwrap();
    let n = 256;
    let mut counts = std::collections::BTreeMap::new();
    let mut rest = DVec2::ZERO;
    for i in 0..n * n {
        let at = DVec2::new(f64::from(i % n) + 0.5, f64::from(i / n) + 0.5) / f64::from(n);
        let (source, left) = tree.choose(at);
        *counts.entry((tree.probability(source) * 1e9) as u64).or_insert(0.0) += 1.0 / f64::from(n * n);
        rest += left / f64::from(n * n);
    }
    assert_eq!(counts.len(), 5);
    for (p, share) in counts {
        assert!((share - p as f64 * 1e-9).abs() < 0.006, "{share} against {p}e-9");
    }
    assert!((rest - 0.5).length() < 0.01, "{rest}");
}
