//! How far slots go to other light in a frame: as far as what is seen changes by no more than a little, wherever it is seen.
//!
//! Of each group of slots it is computed what the rest of their way would change at points that are seen, shadows and all. One
//! group after the other, that which has been on its way for longest first, then goes as far of it as the limit leaves at all of
//! these points. What is not seen goes all the way at once; so does a sample for one beside it, or nearly.

use super::{Light, Slot, Slots};
use crate::lights::LightSample;
use glam::Vec3;

/// Change of a point, as a share of the mean brightness, that takes as many frames as [`Pace::fade`](crate::lights::Pace::fade)
/// says.
const USUAL: f32 = 0.25;
/// Of the changes of slots where nothing is known of what is seen, the largest, relative to the median of all lights.
const LARGEST: f32 = 3.0;

/// Points that change by less than this share of the limit are not looked at more closely.
const NOTABLE: f32 = 0.5;
/// One of so many points is looked at more closely, at most, so many times.
const AROUND: usize = 16;
const ROUNDS: usize = 3;

/// A part of what slots go, and what it changes.
struct Group {
    slots: Vec<usize>,
    since: u32,
    id: u64,
}

impl Slot {
    fn change(&self) -> Vec3 {
        self.to.intensity - self.now.intensity
    }

    /// Goes a part of its way.
    fn go(&mut self, part: f32) {
        self.now = if part < 1.0 { self.now.mix(&self.to, part) } else { self.to.clone() };
    }
}

impl Slots {
    /// Goes on by a frame. `brought` computes what samples whose intensity changes by so much bring to points that are seen, by
    /// sample and then by point: per unit of intensity, relative to the mean brightness; `None` where no point is known. It is
    /// asked first for points everywhere; then, for those samples alone that would go on, for points that these light most
    /// and for others close to some of those that it gave so far, by their numbers. In a `hurry` each goes the `fade`th part of
    /// what is left of its way at least, however much that changes.
    pub fn advance(
        &mut self,
        in_hurry: bool,
        mut brought: impl FnMut(&[(LightSample, Vec3)], Option<&[usize]>) -> Option<Vec<f32>>,
    ) {
        let going: Vec<usize> = (0..self.slots.len()).filter(|&i| self.slots[i].is_going()).collect();
        if self.fade == 0 || going.is_empty() {
            self.slots.iter_mut().for_each(|slot| slot.go(1.0));
            return;
        }
        let changes: Vec<_> = going.iter().map(|&i| (self.slots[i].sample, self.slots[i].change())).collect();
        let mut groups = self.groups(&going);
        let limit = USUAL / self.fade as f32;
        let least = if in_hurry { 1.0 / self.fade as f32 } else { 0.0 };
        let Some(everywhere) = brought(&changes, None) else { return self.go_unseen(&groups) };
        let mut seen = Seen { rows: vec![Vec::new(); going.len()], changes };
        seen.add(&everywhere);
        let mut rows: Vec<Vec<usize>> = groups.iter().map(|group| rows_of(group, &going)).collect();
        let mut parts = seen.parts(&rows, limit, least);
        // Those that wait for others change nothing, wherever one looks.
        let goes: Vec<bool> = parts.iter().map(|&part| part > 0.0).collect();
        retain(&mut groups, &goes);
        retain(&mut rows, &goes);
        retain(&mut parts, &goes);
        seen.keep(&mut rows);
        // Where they light most, and close to those points that change most, others may change more.
        for round in 0..ROUNDS {
            let around = seen.most_changed(&rows, &parts, limit);
            if around.is_empty() && round > 0 {
                break;
            }
            seen.add(&brought(&seen.changes, Some(&around)).unwrap_or_default());
            parts = seen.parts(&rows, limit, least);
        }
        for (group, part) in groups.iter().zip(parts) {
            group.slots.iter().for_each(|&slot| self.slots[slot].go(part));
        }
    }

    /// Slots that are on their way, those first that have been so for longest.
    fn groups(&self, going: &[usize]) -> Vec<Group> {
        let mut order = going.to_vec();
        order.sort_by_key(|&slot| self.slots[slot].group);
        let same = |a: &usize, b: &usize| self.slots[*a].group == self.slots[*b].group;
        let of = |slots: &[usize]| {
            let since = slots.iter().map(|&slot| self.slots[slot].since).min().unwrap_or(0);
            Group { slots: slots.to_vec(), since, id: self.slots[slots[0]].group }
        };
        let mut groups: Vec<Group> = order.chunk_by(same).map(of).collect();
        groups.sort_by_key(|group| (group.since, group.id));
        groups
    }

    /// Goes on where nothing is known of what is seen: the slower, the brighter.
    fn go_unseen(&mut self, groups: &[Group]) {
        let bright = |slot: &Slot, Light { intensity, .. }: &Light| intensity.max_element() / slot.area();
        let lit = self.slots.iter().filter(|slot| slot.stratum.is_some());
        let mut all: Vec<f32> = lit.map(|slot| bright(slot, &slot.to)).collect();
        all.sort_unstable_by(f32::total_cmp);
        let usual = all.get(all.len() / 2).copied().unwrap_or(0.0);
        for Group { slots, .. } in groups {
            let change = |&i: &usize| self.slots[i].change().abs().max_element() / self.slots[i].area();
            let most = (slots.iter().map(change).fold(0.0, f32::max) / usual).min(LARGEST);
            let part = 1.0 / (self.fade as f32 * most);
            slots.iter().for_each(|&slot| self.slots[slot].go(part));
        }
    }
}

/// Keeps some.
fn retain<T>(all: &mut Vec<T>, is_kept: &[bool]) {
    let mut is_kept = is_kept.iter();
    all.retain(|_| is_kept.next().is_some_and(|&kept| kept));
}

/// Where the slots of a group are among those that are on their way.
fn rows_of(group: &Group, going: &[usize]) -> Vec<usize> {
    group.slots.iter().filter_map(|slot| going.binary_search(slot).ok()).collect()
}

/// What slots bring to points that are seen, and by how much they are to change.
struct Seen {
    /// By slot, then by point.
    rows: Vec<Vec<f32>>,
    changes: Vec<(LightSample, Vec3)>,
}

impl Seen {
    /// Keeps these slots alone, which have other numbers then.
    fn keep(&mut self, groups: &mut [Vec<usize>]) {
        let kept: Vec<usize> = groups.concat();
        self.rows = kept.iter().map(|&row| std::mem::take(&mut self.rows[row])).collect();
        self.changes = kept.iter().map(|&row| self.changes[row]).collect();
        groups.iter_mut().flatten().zip(0..).for_each(|(row, number)| *row = number);
    }

    /// Takes more points, by slot and then by point.
    fn add(&mut self, brought: &[f32]) {
        let points = brought.len() / self.rows.len().max(1);
        let parts = brought.chunks_exact(points.max(1));
        self.rows.iter_mut().zip(parts).for_each(|(row, part)| row.extend_from_slice(part));
    }

    fn points(&self) -> usize {
        self.rows.first().map_or(0, Vec::len)
    }

    /// How far each group may go, one after the other, and at least.
    fn parts(&self, groups: &[Vec<usize>], limit: f32, least: f32) -> Vec<f32> {
        let mut changed = vec![Vec3::ZERO; self.points()];
        let mut part_of = |rows: &Vec<usize>| {
            let mut rest = vec![Vec3::ZERO; self.points()];
            for &row in rows {
                let change = self.changes[row].1;
                rest.iter_mut().zip(&self.rows[row]).for_each(|(rest, &brought)| *rest += change * brought);
            }
            let parts = changed.iter().zip(&rest).map(|(c, r)| largest_part(*c, *r, limit));
            let part = parts.fold(1.0, f32::min).max(least);
            changed.iter_mut().zip(&rest).for_each(|(changed, rest)| *changed += *rest * part);
            part
        };
        groups.iter().map(&mut part_of).collect()
    }

    /// The points to which single slots change most if groups go so far, whatever is left of that in all: close to them, less may
    /// cancel. None where a part of the limit is not reached.
    fn most_changed(&self, groups: &[Vec<usize>], parts: &[f32], limit: f32) -> Vec<usize> {
        let mut changed = vec![0.0; self.points()];
        for (rows, part) in groups.iter().zip(parts) {
            for &row in rows {
                let change = self.changes[row].1.abs().max_element() * part;
                changed.iter_mut().zip(&self.rows[row]).for_each(|(sum, &brought)| *sum += change * brought);
            }
        }
        let mut order: Vec<usize> =
            (0..changed.len()).filter(|&point| changed[point] > NOTABLE * limit).collect();
        order.sort_by(|&a, &b| changed[b].total_cmp(&changed[a]).then(a.cmp(&b)));
        order.truncate(self.points() / AROUND);
        order
    }
}

/// How far a point may go on its way, where it has changed already.
fn largest_part(changed: Vec3, rest: Vec3, limit: f32) -> f32 {
    let left = Vec3::splat(limit) - changed * rest.signum();
    let parts = left.max(Vec3::ZERO) / rest.abs();
    [parts.x, parts.y, parts.z].into_iter().fold(1.0, f32::min)
}

#[cfg(test)]
mod tests {
    use super::super::{Chosen, Wanted};
    use super::*;
    use crate::lights::{Profile, SampleOrigin};

    fn wanted(stratum: u64, point: u32) -> Wanted {
        let sample = LightSample {
            position: Vec3::ZERO,
            normal: Vec3::Y,
            intensity: Vec3::ONE,
            profile: Profile::Cosine,
            origin: SampleOrigin::Emitter { triangle: 0, point },
            rectangle: None,
        };
        Wanted { stratum, chosen: Chosen { sample, shares: Vec::new() } }
    }

    /// Two strata that are to show other samples: points 2 and 3 for 0 and 1.
    fn going(fade: u32) -> Slots {
        let mut slots = Slots::new(vec![wanted(0, 0), wanted(1, 1)], 2, fade);
        slots.show(vec![wanted(0, 2), wanted(1, 3)], &[], |_, _| None);
        slots
    }

    /// At the one point that is seen: nothing of the second stratum.
    fn brings(sample: &LightSample) -> f32 {
        match sample.origin {
            SampleOrigin::Emitter { point: 0, .. } => 2.0,
            SampleOrigin::Emitter { point: 2, .. } => 1.0,
            _ => 0.0,
        }
    }

    fn brought(changes: &[(LightSample, Vec3)], around: Option<&[usize]>) -> Option<Vec<f32>> {
        let changes = if around.is_none() { changes } else { &[] };
        Some(changes.iter().map(|(sample, _)| brings(sample)).collect())
    }

    fn lit(slots: &Slots) -> f32 {
        slots.slots.iter().map(|slot| slot.now.intensity.x * brings(&slot.sample)).sum()
    }

    #[test]
    fn what_is_seen_changes_by_no_more_than_the_limit_and_the_rest_at_once() {
        let limit = USUAL / 5.0;
        let mut slots = going(5);
        let (mut before, mut frames) = (lit(&slots), 0);
        while !slots.is_settled() {
            slots.advance(false, brought);
            let (now, change) = (lit(&slots), (lit(&slots) - before).abs());
            assert!(change <= limit * 1.001, "{change}");
            (before, frames) = (now, frames + 1);
            let of = |point: u32| {
                let is_it = |slot: &&Slot| slot.sample.origin == SampleOrigin::Emitter { triangle: 0, point };
                slots.slots.iter().find(is_it).map_or(0.0, |slot| slot.now.intensity.x)
            };
            assert_eq!(of(3), 1.0, "nobody sees it");
            assert!((of(0) + of(2) - 1.0).abs() < 1e-5, "they go together");
        }
        // From 2 to 1 in steps of a twentieth, and not much slower.
        assert_eq!(before, 1.0);
        assert!((20..=21).contains(&frames), "{frames}");
        // In a hurry more may change, if not at once.
        let mut slots = going(5);
        let before = lit(&slots);
        slots.advance(true, brought);
        assert!((before - lit(&slots) - 0.2).abs() < 1e-6, "a fifth of 1");
        // The control: at once, if that is wanted.
        let mut slots = going(0);
        slots.advance(false, brought);
        assert!(slots.is_settled());
        assert_eq!(lit(&slots), 1.0);
    }

    #[test]
    fn points_close_to_those_that_change_much_are_watched_as_well() {
        // What is watched at first has the same of both samples; what lies beside it has nothing of the new one.
        let limit = USUAL / 5.0;
        let one = |samples: &[(LightSample, Vec3)], close: bool| -> Vec<f32> {
            let of = |sample: &LightSample| match sample.origin {
                SampleOrigin::Emitter { point: 0, .. } => 2.0,
                SampleOrigin::Emitter { point: 2, .. } if !close => 2.0,
                _ => 0.0,
            };
            samples.iter().flat_map(|(sample, _)| [of(sample); AROUND]).collect()
        };
        let change = |with_close: bool| {
            let mut slots = going(5);
            slots.advance(false, |changes, around| match (around.is_none(), with_close) {
                (true, _) => Some(one(changes, false)),
                (_, true) => Some(one(changes, true)),
                (_, false) => None,
            });
            let of = |slot: &Slot| if brings(&slot.sample) == 2.0 { slot.now.intensity.x * 2.0 } else { 0.0 };
            2.0 - slots.slots.iter().map(of).sum::<f32>()
        };
        assert!(change(true) <= 1.001 * limit, "{}", change(true));
        // The control.
        assert_eq!(change(false), 2.0);
    }

    #[test]
    fn where_nothing_is_known_to_be_seen_it_takes_the_frames_that_are_given() {
        let mut slots = going(5);
        let frames = (1..).find(|_| {
            slots.advance(false, |_, _| None);
            slots.is_settled()
        });
        assert_eq!(frames, Some(5));
    }

    #[test]
    fn a_point_that_has_changed_may_change_back_but_not_on() {
        let part = |changed: f32, rest: f32| largest_part(Vec3::splat(changed), Vec3::splat(rest), 0.1);
        assert_eq!(part(0.1, 1.0), 0.0);
        assert!((part(0.1, -1.0) - 0.2).abs() < 1e-6);
        assert_eq!((part(0.1, -0.2), part(0.1, 0.0), part(0.0, 0.1)), (1.0, 1.0, 1.0));
    }

    #[test]
    fn what_goes_on_is_looked_at_where_it_lights_most_and_what_waits_is_not() {
        let limit = USUAL / 5.0;
        // The first stratum changes the one point that is known by as much as it may, so that another that lights it waits.
        let everywhere = |(sample, _): &(LightSample, Vec3)| match sample.origin {
            SampleOrigin::Emitter { point: 1, .. } => 1.0,
            _ => brings(sample),
        };
        let after = |peak: f32| {
            let mut slots = going(5);
            let mut asked = Vec::new();
            slots.advance(false, |changes, around| {
                let Some(_) = around else { return Some(changes.iter().map(everywhere).collect()) };
                asked.push(changes.len());
                // Samples 0 and 2 light another point by more, once.
                let more = |(sample, _): &(LightSample, Vec3)| peak * brings(sample);
                Some(if asked.len() == 1 { changes.iter().map(more).collect() } else { Vec::new() })
            });
            let gone = |point: u32| {
                let is_it = |slot: &&Slot| matches!(slot.sample.origin, SampleOrigin::Emitter { point: p, .. } if p == point);
                slots
                    .slots
                    .iter()
                    .find(|slot| is_it(slot) && slot.now.intensity != Vec3::ZERO)
                    .map(|s| s.now.intensity.x)
            };
            (gone(2).unwrap_or(0.0), asked)
        };
        let (plain, asked) = after(0.0);
        let (watched, _) = after(4.0);
        // Not all four samples: those of the second stratum wait.
        assert!(asked.iter().all(|&count| count == 2), "{asked:?}");
        // Light of 1 comes where 2 goes.
        assert!((watched - 0.25 * limit).abs() < 1e-5, "{watched}");
        // The control: without that point it goes four times as far.
        assert!((plain - limit).abs() < 1e-5, "{plain}");
    }
}
