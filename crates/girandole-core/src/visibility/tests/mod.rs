mod bounds;
mod cases;
mod database;
mod growth;
mod ids;
mod joints;
mod lights;
mod many;
mod motion;
mod needed;
mod outliers;
mod random;
mod seen;
mod transparency;

use super::light_points::LightPoint;
use super::{State, VisibilityDatabase, VisibilitySettings};
use crate::lights::{Clamp, LightChanges, LightSample, LightSet, LightSettings, Profile, SampleOrigin};
use crate::scene::{Geometry, LightId, Material, MaterialId, Mesh, NONE, ObjectId, Scene, Transform};
use crate::trace::SceneTracer;
use glam::{Quat, Vec2, Vec3, vec3};

/// Numbers that look random.
pub struct Numbers(pub u64);

impl Numbers {
    pub fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f32) as usize % count.max(1)
    }

    pub fn vector(&mut self) -> Vec3 {
        vec3(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    pub fn rotation(&mut self) -> Quat {
        Quat::from_xyzw(self.unit() - 0.5, self.unit() - 0.5, self.unit() - 0.5, self.unit() + 0.01)
            .normalize()
    }
}

/// White, double-sided, and cut out everywhere.
pub fn empty_scene() -> Scene {
    let mut scene = Scene::default();
    scene.add_material(Material::default());
    scene.add_material(Material { double_sided: true, ..Material::default() });
    scene.add_material(Material { alpha: 0.3, alpha_cutoff: Some(0.5), ..Material::default() });
    scene
}

/// A box seen from inside.
pub fn room(min: Vec3, max: Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_box(min, max, MaterialId(0));
    for triangle in &mut mesh.triangles {
        triangle.vertices.swap(1, 2);
    }
    for patch in &mut mesh.patches {
        patch.outline.reverse();
    }
    for normal in &mut mesh.normals {
        *normal = -*normal;
    }
    mesh
}

pub fn polygon(corners: &[Vec3], material: MaterialId) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_polygon(corners, material);
    mesh
}

pub fn add(scene: &mut Scene, mesh: Mesh) -> ObjectId {
    scene.add_object("", mesh, Transform::IDENTITY)
}

/// A light of no surface.
pub fn light(position: Vec3, normal: Vec3, profile: Profile) -> LightSample {
    let origin = SampleOrigin::Punctual { light: LightId(0) };
    LightSample { position, normal, intensity: Vec3::ONE, profile, origin, rectangle: None }
}

/// A light on a surface, as the random walk leaves it.
pub fn bounce(tracer: &SceneTracer, triangle: u32, at: Vec2) -> LightSample {
    let geometry = tracer.geometry();
    let normal = geometry.normal(triangle);
    LightSample {
        position: tracer.offset_ray_origin(geometry.point(triangle, at), normal),
        normal,
        intensity: Vec3::ONE,
        profile: Profile::Cosine,
        origin: SampleOrigin::Bounce { path: 0, bounce: 1, triangle },
        rectangle: None,
    }
}

pub fn set(geometry: &Geometry, samples: Vec<LightSample>) -> LightSet {
    LightSet::from_samples(geometry, samples)
}

pub fn build(scene: &Scene, geometry: &Geometry, samples: Vec<LightSample>) -> VisibilityDatabase {
    VisibilityDatabase::build(scene, geometry, &set(geometry, samples), &VisibilitySettings::default())
        .expect("a database")
}

/// How light samples differ from those that a database is of.
pub fn changes(database: &VisibilityDatabase, lights: &LightSet) -> LightChanges {
    if database.lights.len() != lights.len() {
        return LightChanges::everything();
    }
    let now = LightPoint::of(lights.samples(), &database.surfaces, &database.groups);
    let pairs = (0..).zip(database.lights.iter().zip(&now));
    LightChanges::of_moved(pairs.filter(|(_, (then, now))| then != now).map(|(index, _)| index).collect())
}

/// As many light samples of a scene.
pub fn sampled(scene: &Scene, geometry: &Geometry, count: u32) -> LightSet {
    let settings = LightSettings { count, ..LightSettings::default() };
    LightSet::sample(scene, geometry, &settings).expect("there is light")
}

/// Uniform barycentric coordinates.
pub fn barycentric(numbers: &mut Numbers) -> Vec2 {
    let (u, v) = (numbers.unit(), numbers.unit());
    if u + v > 1.0 { Vec2::new(1.0 - u, 1.0 - v) } else { Vec2::new(u, v) }
}

/// How traced rays compare with states.
#[derive(Clone, Copy, Debug, Default)]
pub struct Verdict {
    /// Rays that contradict the states.
    pub wrong: usize,
    /// Rays that do so only because they start in the very seam of two surfaces.
    pub seams: usize,
    /// Rays that would contradict them if unoccluded and fully occluded were swapped.
    pub wrong_if_swapped: usize,
    /// Rays between pairs that face each other, by the pair's state.
    pub rays: [usize; 3],
}

/// Random points of all surfaces, from both sides, against all lights.
pub fn verify(
    scene: &Scene,
    geometry: &Geometry,
    lights: &[LightSample],
    database: &VisibilityDatabase,
    points: usize,
    numbers: &mut Numbers,
) -> Verdict {
    let tracer = SceneTracer::new(scene, geometry);
    let mut verdict = Verdict::default();
    for _ in 0..points {
        let triangle = numbers.below(geometry.triangles.len()) as u32;
        let at = barycentric(numbers);
        let material = &scene.materials[geometry.triangles[triangle as usize].material];
        let front = !material.double_sided || numbers.unit() < 0.5;
        let normal = geometry.normal(triangle) * if front { 1.0 } else { -1.0 };
        let position = geometry.point(triangle, at);
        let leaf = database.receivers().leaf_at(triangle, position, front).expect("it is shaded");
        let lifted = tracer.offset_ray_origin(position, normal);
        for (light, &state) in lights.iter().zip(database.leaf_states(leaf)) {
            if light.geometric_factor(position, normal, normal, Clamp::Off).is_none() {
                continue;
            }
            let to = match light.profile {
                Profile::Directional => lifted - light.normal * (lifted.length() + 2.0 * geometry.extent()),
                _ => light.position,
            };
            let blocking = tracer.occluder(lifted, triangle, to, light.triangle(), NONE);
            let free = blocking.is_none();
            verdict.rays[state as usize] += 1;
            if state == if free { State::Full } else { State::Unoccluded } {
                // Where surfaces meet, a point may be rounded to behind the other one.
                let at_seam = blocking.is_some_and(|b| {
                    let height = geometry.normal(b).dot(lifted - geometry.corners(b)[0]);
                    height.abs() <= 5e-7 * geometry.diagonal()
                });
                verdict.seams += usize::from(at_seam);
                verdict.wrong += usize::from(!at_seam);
            }
            if state == if free { State::Unoccluded } else { State::Full } {
                verdict.wrong_if_swapped += 1;
            }
        }
    }
    verdict
}

/// Whether the receivers are what they promise to be.
pub fn check_receivers(geometry: &Geometry, database: &VisibilityDatabase, numbers: &mut Numbers) {
    let receivers = database.receivers();
    assert_eq!(receivers.triangles.len(), geometry.triangles.len());
    assert!(receivers.cells.iter().all(|&c| (c as usize) < receivers.leaves.len()));
    for (i, node) in receivers.nodes.iter().enumerate() {
        assert!(node.parent == NONE || receivers.nodes[node.parent as usize].children.contains(&(i as u32)));
        assert_eq!(node.children[0] == NONE, node.leaf != NONE);
        if node.children[0] != NONE {
            let below: f32 = node.children.iter().map(|&c| receivers.nodes[c as usize].area).sum();
            assert!((below - node.area).abs() <= 1e-3 * node.area, "{below} {}", node.area);
        }
    }
    // Points lie in the bounds of their leaf.
    for _ in 0..200.min(geometry.triangles.len() * 10) {
        let triangle = numbers.below(geometry.triangles.len()) as u32;
        let position = geometry.point(triangle, barycentric(numbers));
        let leaf = receivers.leaf_at(triangle, position, true).expect("all fronts are shaded");
        let leaf = &receivers.leaves[leaf as usize];
        assert!(leaf.center.distance(position) <= leaf.radius * 1.0001 + geometry.diagonal() * 1e-5);
    }
}
