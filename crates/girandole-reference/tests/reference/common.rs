//! Scenes, views and statistics that the tests share.

use girandole_core::glam::{DVec3, Vec2, Vec3};
use girandole_core::image::Image;
use girandole_core::scene::{
    Geometry, Material, MaterialId, Mesh, PunctualKind, PunctualLight, Scene, Transform, View,
};
use girandole_core::trace::SceneTracer;
use girandole_reference::{Estimate, PathSettings, path_trace};

/// A scene that grows piece by piece.
#[derive(Default)]
pub struct Stage {
    pub scene: Scene,
}

impl Stage {
    pub fn material(&mut self, material: Material) -> MaterialId {
        self.scene.add_material(material)
    }

    pub fn mesh(&mut self, mesh: Mesh) {
        self.scene.add_object("", mesh, Transform::IDENTITY);
    }

    /// A parallelogram that faces `u × v`, from its corner and two sides.
    pub fn quad(&mut self, corner: Vec3, u: Vec3, v: Vec3, material: MaterialId) {
        let mut mesh = Mesh::default();
        mesh.add_polygon(&[corner, corner + u, corner + u + v, corner + v], material);
        self.mesh(mesh);
    }

    /// A box seen from inside.
    pub fn room(&mut self, min: Vec3, max: Vec3, material: MaterialId) {
        let mut mesh = Mesh::default();
        mesh.add_box(min, max, material);
        for triangle in &mut mesh.triangles {
            triangle.vertices.swap(1, 2);
        }
        for patch in &mut mesh.patches {
            patch.outline.reverse();
        }
        for normal in &mut mesh.normals {
            *normal = -*normal;
        }
        self.mesh(mesh);
    }

    pub fn punctual(&mut self, kind: PunctualKind, intensity: Vec3, from: Vec3, towards: Vec3) {
        let node = self.scene.add_node("", Transform::looking_at(from, towards));
        self.scene.lights.push(PunctualLight { name: String::new(), node, kind, intensity });
    }

    pub fn geometry(&self) -> Geometry {
        Geometry::new(&self.scene)
    }
}

/// A square view from one point to another; `extent` is the tangent of half the angle.
pub fn look(eye: Vec3, target: Vec3, extent: f32) -> View {
    let forward = (target - eye).normalize();
    let other = if forward.y.abs() > 0.9 { Vec3::Z } else { Vec3::Y };
    let right = forward.cross(other).normalize();
    View {
        eye: eye.as_dvec3(),
        right,
        up: right.cross(forward),
        forward,
        half_extent: Vec2::splat(extent),
        center: Vec2::ZERO,
        orthographic: false,
        depth: None,
        clip: Default::default(),
    }
}

pub fn trace(scene: &Scene, geometry: &Geometry, view: &View, size: u32, settings: PathSettings) -> Estimate {
    let tracer = SceneTracer::new(scene, geometry);
    path_trace(&tracer, view, [size, size], &settings, &|_| ())
}

pub fn constant(like: &Image, value: Vec3) -> Image {
    Image { pixels: vec![value; like.pixels.len()], ..*like }
}

/// What differs between an estimate and what it is expected to be, in standard deviations.
#[derive(Debug)]
pub struct Deviation {
    /// How many blocks of 8 × 8 pixels.
    pub blocks: usize,
    /// The greatest deviation of a block.
    pub largest: f64,
    /// Mean square over the blocks: 1 if only noise differs.
    pub mean_square: f64,
    /// Of the mean of all pixels, by channel the worst.
    pub overall: f64,
    /// Ratio of the means.
    pub energy: f64,
}

impl Deviation {
    /// Bounds that noise passes but once in some ten thousand runs: seeds are fixed, so it passes always or never. The
    /// tail is given some room, because a few hundred paths of a block are no normal distribution yet.
    pub fn is_noise(&self) -> bool {
        self.blocks > 0
            && self.largest < 6.0
            && self.mean_square < 1.0 + 4.0 * (2.0 / self.blocks as f64).sqrt()
            && self.overall < 4.0
    }
}

/// Blocks of 8 × 8 pixels of an estimate against a picture whose own noise is `noise(block's mean)`, for the mean of
/// all pixels `noise_of_mean`; pixels where `valid` is false are left out.
pub fn deviation(
    expected: &Image,
    estimate: &Estimate,
    valid: &dyn Fn(usize) -> bool,
    noise: &dyn Fn(DVec3) -> DVec3,
    noise_of_mean: f64,
) -> Deviation {
    let (width, height) = (expected.width as usize, expected.height as usize);
    assert_eq!((estimate.mean.width, estimate.mean.height), (expected.width, expected.height));
    let mut squares = Vec::new();
    let mut largest: f64 = 0.0;
    let (mut all, mut all_variance, mut all_expected, mut count) =
        (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, 0.0);
    for (x0, y0) in (0..height).step_by(8).flat_map(|y| (0..width).step_by(8).map(move |x| (x, y))) {
        let (mut difference, mut variance, mut mean, mut n) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, 0.0);
        for (x, y) in (y0..height.min(y0 + 8)).flat_map(|y| (x0..width.min(x0 + 8)).map(move |x| (x, y))) {
            let i = y * width + x;
            if valid(i) {
                let e = expected.pixels[i].as_dvec3();
                difference += estimate.mean.pixels[i].as_dvec3() - e;
                variance += estimate.variance.pixels[i].as_dvec3();
                mean += e;
                n += 1.0;
            }
        }
        all += difference;
        all_variance += variance;
        all_expected += mean;
        count += n;
        // Blocks with few valid pixels are too noisy.
        if n >= 32.0 {
            let noise = noise(mean / n) * (64f64 / n).sqrt();
            let rounding = mean / n * 1e-5 + 1e-9;
            let z =
                (difference / n) / (variance / (n * n) + noise * noise + rounding * rounding).map(f64::sqrt);
            largest = largest.max(z.abs().max_element());
            squares.push(z.length_squared() / 3.0);
        }
    }
    let rounding = all_expected / count * 1e-5 + 1e-9;
    let z = (all / count)
        / (all_variance / (count * count) + rounding * rounding + noise_of_mean * noise_of_mean)
            .map(f64::sqrt);
    Deviation {
        blocks: squares.len(),
        largest,
        mean_square: squares.iter().sum::<f64>() / squares.len() as f64,
        overall: z.abs().max_element(),
        energy: 1.0 + all.element_sum() / all_expected.element_sum(),
    }
}

/// Asserts that an estimate is a constant but for its noise, and not another one 1 % off.
pub fn assert_constant(estimate: &Estimate, value: Vec3, what: &str) {
    assert_picture(estimate, &constant(&estimate.mean, value), 0.99, what);
}

/// Asserts that an estimate is a picture but for its noise; the picture times `wrong` must fail the same test.
pub fn assert_picture(estimate: &Estimate, expected: &Image, wrong: f32, what: &str) {
    let test = |expected: &Image| deviation(expected, estimate, &|_| true, &|_| DVec3::ZERO, 0.0);
    let found = test(expected);
    assert!(found.is_noise(), "{what}: {found:?}");
    let wrong = Image { pixels: expected.pixels.iter().map(|p| *p * wrong).collect(), ..*expected };
    assert!(!test(&wrong).is_noise(), "{what}: too noisy to tell anything, {found:?}");
}
