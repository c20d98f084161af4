//! Transfer vectors by clustered principal components (Sloan, Hall, Hart and Snyder 2003): each is the mean of its cluster and a
//! weighted sum of the cluster's bases.
//!
//! 1. Clusters start at vectors that are far from each other, and move to the means of those that are nearest to them.
//! 2. Again and again each vector goes to the cluster that is least wrong about it, and clusters get the mean of what they have and
//!    the eigenvectors of its covariance with the largest eigenvalues (§4.3). Neither step adds to the error.
//!
//! Worked example: three channels of 25 coefficients are 75 numbers a vertex; with 8 bases they are 8 and the cluster's index. Files are
//! as small. The renderer multiplies what is incident by means and bases alone, once a cluster and point of its grid, and a vertex by its
//! weights; the CPU takes the vectors that they make ([`CompressedTransfer::vectors`]).
//!
//! Eigenvectors are Jacobi's, in a few lines: the linear algebra crate that has them multiplies by the machine's vector width.

use crate::parallel;

/// How transfer vectors are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Compression {
    /// Clusters of vectors, 1 to 4096. More have a smaller error, and take longer to find.
    pub clusters: u32,
    /// Bases of each cluster, 0 to 192; as many as vectors have coefficients, of all channels, leave no error. More have a smaller error,
    /// and each is one more weight a vertex.
    pub bases: u32,
}

impl Default for Compression {
    /// 32 clusters of 12 bases: a sixth of three channels of 25 coefficients. A coloured torus of 820 vertices has an error of 0.2 % in the
    /// mean then, less than 1024 rays leave; the teapot one of 1.4 %.
    fn default() -> Self {
        Self { clusters: 32, bases: 12 }
    }
}

/// Compressed transfer vectors, one for each side and vertex, all of whose channels are compressed together.
#[derive(Clone, Debug, PartialEq)]
pub struct CompressedTransfer {
    /// Numbers of a vector: channels times coefficients.
    pub length: usize,
    /// Bases of each cluster.
    pub bases_each: usize,
    /// The cluster of each vector.
    pub clusters: Vec<u32>,
    /// The weight of each basis, vector by vector.
    pub weights: Vec<f32>,
    /// The mean of each cluster, one after another.
    pub means: Vec<f32>,
    /// The bases of each cluster, one after another: orthonormal, those that count most first.
    pub bases: Vec<f32>,
    /// How far all this is from what it stands for.
    pub error: CompressionError,
}

/// How far compressed vectors are from the exact ones, as a share of the root of the mean square of those: under light of all
/// directions alike, about the share of irradiance that is wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompressionError {
    /// Root of the mean square.
    pub mean: f32,
    /// The worst vector.
    pub worst: f32,
}

/// Rounds without bases, then rounds with them, at most.
const ROUNDS: [u32; 2] = [8, 24];
/// Vectors that are worked on together.
const CHUNK: usize = 256;

impl CompressedTransfer {
    /// Of vectors of this length, one after another.
    pub(super) fn new(vectors: &[f32], length: usize, compression: Compression) -> Self {
        let count = vectors.len() / length;
        let bases_each = (compression.bases as usize).min(length);
        let mut clusters = starts(vectors, length, (compression.clusters as usize).min(count));
        let mut assigned = assign(&clusters, vectors, length);
        for (rounds, bases) in ROUNDS.into_iter().zip([0, bases_each]) {
            for _ in 0..rounds {
                fill_empty(&mut assigned, clusters.len());
                fit(&mut clusters, &assigned, vectors, (length, bases));
                let next = assign(&clusters, vectors, length);
                let is_same = next.iter().zip(&assigned).all(|(a, b)| a.cluster == b.cluster);
                assigned = next;
                if is_same {
                    break;
                }
            }
        }
        // Clusters that nothing is in have no bases.
        clusters.iter_mut().for_each(|cluster| cluster.bases.resize(bases_each * length, 0.0));
        let mut result = Self {
            length,
            bases_each,
            clusters: assigned.iter().map(|a| a.cluster).collect(),
            weights: Vec::with_capacity(count * bases_each),
            means: clusters.iter().flat_map(|c| c.mean.iter().copied()).collect(),
            bases: clusters.iter().flat_map(|c| c.bases.iter().copied()).collect(),
            error: CompressionError::default(),
        };
        for (vector, &cluster) in vectors.chunks_exact(length).zip(&result.clusters) {
            let cluster = &clusters[cluster as usize];
            result
                .weights
                .extend(cluster.bases.chunks_exact(length).map(|basis| cluster.weight(vector, basis)));
        }
        result.error = result.error_of(vectors);
        result
    }

    /// All vectors, one after another, as far as they are known.
    pub fn vectors(&self) -> Vec<f32> {
        (0..self.clusters.len()).flat_map(|i| self.vector(i)).collect()
    }

    fn vector(&self, index: usize) -> Vec<f32> {
        let cluster = self.clusters[index] as usize;
        let mut vector = self.means[cluster * self.length..(cluster + 1) * self.length].to_vec();
        let size = self.bases_each * self.length;
        let bases = self.bases[cluster * size..(cluster + 1) * size].chunks_exact(self.length);
        for (basis, weight) in bases.zip(&self.weights[index * self.bases_each..]) {
            vector.iter_mut().zip(basis).for_each(|(x, b)| *x += weight * b);
        }
        vector
    }

    fn error_of(&self, vectors: &[f32]) -> CompressionError {
        let (mut all, mut wrong, mut worst) = (0f64, 0f64, 0f64);
        for (i, vector) in vectors.chunks_exact(self.length).enumerate() {
            all += vector.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>();
            let here = self.vector(i);
            let square = here.iter().zip(vector).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
            wrong += square;
            worst = worst.max(square);
        }
        let all = all.max(f64::MIN_POSITIVE);
        let count = self.clusters.len() as f64;
        CompressionError { mean: (wrong / all).sqrt() as f32, worst: (worst * count / all).sqrt() as f32 }
    }
}

#[derive(Clone, Debug)]
struct Cluster {
    mean: Vec<f32>,
    bases: Vec<f32>,
}

impl Cluster {
    fn at(vector: &[f32]) -> Self {
        Self { mean: vector.to_vec(), bases: Vec::new() }
    }

    fn weight(&self, vector: &[f32], basis: &[f32]) -> f32 {
        vector.iter().zip(&self.mean).zip(basis).map(|((x, m), b)| (x - m) * b).sum()
    }

    /// Square of what is left of a vector.
    fn rest(&self, vector: &[f32]) -> f32 {
        let whole: f32 = vector.iter().zip(&self.mean).map(|(x, m)| (x - m) * (x - m)).sum();
        let bases = self.bases.chunks_exact(vector.len());
        (whole - bases.map(|basis| self.weight(vector, basis).powi(2)).sum::<f32>()).max(0.0)
    }
}

/// Which cluster a vector is in, and the square of what is left of it.
#[derive(Clone, Copy, Debug, Default)]
struct Assigned {
    cluster: u32,
    rest: f32,
}

/// Clusters at vectors each of which is the farthest from those before.
fn starts(vectors: &[f32], length: usize, count: usize) -> Vec<Cluster> {
    let mut clusters = Vec::with_capacity(count);
    let mut nearest = vec![f32::INFINITY; vectors.len() / length];
    let mut next = 0;
    for _ in 0..count {
        let cluster = Cluster::at(&vectors[next * length..(next + 1) * length]);
        for (nearest, vector) in nearest.iter_mut().zip(vectors.chunks_exact(length)) {
            *nearest = nearest.min(cluster.rest(vector));
        }
        clusters.push(cluster);
        next = farthest(nearest.iter().copied());
    }
    clusters
}

/// The first of the largest.
fn farthest(rests: impl Iterator<Item = f32>) -> usize {
    let largest = |best: (usize, f32), (i, rest): (usize, f32)| if rest > best.1 { (i, rest) } else { best };
    rests.enumerate().fold((0, f32::NEG_INFINITY), largest).0
}

/// For each vector the cluster that is least wrong about it, the first of several.
fn assign(clusters: &[Cluster], vectors: &[f32], length: usize) -> Vec<Assigned> {
    let mut assigned = vec![Assigned::default(); vectors.len() / length];
    let chunks = assigned.chunks_mut(CHUNK).zip(vectors.chunks(CHUNK * length)).collect();
    parallel::for_each(chunks, |(assigned, vectors): (&mut [Assigned], &[f32])| {
        for (assigned, vector) in assigned.iter_mut().zip(vectors.chunks_exact(length)) {
            assigned.rest = f32::INFINITY;
            for (cluster, here) in (0..).zip(clusters) {
                let rest = here.rest(vector);
                if rest < assigned.rest {
                    *assigned = Assigned { cluster, rest };
                }
            }
        }
    });
    assigned
}

/// Gives clusters that have nothing the vectors that are most wrong.
fn fill_empty(assigned: &mut [Assigned], clusters: usize) {
    let mut members = vec![0u32; clusters];
    assigned.iter().for_each(|a| members[a.cluster as usize] += 1);
    for empty in (0..clusters).filter(|&c| members[c] == 0) {
        let worst = &mut assigned[farthest(assigned.iter().map(|a| a.rest))];
        *worst = Assigned { cluster: empty as u32, rest: 0.0 };
    }
}

/// Mean and bases of what clusters have.
fn fit(clusters: &mut [Cluster], assigned: &[Assigned], vectors: &[f32], (length, bases): (usize, usize)) {
    let mut members: Vec<Vec<&[f32]>> = vec![Vec::new(); clusters.len()];
    for (assigned, vector) in assigned.iter().zip(vectors.chunks_exact(length)) {
        members[assigned.cluster as usize].push(vector);
    }
    let work = clusters.iter_mut().zip(members).filter(|(_, members)| !members.is_empty()).collect();
    parallel::for_each(work, |(cluster, members): (&mut Cluster, Vec<&[f32]>)| {
        let mut mean = vec![0f64; length];
        for vector in &members {
            mean.iter_mut().zip(*vector).for_each(|(sum, x)| *sum += f64::from(*x));
        }
        mean.iter_mut().for_each(|sum| *sum /= members.len() as f64);
        cluster.mean = mean.iter().map(|m| *m as f32).collect();
        if bases == 0 {
            return;
        }
        let mut covariance = vec![0f64; length * length];
        for vector in members {
            let from_mean: Vec<f64> = vector.iter().zip(&mean).map(|(x, m)| f64::from(*x) - m).collect();
            for (row, x) in covariance.chunks_exact_mut(length).zip(&from_mean) {
                row.iter_mut().zip(&from_mean).for_each(|(sum, y)| *sum += x * y);
            }
        }
        let principal = eigenvectors(covariance, length);
        cluster.bases = principal.into_iter().take(bases).flatten().map(|x| x as f32).collect();
    });
}

/// Eigenvectors of a symmetric matrix of so many rows, those of the largest eigenvalues first, orthonormal: Jacobi's method, row by
/// row (Golub and Van Loan, §8.5).
fn eigenvectors(mut matrix: Vec<f64>, n: usize) -> Vec<Vec<f64>> {
    let mut vectors: Vec<f64> = (0..n * n).map(|i| if i / n == i % n { 1.0 } else { 0.0 }).collect();
    let whole = matrix.iter().map(|x| x * x).sum::<f64>();
    for _ in 0..64 {
        let off: f64 = (0..n * n).filter(|i| i / n != i % n).map(|i| matrix[i] * matrix[i]).sum();
        if off <= 1e-24 * whole {
            break;
        }
        for (p, q) in (0..n).flat_map(|p| (p + 1..n).map(move |q| (p, q))) {
            let beside = matrix[p * n + q];
            if beside == 0.0 {
                continue;
            }
            let tau = (matrix[q * n + q] - matrix[p * n + p]) / (2.0 * beside);
            let tangent = 1f64.copysign(tau) / (tau.abs() + (1.0 + tau * tau).sqrt());
            let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
            let sine = tangent * cosine;
            let turn = |all: &mut [f64], a: usize, b: usize| {
                let (x, y) = (all[a], all[b]);
                (all[a], all[b]) = (cosine * x - sine * y, sine * x + cosine * y);
            };
            for k in 0..n {
                turn(&mut matrix, k * n + p, k * n + q);
            }
            for k in 0..n {
                turn(&mut matrix, p * n + k, q * n + k);
                // As rows, which lie together.
                turn(&mut vectors, p * n + k, q * n + k);
            }
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| matrix[b * n + b].total_cmp(&matrix[a * n + a]));
    order.into_iter().map(|i| vectors[i * n..(i + 1) * n].to_vec()).collect()
}

#[cfg(test)]
mod tests;
