//! What tells light samples apart, from one sampling of a scene to the next.

use super::{LightId, LightSample, SampleOrigin, punctual};
use crate::scene::{Geometry, MaterialId, NONE};
use rustc_hash::FxHashMap;

/// A light sample's identity within its set. It says where the sample comes from, in terms that stay the same when the
/// scene changes elsewhere: the same path of the random walk may end on another triangle, and is the same light then.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SampleId {
    /// A punctual light; a point light has two samples, an even one above and an odd one below.
    Punctual {
        /// The light.
        light: LightId,
        /// Which of its samples: 0 or 1, unless one stands for more light than one sample should carry.
        index: u32,
    },
    /// One of an emitter's samples.
    Emitter {
        /// Index into the scene's objects.
        object: u32,
        /// Its material.
        material: MaterialId,
        /// Whether it shines from the back.
        back: bool,
        /// Which point of its sequence.
        point: u32,
        /// Which of the samples at this point: 0, unless it stands for more light than one sample should carry.
        index: u32,
    },
    /// One of the environment's samples.
    Environment {
        /// Which point of its sequence.
        point: u32,
        /// Whether it is one of the sun's, which have a sequence of their own.
        sun: bool,
        /// Which of the samples at this point: 0, unless it stands for more light than one sample should carry.
        index: u32,
    },
    /// Left by a random walk.
    Bounce {
        /// Which path.
        path: u32,
        /// 1 for the first surface after the emitter.
        bounce: u32,
        /// Which of the samples that were made of it: 0, unless it stands for more light than one sample should carry.
        index: u32,
    },
}

/// Which emitter's point or path's bounce a sample is, wherever that lies.
pub(super) fn origin(sample: &LightSample) -> [u32; 3] {
    match sample.origin {
        SampleOrigin::Punctual { light } => [0, light.0, punctual::side(sample)],
        SampleOrigin::Emitter { triangle, point } => [1, triangle, point],
        SampleOrigin::Bounce { path, bounce, .. } => [2, path, bounce],
        SampleOrigin::Environment { point, sun } => [3 + u32::from(sun), point, 0],
    }
}

/// An id for each sample.
pub(super) fn identify(geometry: &Geometry, samples: &[LightSample]) -> Vec<SampleId> {
    let mut counts: FxHashMap<SampleId, u32> = FxHashMap::default();
    let identify = |sample: &LightSample| {
        let mut id = first(geometry, sample);
        let count = counts.entry(id).or_default();
        let (SampleId::Punctual { index, .. }
        | SampleId::Emitter { index, .. }
        | SampleId::Environment { index, .. }
        | SampleId::Bounce { index, .. }) = &mut id;
        // Of a punctual light's, every other one is on the same side.
        *index += *count * if sample.punctual().is_some() { 2 } else { 1 };
        *count += 1;
        id
    };
    samples.iter().map(identify).collect()
}

/// The id of the first sample of this origin.
fn first(geometry: &Geometry, sample: &LightSample) -> SampleId {
    match sample.origin {
        SampleOrigin::Punctual { light } => SampleId::Punctual { light, index: punctual::side(sample) },
        SampleOrigin::Environment { point, sun } => SampleId::Environment { point, sun, index: 0 },
        SampleOrigin::Bounce { path, bounce, .. } => SampleId::Bounce { path, bounce, index: 0 },
        SampleOrigin::Emitter { triangle, point } => match geometry.triangles.get(triangle as usize) {
            Some(t) => SampleId::Emitter {
                object: t.object,
                material: t.material,
                back: geometry.normal(triangle).dot(sample.normal) < 0.0,
                point,
                index: 0,
            },
            None => {
                SampleId::Emitter { object: NONE, material: MaterialId(NONE), back: false, point, index: 0 }
            }
        },
    }
}
