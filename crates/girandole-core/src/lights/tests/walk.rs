use super::*;
use crate::lights::guide::Guides;
use crate::scene::builtin::shapes;
use crate::scene::{PunctualKind, PunctualLight};

const BOTH: [Termination; 2] = [Termination::Throughput, Termination::Albedo];

fn indirect_only(count: u32, bounces: u32, termination: Termination, seed: u32) -> LightSettings {
    LightSettings {
        count,
        direct_share: Some(0.0),
        bounces,
        termination,
        seed,
        candidates: 1,
        ..LightSettings::default()
    }
}

fn box_with(rho: Vec3) -> (Scene, Geometry) {
    let mut light = Material::emitter("light", vec3(3.0, 2.0, 1.0));
    light.base_color = rho;
    scene_of(closed_box(), vec![light, Material::diffuse("wall", rho)])
}

/// In a closed room of one albedo, bounce b carries Φ·ρᵇ.
fn expected_in_box(rho: Vec3, bounces: u32) -> DVec3 {
    let rho = rho.as_dvec3();
    let (mut left, mut sum) = (DVec3::new(3.0, 2.0, 1.0) * std::f64::consts::PI, DVec3::ZERO);
    for _ in 0..bounces {
        left *= rho;
        sum += left;
    }
    sum
}

#[test]
fn a_closed_room_holds_the_geometric_series_of_light() {
    for (rho, count, seeds) in [
        (Vec3::splat(0.7), 8, 600),
        (vec3(0.8, 0.4, 0.2), 8, 600),
        (Vec3::splat(0.5), 100, 200),
        (vec3(0.2, 0.9, 0.6), 2, 600),
    ] {
        let (scene, geometry) = box_with(rho);
        for termination in BOTH {
            for bounces in [1, 5] {
                let run = |seed| {
                    let settings = indirect_only(count, bounces, termination, seed);
                    LightSet::sample(&scene, &geometry, &settings).unwrap()
                };
                let mean = over_seeds(seeds, |seed| flux(indirect(&run(seed))));
                let expected = expected_in_box(rho, bounces);
                assert!(
                    agrees(mean, expected, 0.0),
                    "{rho} {termination:?} {bounces}: {mean:?} for {expected}"
                );
                // Negative control: divided by the number of deposits instead of paths.
                let emissions = Emissions::of(&scene);
                let trees = emitters::trees(&emitters::groups(&scene, &geometry, &emissions), &[]);
                let power =
                    |pilot: &[LightSample]| -> Vec<f64> { pilot.iter().map(importance::power).collect() };
                let tracer = SceneTracer::new(&scene, &geometry);
                let wrong = over_seeds(100, |seed| {
                    let settings = indirect_only(count, bounces, termination, seed);
                    let paths = Walk {
                        tracer: &tracer,
                        world_from_nodes: &scene.world_from_nodes(),
                        emissions: &emissions,
                        emitters: &trees,
                        guides: &Guides::default(),
                        settings: &settings,
                        seed,
                    };
                    let pilot = complete(Pilot::new(&paths, [count, 1]));
                    let counts = pilot.counts(&power(&pilot.deposits));
                    let left = complete(walk(&paths, &pilot, counts));
                    let deposits: Vec<LightSample> =
                        left.paths.into_iter().flat_map(|path| path.deposits).collect();
                    flux(&deposits) / deposits.len() as f64
                });
                let same = termination == Termination::Throughput && bounces == 1;
                assert!(same || !agrees(wrong, expected, 0.0), "negative control: {wrong:?}");
            }
        }
    }
}

/// A sphere from the inside with a hole: what leaves any of its points lands evenly all over it.
fn sphere_with_hole(rho: f32) -> (Scene, Geometry, f64) {
    let mut mesh = shapes::sphere(1.0, 48, 24, MaterialId(1));
    mesh.triangles.iter_mut().for_each(|t| t.vertices.swap(1, 2));
    mesh.normals.iter_mut().for_each(|n| *n = -*n);
    let height = |t: &crate::scene::MeshTriangle| {
        t.vertices.iter().map(|&v| mesh.positions[v as usize].y).fold(f32::MIN, f32::max)
    };
    let kept: Vec<_> = mesh.triangles.iter().filter(|t| height(t) < 0.4).copied().collect();
    mesh.triangles = kept;
    for t in &mut mesh.triangles {
        let low = t.vertices.iter().all(|&v| mesh.positions[v as usize].y < -0.9);
        t.material = MaterialId(u32::from(!low));
    }
    let mut light = Material::emitter("light", vec3(3.0, 2.0, 1.0));
    light.base_color = Vec3::splat(rho);
    let (scene, geometry) = scene_of(mesh, vec![light, Material::diffuse("wall", Vec3::splat(rho))]);
    let area: f64 = (0..geometry.triangles.len() as u32).map(|t| f64::from(geometry.area(t))).sum();
    (scene, geometry, area / (4.0 * std::f64::consts::PI))
}

#[test]
fn a_half_open_cavity_loses_the_same_share_at_every_bounce() {
    let rho = 0.8;
    let (scene, geometry, closed) = sphere_with_hole(rho);
    assert!((0.6..0.75).contains(&closed));
    let emitted: DVec3 = (0..geometry.triangles.len() as u32)
        .map(|t| geometry.emission(&scene, t, glam::Vec2::ZERO).as_dvec3() * f64::from(geometry.area(t)))
        .sum::<DVec3>()
        * std::f64::consts::PI;
    let factor = f64::from(rho) * closed;
    for termination in BOTH {
        for (count, candidates, seeds) in [(8, 1, 150), (64, 4, 60)] {
            let sets: Vec<LightSet> = (0..seeds)
                .map(|seed| {
                    let settings = LightSettings { candidates, ..indirect_only(count, 5, termination, seed) };
                    LightSet::sample(&scene, &geometry, &settings).unwrap()
                })
                .collect();
            let mut weight = 0.0;
            for last in 1..=5 {
                weight += factor.powi(last as i32);
                let upto = |s: &&LightSample| matches!(s.origin, SampleOrigin::Bounce { bounce, .. } if bounce <= last);
                let mean = over_seeds(seeds, |seed| flux(indirect(&sets[seed as usize]).iter().filter(upto)));
                // Facets make the sphere a little less than round.
                let expected = emitted * weight;
                assert!(
                    agrees(mean, expected, 0.01),
                    "{termination:?} {count} {last}: {mean:?} for {expected}"
                );
                assert!(!agrees(mean, expected * 1.5, 0.01), "negative control: {mean:?} for {expected}");
            }
        }
    }
}

#[test]
fn two_plates_exchange_what_their_form_factor_says() {
    // Unit squares one unit apart: F = 0.19982 (Howell's catalogue, C-11).
    let mut mesh = Mesh::default();
    square(&mut mesh, Vec3::ZERO, 1.0, true, MaterialId(0));
    square(&mut mesh, Vec3::Y, 1.0, false, MaterialId(1));
    let materials = vec![Material::emitter("light", Vec3::ONE), Material::diffuse("plate", Vec3::splat(0.5))];
    let (scene, geometry) = scene_of(mesh, materials);
    let expected = DVec3::splat(std::f64::consts::PI * 0.19982 * 0.5);
    for termination in BOTH {
        let mean = over_seeds(500, |seed| {
            let set = LightSet::sample(&scene, &geometry, &indirect_only(16, 1, termination, seed)).unwrap();
            assert_eq!(set.samples.len(), 16);
            flux(&set.samples)
        });
        assert!(agrees(mean, expected, 2e-4), "{mean:?} for {expected}");
        assert!(!agrees(mean, expected * 1.05, 0.0), "negative control");
    }
}

#[test]
fn punctual_lights_start_paths_with_their_own_flux() {
    let rho = 0.6;
    let lit = |kind: PunctualKind, at: Vec3, to: Vec3, mesh: Mesh, bounces| {
        let wall = Material::diffuse("wall", Vec3::splat(rho));
        let (mut scene, _) = scene_of(mesh, vec![wall.clone(), wall]);
        let node = scene.add_node("lamp", Transform::looking_at(at, to));
        let intensity = vec3(3.0, 2.0, 1.0);
        scene.lights.push(PunctualLight { name: String::new(), node, kind, intensity });
        let geometry = Geometry::new(&scene);
        over_seeds(300, |seed| {
            let settings = indirect_only(34, bounces, Termination::Albedo, seed);
            flux(indirect(&LightSet::sample(&scene, &geometry, &settings).unwrap()))
        })
    };
    let rho = f64::from(rho);
    let color = DVec3::new(3.0, 2.0, 1.0);
    let pi = std::f64::consts::PI;
    let centre = Vec3::splat(0.5);
    // In a closed room all of a point's 4πI, or a spot's share of it, arrives.
    let series = rho + rho * rho;
    let mean = lit(PunctualKind::Point, centre, Vec3::ZERO, closed_box(), 2);
    assert!(agrees(mean, color * 4.0 * pi * series, 0.0), "{mean:?}");
    assert!(!agrees(mean, color * 3.8 * pi * series, 0.0), "negative control");
    let (inner, outer) = (0.4_f32, 0.9_f32);
    let (ci, co) = (f64::from(inner).cos(), f64::from(outer).cos());
    let solid_angle = 2.0 * pi * (1.0 - ci + (ci - co) / 3.0);
    let mean = lit(PunctualKind::Spot { inner, outer }, centre, Vec3::ZERO, closed_box(), 2);
    assert!(agrees(mean, color * solid_angle * series, 0.0), "{mean:?}");
    assert!(!agrees(mean, color * 2.0 * pi * (1.0 - co) * series, 0.0), "negative control");
    // The sun at 60° from the zenith on a plate of 4 m²: half its irradiance.
    let mut plate = Mesh::default();
    square(&mut plate, Vec3::ZERO, 2.0, true, MaterialId(0));
    let from = vec3(3.0_f32.sqrt(), 1.0, 0.0);
    let mean = lit(PunctualKind::Directional, from, Vec3::ZERO, plate, 1);
    assert!(agrees(mean, color * 4.0 * 0.5 * rho, 0.0), "{mean:?}");
    assert!(!agrees(mean, color * 4.0 * 0.55 * rho, 0.0), "negative control");
}

#[test]
fn choosing_among_deposits_changes_no_expected_light() {
    // Coloured deposits of uneven strength at random places: half of them on two walls, the others anywhere.
    let deposits: Vec<LightSample> = (0..500)
        .map(|i| {
            let s = |d| sequence::sample(i, d, 42);
            let (on_wall, normal) = match i % 4 {
                0 => (vec3(1.0, 1.0, 0.0), Vec3::Z),
                1 => (vec3(1.0, 0.0, 1.0), Vec3::Y),
                _ => (Vec3::ONE, crate::math::warp::sphere(glam::Vec2::new(s(3), s(4)))),
            };
            LightSample {
                position: vec3(s(0), s(1), s(2)) * 4.0 * on_wall,
                normal,
                intensity: vec3(0.5 * s(5), 1.0, s(7) * s(7)) * s(6),
                profile: Profile::Cosine,
                origin: SampleOrigin::Bounce { path: i, bounce: 1, triangle: 0 },
                rectangle: None,
            }
        })
        .collect();
    // A probe: light through a soft window. Samples have the mean colour of what they stand for, which leaves all the light
    // there is in each channel, but where it is only for the power.
    let window = |s: &LightSample| f64::from(s.position.x * s.position.y + s.normal.z.max(0.0));
    let probe = |samples: &[LightSample]| -> DVec3 {
        let power = samples.iter().map(|s| importance::power(s) * window(s)).sum();
        let [red, blue] = [0, 2].map(|c| samples.iter().map(|s| f64::from(s.intensity[c])).sum());
        DVec3::new(power, red, blue)
    };
    let choose = |deposits: &[LightSample], count, seed| {
        let weights: Vec<f64> = deposits.iter().map(importance::power).collect();
        let sources = vec![Emission::Material(MaterialId(0)); deposits.len()];
        let candidates = Candidates {
            samples: deposits,
            sources: &sources,
            weights: &weights,
            is_guided: false,
            tracer: None,
        };
        resample(candidates, (count, &importance::Importance::uniform()), 0.7, seed)
            .0
            .into_iter()
            .map(|c| c.sample)
            .collect::<Vec<_>>()
    };
    let expected = probe(&deposits);
    for count in [1, 7, 60, 500] {
        let mean = over_seeds(1500, |seed| {
            let chosen = choose(&deposits, count, seed);
            assert_eq!(chosen.len() as u32, count);
            // Each time all the power, by the weights.
            let total: f64 = deposits.iter().map(importance::power).sum();
            let power: f64 = chosen.iter().map(importance::power).sum();
            assert!((power / total - 1.0).abs() < 1e-4, "{power} of {total}");
            probe(&chosen)
        });
        assert!(agrees(mean, expected, 0.0), "{count}: {mean:?} for {expected}");
        if count > 1 {
            assert!(!agrees(mean, expected * 1.1, 0.0), "negative control");
        }
    }
    // And it spreads them: less variance than choosing at random.
    let spread = over_seeds(300, |seed| probe(&choose(&deposits, 60, seed))).1;
    let random = over_seeds(300, |seed| {
        let pick = |i| {
            let at = sequence::hash(seed * 60 + i) % 500;
            let s = deposits[at as usize];
            LightSample { intensity: s.intensity * (500.0 / 60.0), ..s }
        };
        probe(&(0..60).map(pick).collect::<Vec<_>>())
    })
    .1;
    assert!(spread.x < random.x * 0.5, "{spread} against {random}");
}

#[test]
fn samples_lie_on_surfaces_that_reflect_and_face_away_from_them() {
    let scene = crate::scene::builtin::build("block", crate::scene::builtin::MovingObject::Teapot).unwrap();
    let geometry = Geometry::new(&scene);
    let settings = LightSettings { count: 2000, ..LightSettings::default() };
    let set = LightSet::sample(&scene, &geometry, &settings).unwrap();
    let offset = crate::trace::ray_offset_distance(&geometry, Vec3::ZERO);
    let mut bounces = [0; 6];
    for s in indirect(&set) {
        let SampleOrigin::Bounce { path, bounce, triangle } = s.origin else { panic!("{:?}", s.origin) };
        assert!(path < set.paths);
        bounces[bounce as usize] += 1;
        let [a, ..] = geometry.corners(triangle);
        let height = (s.position - a).dot(geometry.normal(triangle));
        assert!((height - offset).abs() < offset * 0.3, "{height} {offset}");
        assert!((s.normal - geometry.normal(triangle)).length() < 1e-6, "single-sided: from the front");
        let material = &scene.materials[geometry.triangles[triangle as usize].material];
        assert!(material.base_color.max_element() > 0.0);
    }
    assert!(bounces[0] == 0 && (1..5).all(|b| bounces[b] > bounces[b + 1]), "{bounces:?}");
}

#[test]
fn a_walk_that_ignores_moving_objects_is_that_of_the_scene_without_them() {
    use crate::scene::builtin::{MovingObject, build};
    let sample = |object, walk_dynamic| {
        let scene = build("table", object).unwrap();
        let geometry = Geometry::new(&scene);
        let settings = LightSettings { walk_dynamic, ..LightSettings::default() };
        LightSet::sample(&scene, &geometry, &settings).unwrap()
    };
    let without = sample(MovingObject::None, true);
    assert_eq!(sample(MovingObject::Torus, false), without);
    assert_ne!(sample(MovingObject::Torus, true), without, "negative control");
}

#[test]
fn smooth_normals_do_not_change_the_light_that_a_surface_reflects_on_average() {
    // A coarse sphere around a lamp, once flat and once with smooth normals: bent normals move light between its
    // facets, but what a closed grey cavity holds after one bounce stays within a few percent.
    let reflected = |smooth: bool| {
        let mut mesh = shapes::sphere(1.0, 12, 6, MaterialId(0));
        mesh.triangles.iter_mut().for_each(|t| t.vertices.swap(1, 2));
        mesh.normals.iter_mut().for_each(|n| *n = -*n);
        if !smooth {
            mesh.normals.iter_mut().for_each(|n| *n = Vec3::ZERO);
        }
        let (mut scene, _) = scene_of(mesh, vec![Material::diffuse("wall", Vec3::splat(0.5))]);
        let node = scene.add_node("lamp", Transform::IDENTITY);
        let kind = PunctualKind::Point;
        scene.lights.push(PunctualLight { name: String::new(), node, kind, intensity: Vec3::ONE });
        let geometry = Geometry::new(&scene);
        over_seeds(60, |seed| {
            let settings = indirect_only(200, 1, Termination::Albedo, seed);
            flux(indirect(&LightSet::sample(&scene, &geometry, &settings).unwrap()))
        })
    };
    let flat = reflected(false);
    assert!(agrees(flat, DVec3::splat(4.0 * std::f64::consts::PI * 0.5), 0.0), "{flat:?}");
    let smooth = reflected(true);
    assert!((smooth.0.x / flat.0.x - 1.0).abs() < 0.1, "{smooth:?} {flat:?}");
    // The lamp sits at the centre, so a smooth normal meets every ray head-on: brighter than flat.
    assert!(smooth.0.x > flat.0.x * 1.01, "the bend counts: {smooth:?} {flat:?}");
}
