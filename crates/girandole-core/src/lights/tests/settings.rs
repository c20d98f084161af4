use super::*;
use crate::scene::builtin::{self, MovingObject};

fn message(settings: LightSettings) -> String {
    let (scene, geometry) =
        scene_of(closed_box(), vec![Material::emitter("l", Vec3::ONE), Material::default()]);
    LightSet::sample(&scene, &geometry, &settings).unwrap_err().to_string()
}

#[test]
fn settings_out_of_range_are_refused_with_a_sentence() {
    let d = LightSettings::default();
    assert!(d.validate().is_ok());
    assert!(message(LightSettings { count: 0, ..d }).contains("choose 1 to"));
    assert!(message(LightSettings { count: MAX_LIGHTS + 1, ..d }).contains("choose 1 to"));
    for share in [f32::NAN, -0.1, 1.01, f32::INFINITY] {
        assert!(message(LightSettings { direct_share: Some(share), ..d }).contains("from 0 to 1"));
    }
    assert!(message(LightSettings { bounces: MAX_BOUNCES + 1, ..d }).contains("bounces"));
    assert!(message(LightSettings { candidates: 0, ..d }).contains("candidates"));
}

#[test]
fn counts_are_exact_and_the_split_is_as_asked() {
    let scene = builtin::build("table", MovingObject::Torus).unwrap();
    let geometry = Geometry::new(&scene);
    for count in [1, 2, 8, 33, 300] {
        for share in [0.0, 0.1, 0.25, 1.0] {
            for (bounces, candidates) in [(0, 1), (1, 1), (5, 1), (5, 16)] {
                let settings = LightSettings {
                    count,
                    direct_share: Some(share),
                    bounces,
                    candidates,
                    ..LightSettings::default()
                };
                let set = LightSet::sample(&scene, &geometry, &settings).unwrap();
                let mut direct = (share * count as f32).round() as u32;
                if share > 0.0 {
                    direct = direct.max(1);
                }
                if bounces == 0 {
                    direct = count;
                }
                assert_eq!((set.samples.len() as u32, set.direct), (count, direct), "{settings:?}");
                assert!(set.warnings.is_empty(), "{:?}", set.warnings);
                let finite = |s: &LightSample| s.position.is_finite() && s.intensity.is_finite();
                assert!(set.samples.iter().all(finite));
                assert!(set.samples.iter().all(|s| (s.normal.length() - 1.0).abs() < 1e-5));
            }
        }
    }
}

#[test]
fn scenes_that_reflect_nothing_end_with_a_warning_and_no_light_is_an_error() {
    // A black room: the rest lies on the emitter, all energy is there.
    let (scene, geometry) = scene_of(
        closed_box(),
        vec![Material::emitter("light", Vec3::ONE), Material::diffuse("black", Vec3::ZERO)],
    );
    let set = LightSet::sample(&scene, &geometry, &LightSettings::default()).unwrap();
    assert_eq!((set.samples.len(), set.direct, set.warnings.len()), (300, 300, 1));
    assert!(set.warnings[0].contains("little of it is reflected"), "{}", set.warnings[0]);
    assert!((flux(&set.samples).x - std::f64::consts::PI).abs() < 1e-4);
    // An emitter under an open sky.
    let mut mesh = Mesh::default();
    square(&mut mesh, Vec3::ZERO, 1.0, true, MaterialId(0));
    let (scene, geometry) = scene_of(mesh, vec![Material::emitter("light", Vec3::ONE)]);
    let set = LightSet::sample(&scene, &geometry, &LightSettings::default()).unwrap();
    assert_eq!((set.samples.len(), set.direct, set.warnings.len()), (300, 300, 1));
    // No light at all; a material that would emit but for its black texture.
    let (mut scene, geometry) = scene_of(closed_box(), vec![Material::default(), Material::default()]);
    let error = LightSet::sample(&scene, &geometry, &LightSettings::default()).unwrap_err();
    assert!(error.to_string().contains("the scene has no light"), "{error}");
    // One that has no area.
    let mut mesh = closed_box();
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([Vec3::ZERO, Vec3::X, Vec3::X * 0.5]);
    mesh.normals.extend([Vec3::Y; 3]);
    mesh.triangles.push(crate::scene::MeshTriangle {
        vertices: [first, first + 1, first + 2],
        material: MaterialId(2),
    });
    let materials = vec![Material::default(), Material::default(), Material::emitter("lamp", Vec3::ONE)];
    let (flat, flat_geometry) = scene_of(mesh, materials);
    let error = LightSet::sample(&flat, &flat_geometry, &LightSettings::default()).unwrap_err();
    assert!(error.to_string().contains("has an area"), "{error}");
    // Only a punctual light, in a black room.
    scene.materials[0].base_color = Vec3::ZERO;
    scene.materials[1].base_color = Vec3::ZERO;
    let node = scene.add_node("lamp", Transform::translation(Vec3::splat(0.5)));
    let kind = crate::scene::PunctualKind::Point;
    scene.lights.push(crate::scene::PunctualLight { name: String::new(), node, kind, intensity: Vec3::ONE });
    let set = LightSet::sample(&scene, &geometry, &LightSettings::default()).unwrap();
    assert_eq!((set.samples.len(), set.warnings.len()), (2, 1));
}

/// FNV-1a over the bits of everything in the samples.
fn fingerprint(set: &LightSet) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut add = |x: u32| {
        for byte in x.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    };
    for s in &set.samples {
        for v in [s.position, s.normal, s.intensity] {
            v.to_array().into_iter().for_each(|c| add(c.to_bits()));
        }
        add(s.triangle());
    }
    add(set.direct);
    add(set.paths);
    hash
}

#[test]
fn same_seed_same_bits_on_every_machine() {
    let scene = builtin::build("pillars", MovingObject::Teapot).unwrap();
    let geometry = Geometry::new(&scene);
    let settings = LightSettings { count: 256, direct_share: Some(0.2), seed: 7, ..LightSettings::default() };
    let set = LightSet::sample(&scene, &geometry, &settings).unwrap();
    let other = LightSet::sample(&scene, &geometry, &LightSettings { seed: 8, ..settings }).unwrap();
    assert_ne!(fingerprint(&set), fingerprint(&other));
    // Changes only when the sampling or the room does; then say so in the changelog.
    assert_eq!(fingerprint(&set), 0x3329_32ea_bfdf_5548, "{:#x}", fingerprint(&set));
}

#[cfg(feature = "parallel")]
#[test]
fn the_number_of_threads_does_not_matter() -> std::result::Result<(), rayon::ThreadPoolBuildError> {
    let scene = builtin::build("gap", MovingObject::Torus).unwrap();
    let geometry = Geometry::new(&scene);
    let sample = || LightSet::sample(&scene, &geometry, &LightSettings::default()).unwrap();
    let with = |n: usize| Ok(rayon::ThreadPoolBuilder::new().num_threads(n).build()?.install(sample));
    assert_eq!(with(1)?, with(5)?);
    Ok(())
}

#[test]
fn rectangles_are_as_large_as_what_samples_stand_for() {
    let mean_area = |count: u32, scale: f32| {
        let mut mesh = closed_box();
        mesh.positions.iter_mut().for_each(|p| *p *= scale);
        let (scene, geometry) = scene_of(mesh, vec![Material::emitter("l", Vec3::ONE), Material::default()]);
        let settings = LightSettings { count, ..LightSettings::default() };
        let set = LightSet::sample(&scene, &geometry, &settings).unwrap();
        for s in set.samples() {
            let area = s.rectangle.unwrap().area();
            assert!(area > 0.0 && area.is_finite(), "{s:?}");
            let corner = s.position + s.normal * (0.01 * area.sqrt());
            let at = |clamp| s.geometric_factor(corner, -s.normal, -s.normal, clamp).map_or(0.0, |(g, _)| g);
            assert!(at(Clamp::Own) <= 1.001 * std::f32::consts::PI / area, "{} {area}", at(Clamp::Own));
            assert!(at(Clamp::Off) > 100.0 * at(Clamp::Own) && at(Clamp::At(2.0)) == 2.0);
        }
        let stands_for = |s: &LightSample| {
            s.rectangle.map(|r| r.area() / if s.is_spread() { SPREAD * SPREAD } else { 1.0 })
        };
        set.samples().iter().filter_map(stands_for).sum::<f32>() / count as f32
    };
    let one = mean_area(200, 1.0);
    // Together the samples stand for about the surface of the box, 6 m², whatever their number.
    assert!((3.0..9.0).contains(&(one * 200.0)), "{}", one * 200.0);
    let fourfold = mean_area(800, 1.0) * 4.0 / one;
    assert!((fourfold - 1.0).abs() < 0.2, "{fourfold}");
    assert!((mean_area(200, 2.0) / one / 4.0 - 1.0).abs() < 1e-3);
    // Punctual lights are points.
    let (mut scene, _) = scene_of(closed_box(), vec![Material::default(), Material::default()]);
    let node = scene.add_node("lamp", Transform::translation(Vec3::splat(0.5)));
    let kind = crate::scene::PunctualKind::Point;
    scene.lights.push(crate::scene::PunctualLight { name: String::new(), node, kind, intensity: Vec3::ONE });
    let set = LightSet::sample(&scene, &Geometry::new(&scene), &LightSettings::default()).unwrap();
    assert!(set.samples()[..2].iter().all(|s| s.rectangle.is_none()));
}
