//! How bright all candidates make points that are seen.

use super::LightSample;
use glam::Vec3;

/// What is taken together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Emitters, and what surfaces reflect.
    Near,
    /// What comes from an environment.
    Sky,
}

impl Kind {
    /// That of a sample; `None` where all of its light is there in any case: of the sun and of punctual lights.
    pub fn of(sample: &LightSample) -> Option<Self> {
        let is_whole = sample.is_of_sun() || sample.punctual().is_some();
        let kind = if sample.profile.is_parallel() { Self::Sky } else { Self::Near };
        (!is_whole).then_some(kind)
    }
}

/// What all candidates bring to points, by kind, by point and by channel.
#[derive(Clone, Debug)]
pub(super) struct Brightness {
    near: Vec<Measured>,
    sky: Vec<Measured>,
}

/// At a point: the sum over pairs, and over their squares, which is the variance of that sum at most.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Measured {
    pub light: Vec3,
    pub variance: Vec3,
}

impl Brightness {
    /// Of so many points, by pairs of a candidate and a point.
    pub fn of<'a>(points: usize, pairs: impl Iterator<Item = (&'a LightSample, usize, Vec3)>) -> Self {
        let none = vec![Measured::default(); points];
        let mut result = Self { near: none.clone(), sky: none };
        for (candidate, point, light) in pairs {
            let measured = match Kind::of(candidate) {
                Some(Kind::Near) => &mut result.near[point],
                Some(Kind::Sky) => &mut result.sky[point],
                None => continue,
            };
            measured.light += light;
            measured.variance += light * light;
        }
        result
    }

    /// Near things first.
    pub fn by_kind(&self) -> [(Kind, &[Measured]); 2] {
        [(Kind::Near, &self.near), (Kind::Sky, &self.sky)]
    }
}
