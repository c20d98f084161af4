use super::*;
use crate::lights::emission::Emissions;
use crate::lights::tests::{agrees, flux, over_seeds};
use crate::lights::view_points::{POINTS, view_points};
use crate::lights::walk::Walk;
use crate::lights::{LightSample, direct, emitters};
use crate::scene::{Material, Mesh, Scene, Sky, Transform, View};
use crate::slices::complete;
use glam::vec3;

/// Brighter above, and to one side.
pub(in crate::lights) fn sky() -> Environment {
    let pixel = |i: u32| vec3(1.2 - (i / 32) as f32 / 16.0, 0.8, (i % 32) as f32 / 32.0);
    let map = crate::image::Image { width: 32, height: 16, pixels: (0..32 * 16).map(pixel).collect() };
    Environment::new(map).expect("an environment")
}

/// A room open through a window in its wall towards −X, beside a large closed block, and a view of it.
pub(in crate::lights) fn room(environment: Environment) -> (Scene, View) {
    let mut scene = Scene::default();
    scene.environment = Some(environment);
    let white = scene.add_material(Material::diffuse("", Vec3::splat(0.7)));
    let boxes = [
        (vec3(-2.0, -0.2, -2.0), vec3(2.0, 0.0, 2.0)),
        (vec3(-2.0, 2.5, -2.0), vec3(2.0, 2.7, 2.0)),
        (vec3(1.8, 0.0, -2.0), vec3(2.0, 2.5, 2.0)),
        (vec3(-2.0, 0.0, -2.0), vec3(1.8, 2.5, -1.8)),
        (vec3(-2.0, 0.0, 1.8), vec3(1.8, 2.5, 2.0)),
        (vec3(-2.0, 0.0, -1.8), vec3(-1.8, 1.0, 1.8)),
        (vec3(-2.0, 1.8, -1.8), vec3(-1.8, 2.5, 1.8)),
        (vec3(-2.0, 1.0, -1.8), vec3(-1.8, 1.8, -0.5)),
        (vec3(-2.0, 1.0, 0.5), vec3(-1.8, 1.8, 1.8)),
        (vec3(-2.0, -0.2, 2.0), vec3(2.0, 2.7, 9.0)),
    ];
    for (low, high) in boxes {
        let mut mesh = Mesh::default();
        mesh.add_box(low, high, white);
        scene.add_object("", mesh, Transform::IDENTITY);
    }
    let view = View {
        eye: DVec3::new(1.5, 1.5, 1.5),
        right: Vec3::X,
        up: Vec3::Y,
        forward: Vec3::NEG_Z,
        half_extent: Vec2::ONE,
        center: Vec2::ZERO,
        orthographic: false,
        depth: None,
        clip: Default::default(),
    };
    (scene, view)
}

/// What is known of a scene, with a guide for what a view sees and none.
fn with_guides(
    environment: Environment,
    check: impl Fn(&SceneTracer, &[Vec<Source>], &[SourceTree], [&Guides; 2]),
) {
    let (scene, view) = room(environment);
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let groups = emitters::groups(&scene, &geometry, &Emissions::of(&scene));
    let trees = emitters::trees(&groups, &[]);
    let points = view_points(&tracer, &[view], POINTS);
    let guides = complete(Guides::new(&tracer, &LightSettings::default(), &points, &groups, &trees));
    assert!(guides.directions.len() == 1 && guides.starts.len() == trees.len());
    check(&tracer, &groups, &trees, [&guides, &Guides::default()]);
}

#[test]
fn densities_are_those_of_the_points_that_they_warp() {
    // Near a corner, and along an edge.
    let point = |i: u32| {
        let [x, y, z] = [0, 1, 2].map(|d| f64::from(sequence::sample(i, d, 5)));
        if i.is_multiple_of(3) { ([0.1 * x, 0.2 * y, z], 1.0) } else { ([0.7 + 0.1 * x * y, y, 0.5], 2.0) }
    };
    let density = Density::<3>::new(1, |_| (0..2000).map(point).collect()).expect("points");
    assert!(Density::<3>::new(1, |_| vec![([0.5; 3], 0.0)]).is_none());
    let count = 1 << 14;
    let (mut volume, mut moment, mut undivided, mut inside) = (0.0, 0.0, 0.0, 0);
    for i in 0..count {
        let at = std::array::from_fn(|d| f64::from(sequence::sample(i, d as u32, 7)));
        let (at, density) = density.warp(at);
        assert!(density >= 0.2 - 1e-9 && at.iter().all(|x| (0.0..1.0).contains(x)));
        let f = at[0] * at[0] + at[1] * at[2];
        volume += 1.0 / density / f64::from(count);
        moment += f / density / f64::from(count);
        undivided += f / f64::from(count);
        inside += u32::from((0.7..0.8).contains(&at[0]) && (0.4..0.6).contains(&at[2]));
    }
    let exact = 1.0 / 3.0 + 0.25;
    assert!((volume - 1.0).abs() < 0.01 && (moment / exact - 1.0).abs() < 0.01, "{volume} {moment}");
    // Most points are in this fiftieth of the cube, and a third of those that are warped.
    assert!(inside > count / 3, "{inside}");
    assert!((undivided / exact - 1.0).abs() > 0.05, "negative control: {undivided}");
}

#[test]
fn directions_and_discs_are_found_where_numbers_choose_them() {
    with_guides(sky(), |tracer, _, trees, _| {
        let environment = tracer.scene().environment.as_ref().expect("a sky");
        let square = Square::new(&trees[0], environment);
        for i in 0..2000 {
            let at = DVec2::new(f64::from(sequence::sample(i, 0, 3)), f64::from(sequence::sample(i, 1, 3)));
            let (source, within) = trees[0].choose(at);
            let direction = environment.cell_direction(source.cell().expect("of the sky"), within);
            let (found, weight) = square.place(direction, 1.0).expect("a cell");
            let away = DVec2::from_array(found).distance(at);
            // Across the border of a cell rounding leads anywhere.
            let is_inside = within.min_element().min(1.0 - within.max_element()) > 1e-3;
            assert!(weight > 0.0 && (away < 1e-4 || !is_inside), "{at} {found:?}");
        }
    });
}

#[test]
fn rays_pass_through_the_window() {
    with_guides(sky(), |tracer, _, _, [guides, _]| {
        let (center, radius) = guides.starts[&0].disc;
        let window = vec3(-1.9, 1.4, 0.0) - tracer.geometry().origin.as_vec3();
        assert!(center.distance(window) < 0.5, "{center} for {window}");
        let corners = [tracer.geometry().bounds.0, tracer.geometry().bounds.1];
        assert!(corners.iter().all(|corner| corner.distance(center) <= radius * 1.0001));
    });
}

/// What these paths bring to the room's inner surfaces, each, over 40 seeds.
fn mean_inside(
    (tracer, trees, guides): (&SceneTracer, &[SourceTree], &Guides),
    paths: Vec<u32>,
) -> (DVec3, DVec3) {
    let (scene, geometry) = (tracer.scene(), tracer.geometry());
    let is_inside = |deposit: &&LightSample| {
        let at = (deposit.position.as_dvec3() + geometry.origin).as_vec3();
        at.abs().max_element() < 2.6 && at.x.abs() < 1.85 && at.z.abs() < 1.85 && (-0.1..2.6).contains(&at.y)
    };
    over_seeds(40, |seed| {
        let walk = Walk {
            tracer,
            world_from_nodes: &scene.world_from_nodes(),
            emissions: &Emissions::of(scene),
            emitters: trees,
            guides,
            settings: &LightSettings { bounces: 3, ..LightSettings::default() },
            seed,
        };
        let walked = complete(walk.paths(paths.clone()));
        let inside = walked.iter().flat_map(|path| &path.deposits).filter(is_inside);
        flux(inside) / paths.len() as f64
    })
}

#[test]
fn guided_light_is_that_of_plain_sampling_in_the_mean() {
    with_guides(sky(), |tracer, groups, trees, guides| {
        let mean = |guides: &Guides, count: u32| mean_inside((tracer, trees, guides), (0..count).collect());
        let (guided, plain) = (mean(guides[0], 512), mean(guides[1], 16384));
        let both = (guided.0, (guided.1 * guided.1 + plain.1 * plain.1).map(f64::sqrt));
        assert!(agrees(both, plain.0, 0.0), "{guided:?} for {plain:?}");
        assert!(guided.1.cmplt(plain.1).all(), "{guided:?} has no less noise than {plain:?}");
        assert!(!agrees(both, plain.0 * 1.3, 0.0), "negative control: {both:?}");

        let (scene, geometry, emissions) = (tracer.scene(), tracer.geometry(), Emissions::of(tracer.scene()));
        // On the window's sill, all light of a quarter of the sky.
        let [guided, plain] = guides.map(|guides| {
            over_seeds(100, |seed| {
                let samples =
                    direct::area((scene, geometry), &emissions, (groups, guides), &[1.0], 64, seed).concat();
                let from_window = samples.iter().filter(|s| s.normal.x > 0.7 && s.normal.y < 0.0);
                from_window.map(|s| s.intensity.as_dvec3()).sum()
            })
        });
        let both = (guided.0, (guided.1 * guided.1 + plain.1 * plain.1).map(f64::sqrt));
        assert!(agrees(both, plain.0, 0.0), "{guided:?} for {plain:?}");
        assert!(!agrees(both, plain.0 * 1.2, 0.0), "negative control: {both:?}");
    });
}

#[test]
fn sunlight_that_is_guided_is_that_of_plain_sampling_in_the_mean() {
    let before_window = Sky { azimuth: 4.4, elevation: 0.6, ..Sky::default() };
    with_guides(Environment::sky(&before_window).expect("a sky"), |tracer, groups, trees, guides| {
        assert!(trees.len() == 2 && groups[1].iter().all(Source::is_sun));
        let of_sun = |count: u32| (0..count).map(|path| 2 * path + 1).collect();
        let guided = mean_inside((tracer, trees, guides[0]), of_sun(512));
        let plain = mean_inside((tracer, trees, guides[1]), of_sun(16384));
        let both = (guided.0, (guided.1 * guided.1 + plain.1 * plain.1).map(f64::sqrt));
        assert!(agrees(both, plain.0, 0.0), "{guided:?} for {plain:?}");
        assert!(guided.1.cmplt(plain.1).all(), "{guided:?} has no less noise than {plain:?}");
        assert!(!agrees(both, plain.0 * 1.3, 0.0), "negative control: {both:?}");
    });
}
