//! Which of a scene's animations play.
//!
//! A file has one for each thing that moves (a door, a lamp), or one for each thing that somebody may do (walk, run). So the first
//! plays, and with it each later one that drives nothing that those before it drive. One that is [chosen](Scene::choose_clip) plays
//! alone.

use super::motion::Pose;
use super::{Channel, NodeId, Scene};
use crate::{Error, Result};
use std::collections::{BTreeMap, BTreeSet};

/// Moments at most that tell where things come by.
const MOST_MOMENTS: usize = 512;

/// What was chosen, and what animations drove, as it was before.
#[derive(Clone, Debug, Default)]
pub(super) struct Clips {
    chosen: Option<usize>,
    at_rest: BTreeMap<NodeId, Pose>,
}

impl Scene {
    /// Indices of the animations that play.
    pub fn playing_clips(&self) -> Vec<usize> {
        match self.clip() {
            Some(chosen) => vec![chosen],
            None => self.compatible_clips(),
        }
    }

    /// The animation that was chosen to play alone, if one was.
    pub fn clip(&self) -> Option<usize> {
        self.clips.chosen.filter(|&clip| clip < self.animations.len())
    }

    /// Has one animation play alone, or, with `None`, all that drive different things. What no longer plays is put back where it was
    /// before; what plays moves with the next [`Scene::set_time`].
    ///
    /// # Errors
    /// [`Error::Invalid`] where there is no such animation.
    pub fn choose_clip(&mut self, clip: Option<usize>) -> Result<()> {
        if let Some(clip) = clip.filter(|&clip| clip >= self.animations.len()) {
            let count = self.animations.len();
            return Err(Error::Invalid(format!("there is no animation {clip}; the scene has {count}")));
        }
        self.set_poses(self.clips.at_rest.values().cloned().collect())?;
        self.clips.chosen = clip;
        Ok(())
    }

    /// The animation of this name, or at this index.
    ///
    /// # Errors
    /// [`Error::Unknown`] with the animations that exist.
    pub fn find_clip(&self, name_or_index: &str) -> Result<usize> {
        if self.animations.is_empty() {
            return Err(Error::Invalid(format!(
                "there is no animation called `{name_or_index}`, nor any other"
            )));
        }
        let named = self.animations.iter().position(|a| a.name == name_or_index);
        let numbered = || name_or_index.parse().ok().filter(|&i: &usize| i < self.animations.len());
        named.or_else(numbered).ok_or_else(|| {
            let known = self.animations.iter().enumerate().map(|(i, a)| format!("{i} ({})", a.name));
            Error::Unknown {
                kind: "animation",
                name: name_or_index.into(),
                known: known.collect::<Vec<_>>().join(", "),
            }
        })
    }

    /// The first animation, and those after it that drive nothing that those before drive.
    fn compatible_clips(&self) -> Vec<usize> {
        let mut driven: BTreeSet<(NodeId, Option<usize>)> = BTreeSet::new();
        let mut result = Vec::new();
        for (index, animation) in self.animations.iter().enumerate() {
            let own: BTreeSet<_> = animation.channels.iter().map(|c| (c.node, c.part())).collect();
            if driven.is_disjoint(&own) {
                driven.extend(own);
                result.push(index);
            }
        }
        result
    }

    fn channels(&self, clips: &[usize]) -> impl Iterator<Item = &Channel> {
        clips.iter().flat_map(|&clip| &self.animations[clip].channels)
    }

    /// Seconds after which what plays repeats: the last key's time. 0 where nothing is animated.
    pub fn duration(&self) -> f64 {
        self.duration_of(&self.playing_clips())
    }

    fn duration_of(&self, clips: &[usize]) -> f64 {
        let times = self.channels(clips).filter_map(|c| c.times.last());
        times.copied().fold(0.0, f32::max).into()
    }

    /// What animations that play make of nodes at a moment, in the order of nodes.
    pub(super) fn poses(&self, seconds: f64) -> Vec<Pose> {
        self.poses_of(&self.playing_clips(), seconds)
    }

    fn poses_of(&self, clips: &[usize], seconds: f64) -> Vec<Pose> {
        let duration = self.duration_of(clips);
        let seconds = if seconds > duration && duration > 0.0 { seconds % duration } else { seconds };
        let mut poses: BTreeMap<NodeId, Pose> = BTreeMap::new();
        for channel in self.channels(clips) {
            let node = channel.node;
            let pose = poses.entry(node).or_insert_with(|| Pose { node, local: None, morph_weights: None });
            channel.add_to(pose, self.nodes[node].local, seconds);
        }
        poses.into_values().collect()
    }

    /// Poses by which all that may be chosen leads, whatever is.
    pub(super) fn all_poses(&self) -> Vec<Vec<Pose>> {
        let together = self.compatible_clips();
        let others = (0..self.animations.len()).filter(|clip| together.binary_search(clip).is_err());
        let mut choices: Vec<Vec<usize>> = others.map(|clip| vec![clip]).collect();
        choices.insert(0, together);
        let most = (MOST_MOMENTS / choices.len()).max(2);
        let poses = choices.iter().flat_map(|clips| {
            self.moments(clips, most).into_iter().map(|seconds| self.poses_of(clips, seconds))
        });
        poses.collect()
    }

    /// Moments that tell where things come by: keys and the middle between them, or so many evenly spaced ones where those are more.
    fn moments(&self, clips: &[usize], most: usize) -> Vec<f64> {
        let mut keys: Vec<f64> = self.channels(clips).flat_map(|c| &c.times).map(|&t| t.into()).collect();
        keys.sort_by(f64::total_cmp);
        keys.dedup();
        if keys.len() > most / 2 {
            let (first, last) = (keys[0], keys[keys.len() - 1]);
            return (0..most).map(|i| first + (last - first) * i as f64 / (most - 1) as f64).collect();
        }
        keys.iter().copied().chain(keys.windows(2).map(|pair| (pair[0] + pair[1]) * 0.5)).collect()
    }

    /// Remembers how nodes are that animations drive, before they first do.
    pub(super) fn remember_rest(&mut self) {
        let driven: BTreeSet<NodeId> =
            self.animations.iter().flat_map(|a| &a.channels).map(|c| c.node).collect();
        for node in driven {
            let at = &self.nodes[node];
            let morph_weights = (!at.morph_weights.is_empty()).then(|| at.morph_weights.clone());
            let pose = || Pose { node, local: Some(at.local), morph_weights };
            self.clips.at_rest.entry(node).or_insert_with(pose);
        }
    }
}
