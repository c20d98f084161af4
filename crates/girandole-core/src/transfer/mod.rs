//! Precomputed radiance transfer (Sloan, Kautz and Snyder 2002; Barczak §4.4): what the vertices of a rigid object receive of
//! light from far away, with the object's own shadows and interreflection, as a dot product.
//!
//! 1. The object is taken out of its scene (`alone.rs`), in *transfer space*: that of its mesh, or, where the object is stretched, the
//!    mesh as stretched as it is.
//! 2. From each vertex rays find out what of the object blocks light (`simulate.rs`). A vertex's *transfer vector* T is the clamped cosine
//!    about its normal, in closed form, less what is blocked, in spherical harmonics.
//! 3. Rays that are blocked bring what is reflected where they end: T of a bounce is a mean of T of the bounce before, at the middles of small
//!    pieces of triangles (`reflectors.rs`).
//! 4. If it is asked for, vectors are compressed (`compression.rs`).
//!
//! The irradiance at a vertex is then `E = Σ T_k c_k`, with the coefficients c of the incident radiance in transfer space
//! ([`ObjectTransfer::irradiance`]). Worked example: on a convex object T is the clamped cosine, and radiance 1 from everywhere, `c₀ = √4π`,
//! has irradiance `T₀ c₀ = π Y₀ √4π = π`.
//!
//! What a surface reflects of irradiance is `albedo / π`, as everywhere. Specular lobes and normal maps have no part in it. Double-sided
//! vertices have a vector for either side.

mod alone;
mod compression;
mod file;
mod incident;
mod lit;
mod points;
mod receivers;
mod reflectors;
mod simulate;

pub use compression::{CompressedTransfer, Compression, CompressionError};
pub use file::{Cached, cached};
pub use incident::{Gathering, IncidentLight};
pub use lit::{Grid, TransferredLight};
pub use simulate::TransferError;

use crate::math::sh::{self, coefficient_count};
use crate::scene::{ObjectId, Scene};
use crate::{Error, Result};
use alone::Alone;
use glam::{DAffine3, DMat3, DVec3, Mat3, Vec3};

/// How transfer is simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferSettings {
    /// Bands of spherical harmonics, 1 to [`MAX_BANDS`](sh::MAX_BANDS). Light and shadows are as sharp as they allow: the thesis's five have 25
    /// coefficients and tell directions apart that are some 45° from each other. More cost the square.
    pub bands: u32,
    /// Rays from each vertex, 64 to 65 536; half of them are the control of the other half. More rays have less noise: the error falls almost with
    /// their number.
    pub directions: u32,
    /// How often light is reflected from the object to itself. 0 is shadows alone. What is left out after three is some
    /// hundredths of a percent of what a torus receives, and a percent in deep hollows.
    pub bounces: u32,
    /// Whether vectors are compressed; without, they are what was found.
    pub compression: Option<Compression>,
}

impl Default for TransferSettings {
    fn default() -> Self {
        Self { bands: 5, directions: 2048, bounces: 3, compression: None }
    }
}

impl TransferSettings {
    /// Whether they are possible.
    ///
    /// # Errors
    /// [`Error::Invalid`] that says which is not.
    pub fn validate(&self) -> Result<()> {
        let within = |what: &str, value: u32, least: u32, most: u32| {
            if (least..=most).contains(&value) {
                return Ok(());
            }
            invalid(format!("transfer cannot have {value} {what}; choose {least} to {most}"))
        };
        within("bands of spherical harmonics", self.bands, 1, sh::MAX_BANDS)?;
        within("rays a vertex", self.directions, 64, 65_536)?;
        within("bounces", self.bounces, 0, 64)?;
        let Some(Compression { clusters, bases }) = self.compression else { return Ok(()) };
        within("clusters", clusters, 1, 4096)?;
        within("bases a cluster", bases, 0, 3 * sh::MAX_BANDS * sh::MAX_BANDS)
    }
}

/// What the vertices of one object receive, by the light that comes to it from far away.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectTransfer {
    bands: u32,
    channels: usize,
    sides: usize,
    vertex_count: usize,
    /// [side][vertex][channel][coefficient].
    coefficients: Vec<f32>,
    compressed: Option<CompressedTransfer>,
    error: TransferError,
    /// Transfer space from mesh space where that is not the identity.
    stretch: Option<DMat3>,
    bounds: (Vec3, Vec3),
    radius: f32,
}

/// Where transfer space is in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferFrame {
    /// A similarity: rotation or reflection, uniform scale and translation.
    pub world_from_transfer: DAffine3,
    /// Turns directions in the world to those of transfer space: orthogonal, its determinant 1 or −1.
    pub transfer_from_world_direction: Mat3,
}

impl ObjectTransfer {
    /// Simulates the transfer of an object as it is: its mesh, its materials, and how it is stretched. Where it is in the scene, and what else
    /// there is, does not matter. The result is the same on every machine; `progress` is called with the finished share, 0 to 1, from any thread.
    ///
    /// # Errors
    /// [`Error::Invalid`] where settings are not possible, there is no such object, or it is deformed, lets light through, or has a
    /// transform that is singular.
    pub fn simulate(
        scene: &Scene,
        object: ObjectId,
        settings: &TransferSettings,
        progress: &(dyn Fn(f32) + Sync),
    ) -> Result<Self> {
        settings.validate()?;
        Ok(Self::of(&Alone::new(scene, object)?, settings, progress))
    }

    fn of(alone: &Alone, settings: &TransferSettings, progress: &(dyn Fn(f32) + Sync)) -> Self {
        let simulated = simulate::simulate(alone, settings, progress);
        let (bounds, radius) = alone.bounds();
        let length = simulated.channels * coefficient_count(settings.bands);
        let compressed = settings
            .compression
            .map(|compression| CompressedTransfer::new(&simulated.coefficients, length, compression));
        Self {
            bands: settings.bands,
            channels: simulated.channels,
            sides: simulated.sides,
            vertex_count: alone.vertex_count(),
            coefficients: compressed.as_ref().map_or(simulated.coefficients, CompressedTransfer::vectors),
            compressed,
            error: simulated.error,
            stretch: alone.stretch,
            bounds,
            radius,
        }
    }

    /// Bands of spherical harmonics.
    pub fn bands(&self) -> u32 {
        self.bands
    }

    /// Vectors a vertex: 1 where all of the object is grey, or it does not light itself, else 3: red, green and blue.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Sides of vertices that have vectors: 2 where a surface is double-sided, else only that of the normal.
    pub fn sides(&self) -> usize {
        self.sides
    }

    /// Vertices, in the order of the mesh.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// How far rays leave it from the truth.
    pub fn error(&self) -> &TransferError {
        &self.error
    }

    /// What its vectors are made of, where they are compressed.
    pub fn compressed(&self) -> Option<&CompressedTransfer> {
        self.compressed.as_ref()
    }

    /// All vectors, \[side\]\[vertex\]\[channel\]\[coefficient\], the side of the normal first. Where they are compressed, this is what is left of
    /// them.
    pub fn coefficients(&self) -> &[f32] {
        &self.coefficients
    }

    /// Smallest and largest corner of the object's box in transfer space.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds
    }

    /// Centre of the object's bounding sphere in transfer space.
    pub fn center(&self) -> Vec3 {
        (self.bounds.0 + self.bounds.1) * 0.5
    }

    /// Radius of the object's bounding sphere in transfer space.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// What a vertex receives on the side of its normal, W/m², of incident radiance with these coefficients in transfer space.
    pub fn irradiance(&self, vertex: usize, environment: &[Vec3]) -> Vec3 {
        self.irradiance_of_side(0, vertex, environment)
    }

    /// What a vertex receives on the side of its normal (0), or on the other one (1), W/m².
    pub fn irradiance_of_side(&self, side: usize, vertex: usize, environment: &[Vec3]) -> Vec3 {
        let length = coefficient_count(self.bands);
        let first = (side * self.vertex_count + vertex) * self.channels * length;
        let all = &self.coefficients[first..first + self.channels * length];
        let mut sum = Vec3::ZERO;
        for channel in 0..3 {
            let vector = &all[length * (channel % self.channels)..][..length];
            sum[channel] = vector.iter().zip(environment).map(|(t, c)| t * c[channel]).sum();
        }
        sum
    }

    /// Where transfer space is, now that the object is where it is.
    ///
    /// # Errors
    /// [`Error::Invalid`] where there is no such object, it has another mesh, or it is not a similarity away from what was simulated.
    pub fn frame(&self, scene: &Scene, object: ObjectId) -> Result<TransferFrame> {
        let found = alone::rigid_object(scene, object)?;
        let vertices = scene.meshes[found.mesh].positions.len();
        if vertices != self.vertex_count {
            return invalid(format!(
                "object {} has {vertices} vertices and its transfer {}; simulate it for this object",
                object.0, self.vertex_count
            ));
        }
        let world = scene.world_from_node(found.node);
        let unstretched = self.stretch.map_or(DMat3::IDENTITY, |stretch| stretch.inverse());
        let linear = world.matrix3 * unstretched;
        let Some(turn) = orthogonal_part(linear) else {
            return invalid(format!(
                "object {} is stretched otherwise than when its transfer was simulated; simulate it anew, or scale it alike along \
                 all axes",
                object.0
            ));
        };
        Ok(TransferFrame {
            world_from_transfer: DAffine3::from_mat3_translation(linear, world.translation),
            transfer_from_world_direction: turn.transpose().as_mat3(),
        })
    }
}

/// How far a similarity may be from one, as a share of its scale: less is not seen.
const SIMILAR: f64 = 1e-3;

/// The rotation, or reflection, of a matrix that is a uniform scale but for that.
fn orthogonal_part(matrix: DMat3) -> Option<DMat3> {
    let scale = matrix.determinant().abs().cbrt();
    let mut turn = matrix * (1.0 / scale);
    let square = turn.transpose() * turn;
    if !(scale > 0.0 && square.abs_diff_eq(DMat3::IDENTITY, 2.0 * SIMILAR)) {
        return None;
    }
    // Newton's iteration for the polar decomposition (Higham 1986).
    for _ in 0..3 {
        turn = (turn + turn.inverse().transpose()) * 0.5;
    }
    turn.is_finite().then_some(turn)
}

/// Bounds of some positions, and the largest distance from their centre; those that are not finite do not count.
fn bounds_of(positions: impl Iterator<Item = DVec3> + Clone) -> ((Vec3, Vec3), f32) {
    let finite = positions.filter(|p| p.is_finite());
    let all = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = finite.clone().fold(all, |(low, high), p| (low.min(p), high.max(p)));
    if !low.cmple(high).all() {
        return ((Vec3::ZERO, Vec3::ZERO), 0.0);
    }
    let center = (low + high) * 0.5;
    let radius = finite.map(|p| p.distance(center)).fold(0.0, f64::max);
    ((low.as_vec3(), high.as_vec3()), radius as f32)
}

fn invalid<T>(sentence: String) -> Result<T> {
    Err(Error::Invalid(sentence))
}

#[cfg(test)]
mod tests;
