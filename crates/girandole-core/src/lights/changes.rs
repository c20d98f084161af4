//! Which light samples changed: found where one set takes another's place, for all who derive something from them.

use super::{LightSample, LightSet, SampleId};

/// How a set of light samples differs from the one before, place by place. Lists are sorted, and name each place once.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightChanges {
    moved: Vec<u32>,
    dimmed: Vec<u32>,
    everything: bool,
}

impl LightChanges {
    /// That all samples are others.
    pub fn everything() -> Self {
        Self { everything: true, ..Self::default() }
    }

    /// That these samples moved.
    #[cfg(test)]
    pub(crate) fn of_moved(moved: Vec<u32>) -> Self {
        Self { moved, ..Self::default() }
    }

    /// From one set to another.
    pub(crate) fn between(before: &LightSet, after: &LightSet) -> Self {
        if before.len() != after.len() {
            return Self::everything();
        }
        let mut changes = Self::default();
        for (index, (then, now)) in (0..).zip(before.samples().iter().zip(after.samples())) {
            if then == now {
                continue;
            }
            let is_dimmed = LightSample { intensity: now.intensity, ..*then } == *now;
            if is_dimmed { &mut changes.dimmed } else { &mut changes.moved }.push(index);
        }
        changes
    }

    /// Whether all samples are others: more or fewer, or made anew.
    pub fn is_everything(&self) -> bool {
        self.everything
    }

    /// Whether each sample is as it was.
    pub fn is_empty(&self) -> bool {
        !self.everything && self.moved.is_empty() && self.dimmed.is_empty()
    }

    /// Places in the set whose samples are elsewhere, or are others.
    pub fn moved(&self) -> &[u32] {
        &self.moved
    }

    /// Places in the set whose samples are where they were, and shine otherwise.
    pub fn dimmed(&self) -> &[u32] {
        &self.dimmed
    }

    /// Both, in order.
    pub fn changed(&self) -> Vec<usize> {
        let mut all: Vec<usize> =
            self.moved.iter().chain(&self.dimmed).map(|index| *index as usize).collect();
        all.sort_unstable();
        all
    }

    /// The identities of the samples that changed, in the set after.
    pub fn ids<'a>(&'a self, after: &'a LightSet) -> impl Iterator<Item = SampleId> + 'a {
        self.changed().into_iter().filter_map(|index| after.ids().get(index).copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::LightSettings;
    use crate::scene::Geometry;
    use crate::scene::builtin::{self, MovingObject};
    use glam::Vec3;

    #[test]
    fn changes_name_what_moved_and_what_shines_otherwise() {
        let scene = builtin::build("table", MovingObject::None).expect("a room");
        let geometry = Geometry::new(&scene);
        let set = LightSet::sample(&scene, &geometry, &LightSettings { count: 12, ..Default::default() });
        let set = set.expect("lights");
        let with = |change: &dyn Fn(usize, &mut LightSample)| {
            let mut samples = set.samples().to_vec();
            samples.iter_mut().enumerate().for_each(|(index, sample)| change(index, sample));
            LightSet::from_samples(&geometry, samples)
        };
        let other = with(&|index, sample| match index {
            2 => sample.intensity *= 0.5,
            5 => sample.position += Vec3::Y * 0.1,
            7 => (sample.position, sample.intensity) = (sample.position + Vec3::X, Vec3::ZERO),
            9 => sample.intensity = Vec3::ZERO,
            _ => {}
        });
        let changes = LightChanges::between(&set, &other);
        assert_eq!((changes.moved(), changes.dimmed()), (&[5, 7][..], &[2, 9][..]));
        assert_eq!(changes.changed(), [2, 5, 7, 9]);
        assert!(changes.ids(&other).eq([2, 5, 7, 9].map(|index| other.ids()[index])));
        assert!(LightChanges::between(&set, &set.clone()).is_empty() && !changes.is_empty());
        let fewer = LightSet::from_samples(&geometry, set.samples()[1..].to_vec());
        assert!(LightChanges::between(&set, &fewer).is_everything());
    }
}
