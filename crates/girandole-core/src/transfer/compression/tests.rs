use super::*;
use crate::math::sequence;
use crate::scene::builtin::shapes;
use crate::scene::{Material, ObjectId, Scene, Transform};
use crate::transfer::{ObjectTransfer, TransferSettings};
use glam::Vec3;

fn random(i: usize, seed: u32) -> f32 {
    sequence::sample(i as u32, 0, seed) - 0.5
}

/// The transfer of a coloured torus, whose vectors have 75 numbers.
fn torus(compression: Option<Compression>) -> ObjectTransfer {
    let mut scene = Scene::default();
    let material = scene.add_material(Material::diffuse("", Vec3::new(0.9, 0.5, 0.1)));
    scene.add_object("", shapes::torus(0.36, 0.14, 24, 12, material), Transform::IDENTITY);
    let settings = TransferSettings { directions: 256, bounces: 2, compression, ..Default::default() };
    ObjectTransfer::simulate(&scene, ObjectId(0), &settings, &|_| {}).expect("transfer")
}

#[test]
fn eigenvectors_are_those_of_the_matrix() {
    for n in [1, 2, 7, 40] {
        // AᵀA, of fewer rows than columns: some eigenvalues are 0, and two are equal.
        let a: Vec<f64> =
            (0..n * n).map(|i| f64::from(random(i, 1)) * f64::from(u8::from(i < n * n * 3 / 4))).collect();
        let element = |i: usize, j: usize| (0..n).map(|k| a[k * n + i] * a[k * n + j]).sum::<f64>();
        let matrix: Vec<f64> = (0..n * n).map(|i| element(i / n, i % n)).collect();
        let vectors = eigenvectors(matrix.clone(), n);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut before = f64::INFINITY;
        for (i, vector) in vectors.iter().enumerate() {
            let image: Vec<f64> = matrix.chunks_exact(n).map(|row| dot(row, vector)).collect();
            let value = dot(&image, vector);
            assert!(image.iter().zip(vector).all(|(x, v)| (x - value * v).abs() < 1e-10), "{n}: {i}");
            assert!(value <= before + 1e-12, "the largest first");
            before = value;
            for (j, other) in vectors.iter().enumerate() {
                let wanted = if i == j { 1.0 } else { 0.0 };
                assert!((dot(vector, other) - wanted).abs() < 1e-12, "{n}: {i} {j}");
            }
        }
        // Negative control: the axes are none.
        let is_one = |i: usize| (0..n).all(|j| i == j || matrix[j * n + i].abs() < 1e-10);
        assert!(n == 1 || !(0..n).all(is_one));
    }
}

#[test]
fn two_planes_are_two_clusters() {
    // In eight dimensions: one plane through two axes, another one beside it through two others.
    let vectors: Vec<f32> = (0..200)
        .flat_map(|i| {
            let mut vector = [0.0; 8];
            let first = i % 2 * 4;
            vector[first] = random(i, 1);
            vector[first + 1] = random(i, 2);
            vector[first + 2] = 1.0;
            vector
        })
        .collect();
    let error = |clusters, bases| CompressedTransfer::new(&vectors, 8, Compression { clusters, bases }).error;
    assert!(error(2, 2).worst < 1e-6, "{:?}", error(2, 2));
    assert!(error(1, 2).mean > 0.1 && error(2, 1).mean > 0.1, "negative control");
}

#[test]
fn the_error_falls_with_clusters_and_bases() {
    let exact = torus(None);
    let length = exact.coefficients().len() / exact.vertex_count();
    assert_eq!(length, 75);
    let error = |clusters, bases| {
        let compressed =
            CompressedTransfer::new(exact.coefficients(), length, Compression { clusters, bases });
        compressed.error
    };
    let by_bases = [0, 2, 4, 8, 16, 75].map(|bases| error(4, bases).mean);
    assert!(by_bases.windows(2).all(|pair| pair[1] < 0.8 * pair[0]), "{by_bases:?}");
    let by_clusters = [1, 4, 16, 64].map(|clusters| error(clusters, 2).mean);
    assert!(by_clusters.windows(2).all(|pair| pair[1] < 0.9 * pair[0]), "{by_clusters:?}");
    // With all bases nothing is lost, whatever the clusters.
    for clusters in [1, 5] {
        let all = error(clusters, 75);
        assert!(all.worst < 1e-5 && all.worst >= all.mean, "{all:?}");
    }
    let usual = Compression::default();
    let found = error(usual.clusters, usual.bases);
    assert!(found.mean < 0.01, "{found:?}");
    // As many clusters as vectors, or more, need no bases.
    assert!(error(4096, 0).worst < 1e-6);
}

#[test]
fn what_is_said_of_the_error_is_so() {
    let (exact, compressed) = (torus(None), torus(Some(Compression { clusters: 3, bases: 4 })));
    let held = compressed.compressed().expect("compressed");
    assert!(exact.compressed().is_none() && held.vectors() == compressed.coefficients());
    assert_eq!((held.clusters.len(), held.weights.len()), (288, 4 * 288));
    assert_eq!((held.means.len(), held.bases.len()), (3 * 75, 3 * 4 * 75));
    let squares = |f: &dyn Fn(usize) -> f32| (0..288 * 75).map(|i| f64::from(f(i)).powi(2)).sum::<f64>();
    let (a, b) = (exact.coefficients(), compressed.coefficients());
    let found = (squares(&|i| a[i] - b[i]) / squares(&|i| a[i])).sqrt() as f32;
    assert!((found / held.error.mean - 1.0).abs() < 1e-3, "{found} for {:?}", held.error);
    // Irradiance is that of the compressed vectors, a little beside that of the exact ones.
    let environment: Vec<Vec3> = (0..25).map(|k| Vec3::splat(random(k, 4))).collect();
    let apart = |v| (exact.irradiance(v, &environment) - compressed.irradiance(v, &environment)).length();
    let most = (0..288).map(apart).fold(0.0, f32::max);
    assert!(most > 1e-4 && most < 0.5, "{most}");
}

#[cfg(feature = "parallel")]
#[test]
fn threads_change_nothing() {
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| torus(Some(Compression { clusters: 5, bases: 3 })))
    };
    let one = with(1);
    assert!(one == with(3));
    assert!(one != torus(Some(Compression { clusters: 5, bases: 2 })), "negative control");
}

#[test]
fn more_clusters_than_different_vectors_leave_no_error() {
    let vectors: Vec<f32> = (0..120).flat_map(|i| [(i % 3) as f32, 1.0, -((i % 3) as f32)]).collect();
    for clusters in [3, 8, 120] {
        let compressed = CompressedTransfer::new(&vectors, 3, Compression { clusters, bases: 2 });
        assert!(compressed.error.worst < 1e-6, "{clusters}: {:?}", compressed.error);
        assert_eq!(compressed.bases.len(), compressed.means.len() * compressed.bases_each);
    }
    // The control: one mean for all.
    let one = CompressedTransfer::new(&vectors, 3, Compression { clusters: 1, bases: 0 });
    assert!(one.error.mean > 0.1, "{:?}", one.error);
}
