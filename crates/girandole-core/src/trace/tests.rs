use super::hierarchy::{MAX_DEPTH, boxes, clustered, depth, has_long_chains, is_long};
use super::*;
use crate::scene::{ColorSpace, Filter, Material, MaterialId, Mesh, MeshTriangle};
use crate::scene::{Texture, TextureRef, Transform, Wrap};

struct Numbers(u64);

impl Numbers {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }
}

fn scene(meshes: impl IntoIterator<Item = Mesh>) -> (Scene, Geometry) {
    let mut scene = Scene::default();
    scene.add_material(Material::default());
    scene.add_material(Material { double_sided: true, ..Material::default() });
    for mesh in meshes {
        scene.add_object("", mesh, Transform::IDENTITY);
    }
    let geometry = Geometry::new(&scene);
    (scene, geometry)
}

fn add_triangle(mesh: &mut Mesh, corners: [Vec3; 3]) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners);
    mesh.normals.extend([Vec3::Y; 3]);
    mesh.triangles.push(MeshTriangle { vertices: [first, first + 1, first + 2], material: MaterialId(0) });
}

fn soup(numbers: &mut Numbers, count: usize, scale: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for _ in 0..count {
        let at = numbers.vector();
        let size = 0.5 * numbers.unit();
        add_triangle(&mut mesh, [(); 3].map(|()| (at + numbers.vector() * size) * scale));
    }
    mesh
}

/// A closed sphere of triangles that share vertices at two poles and along all edges.
fn sphere(rings: u32, segments: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let point = |ring: u32, segment: u32| {
        let theta = std::f32::consts::PI * ring as f32 / rings as f32;
        let phi = std::f32::consts::TAU * (segment % segments) as f32 / segments as f32;
        if ring == 0 || ring == rings {
            return Vec3::new(0.0, if ring == 0 { 1.0 } else { -1.0 }, 0.0);
        }
        Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    for ring in 0..rings {
        for segment in 0..segments {
            let (a, b) = (point(ring, segment), point(ring, segment + 1));
            let (c, d) = (point(ring + 1, segment), point(ring + 1, segment + 1));
            if ring > 0 {
                add_triangle(&mut mesh, [a, b, d]);
            }
            if ring + 1 < rings {
                add_triangle(&mut mesh, [a, d, c]);
            }
        }
    }
    mesh
}

fn closed_box() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_box(Vec3::new(-1.0, -0.7, -0.3), Vec3::new(0.9, 0.8, 0.6), MaterialId(0));
    mesh
}

/// Möller and Trumbore's test, in double precision: shares nothing with the one that it checks.
fn brute_force(geometry: &Geometry, origin: Vec3, direction: Vec3) -> Option<(f64, u32)> {
    let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
    let mut best: Option<(f64, u32)> = None;
    for i in 0..geometry.triangles.len() as u32 {
        let [a, b, c] = geometry.corners(i).map(Vec3::as_dvec3);
        let (ab, ac) = (b - a, c - a);
        let p = d.cross(ac);
        let determinant = ab.dot(p);
        let u = (o - a).dot(p) / determinant;
        let q = (o - a).cross(ab);
        let v = d.dot(q) / determinant;
        let t = ac.dot(q) / determinant;
        if determinant != 0.0
            && u >= 0.0
            && v >= 0.0
            && u + v <= 1.0
            && t > 0.0
            && best.is_none_or(|x| t < x.0)
        {
            best = Some((t, i));
        }
    }
    best
}

#[test]
fn agrees_with_brute_force_at_every_scale() {
    let mut numbers = Numbers(1);
    for scale in [1e-4, 1.0, 3e3] {
        let (scene, geometry) = scene([soup(&mut numbers, 300, scale)]);
        let tracer = SceneTracer::new(&scene, &geometry);
        let mut hits = 0;
        for i in 0..1500 {
            // From inside, from outside, and from very far; directions of any length.
            let distance = [0.5, 3.0, 300.0][i % 3];
            let origin = numbers.vector() * distance * scale;
            let target = numbers.vector() * scale;
            let direction = (target - origin) * [1.0, 1e-3, 40.0][i / 3 % 3];
            let expected = brute_force(&geometry, origin, direction);
            let found = tracer.closest_hit(origin, direction, f32::INFINITY, NONE);
            assert_eq!(found.map(|h| h.triangle), expected.map(|e| e.1), "scale {scale}, ray {i}");
            if let (Some(hit), Some((t, triangle))) = (found, expected) {
                hits += 1;
                assert!((f64::from(hit.t) - t).abs() <= 1e-6 * t, "{} for {t}", hit.t);
                let at = geometry.point(hit.triangle, hit.barycentric);
                let miss = (at.as_dvec3() - origin.as_dvec3() - direction.as_dvec3() * t).length();
                assert!(miss < 1e-6 * f64::from(scale * distance.max(1.0)), "{miss}");
                let short = origin + direction * (hit.t * 0.999);
                let long = origin + direction * (hit.t * 1.001);
                // From very far, rounding the end points makes another ray of it.
                assert!(distance > 100.0 || !tracer.occluded(origin, NONE, short, NONE));
                assert!(distance > 100.0 || tracer.occluded(origin, NONE, long, NONE));
                let next = tracer.closest_hit(origin, direction, f32::INFINITY, triangle);
                assert!(next.is_none_or(|n| n.triangle != triangle && n.t >= hit.t));
                // Negative control: brute force over the wrong ray does not agree.
                let other = brute_force(&geometry, origin, direction + Vec3::splat(0.2) * direction.length());
                hits -= usize::from(other.is_some_and(|o| o.0 == t));
            }
        }
        assert!(hits > 300, "only {hits} rays tested anything");
    }
}

#[test]
fn axis_parallel_rays_in_boxes() {
    let mut numbers = Numbers(2);
    let boxes: Vec<Mesh> = (0..40)
        .map(|_| {
            let mut mesh = Mesh::default();
            let at = numbers.vector() * 4.0;
            mesh.add_box(at, at + (numbers.vector() + 1.5) * 0.3, MaterialId(0));
            mesh
        })
        .collect();
    let (scene, geometry) = scene(boxes);
    let tracer = SceneTracer::new(&scene, &geometry);
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    let mut hits = 0;
    for i in 0..3000 {
        // Every other one with negative zeros.
        let direction = if i / 6 % 2 == 0 { axes[i % 6] } else { -axes[i % 6] };
        let origin = numbers.vector() * 4.5;
        let expected = brute_force(&geometry, origin, direction);
        let found = tracer.closest_hit(origin, direction, f32::INFINITY, NONE);
        assert_eq!(found.map(|h| h.triangle), expected.map(|e| e.1), "{origin} {direction}");
        hits += usize::from(found.is_some());
    }
    assert!(hits > 100 && hits < 2900, "{hits}");
}

/// Rays that leave a closed mesh without a hit, among those aimed exactly at its vertices and edges.
fn leaks(mesh: Mesh) -> usize {
    let (scene, geometry) = scene([mesh]);
    let tracer = SceneTracer::new(&scene, &geometry);
    let mut numbers = Numbers(3);
    let mut leaks = 0;
    for _ in 0..12 {
        let origin = numbers.vector() * 0.25;
        for i in 0..geometry.triangles.len() as u32 {
            let [a, b, c] = geometry.corners(i);
            let share = numbers.unit();
            for target in [a, b, c, (a + b) * 0.5, (b + c) * 0.5, a + (c - a) * share] {
                let direction = target - origin;
                leaks += usize::from(tracer.closest_hit(origin, direction, f32::INFINITY, NONE).is_none());
                leaks += usize::from(!tracer.occluded(origin, NONE, origin + direction * 3.0, NONE));
            }
        }
    }
    leaks
}

#[test]
fn closed_meshes_do_not_leak() {
    assert_eq!(leaks(sphere(12, 17)), 0);
    assert_eq!(leaks(closed_box()), 0);
    // Negative control: with one triangle taken out, they do.
    let mut open = sphere(12, 17);
    open.triangles.pop();
    assert!(leaks(open) > 10);
    let mut open = closed_box();
    open.triangles.pop();
    open.patches.pop();
    assert!(leaks(open) > 10);
}

#[test]
fn signs_of_areas_are_exact() {
    // The products differ by less than a rounding error: the plain difference is 0.
    let e = f64::EPSILON;
    let (a, b) = (DVec2::new(1.0 + e, 1.0), DVec2::new(1.0, 1.0 - e));
    assert_eq!(a.x * b.y, 1.0);
    assert_eq!(doubled_area(a, b), -e * e);
    assert_eq!(doubled_area(b, a), e * e);
    assert_eq!(doubled_area(a, a), 0.0);
}

#[test]
fn near_walls_block() {
    // A wall 20 µm from the start of a ray 10 m long.
    let mut mesh = Mesh::default();
    let wall = |z: f32| [Vec3::new(-5.0, -5.0, z), Vec3::new(5.0, -5.0, z), Vec3::new(5.0, 5.0, z)];
    mesh.add_polygon(&wall(2e-5), MaterialId(0));
    mesh.add_polygon(&wall(20.0), MaterialId(0));
    let (scene, geometry) = scene([mesh]);
    let tracer = SceneTracer::new(&scene, &geometry);
    let from = Vec3::new(1.0, -1.0, -geometry.origin.z as f32);
    let to = from + Vec3::Z * 10.0;
    assert!(tracer.occluded(from, NONE, to, NONE));
    assert_eq!(tracer.closest_hit(from, Vec3::Z, f32::INFINITY, NONE).map(|h| h.triangle), Some(0));
    assert!(!tracer.occluded(from, 0, to, NONE));
    assert!(!tracer.occluded(from, NONE, to, 0));
    assert!(!tracer.occluded(from + Vec3::Z * 1e-4, NONE, to, NONE));
}

#[test]
fn the_hierarchy_does_not_matter() {
    let mut numbers = Numbers(4);
    // Twice the same triangles: the lower index wins everywhere.
    let mesh = soup(&mut numbers, 200, 1.0);
    let (mut scene, _) = scene([mesh.clone(), mesh]);
    // What may move on its own counts on its own.
    scene.objects[1].dynamic = true;
    let geometry = Geometry::new(&scene);
    assert_eq!(geometry.triangles.len(), 400);
    let builds = [BvhBuildParams::fastest_build(), BvhBuildParams::very_slow_build()];
    let [fast, slow] = builds.map(|b| complete(SceneTracer::with_build(&scene, &geometry, &b)));
    let mut hits = 0;
    for _ in 0..3000 {
        let (origin, direction) = (numbers.vector() * 2.0, numbers.vector());
        let hit = fast.closest_hit(origin, direction, f32::INFINITY, NONE);
        assert_eq!(hit, slow.closest_hit(origin, direction, f32::INFINITY, NONE));
        hits += usize::from(hit.is_some());
        assert!(hit.is_none_or(|h| h.triangle < 200));
        let to = origin + direction;
        let blocked = fast.occluded(origin, NONE, to, NONE);
        assert_eq!(blocked, slow.occluded(origin, NONE, to, NONE));
        let guess = (numbers.unit() * 400.0) as u32;
        assert_eq!(blocked, fast.occluder(origin, NONE, to, NONE, guess).is_some());
    }
    assert!(hits > 300, "{hits}");
}

#[test]
fn held_hierarchies_give_what_a_fresh_one_gives() {
    let mut numbers = Numbers(9);
    let meshes: [Mesh; 3] = std::array::from_fn(|_| soup(&mut numbers, 100, 1.0));
    let (mut scene, _) = scene(meshes);
    scene.objects[1].dynamic = true;
    let mut held = HeldHierarchies::default();
    let mut kept: Vec<Arc<Hierarchy>> = Vec::new();
    for step in 0..6 {
        if step == 4 {
            // It was static until now.
            scene.objects[2].dynamic = true;
        }
        let moved = if step < 4 { 1 } else { 2 };
        let place = Transform::translation(numbers.vector());
        scene.set_transform(scene.objects[moved].node, place).expect("a place");
        let geometry = Geometry::new(&scene);
        for round in 0..2 {
            let (tracer, fresh) = (held.tracer(&scene, &geometry), SceneTracer::new(&scene, &geometry));
            let mut hits = [0; 3];
            for _ in 0..500 {
                let (origin, direction) = (numbers.vector() * 2.0, numbers.vector());
                let hit = tracer.closest_hit(origin, direction, f32::INFINITY, NONE);
                assert_eq!(hit, fresh.closest_hit(origin, direction, f32::INFINITY, NONE));
                if let Some(hit) = hit {
                    hits[geometry.triangles[hit.triangle as usize].object as usize] += 1;
                }
                let to = origin + direction;
                assert_eq!(tracer.occluded(origin, NONE, to, NONE), fresh.occluded(origin, NONE, to, NONE));
            }
            assert!(hits.iter().all(|hits| *hits > 10), "{hits:?}");
            let same: Vec<bool> =
                kept.iter().zip(&tracer.hierarchies).map(|(a, b)| Arc::ptr_eq(a, b)).collect();
            kept.clone_from(&tracer.hierarchies);
            let expected = match (step, round) {
                (0, 0) => Vec::new(),
                (_, 1) => vec![true, true],
                // Another one is static, or none.
                (4, _) => vec![false, false],
                _ => vec![true, false],
            };
            assert_eq!(same, expected, "{step} {round}");
        }
    }
}

#[test]
fn cameras_do_not_see_backs() {
    let mut mesh = Mesh::default();
    let square = |z: f32| {
        [Vec3::new(-1.0, -1.0, z), Vec3::new(1.0, -1.0, z), Vec3::new(1.0, 1.0, z), Vec3::new(-1.0, 1.0, z)]
    };
    mesh.add_polygon(&square(-1.0), MaterialId(0));
    mesh.add_polygon(&square(1.0), MaterialId(1));
    let (scene, geometry) = scene([mesh]);
    let tracer = SceneTracer::new(&scene, &geometry);
    let seen = |from: f32| {
        let origin = Vec3::new(0.1, 0.2, from);
        tracer.closest_visible(origin, Vec3::Z * -from.signum()).map(|h| (h.triangle / 2, h.t))
    };
    // Both face +Z. From behind, only the double-sided one farther away is there; rays hit both.
    assert_eq!(seen(3.0), Some((1, 2.0)));
    assert_eq!(seen(-3.0), Some((1, 4.0)));
    let hit = tracer.closest_hit(Vec3::new(0.1, 0.2, -3.0), Vec3::Z, 10.0, NONE);
    assert_eq!(hit.map(|h| h.t), Some(2.0));
    assert_eq!(tracer.closest_hit(Vec3::new(0.1, 0.2, -3.0), Vec3::Z, 2.0, NONE), None);
}

#[test]
fn transparent_surfaces_are_met_in_order() {
    let square = |z: f32| {
        [Vec3::new(-1.0, -1.0, z), Vec3::new(1.0, -1.0, z), Vec3::new(1.0, 1.0, z), Vec3::new(-1.0, 1.0, z)]
    };
    let mut mesh = Mesh::default();
    for (z, material) in [(-2.0, 1), (2.0, 0), (1.0, 1), (0.0, 1)] {
        mesh.add_polygon(&square(z), material.into());
    }
    let (mut scene, _) = scene([mesh]);
    scene.materials[1] = Material { blended: true, alpha: 0.5, ..Material::default() };
    let geometry = Geometry::new(&scene);
    let tracer = SceneTracer::new(&scene, &geometry);
    let origin = Vec3::new(0.1, 0.2, -3.0);
    let met = |t_max: f32| -> Vec<f32> {
        tracer.transparent_hits(origin, Vec3::Z, t_max).iter().map(|hit| hit.t).collect()
    };
    assert_eq!(met(f32::INFINITY), [1.0, 3.0, 4.0]);
    assert_eq!(met(3.5), [1.0, 3.0]);
    assert!(tracer.transparent_hits(origin, -Vec3::Z, f32::INFINITY).is_empty());
    // They block nothing.
    assert_eq!(tracer.closest_hit(origin, Vec3::Z, 10.0, NONE).map(|hit| hit.t), Some(5.0));
    assert!(!tracer.occluded(origin, NONE, origin + Vec3::Z * 4.5, NONE));
    assert!(tracer.occluded(origin, NONE, origin + Vec3::Z * 5.5, NONE));
    // All face +Z: a camera at −Z does not see them.
    assert!(!tracer.is_visible(geometry.triangles.len() as u32 - 1, Vec3::Z));
    let mut held = HeldHierarchies::default();
    assert_eq!(held.tracer(&scene, &geometry).closest_hit(origin, Vec3::Z, 4.5, NONE), None);
}

#[test]
fn masks_cut_holes() {
    let mut mesh = Mesh::default();
    let square = [
        Vec3::new(-1.0, -1.0, 0.0),
        Vec3::new(1.0, -1.0, 0.0),
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(-1.0, 1.0, 0.0),
    ];
    mesh.add_polygon(&square, MaterialId(0));
    let (mut scene, geometry) = scene([mesh]);
    scene.textures.push(Texture {
        name: String::new(),
        width: 2,
        height: 1,
        texels: vec![[255, 255, 255, 0], [255, 255, 255, 255]],
        color_space: ColorSpace::Srgb,
        wrap: [Wrap::Clamp; 2],
        filter: Filter::Nearest,
    });
    scene.materials[0].base_color_texture = Some(TextureRef::new(0));
    let blocked = |scene: &Scene, x: f32| {
        let tracer = SceneTracer::new(scene, &geometry);
        let (from, to) = (Vec3::new(x, 0.3, 1.0), Vec3::new(x, 0.3, -1.0));
        let blocked = tracer.occluded(from, NONE, to, NONE);
        assert_eq!(blocked, tracer.closest_hit(from, to - from, 1.0, NONE).is_some());
        assert_eq!(blocked, (0..2).any(|i| tracer.occluder(from, NONE, to, NONE, i).is_some()));
        blocked
    };
    assert!(blocked(&scene, -0.5) && blocked(&scene, 0.5));
    scene.materials[0].alpha_cutoff = Some(0.5);
    assert!(!blocked(&scene, -0.5) && blocked(&scene, 0.5));
}

#[test]
fn nothing_and_nonsense_are_answered() {
    let (empty, geometry) = scene([]);
    let tracer = SceneTracer::new(&empty, &geometry);
    assert_eq!(tracer.closest_hit(Vec3::ZERO, Vec3::X, f32::INFINITY, NONE), None);
    assert!(!tracer.occluded(Vec3::ZERO, NONE, Vec3::X, NONE));
    let (scene, geometry) = scene([closed_box()]);
    let tracer = SceneTracer::new(&scene, &geometry);
    for direction in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
        assert_eq!(tracer.closest_hit(Vec3::ZERO, direction, f32::INFINITY, NONE), None);
    }
    assert_eq!(tracer.closest_hit(Vec3::NAN, Vec3::X, f32::INFINITY, NONE), None);
    assert!(!tracer.occluded(Vec3::ZERO, NONE, Vec3::ZERO, NONE));
}

/// Triangles that all have the same box make the deepest hierarchies.
#[test]
fn many_equal_boxes_are_traced_like_any() {
    let mut mesh = Mesh::default();
    let mut numbers = Numbers(11);
    for _ in 0..3000 {
        add_triangle(&mut mesh, [Vec3::ZERO, Vec3::ONE, numbers.vector().abs()]);
    }
    let (scene, geometry) = scene([mesh]);
    let tracer = SceneTracer::new(&scene, &geometry);
    assert!(depth(&tracer.hierarchies[0].bvh) < MAX_DEPTH);
    let all: Vec<u32> = (0..geometry.triangles.len() as u32).collect();
    let clustered = clustered(&boxes(&geometry, &all), &BvhBuildParams::medium_build());
    assert!(is_long(&clustered), "the control: clusters would be too deep a hierarchy");
    let mut met = 0;
    for _ in 0..300 {
        let (origin, target) = (numbers.vector() * 2.0, numbers.vector() * 0.4);
        let direction = target - origin;
        let ray = WatertightRay::new(origin.as_dvec3(), direction.as_dvec3()).unwrap();
        let nearest = (0..geometry.triangles.len() as u32)
            .filter_map(|i| Some((ray.intersect(&geometry.corners(i))?.0, i)))
            .filter(|(t, _)| *t > 0.0)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let hit = tracer.closest_hit(origin, direction, f32::INFINITY, NONE);
        assert_eq!(hit.map(|h| h.triangle), nearest.map(|n| n.1));
        met += usize::from(hit.is_some());
    }
    assert!(met > 100, "{met}");
}

/// Coplanar triangles on one edge, each larger than the one before.
fn on_one_edge(count: usize) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..count {
        let height = (i + 1) as f32 / count as f32;
        add_triangle(&mut mesh, [Vec3::ZERO, Vec3::X, Vec3::new(0.5, height, 0.0)]);
    }
    mesh
}

/// So many squares along each side of a plane, all the same.
fn grid(side: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..side * side {
        let at = |x: u32, z: u32| Vec3::new((i % side + x) as f32, 0.0, (i / side + z) as f32);
        add_triangle(&mut mesh, [at(0, 0), at(0, 1), at(1, 1)]);
        add_triangle(&mut mesh, [at(0, 0), at(1, 1), at(1, 0)]);
    }
    mesh
}

#[test]
fn nested_triangles_take_no_longer_than_others() {
    let count = 20_000;
    let mut numbers = Numbers(12);
    let build = BvhBuildParams::medium_build();
    let times = [on_one_edge(count), soup(&mut numbers, count, 1.0)].map(|mesh| {
        let (scene, geometry) = scene([mesh]);
        let once = || {
            let start = std::time::Instant::now();
            let tracer = SceneTracer::new(&scene, &geometry);
            assert!(depth(&tracer.hierarchies[0].bvh) < MAX_DEPTH);
            start.elapsed()
        };
        (0..3).map(|_| once()).min().expect("three")
    });
    // Clustered, the nested ones take as many passes as there are triangles: hundreds of times as long.
    assert!(times[0] < times[1] * 8, "{times:?}");
    // Chains are found among others, and nowhere else.
    let mut other = || soup(&mut numbers, count, 1.0);
    for (meshes, expected) in [
        (vec![on_one_edge(count)], true),
        (vec![on_one_edge(count), other(), other()], true),
        (vec![other()], false),
        (vec![sphere(100, 100)], false),
        (vec![grid(100)], false),
    ] {
        let (_, geometry) = scene(meshes);
        let boxes = boxes(&geometry, &(0..geometry.triangles.len() as u32).collect::<Vec<_>>());
        assert_eq!(has_long_chains(&boxes, &build), expected, "{}", geometry.triangles.len());
    }
    // Of those that a ray meets at the same distance, the lowest index counts, here that of the smallest.
    let (scene, geometry) = scene([on_one_edge(count)]);
    let tracer = SceneTracer::new(&scene, &geometry);
    for height in [0.010_02, 0.300_02, 0.770_02] {
        let origin = geometry.corners(0)[0] + Vec3::new(0.5, height, 1.0);
        let hit = tracer.closest_hit(origin, Vec3::NEG_Z, f32::INFINITY, NONE).expect("a hit");
        let first =
            (0..count as u32).find(|&i| geometry.corners(i)[2].y - geometry.corners(i)[0].y >= height);
        assert_eq!(Some(hit.triangle), first);
    }
}
