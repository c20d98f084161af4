//! A light set whose samples come and go: a fixed number of slots, each with one shadow map. A sample that comes takes a free
//! slot, and its intensity comes in while that of the one that goes fades away: light in all is kept. How fast depends on what
//! is seen of that (`slots/steps.rs`).

use super::emission::{Emissions, Shares};
use super::ids::origin;
use super::resample::Chosen;
use super::{LightSample, Rectangle};
use glam::Vec3;
use rustc_hash::FxHashMap;

mod steps;

/// Turns of the normal by more than this cosine make another sample…
const SAME_NORMAL: f32 = 0.99;
/// …and centres of rectangles that are farther apart than this share of their radius…
const SAME_CENTER: f32 = 0.75;
/// …or areas that are less or more than these times as large.
const SAME_AREA: [f32; 2] = [0.2, 1.6];

/// How much light, and where it comes from.
#[derive(Clone, Debug, Default, PartialEq)]
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
    now: Light,
    to: Light,
    /// Slots that go to other light together have the same one, and since when.
    group: u64,
    since: u32,
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
    /// See [`Pace`](super::Pace).
    fade: u32,
    frame: u32,
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
    /// At full intensity.
    fn new(Wanted { stratum, chosen }: Wanted) -> Self {
        let to = Light::of(&chosen);
        let (now, group) = (to.clone(), stratum);
        Self { stratum: Some(stratum), sample: chosen.sample, now, to, group, since: 0 }
    }

    fn is_going(&self) -> bool {
        self.now != self.to
    }

    fn is_dark(&self) -> bool {
        self.stratum.is_none() && !self.is_going()
    }

    /// Goes on to other light, from what it is now.
    fn go_to(&mut self, stratum: Option<u64>, to: Light, (group, frame): (u64, u32)) {
        if !self.is_going() {
            self.since = frame;
        }
        (self.stratum, self.to, self.group) = (stratum, to, group);
    }

    fn area(&self) -> f32 {
        self.sample.rectangle.as_ref().map_or(1.0, Rectangle::area).max(f32::MIN_POSITIVE)
    }

    /// Whether a sample is the one that is shown, if somewhat elsewhere, and stands for about the same surface.
    fn shows(&self, sample: &LightSample) -> bool {
        let (Some(old), Some(new)) = (&self.sample.rectangle, &sample.rectangle) else { return true };
        let reach = old.radius();
        self.sample.position.distance(sample.position) <= reach
            && old.center.distance(new.center) <= SAME_CENTER * reach
            && (SAME_AREA[0]..=SAME_AREA[1]).contains(&(new.area() / old.area()))
            && self.sample.normal.dot(sample.normal) >= SAME_NORMAL
    }

    /// Takes the place of a sample that it shows; what that is spread over stays as it is, lest its edges sweep over surfaces
    /// nearby.
    fn follow(&mut self, sample: &LightSample) {
        let shift = sample.position - self.sample.position;
        let rectangle = self.sample.rectangle.map(|r| Rectangle { center: r.center + shift, ..r });
        self.sample = LightSample { rectangle, ..*sample };
    }
}

impl Slots {
    /// With these samples at full intensity, and so many more slots that are dark.
    pub fn new(wanted: Vec<Wanted>, spare: usize, fade: u32) -> Self {
        let mut slots: Vec<Slot> = wanted.into_iter().map(Slot::new).collect();
        let none = Light::default();
        let dark = |slot: Slot| Slot { stratum: None, now: none.clone(), to: none.clone(), ..slot };
        let dark = slots.first().cloned().map(dark);
        slots.extend(std::iter::repeat_n(dark, spare).flatten());
        Self { slots, fade, frame: 0, has_waiting: false }
    }

    /// How many are dark.
    pub fn free(&self) -> usize {
        self.slots.iter().filter(|slot| slot.is_dark()).count()
    }

    /// Whether nothing is on its way.
    pub fn is_settled(&self) -> bool {
        !self.has_waiting && !self.slots.iter().any(Slot::is_going)
    }

    /// Takes samples along with what they lie on.
    pub fn carry(&mut self, carry: impl Fn(&LightSample) -> Option<LightSample>) {
        for slot in &mut self.slots {
            slot.sample = carry(&slot.sample).unwrap_or(slot.sample);
        }
    }

    /// Shows what strata are to be represented by. Where a sample would have to come while no slot is free, the one that is
    /// shown stays: `stay` makes it represent its stratum as it is now, if it still can. What `lineage` says belongs together goes
    /// the same way in the same time.
    pub fn show(
        &mut self,
        wanted: Vec<Wanted>,
        lineage: &[(u64, u64)],
        stay: impl Fn(u64, &LightSample) -> Option<Chosen>,
    ) {
        self.frame += 1;
        let frame = self.frame;
        let lineage: FxHashMap<u64, u64> = lineage.iter().copied().collect();
        let group = |stratum: u64| (lineage.get(&stratum).copied().unwrap_or(stratum), frame);
        let mut by_origin: FxHashMap<[u32; 3], Vec<usize>> = FxHashMap::default();
        let mut by_stratum: FxHashMap<u64, usize> = FxHashMap::default();
        for (index, slot) in self.slots.iter_mut().enumerate() {
            (slot.group, _) = group(slot.group);
            if let Some(stratum) = slot.stratum {
                by_origin.entry(origin(&slot.sample)).or_default().push(index);
                by_stratum.insert(stratum, index);
            }
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
            let (slot, to) = (&mut self.slots[index], Light::of(&wanted.chosen));
            slot.follow(sample);
            slot.stratum = Some(wanted.stratum);
            if slot.to != to {
                slot.go_to(Some(wanted.stratum), to, group(wanted.stratum));
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
            let group = group(wanted.stratum);
            match (before(&wanted, &is_kept), self.slots.iter().position(Slot::is_dark)) {
                (Some(index), _) if self.fade == 0 => {
                    self.slots[index] = Slot::new(wanted);
                    is_kept[index] = true;
                }
                (_, Some(dark)) => {
                    let (group, since) = group;
                    self.slots[dark] = Slot { now: Light::default(), group, since, ..Slot::new(wanted) };
                    is_kept[dark] = true;
                }
                (before, None) => {
                    self.has_waiting = true;
                    let Some(index) = before else { continue };
                    is_kept[index] = true;
                    if let Some(chosen) = stays(&wanted, &self.slots[index]) {
                        self.slots[index].go_to(Some(wanted.stratum), Light::of(&chosen), group);
                    }
                }
            }
        }
        for (slot, _) in self.slots.iter_mut().zip(is_kept).filter(|(_, is_kept)| !is_kept) {
            if let Some(stratum) = slot.stratum {
                slot.go_to(None, Light::default(), group(stratum));
            }
        }
    }

    /// What is shown, with what is emitted now instead of when light was sampled.
    pub fn samples<'a>(
        &'a self,
        [sampled, now]: [&'a Emissions; 2],
    ) -> impl Iterator<Item = LightSample> + 'a {
        self.slots.iter().map(move |slot| {
            let Light { intensity, shares } = &slot.now;
            let intensity = sampled.carried(now, *intensity, shares).unwrap_or(Vec3::ZERO);
            LightSample { intensity, ..slot.sample }
        })
    }
}
