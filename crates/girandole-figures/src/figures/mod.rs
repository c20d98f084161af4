//! The experiments, each a module.

use crate::bench::Bench;
use crate::report::Outcome;
use anyhow::Result;

mod bleeding;
mod block;
mod cost;
mod edges;
mod error;
mod failures;
mod fit;
mod leaks;
mod levels;
mod lights;
mod lit;
mod low_resolution;
mod mitsuba;
mod motion;
mod passes;
mod resolutions;
mod scenes;
mod shadows;
mod silhouettes;
mod staleness;
mod structure;
mod subjects;
mod swarm;
mod transfer;
mod updates;
mod variants;
mod views;

/// An experiment.
pub struct Figure {
    /// Its number in the thesis, as `5-2`, or a name where it is one of ours.
    pub id: &'static str,
    /// What it is about.
    pub title: &'static str,
    /// What the thesis shows; of our own experiments, what is asked.
    pub thesis: &'static str,
    /// Makes it.
    pub run: fn(&Bench) -> Result<Outcome>,
}

/// All of them: the thesis's in its order, then ours.
pub const FIGURES: [Figure; 23] = [
    leaks::FIGURE,
    edges::WITHOUT,
    edges::STEPS,
    passes::VIEWS,
    passes::PILLAR,
    transfer::SELF_SHADOWS,
    transfer::EDGE,
    staleness::FIGURE,
    scenes::FIGURE,
    lights::SCENES,
    lights::MODES,
    updates::FRAMES,
    updates::MAPS,
    updates::SHARES,
    shadows::FIGURE,
    resolutions::FIGURE,
    bleeding::FIGURE,
    block::FIGURE,
    failures::FIGURE,
    silhouettes::FIGURE,
    levels::FIGURE,
    cost::FIGURE,
    error::FIGURE,
];
