//! Files that hold the transfer of an object, so that it is simulated once.
//!
//! Little endian: a magic word, the version, the key of object and settings, a header, the vectors or what they are made of, and a checksum of
//! all that.

use super::alone::Alone;
use super::{
    CompressedTransfer, Compression, CompressionError, ObjectTransfer, TransferError, TransferSettings,
};
use crate::math::sh::coefficient_count;
use crate::scene::{ObjectId, Scene};
use crate::{Result, files};
use fnv::FnvHasher;
use glam::{DMat3, Vec3};
use std::hash::Hasher;
use std::path::Path;

const MAGIC: &[u8; 8] = b"GIRTRANS";
/// Of the format, and of what the simulator finds.
const VERSION: u32 = 3;

/// Whether transfer was there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Cached {
    /// It was read.
    Found,
    /// It was simulated for the first time.
    Computed,
    /// It was simulated again, for what was there is of no use.
    Recomputed {
        /// Why.
        why: String,
    },
    /// It was simulated, and could not be kept.
    NotKept {
        /// Why.
        why: String,
    },
}

/// The transfer of an object: read from a folder where it was simulated before with these settings, else simulated and kept there. A file
/// that is damaged, of another version or of something else is simulated again and overwritten. Its name is the key: a hash of the mesh, of what
/// its materials reflect, of how it is stretched, and of the settings.
///
/// # Errors
/// As [`ObjectTransfer::simulate`]. A folder that cannot be written is none ([`Cached::NotKept`]).
pub fn cached(
    scene: &Scene,
    object: ObjectId,
    settings: &TransferSettings,
    folder: &Path,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<(ObjectTransfer, Cached)> {
    settings.validate()?;
    let alone = Alone::new(scene, object)?;
    let key = key(&alone, settings);
    let path = folder.join(format!("{key:016x}.transfer"));
    let mut cached = Cached::Computed;
    if path.exists() {
        match files::read(&path)
            .map_err(|e| e.to_string())
            .and_then(|bytes| ObjectTransfer::read(&bytes, key))
        {
            Ok(transfer) if transfer.vertex_count == alone.vertex_count() => {
                return Ok((transfer, Cached::Found));
            }
            Ok(_) => cached = Cached::Recomputed { why: format!("{} is of another mesh", path.display()) },
            Err(why) => cached = Cached::Recomputed { why: format!("{} {why}", path.display()) },
        }
    }
    let transfer = ObjectTransfer::of(&alone, settings, progress);
    let kept = std::fs::create_dir_all(folder)
        .map_err(|error| format!("{} cannot be made: {error}", folder.display()))
        .and_then(|()| files::write(&path, &transfer.write(key)).map_err(|error| error.to_string()));
    if let Err(why) = kept {
        cached = Cached::NotKept { why };
    }
    Ok((transfer, cached))
}

/// A hash of all that transfer depends on.
fn key(alone: &Alone, settings: &TransferSettings) -> u64 {
    let mut hasher = FnvHasher::default();
    let mesh = alone.mesh();
    hasher.write_u32(VERSION);
    hasher.write(bytemuck::cast_slice(&mesh.positions));
    hasher.write(bytemuck::cast_slice(&mesh.normals));
    hasher.write(bytemuck::cast_slice(&mesh.colors));
    for uv in &mesh.uvs {
        hasher.write(bytemuck::cast_slice(uv));
    }
    for triangle in &mesh.triangles {
        hasher.write(bytemuck::cast_slice(&triangle.vertices));
        hasher.write_u32(triangle.material.0);
    }
    for texture in &alone.scene.textures {
        hasher.write(bytemuck::cast_slice(&texture.texels));
        hasher.write(
            format!("{} {} {:?} {:?}", texture.width, texture.height, texture.wrap, texture.filter)
                .as_bytes(),
        );
    }
    hasher.write(format!("{:?} {:?} {settings:?}", alone.scene.materials, alone.stretch).as_bytes());
    hasher.finish()
}

impl ObjectTransfer {
    /// As a file's bytes, for this key.
    pub(super) fn write(&self, key: u64) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        let compressed = self.compressed.as_ref();
        // No clusters: vectors as they are.
        let clusters = compressed.map_or(0, |c| c.means.len() / c.length);
        let bases = compressed.map_or(0, |c| c.bases_each);
        let sizes = [self.channels, self.sides, self.vertex_count, clusters, bases].map(|n| n as u32);
        let TransferError { constant, constant_worst, vector, vector_worst } = self.error;
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(key.to_le_bytes());
        bytes.extend(self.bands.to_le_bytes());
        bytes.extend(sizes.iter().flat_map(|n| n.to_le_bytes()));
        let stretch = self.stretch.unwrap_or(DMat3::ZERO);
        bytes.extend(stretch.to_cols_array().iter().flat_map(|x| x.to_le_bytes()));
        let (low, high) = self.bounds;
        let numbers = [constant, constant_worst, vector, vector_worst, self.radius];
        let numbers = numbers.into_iter().chain(low.to_array()).chain(high.to_array());
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        match compressed {
            None => bytes.extend(self.coefficients.iter().flat_map(|x| x.to_le_bytes())),
            Some(compressed) => {
                let CompressionError { mean, worst } = compressed.error;
                bytes.extend(compressed.clusters.iter().flat_map(|n| n.to_le_bytes()));
                let all = [&[mean, worst][..], &compressed.weights, &compressed.means, &compressed.bases];
                bytes.extend(all.into_iter().flatten().flat_map(|x| x.to_le_bytes()));
            }
        }
        let checksum = crc32fast::hash(&bytes);
        bytes.extend(checksum.to_le_bytes());
        bytes
    }

    /// From a file's bytes, for this key; else what is wrong with them.
    pub(super) fn read(bytes: &[u8], key: u64) -> std::result::Result<Self, String> {
        let rest = bytes.strip_prefix(MAGIC).ok_or("is no file of transfer")?;
        let mut rest = Words(rest);
        let damaged = || "is damaged".to_owned();
        let version = rest.u32().ok_or_else(damaged)?;
        if version != VERSION {
            return Err(format!("is of version {version}, and this program writes version {VERSION}"));
        }
        let (body, checksum) = bytes.split_at(bytes.len() - 4);
        if checksum != crc32fast::hash(body).to_le_bytes() {
            return Err(damaged());
        }
        rest.0 = &rest.0[..rest.0.len() - 4];
        if rest.take().map(u64::from_le_bytes) != Some(key) {
            return Err("is of another object or other settings".into());
        }
        rest.transfer().ok_or_else(damaged)
    }
}

/// What is left of a file.
struct Words<'a>(&'a [u8]);

impl Words<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn f32(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes).filter(|x| x.is_finite())
    }

    fn vector(&mut self) -> Option<Vec3> {
        Some(Vec3::new(self.f32()?, self.f32()?, self.f32()?))
    }

    /// So many numbers, if there are as many.
    fn floats(&mut self, count: usize) -> Option<Vec<f32>> {
        (self.0.len() / 4 >= count).then_some(())?;
        (0..count).map(|_| self.f32()).collect()
    }

    fn compressed(
        &mut self,
        vectors: usize,
        length: usize,
        (clusters, bases): (u32, u32),
    ) -> Option<CompressedTransfer> {
        (self.0.len() / 4 >= vectors).then_some(())?;
        let of_vector = (0..vectors).map(|_| self.u32().filter(|&c| c < clusters));
        let of_vector = of_vector.collect::<Option<Vec<u32>>>()?;
        let (clusters, bases) = (clusters as usize, bases as usize);
        let error = CompressionError { mean: self.f32()?, worst: self.f32()? };
        Some(CompressedTransfer {
            length,
            bases_each: bases,
            clusters: of_vector,
            weights: self.floats(vectors.checked_mul(bases)?)?,
            means: self.floats(clusters * length)?,
            bases: self.floats(clusters * bases * length)?,
            error,
        })
    }

    /// All that follows the key.
    fn transfer(&mut self) -> Option<ObjectTransfer> {
        let [bands, channels, sides] = [self.u32()?, self.u32()?, self.u32()?];
        let [vertices, clusters, bases] = [self.u32()?, self.u32()?, self.u32()?];
        let mut columns = [0.0; 9];
        for value in &mut columns {
            *value = self.take().map(f64::from_le_bytes).filter(|x| x.is_finite())?;
        }
        let stretch = DMat3::from_cols_array(&columns);
        let error = TransferError {
            constant: self.f32()?,
            constant_worst: self.f32()?,
            vector: self.f32()?,
            vector_worst: self.f32()?,
        };
        let radius = self.f32()?;
        let bounds = (self.vector()?, self.vector()?);
        let compression = (clusters > 0).then_some(Compression { clusters, bases });
        let is_possible =
            TransferSettings { bands, compression, ..TransferSettings::default() }.validate().is_ok()
                && [1, 3].contains(&channels)
                && [1, 2].contains(&sides);
        if !is_possible {
            return None;
        }
        let length = channels as usize * coefficient_count(bands);
        let vectors = (sides as usize).checked_mul(vertices as usize)?;
        let (coefficients, compressed) = match compression {
            None => (self.floats(vectors.checked_mul(length)?)?, None),
            Some(_) => {
                let compressed = self.compressed(vectors, length, (clusters, bases))?;
                (compressed.vectors(), Some(compressed))
            }
        };
        if !self.0.is_empty() {
            return None;
        }
        Some(ObjectTransfer {
            bands,
            channels: channels as usize,
            sides: sides as usize,
            vertex_count: vertices as usize,
            coefficients,
            compressed,
            error,
            stretch: (stretch != DMat3::ZERO).then_some(stretch),
            bounds,
            radius,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin::shapes;
    use crate::scene::{Material, Transform};

    fn torus(albedo: f32) -> Scene {
        let mut scene = Scene::default();
        let material = scene.add_material(Material::diffuse("", Vec3::splat(albedo)));
        scene.add_object("", shapes::torus(1.0, 0.4, 12, 8, material), Transform::IDENTITY);
        scene
    }

    #[test]
    fn transfer_is_kept_and_what_is_damaged_or_foreign_is_simulated_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path().join("below");
        let settings = TransferSettings { directions: 64, bounces: 1, ..TransferSettings::default() };
        let get = |scene: &Scene, settings: &TransferSettings| {
            cached(scene, ObjectId(0), settings, &folder, &|_| ()).expect("transfer")
        };
        let scene = torus(0.5);
        let (first, how) = get(&scene, &settings);
        assert_eq!(how, Cached::Computed);
        let (again, how) = get(&scene, &settings);
        assert!(again == first && how == Cached::Found, "{how:?}");
        // Other settings, other materials and other places that stretch it have files of their own; where it is does not matter.
        assert_eq!(get(&scene, &TransferSettings { bounces: 2, ..settings.clone() }).1, Cached::Computed);
        assert_eq!(get(&torus(0.6), &settings).1, Cached::Computed);
        // Compressed vectors come back as they were, in a smaller file.
        let compression = Some(Compression { clusters: 3, bases: 4 });
        let compact = TransferSettings { compression, ..settings.clone() };
        let (compressed, how) = get(&scene, &compact);
        assert!(how == Cached::Computed && compressed != first);
        assert!(get(&scene, &compact) == (compressed.clone(), Cached::Found));
        assert!(compressed.write(0).len() < first.write(0).len() / 2);
        let mut moved = torus(0.5);
        moved.nodes[0].local = Transform::translation(Vec3::new(3.0, 1.0, 0.5));
        assert_eq!(get(&moved, &settings).1, Cached::Found);
        // What is of no use.
        let key = key(&Alone::new(&scene, ObjectId(0)).expect("alone"), &settings);
        let path = folder.join(format!("{key:016x}.transfer"));
        let good = std::fs::read(&path).expect("a file");
        let mut flipped = good.clone();
        flipped[200] ^= 1;
        let mut older = good.clone();
        older[8] = 0;
        for (bytes, fragment) in [
            (&good[..good.len() / 2], "damaged"),
            (&good[..10], "damaged"),
            (&flipped, "damaged"),
            (&older, "version 0"),
            (b"PNG and so on, longer than a header", "no file of transfer"),
            (&first.write(key + 1), "another object"),
        ] {
            std::fs::write(&path, bytes).expect("written");
            let (found, how) = get(&scene, &settings);
            assert!(found == first);
            assert!(
                matches!(&how, Cached::Recomputed { why } if why.contains(fragment)),
                "{fragment}: {how:?}"
            );
            assert!(std::fs::read(&path).expect("a file") == good, "{fragment}: overwritten");
        }
        let blocked = folder.join("blocked");
        std::fs::write(&blocked, b"").expect("a file in the way");
        let (found, how) = cached(&scene, ObjectId(0), &settings, &blocked, &|_| ()).expect("transfer");
        assert!(found == first && matches!(how, Cached::NotKept { .. }), "{how:?}");
    }
}
