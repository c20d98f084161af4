//! A light set whose samples come and go: a fixed number of slots, each with one shadow map. A sample that comes takes a free
//! slot, and its intensity comes in over a few frames, while that of the one that goes fades away: light in all is kept.

use super::emission::{Emissions, Shares};
use super::ids::origin;
use super::resample::Chosen;
use super::{LightSample, Rectangle};
use glam::Vec3;
use rustc_hash::FxHashMap;

/// Turns of the normal by more than this cosine make another sample.
const SAME_NORMAL: f32 = 0.9;

/// How much light, and where it comes from.
#[derive(Clone, Debug, Default)]
struct Light {
    intensity: Vec3,
    shares: Shares,
}

/// A place in the set.
#[derive(Clone, Debug)]
struct Slot {
    /// The stratum that its sample stands for; none, if it fades away or is dark.
    stratum: Option<u64>,
    sample: LightSample,
    from: Light,
    to: Light,
    /// Frames on the way from one to the other.
    step: u32,
}

/// What a stratum is to be represented by.
pub(super) struct Wanted {
    pub stratum: u64,
    pub chosen: Chosen,
}

/// All slots.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    slots: Vec<Slot>,
    /// Frames that it takes a sample to come or to go; 0 = at once.
    fade: u32,
    /// Whether some stratum waits for a slot.
    has_waiting: bool,
}

impl Light {
    fn of(chosen: &Chosen) -> Self {
        Self { intensity: chosen.sample.intensity, shares: chosen.shares.clone() }
    }

    fn mix(&self, other: &Self, t: f32) -> Self {
        let mut shares: Shares = self.shares.iter().map(|&(e, share)| (e, share * (1.0 - t))).collect();
        for &(emission, share) in &other.shares {
            match shares.iter_mut().find(|(known, _)| *known == emission) {
                Some((_, sum)) => *sum += share * t,
                None => shares.push((emission, share * t)),
            }
        }
        Self { intensity: self.intensity.lerp(other.intensity, t), shares }
    }
}

impl Slot {
    fn new(wanted: Wanted, fade: u32) -> Self {
        let to = Light::of(&wanted.chosen);
        let sample = wanted.chosen.sample;
        Self { stratum: Some(wanted.stratum), sample, from: Light::default(), to, step: fade }
    }

    fn light(&self, fade: u32) -> Light {
        if self.step >= fade {
            self.to.clone()
        } else {
            self.from.mix(&self.to, self.step as f32 / fade as f32)
        }
    }

    fn is_dark(&self, fade: u32) -> bool {
        self.stratum.is_none() && self.step >= fade
    }

    /// Goes on to other light, step by step from what it is now.
    fn fade_to(&mut self, stratum: Option<u64>, to: Light, fade: u32) {
        self.from = self.light(fade);
        (self.stratum, self.to, self.step) = (stratum, to, 0);
    }

    /// Whether a sample is the one that is shown, if somewhat elsewhere.
    fn shows(&self, sample: &LightSample) -> bool {
        let reach = sample.rectangle.as_ref().map_or(0.0, Rectangle::radius);
        self.sample.position.distance(sample.position) <= reach
            && self.sample.normal.dot(sample.normal) >= SAME_NORMAL
    }
}

impl Slots {
    /// With these samples at full intensity, and so many more slots that are dark.
    pub fn new(wanted: Vec<Wanted>, spare: usize, fade: u32) -> Self {
        let mut slots: Vec<Slot> = wanted.into_iter().map(|wanted| Slot::new(wanted, fade)).collect();
        let dark = slots.first().cloned().map(|slot| Slot { stratum: None, to: Light::default(), ..slot });
        slots.extend(std::iter::repeat_n(dark, spare).flatten());
        Self { slots, fade, has_waiting: false }
    }

    /// How many samples can come without one that goes being cut off.
    pub fn free(&self) -> usize {
        self.slots.iter().filter(|slot| slot.is_dark(self.fade)).count()
    }

    /// Whether nothing is on its way.
    pub fn is_settled(&self) -> bool {
        !self.has_waiting && self.slots.iter().all(|slot| slot.step >= self.fade)
    }

    /// Takes samples along with what they lie on.
    pub fn carry(&mut self, carry: impl Fn(&LightSample) -> Option<LightSample>) {
        for slot in &mut self.slots {
            slot.sample = carry(&slot.sample).unwrap_or(slot.sample);
        }
    }

    /// Shows what strata are to be represented by. Where a sample would have to come while no slot is free, the one that is
    /// shown stays: `stay` makes it represent its stratum as it is now, if it still can.
    pub fn show(&mut self, wanted: Vec<Wanted>, stay: impl Fn(u64, &LightSample) -> Option<Chosen>) {
        let fade = self.fade;
        let mut by_origin: FxHashMap<[u32; 3], Vec<usize>> = FxHashMap::default();
        let mut by_stratum: FxHashMap<u64, usize> = FxHashMap::default();
        for (index, slot) in self.slots.iter().enumerate().filter(|(_, slot)| slot.stratum.is_some()) {
            by_origin.entry(origin(&slot.sample)).or_default().push(index);
            by_stratum.extend(slot.stratum.map(|stratum| (stratum, index)));
        }
        let mut is_kept = vec![false; self.slots.len()];
        let mut coming = Vec::new();
        for wanted in wanted {
            let sample = &wanted.chosen.sample;
            let same = by_origin.get(&origin(sample)).into_iter().flatten();
            let found = same.copied().find(|&index| !is_kept[index] && self.slots[index].shows(sample));
            let Some(index) = found else {
                coming.push(wanted);
                continue;
            };
            is_kept[index] = true;
            let slot = &mut self.slots[index];
            slot.sample = *sample;
            let to = Light::of(&wanted.chosen);
            if slot.stratum == Some(wanted.stratum) {
                slot.to = to;
            } else {
                slot.fade_to(Some(wanted.stratum), to, fade);
            }
        }
        let before = |wanted: &Wanted, is_kept: &[bool]| {
            by_stratum.get(&wanted.stratum).copied().filter(|&index| !is_kept[index])
        };
        let stays = |wanted: &Wanted, slot: &Slot| stay(wanted.stratum, &slot.sample);
        // Those first whose stratum shows nothing, then those that show what is no more.
        coming.sort_by_cached_key(|wanted| match before(wanted, &is_kept) {
            None => 0,
            Some(index) => 1 + u32::from(stays(wanted, &self.slots[index]).is_some()),
        });
        self.has_waiting = false;
        for wanted in coming {
            match (before(&wanted, &is_kept), self.slots.iter().position(|slot| slot.is_dark(fade))) {
                (Some(index), _) if fade == 0 => {
                    self.slots[index] = Slot::new(wanted, fade);
                    is_kept[index] = true;
                }
                (_, Some(dark)) => {
                    self.slots[dark] = Slot { step: 0, ..Slot::new(wanted, fade) };
                    is_kept[dark] = true;
                }
                (before, None) => {
                    if let Some(index) = before {
                        if let Some(chosen) = stays(&wanted, &self.slots[index]) {
                            self.slots[index].to = Light::of(&chosen);
                            self.slots[index].sample = chosen.sample;
                        }
                        is_kept[index] = true;
                    }
                    self.has_waiting = true;
                }
            }
        }
        for (slot, is_kept) in self.slots.iter_mut().zip(is_kept) {
            if slot.stratum.is_some() && !is_kept {
                slot.fade_to(None, Light::default(), fade);
            }
        }
    }

    /// Goes on by a frame.
    pub fn advance(&mut self) {
        self.slots.iter_mut().for_each(|slot| slot.step = (slot.step + 1).min(self.fade));
    }

    /// What is shown, with what is emitted now instead of when light was sampled.
    pub fn samples<'a>(
        &'a self,
        [sampled, now]: [&'a Emissions; 2],
    ) -> impl Iterator<Item = LightSample> + 'a {
        self.slots.iter().map(move |slot| {
            let Light { intensity, shares } = slot.light(self.fade);
            let intensity = sampled.carried(now, intensity, &shares).unwrap_or(Vec3::ZERO);
            LightSample { intensity, ..slot.sample }
        })
    }
}
