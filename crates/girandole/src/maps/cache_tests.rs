//! The cache over many frames.

use super::cache::{MapCache, MapIndex, MapUpdate, StaleCounts};
use super::layout::{AtlasLayout, MapSlot};
use super::map_view::{ShownSquare, TexelRect};
use super::snapshot::Snapshot;
use crate::layout::Light;
use crate::settings::{MapPriority, MapUpdates, RendererOptions};
use crate::shader_constants::{DIRECTIONAL, DISTANT, NO_MAP};
use girandole_core::glam::{Vec3, Vec4};
use girandole_core::math::sequence::sample;
use std::collections::BTreeSet;

const SIZE: u32 = 64;

fn lights_of(intensities: &[f32]) -> Vec<Light> {
    let light = |&i: &f32| Light { intensity: Vec3::new(0.0, i, i / 2.0), ..Light::default() };
    intensities.iter().map(light).collect()
}

/// A cache for the maps of lights, of which `directional[i]` tells whether light i is a directional one.
fn cache(directional: &[bool], options: RendererOptions) -> MapCache {
    let layout = AtlasLayout::new(directional, 256, &options, &wgpu::Limits::default()).expect("a layout");
    MapCache::new(&layout, directional.len())
}

/// Lights of these intensities, with maps that are up to date and are all looked up.
fn drawn(intensities: &[f32]) -> (MapCache, Vec<Light>) {
    let lights = lights_of(intensities);
    let options = RendererOptions { map_size: Some(SIZE), ..RendererOptions::default() };
    let mut cache = cache(&vec![false; lights.len()], options);
    cache.want(&cache.regular_spans(&lights));
    let lit: Vec<u32> = (0..).zip(intensities).filter(|(_, i)| **i > 0.0).map(|(light, _)| light).collect();
    let all = frame(&mut cache, &lights, &few(0));
    assert_eq!(all, lit, "the first frame draws all that it looks up whatever the budget is");
    (cache, lights)
}

fn square(side: u32) -> TexelRect {
    TexelRect { first: [3; 2], end: [3 + side; 2] }
}

fn mark_all(cache: &mut MapCache) {
    (0..cache.len()).for_each(|light| cache.mark(MapIndex::of_frames(light), square(7)));
}

/// A frame: what it draws.
fn draw(cache: &mut MapCache, lights: &[Light], updates: &MapUpdates) -> Vec<MapUpdate> {
    let planned = cache.plan(updates, lights);
    cache.note(&planned, &Snapshot::default());
    cache.advance(lights);
    planned
}

/// A frame: which lights it draws.
fn frame(cache: &mut MapCache, lights: &[Light], updates: &MapUpdates) -> Vec<u32> {
    draw(cache, lights, updates).iter().map(|update| update.light).collect()
}

fn few(most: u32) -> MapUpdates {
    MapUpdates { most: Some(most), ..MapUpdates::default() }
}

#[test]
fn bright_lights_come_first_and_those_with_much_that_is_stale() {
    for (priority, first) in [(MapPriority::Brightness, [1, 3]), (MapPriority::BrightnessAndExtent, [0, 3])] {
        let (mut cache, lights) = drawn(&[2.0, 3.0, 1.0, 4.0, 9.0]);
        for (light, part) in [square(24), square(4), square(4), square(16)].into_iter().enumerate() {
            cache.mark(MapIndex::of_frames(light), part);
        }
        assert_eq!(frame(&mut cache, &lights, &MapUpdates { priority, ..few(2) }), first);
        assert_eq!(cache.counts(&lights), StaleCounts { maps: 2, oldest: 1 });
    }
}

#[test]
fn none_starves_and_each_gets_its_turn_by_its_brightness() {
    let (mut cache, lights) = drawn(&[8.0, 4.0, 1.0, 0.5]);
    let mut turns = [0; 4];
    for _ in 0..300 {
        mark_all(&mut cache);
        let chosen = frame(&mut cache, &lights, &few(1));
        assert_eq!(chosen.len(), 1, "the budget is kept and used");
        turns[chosen[0] as usize] += 1;
    }
    assert!(turns.is_sorted_by(|a, b| a > b) && turns[3] > 5, "{turns:?}");
}

#[test]
fn maps_of_dark_lights_wait_until_those_shine() {
    let (mut cache, mut lights) = drawn(&[2.0, 0.0]);
    cache.mark(MapIndex::of_frames(0), square(7));
    let both = cache.regular_spans(&lights);
    cache.want(&[both[0], 0]);
    assert_eq!(frame(&mut cache, &lights, &MapUpdates::default()), [0]);
    cache.want(&both);
    assert_eq!(cache.counts(&lights), StaleCounts::default());
    lights[1].intensity = Vec3::ONE;
    assert_eq!(cache.counts(&lights).maps, 1);
    assert_eq!(frame(&mut cache, &lights, &few(0)), [1]);
}

#[test]
fn no_map_is_older_than_allowed() {
    let (mut cache, lights) = drawn(&[8.0, 4.0, 1.0, 0.5]);
    // The control: without a bound they grow old.
    for (oldest, reached) in [(Some(0), 0), (Some(1), 1), (Some(5), 5), (None, 30)] {
        let mut most = 0;
        for _ in 0..30 {
            mark_all(&mut cache);
            frame(&mut cache, &lights, &MapUpdates { oldest, ..few(0) });
            most = cache.counts(&lights).oldest.max(most);
        }
        assert_eq!(most, reached);
        frame(&mut cache, &lights, &MapUpdates::default());
    }
}

#[test]
fn what_is_drawn_covers_all_that_became_stale_and_lights_that_moved_are_drawn_as_a_whole() {
    let (mut cache, lights) = drawn(&[1.0, 1.0]);
    let part = TexelRect { first: [3, 1], end: [30, 7] };
    cache.mark(MapIndex::of_frames(0), part);
    cache.invalidate(1);
    // The one that moved takes all of the budget.
    let moved = MapUpdate { light: 1, part: TexelRect::whole(SIZE) };
    assert_eq!(draw(&mut cache, &lights, &few(1)), [moved]);
    cache.invalidate(1);
    assert_eq!(draw(&mut cache, &lights, &few(0)), [moved], "whatever it is");
    assert_eq!(draw(&mut cache, &lights, &MapUpdates::default()), [MapUpdate { light: 0, part }]);
}

#[test]
fn maps_come_within_the_budget_and_lights_without_one_have_no_place() {
    let (mut cache, lights) = drawn(&[1.0, 8.0, 4.0, 2.0]);
    // Another room, and back: two are looked up that are not there, and one whose stale part is worth more than one of these.
    cache.invalidate_all();
    let unit = cache.layout().regular[0];
    cache.want(&[0, 0, unit, 0]);
    frame(&mut cache, &lights, &MapUpdates::default());
    cache.mark(MapIndex::of_frames(2), square(60));
    let three = [unit, unit, unit, 0];
    for (wanted, drawn, seen, left) in [
        (three, vec![1], 2, 2),
        (three, vec![0], 3, 1),
        (three, vec![2], 3, 0),
        (three, vec![], 3, 0),
        ([0; 4], vec![], 0, 0),
        ([unit; 4], vec![3], 4, 0),
    ] {
        cache.want(&wanted);
        assert_eq!(frame(&mut cache, &lights, &few(1)), drawn);
        assert_eq!(cache.words(&[]).iter().filter(|word| **word != NO_MAP).count(), seen);
        assert_eq!(cache.counts(&lights).maps, left);
    }
}

#[test]
fn what_has_room_is_placed_whatever_was_there() {
    let lights = lights_of(&[1.0; 41]);
    let kinds: Vec<bool> = (0..41).map(|light| light == 40).collect();
    let mut cache = cache(&kinds, RendererOptions::default());
    let mut held = 0;
    for case in 0..400 {
        let number = |light: u32| sample(case * 41 + light, 0, 3) * (1.0 + 4.0 * sample(case, 0, 4));
        let wanted: Vec<u32> = (0..41).map(|light| (1 << number(light) as u32) & !1).collect();
        cache.want(&wanted);
        draw(&mut cache, &lights, &MapUpdates::default());
        let is_placed =
            |light: usize| wanted[light] == 0 || cache.slot(light).is_some_and(|s| s.span == wanted[light]);
        let has_room = cache.layout().holds(&wanted);
        assert_eq!((0..41).all(is_placed), has_room, "{wanted:?}");
        held += usize::from(has_room);
    }
    assert!((100..350).contains(&held), "{held}");
}

/// Few samples of a sky light all of a room, each by itself.
#[test]
fn maps_of_a_sky_of_few_samples_are_as_fine_as_a_suns() {
    let across = |profile, flag| {
        let mut lights = lights_of(&vec![1.0; 200]);
        let of_sky = Light { profile, rectangle: Vec4::W * flag, ..lights[0] };
        lights[..20].fill(of_sky);
        let kinds: Vec<bool> = lights.iter().map(Light::has_large_map).collect();
        let cache = cache(&kinds, RendererOptions::default());
        let spans = cache.spans(&[1e4; 200], &lights);
        [19, 20].map(|light| cache.layout().size(spans[light]))
    };
    for (profile, flag, times) in [(DISTANT, 1.0, 4), (DISTANT, 0.0, 1), (DIRECTIONAL, 0.0, 4)] {
        let [of_sky, other] = across(profile, flag);
        assert!(of_sky == times * other && other >= 160, "{profile} {flag}: {of_sky} {other}");
    }
}

/// Walks through a house and looks up more lights or fewer, in maps of several sizes, in all more than there is room for.
#[test]
fn frames_do_not_depend_on_what_was_there_and_cuts_are_over_soon() {
    const ROOM: usize = 30;
    let kinds: Vec<bool> = (0..1200).map(|light| light % 400 == 0).collect();
    let mut lights = lights_of(&(0..1200).map(|light| 1.0 + (light % 7) as f32).collect::<Vec<_>>());
    lights.iter_mut().step_by(400).for_each(|sun| sun.profile = DIRECTIONAL);
    for most in [None, Some(5)] {
        let mut cache = cache(&kinds, RendererOptions { memory_mib: 110, ..RendererOptions::default() });
        let (mut looked_up, mut brought_in, mut enlarged) = (0, 0, 0);
        for cut in 0..60 {
            let first = (sample(cut, 0, 5) * 6.0) as usize * ROOM;
            let room = first..[480, 480, 480, 1200].get(cut as usize % 10).map_or(first + ROOM, |end| *end);
            let texels = |light| {
                let size = [20.0, 100.0, 200.0, 256.0][(sample(light as u32, cut % 2, 6) * 4.0) as usize];
                if room.contains(&light) { size } else { 0.0 }
            };
            let wanted = cache.spans(&(0..1200).map(texels).collect::<Vec<_>>(), &lights);
            let mut with_regular = wanted.iter().zip(cache.regular_spans(&lights));
            enlarged += usize::from(with_regular.any(|(span, regular)| *span > regular));
            let mut drawn = Vec::new();
            while drawn.last() != Some(&0) {
                cache.want(&wanted);
                let updates = MapUpdates { most, ..MapUpdates::default() };
                drawn.push(draw(&mut cache, &lights, &updates).len());
                assert!(drawn.len() <= most.map_or(2, |_| 2 * room.len() / 5 + 2), "{room:?}: {drawn:?}");
            }
            assert!(cut == 0 || most.is_none() || drawn.iter().all(|drawn| *drawn <= 5), "{drawn:?}");
            if room.len() == ROOM {
                (looked_up, brought_in) = (looked_up + ROOM, brought_in + drawn.iter().sum::<usize>());
            }
            let words = cache.words(&[]);
            let mut taken = BTreeSet::new();
            for light in 0..1200 {
                assert_eq!(words[light] == NO_MAP, wanted[light] == 0, "{cut}");
                let is_as_wanted = |slot: MapSlot| wanted[light] == 0 || wanted[light] == slot.span;
                assert!(cache.slot(light).is_none_or(is_as_wanted), "{cut}");
            }
            for index in cache.all_shown() {
                let Some((_, MapSlot { at, page, span }, _)) = cache.holds(index) else { continue };
                let [columns, rows] = cache.layout().per_page(1);
                assert!(at[0] + span <= columns && at[1] + span <= rows && page < cache.layout().pages);
                let units = (0..span * span).map(|unit| (page, at[0] + unit % span, at[1] + unit / span));
                units.for_each(|unit| assert!(taken.insert(unit), "{unit:?} is taken twice"));
            }
        }
        // The controls: what is seen again is there still, often, and there is not always room for large maps.
        assert!(brought_in < looked_up * 4 / 5 && brought_in > looked_up / 4, "{brought_in} of {looked_up}");
        assert!(enlarged > 20 && enlarged < 60, "{enlarged}");
    }
}

/// Two views in turn, which want other sizes of the same maps, and a sun's map for other parts of the scene.
#[test]
fn views_in_turn_draw_nothing_anew_where_there_is_room_for_both() {
    let square = |x: f32| ShownSquare::of(&Light { profile: DIRECTIONAL, scale: x, ..Light::default() });
    for (of_sun, has_room) in [(200.0, true), (1000.0, false)] {
        let mut lights = lights_of(&[1.0; 40]);
        lights[0].profile = DIRECTIONAL;
        let kinds: Vec<bool> = (0..40).map(|light| light == 0).collect();
        let mut cache = cache(&kinds, RendererOptions::default());
        let view = |cache: &mut MapCache, wide: bool| {
            let texels = |light| match light {
                0 => of_sun,
                _ if (light % 2 == 0) == wide => 200.0,
                _ => 90.0,
            };
            let wanted = cache.spans(&(0..40).map(texels).collect::<Vec<_>>(), &lights);
            cache.show(0, square(if wide { 1.0 } else { 2.0 }));
            cache.want(&wanted);
            let drawn = frame(cache, &lights, &MapUpdates::default());
            let is_as_wanted =
                |light: usize| cache.shown(light).is_some_and(|(slot, _)| slot.span == wanted[light]);
            assert!((0..40).all(is_as_wanted), "{of_sun}");
            drawn.len()
        };
        assert_eq!([true, false].map(|wide| view(&mut cache, wide)), [40; 2]);
        let drawn: usize = (0..20).map(|frame| view(&mut cache, frame % 2 == 0)).sum();
        assert_eq!(drawn == 0, has_room, "{of_sun}: {drawn}");
        if !has_room {
            continue;
        }
        // What moves makes all of a light's maps stale, and a light that moves itself leaves none.
        cache.all_shown().into_iter().for_each(|index| cache.mark(index, self::square(7)));
        assert_eq!([true, false, true, false].map(|wide| view(&mut cache, wide)), [40, 40, 0, 0]);
        cache.invalidate(3);
        assert_eq!([true, false, true, false].map(|wide| view(&mut cache, wide)), [1, 1, 0, 0]);
    }
}
