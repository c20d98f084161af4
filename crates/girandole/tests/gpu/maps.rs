//! Shadow maps against rays in double precision, and against themselves: drawn in parts, in batches, alone and among others.

use crate::common::{Context, Test, lamp, room};
use girandole::{MapUpdates, RendererOptions, ShadowMap};
use girandole_core::glam::{DMat3, DVec3, Quat, Vec3};
use girandole_core::lights::{LightSample, LightSet, Profile, SampleOrigin};
use girandole_core::math::{sequence, warp};
use girandole_core::scene::builtin::shapes;
use girandole_core::scene::{Geometry, LightId, Material, Mesh, Scene, Transform};

pub fn tests() -> Vec<Test> {
    vec![
        ("texels_are_what_rays_through_their_centres_find", rays),
        ("no_triangle_is_lost_of_a_mover_of_200_000", many_triangles),
        ("no_triangle_is_lost_where_more_are_large_than_lists_hold", sheets),
        ("maps_larger_than_what_is_drawn_at_once_have_no_seams", bands),
        ("maps_are_the_same_alone_and_in_batches", batches),
    ]
}

/// Texels across.
const SIZE: u32 = 32;

/// A number of 0 to 1, and a vector of −1 to 1.
fn number(case: u32, what: u32) -> f32 {
    sequence::hash(case ^ sequence::hash(what)) as f32 / u32::MAX as f32
}

fn vector(case: u32, what: u32) -> Vec3 {
    Vec3::from([0, 1, 2].map(|axis| number(case, 3 * what + axis) * 2.0 - 1.0))
}

fn light(position: Vec3, normal: Vec3, profile: Profile) -> LightSample {
    let origin = SampleOrigin::Punctual { light: LightId(0) };
    LightSample { position, normal, intensity: Vec3::ONE, profile, origin, rectangle: None }
}

/// A closed room with triangles of all sizes in it, slivers among them, and in every second one a torus that may move.
fn stage(case: u32) -> (Scene, Geometry) {
    let mut scene = Scene::default();
    let gray = scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
    room(&mut scene, Vec3::new(4.0, 3.0, 5.0), gray, None);
    let mut clutter = Mesh::default();
    for triangle in 0..20 {
        let at = vector(case, 100 + triangle) * Vec3::new(1.9, 1.4, 2.4) + Vec3::Y * 1.5;
        let extent = 2f32.powf(-6.0 * number(case, 900 + triangle));
        let thin = if triangle % 4 == 0 { 0.02 } else { 1.0 };
        let [a, b] = [200, 300].map(|what| vector(case, what + triangle) * extent);
        clutter.add_polygon(&[at, at + a, at + a * 0.5 + b * thin], gray);
    }
    scene.add_object("clutter", clutter, Transform::IDENTITY);
    if case.is_multiple_of(2) {
        let at = vector(case, 50) * Vec3::new(1.2, 0.8, 1.7) + Vec3::Y * 1.5;
        let turned = Quat::from_axis_angle(vector(case, 51).normalize(), case as f32);
        scene.add_object("torus", shapes::torus(0.4, 0.15, 8, 6, gray), Transform::rigid(turned, at));
        scene.objects.last_mut().expect("it was added").dynamic = case.is_multiple_of(4);
    }
    let geometry = Geometry::new(&scene);
    (scene, geometry)
}

/// Lights in such a room; some look along axes or lie in planes of walls, some are suns.
fn lights(case: u32, geometry: &Geometry) -> LightSet {
    let of = |index: u32| {
        let case = sequence::hash(case * 64 + index);
        let mut normal = vector(case, 1).normalize();
        if index.is_multiple_of(5) {
            let axis = [Vec3::X, Vec3::Y, Vec3::Z][(index / 5 % 3) as usize];
            normal = if index.is_multiple_of(2) { axis } else { -axis };
        }
        let position =
            vector(case, 2) * Vec3::new(1.95, 1.45, 2.45) + Vec3::Y * 1.5 - geometry.origin.as_vec3();
        light(position, normal, if index % 9 == 8 { Profile::Directional } else { Profile::Cosine })
    };
    LightSet::from_samples(geometry, (0..64).map(of).collect())
}

/// A light's map as the renderer has it: where it is, and its axes.
struct View {
    position: DVec3,
    axes: DMat3,
    is_parallel: bool,
    size: i64,
}

impl View {
    fn new(index: usize, sample: &LightSample, radius: f32) -> Self {
        let is_parallel = sample.profile.is_parallel();
        let turn = (index as f64 * 0.618_033_988_75).fract() as f32 * std::f32::consts::TAU;
        let (x, y) = warp::frame(sample.normal);
        let tangent = x * turn.cos() + y * turn.sin();
        let bitangent = sample.normal.cross(tangent);
        let (across, deep) = if is_parallel { (1.0 / radius, 0.5 / radius) } else { (1.0, 1.0) };
        let axes = [tangent * across, bitangent * across, sample.normal * deep].map(|axis| axis.as_dvec3());
        Self {
            position: if is_parallel { -sample.normal * radius } else { sample.position }.as_dvec3(),
            axes: DMat3::from_cols(axes[0], axes[1], axes[2]).transpose(),
            is_parallel,
            size: i64::from(if is_parallel { 4 * SIZE } else { SIZE }),
        }
    }

    /// The direction of a texel's centre times the map's size, and what it changes by from one column and row to the next; nothing
    /// where a cube has no such texel.
    fn direction(&self, shape: ShadowMap, x: i64, y: i64) -> Option<[DVec3; 3]> {
        let s = self.size;
        let whole = |x: i64, y: i64, z: i64| DVec3::new(x as f64, y as f64, z as f64);
        if self.is_parallel {
            return Some([whole(2 * x + 1 - s, 2 * y + 1 - s, s), DVec3::X * 2.0, DVec3::Y * 2.0]);
        }
        if shape == ShadowMap::Cube {
            let [u, v] = [4 * x + 2 - 2 * s, 4 * y + 2 - 2 * s];
            return match (u.abs() <= s, v.abs() <= s) {
                (true, true) => Some([whole(u, v, s), DVec3::X * 4.0, DVec3::Y * 4.0]),
                (false, true) => Some([
                    whole(u.signum() * s, v, 2 * s - u.abs()),
                    whole(0, 0, -4 * u.signum()),
                    DVec3::Y * 4.0,
                ]),
                (true, false) => Some([
                    whole(u, v.signum() * s, 2 * s - v.abs()),
                    DVec3::X * 4.0,
                    whole(0, 0, -4 * v.signum()),
                ]),
                _ => None,
            };
        }
        let [u, v] = [x + y + 1 - s, x - y];
        let [a, b] = [u, v].map(|q| if q < 0 { -1 } else { 1 });
        Some([whole(u, v, s - u.abs() - v.abs()), whole(1, 1, -a - b), whole(1, -1, b - a)])
    }
}

/// Texels of a map that are not what rays find: off by more than 1e-5 · max(1, 1/|cos θ|) of what is there, but within 1e-4 texel of an
/// edge.
fn wrong(
    view: &View,
    shape: ShadowMap,
    triangles: &[[DVec3; 3]],
    map: impl Iterator<Item = (i64, f32)>,
) -> (usize, usize) {
    // Corners, as homogeneous ones with depths where rays are parallel.
    struct Seen {
        edges: [DVec3; 3],
        normal: DVec3,
        /// Depth by direction.
        plane: DVec3,
    }
    let seen = |corners: &[DVec3; 3]| {
        let local = corners.map(|corner| view.axes * (corner - view.position));
        if local.iter().all(|p| p.z <= 0.0) && !view.is_parallel {
            return None;
        }
        let [p, q, r] = if view.is_parallel { local.map(|p| p.truncate().extend(1.0)) } else { local };
        let volume = p.dot(q.cross(r));
        let plane = if view.is_parallel {
            let depths = local.map(|p| 1.0 - p.z);
            (q.cross(r) * depths[0] + r.cross(p) * depths[1] + p.cross(q) * depths[2]) / volume
        } else {
            (q - p).cross(r - p) * 1e-6 / volume
        };
        let edges = [p.cross(q), q.cross(r), r.cross(p)].map(|edge| edge * volume.signum());
        let normal = (local[1] - local[0]).cross(local[2] - local[0]).normalize();
        (volume != 0.0).then_some(Seen { edges, normal, plane: plane / view.size as f64 })
    };
    let seen: Vec<Seen> = triangles.iter().filter_map(seen).collect();
    let (mut wrong, mut holes) = (0, 0);
    for (at, stored) in map {
        let Some([d, by_column, by_row]) = view.direction(shape, at % view.size, at / view.size) else {
            continue;
        };
        let (mut least, mut is_found, mut is_inside) = (0.0, stored == 0.0, false);
        for triangle in &seen {
            let distance = triangle
                .edges
                .map(|edge| edge.dot(d) / edge.dot(by_column).hypot(edge.dot(by_row)).max(f64::MIN_POSITIVE));
            let distance = distance.into_iter().fold(f64::INFINITY, f64::min);
            if distance < -1e-4 {
                continue;
            }
            let depth = triangle.plane.dot(d).min(1.0);
            let ray = if view.is_parallel { DVec3::Z } else { d.normalize() };
            let cosine = triangle.normal.dot(ray).abs().max(1e-9);
            let off = 1e-5 * (1.0 / cosine) * if view.is_parallel { 1.0 } else { depth };
            is_found |= (f64::from(stored) - depth).abs() <= off;
            if distance > 1e-4 {
                is_inside = true;
                least = f64::max(least, depth - off);
            }
        }
        wrong += usize::from(!is_found || f64::from(stored) < least);
        holes += usize::from(is_inside && stored == 0.0);
    }
    (wrong, holes)
}

fn rays(context: &Context) {
    for shape in [ShadowMap::Octahedral, ShadowMap::Cube] {
        let (mut of_others, mut texels) = (0, 0);
        for case in 0..32 {
            let (scene, geometry) = stage(case);
            let set = lights(case, &geometry);
            let options = RendererOptions {
                shadow_map: shape,
                map_size: Some(SIZE),
                skip_non_blockers: false,
                ..Default::default()
            };
            let mut renderer = context.renderer(options);
            renderer.load(&scene, &geometry, &set).expect("load");
            renderer.draw_shadow_maps(&MapUpdates::default()).expect("maps");
            let triangles = corners(&geometry);
            let radius = geometry.radius();
            let read = |index| context.wait(renderer.shadow_map(index)).expect("a map");
            let maps: Vec<Vec<f32>> = (0..set.len()).map(read).collect();
            let check = |index: usize| {
                let view = View::new(index, &set.samples()[index], radius);
                let all = || (0..).zip(maps[index].iter().copied());
                let found = wrong(&view, shape, &triangles, all());
                assert!(found == (0, 0), "{shape:?}, case {case}, light {index}: {found:?} wrong, holes");
                // The control: a millimetre beside.
                let position = view.position + DVec3::splat(1e-3);
                let other = View { position, ..view };
                if index.is_multiple_of(16) { wrong(&other, shape, &triangles, all()).0 } else { 0 }
            };
            let half = set.len() / 2;
            of_others += std::thread::scope(|scope| {
                let second = scope.spawn(|| (half..set.len()).map(check).sum::<usize>());
                (0..half).map(check).sum::<usize>() + second.join().expect("all maps are right")
            });
            texels += maps.iter().step_by(16).map(Vec::len).sum::<usize>();
        }
        assert!(of_others * 2 > texels, "{shape:?}: {of_others} of {texels}");
    }
}

fn many_triangles(context: &Context) {
    let mut scene = Scene::default();
    let gray = scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
    room(&mut scene, Vec3::new(4.0, 3.0, 5.0), gray, None);
    lamp(&mut scene, 0.3, 20.0, Quat::IDENTITY, Vec3::new(0.3, 2.9, 0.2));
    let at = Vec3::new(0.2, 1.2, -0.3);
    scene.add_object("torus", shapes::torus(0.5, 0.2, 500, 200, gray), Transform::translation(at));
    let torus = scene.objects.last_mut().expect("it was added");
    torus.dynamic = true;
    let node = torus.node;
    scene.take_changes();
    let geometry = Geometry::new(&scene);
    let origin = geometry.origin.as_vec3();
    // From afar; from so near that all triangles at hand are large; and from within.
    let places = [
        (Vec3::new(-1.7, 2.6, 1.9), 1.0),
        (at + Vec3::new(0.0, 0.201, -0.5), 1.0),
        (at + Vec3::new(0.7003, 0.0, 0.0), 1.0),
        (at + Vec3::new(0.0, 0.0, 0.5), 1.0),
    ];
    let towards = |place: Vec3| (at - place).normalize_or(Vec3::Y);
    let samples = places.map(|(place, _)| light(place - origin, towards(place), Profile::Cosine)).to_vec();
    let set = LightSet::from_samples(&geometry, samples.clone());
    let options = RendererOptions { map_size: Some(256), skip_non_blockers: false, ..Default::default() };
    let maps = |geometry: &Geometry, scene: &Scene| {
        let mut renderer = context.renderer(options);
        let set = LightSet::from_samples(geometry, samples.clone());
        renderer.load(scene, geometry, &set).expect("load");
        renderer.draw_shadow_maps(&MapUpdates::default()).expect("maps");
        (0..set.len())
            .map(|index| context.wait(renderer.shadow_map(index)).expect("a map"))
            .collect::<Vec<_>>()
    };
    let drawn = maps(&geometry, &scene);
    let triangles = corners(&geometry);
    assert!(triangles.len() > 200_000);
    for (index, sample) in set.samples().iter().enumerate() {
        let view = View { size: 256, ..View::new(index, sample, geometry.radius()) };
        // Every 37th column and 31st row.
        let at = (0..256).step_by(37).flat_map(|x| (0..256).step_by(31).map(move |y| y * 256 + x));
        let map = at.map(|at| (at, drawn[index][at as usize]));
        let found = wrong(&view, ShadowMap::Octahedral, &triangles, map.clone());
        assert!(found == (0, 0), "light {index}: {found:?} wrong, holes");
        // The control: it sees the torus, of which the room knows nothing.
        assert!(wrong(&view, ShadowMap::Octahedral, &triangles[..12], map).0 > 0, "light {index}");
    }
    // The control: elsewhere it makes other maps.
    scene.set_transform(node, Transform::translation(at + Vec3::X * 0.01)).expect("a place");
    assert!(maps(&Geometry::new(&scene), &scene).iter().zip(&drawn).all(|(a, b)| a != b));
}

/// All triangles.
fn corners(geometry: &Geometry) -> Vec<[DVec3; 3]> {
    let of = |t| geometry.corners(t).map(|corner| corner.as_dvec3());
    (0..geometry.triangles.len() as u32).map(of).collect()
}

fn sheets(context: &Context) {
    // Lists of 128 triangles and of 4096, 640 on software devices.
    for (size, count, step) in [(32, 1200, 1), (256, 6000, 97)] {
        let (geometry, scene) = pile(count);
        let sample = light(-geometry.origin.as_vec3(), Vec3::NEG_Z, Profile::Cosine);
        let set = LightSet::from_samples(&geometry, vec![sample]);
        for shape in [ShadowMap::Octahedral, ShadowMap::Cube] {
            let options = RendererOptions {
                shadow_map: shape,
                map_size: Some(size),
                skip_non_blockers: false,
                ..Default::default()
            };
            let mut renderer = context.renderer(options);
            renderer.load(&scene, &geometry, &set).expect("load");
            renderer.draw_shadow_maps(&MapUpdates::default()).expect("maps");
            let map = context.wait(renderer.shadow_map(0)).expect("a map");
            let texels = || (0..).zip(map.iter().copied()).step_by(step);
            let view = View::new(0, &set.samples()[0], geometry.radius());
            let (view, triangles) = (View { size: i64::from(size), ..view }, corners(&geometry));
            assert_eq!(wrong(&view, shape, &triangles, texels()), (0, 0), "{size}, {shape:?}");
            // The control: all together make it.
            let half: Vec<[DVec3; 3]> = triangles.into_iter().step_by(2).collect();
            assert!(wrong(&view, shape, &half, texels()).0 > 50, "{size}, {shape:?}");
        }
    }
}

/// Sheets before a light, in no order, opaque ones and masked ones.
fn pile(count: u32) -> (Geometry, Scene) {
    let mut scene = Scene::default();
    let opaque = scene.add_material(Material::diffuse("gray", Vec3::splat(0.5)));
    let masked = Material { alpha_cutoff: Some(0.5), ..Material::diffuse("masked", Vec3::splat(0.5)) };
    let masked = scene.add_material(masked);
    let mut mesh = Mesh::default();
    for sheet in 0..count {
        let depth = 1.0 + 2.0 * number(sheet, 0);
        let tilt = vector(sheet, 1) * 0.2;
        let shift = vector(sheet, 2) * 0.7;
        let corner = |x: f32, y: f32| Vec3::new(x, y, -1.0 + tilt.x * x + tilt.y * y) * depth + shift;
        let [x, y] = [3, 4].map(|what| 0.3 + 0.5 * number(sheet, what));
        let outline = [corner(-x, -y), corner(x, -y), corner(x, y), corner(-x, y)];
        mesh.add_polygon(&outline, if sheet % 2 == 0 { opaque } else { masked });
    }
    scene.add_object("sheets", mesh, Transform::IDENTITY);
    (Geometry::new(&scene), scene)
}

fn bands(context: &Context) {
    const LARGE: i64 = 4096;
    let (scene, geometry) = stage(1);
    let set = LightSet::from_samples(&geometry, lights(1, &geometry).samples()[1..2].to_vec());
    let options =
        RendererOptions { map_size: Some(LARGE as u32), skip_non_blockers: false, ..Default::default() };
    let mut renderer = context.renderer(options);
    renderer.load(&scene, &geometry, &set).expect("load");
    renderer.draw_shadow_maps(&MapUpdates::default()).expect("maps");
    let map = context.wait(renderer.shadow_map(0)).expect("a map");
    let view = View { size: LARGE, ..View::new(0, &set.samples()[0], geometry.radius()) };
    // Rows beside each other: a band has 64, of which a batch has 16.
    let rows = (0..LARGE).step_by(512).flat_map(|row| [row, (row + LARGE - 1) % LARGE]);
    let at = rows.flat_map(|y| (0..LARGE).step_by(129).map(move |x| y * LARGE + x));
    let texels = at.map(|at| (at, map[at as usize]));
    let triangles = corners(&geometry);
    let found = wrong(&view, ShadowMap::Octahedral, &triangles, texels.clone());
    assert!(found == (0, 0), "{found:?} wrong, holes");
    // The control: a millimetre beside.
    let other = View { position: view.position + DVec3::splat(1e-3), ..view };
    assert!(wrong(&other, ShadowMap::Octahedral, &triangles, texels).0 > 100);
}

fn batches(context: &Context) {
    let (scene, geometry) = stage(4);
    let all = lights(4, &geometry).samples().to_vec();
    let maps = |count: usize, at: &[usize]| {
        let options = RendererOptions { map_size: Some(128), skip_non_blockers: false, ..Default::default() };
        let mut renderer = context.renderer(options);
        let set = LightSet::from_samples(&geometry, all[..count].to_vec());
        renderer.load(&scene, &geometry, &set).expect("load");
        renderer.draw_shadow_maps(&MapUpdates::default()).expect("maps");
        at.iter().map(|&index| context.wait(renderer.shadow_map(index)).expect("a map")).collect::<Vec<_>>()
    };
    // A quarter of all texels has room beside the maps, so that the first lights of one are in other batches than of another.
    let at = [0, 3, 6];
    let alone = maps(7, &at);
    for count in [13, 40, 64] {
        assert!(maps(count, &at) == alone, "{count}");
    }
    // The control: others are others.
    assert!(maps(7, &[1, 2, 4]).iter().zip(&alone).all(|(a, b)| a != b));
}
