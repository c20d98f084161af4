//! The cache over many frames.

use super::cache::{MapCache, MapUpdate, StaleCounts};
use super::layout::AtlasLayout;
use super::map_view::TexelRect;
use super::snapshot::Snapshot;
use crate::layout::Light;
use crate::settings::{MapPriority, MapUpdates, RendererOptions};
use crate::shader_constants::NO_MAP;
use girandole_core::glam::Vec3;

const SIZE: u32 = 64;

fn lights_of(intensities: &[f32]) -> Vec<Light> {
    let light = |&i: &f32| Light { intensity: Vec3::new(0.0, i, i / 2.0), ..Light::default() };
    intensities.iter().map(light).collect()
}

/// A cache for so many lights, of which a frame looks all up.
fn cache(lights: usize, options: RendererOptions) -> MapCache {
    let kinds = vec![false; lights];
    let layout = AtlasLayout::new(&kinds, 256, &options, &wgpu::Limits::default()).expect("a layout");
    let mut cache = MapCache::new(&layout, lights, &Snapshot::default());
    cache.want(&vec![layout.regular[0]; lights]);
    cache
}

/// Lights of these intensities, with maps that are up to date.
fn drawn(intensities: &[f32]) -> (MapCache, Vec<Light>) {
    let lights = lights_of(intensities);
    let mut cache =
        cache(lights.len(), RendererOptions { map_size: Some(SIZE), ..RendererOptions::default() });
    let all = frame(&mut cache, &lights, &few(0, MapPriority::default()));
    let lit = intensities.iter().filter(|i| **i > 0.0).count();
    assert_eq!(all.len(), lit, "the first frame draws all that it looks up whatever the budget is");
    (cache, lights)
}

fn square(side: u32) -> TexelRect {
    TexelRect { first: [3; 2], end: [3 + side; 2] }
}

fn draw(cache: &mut MapCache, lights: &[Light], updates: &MapUpdates) -> Vec<MapUpdate> {
    let chosen = cache.plan(updates, lights);
    cache.note(&chosen, &Snapshot::default());
    chosen
}

/// A frame: which lights it draws.
fn frame(cache: &mut MapCache, lights: &[Light], updates: &MapUpdates) -> Vec<u32> {
    let drawn = draw(cache, lights, updates);
    cache.advance(lights);
    drawn.iter().map(|update| update.light).collect()
}

fn few(most: u32, priority: MapPriority) -> MapUpdates {
    MapUpdates { most: Some(most), oldest: None, priority }
}

#[test]
fn bright_lights_come_first_and_those_with_much_that_is_stale() {
    for (priority, first) in [(MapPriority::Brightness, [1, 3]), (MapPriority::BrightnessAndExtent, [0, 3])] {
        let (mut cache, lights) = drawn(&[2.0, 3.0, 1.0, 4.0, 9.0]);
        for (light, part) in [square(24), square(4), square(4), square(16)].into_iter().enumerate() {
            cache.mark(light, part);
        }
        assert_eq!(frame(&mut cache, &lights, &few(2, priority)), first);
        assert_eq!(cache.counts(&lights), StaleCounts { maps: 2, oldest: 1 });
    }
}

#[test]
fn none_starves_and_each_gets_its_turn_by_its_brightness() {
    let (mut cache, lights) = drawn(&[8.0, 4.0, 1.0, 0.5]);
    let mut turns = [0; 4];
    for _ in 0..300 {
        (0..4).for_each(|light| cache.mark(light, square(7)));
        let chosen = frame(&mut cache, &lights, &few(1, MapPriority::default()));
        assert_eq!(chosen.len(), 1, "the budget is kept and used");
        turns[chosen[0] as usize] += 1;
    }
    assert!(turns.is_sorted_by(|a, b| a > b) && turns[3] > 5, "{turns:?}");
}

#[test]
fn maps_of_dark_lights_wait_until_those_shine() {
    let (mut cache, mut lights) = drawn(&[2.0, 0.0]);
    cache.mark(0, square(7));
    assert_eq!(frame(&mut cache, &lights, &MapUpdates::default()), [0]);
    assert_eq!(cache.counts(&lights), StaleCounts::default());
    lights[1].intensity = Vec3::ONE;
    assert_eq!(cache.counts(&lights).maps, 1);
    assert_eq!(frame(&mut cache, &lights, &few(0, MapPriority::default())), [1]);
}

#[test]
fn no_map_is_older_than_allowed() {
    let (mut cache, lights) = drawn(&[8.0, 4.0, 1.0, 0.5]);
    for oldest in [0, 1, 5] {
        for _ in 0..30 {
            (0..4).for_each(|light| cache.mark(light, square(7)));
            let updates = MapUpdates { most: Some(0), oldest: Some(oldest), ..MapUpdates::default() };
            frame(&mut cache, &lights, &updates);
            assert!(cache.counts(&lights).oldest <= oldest, "{:?}", cache.counts(&lights));
        }
    }
    // The control: without a bound they grow old.
    cache.mark(2, square(7));
    (0..9).for_each(|_| drop(frame(&mut cache, &lights, &few(0, MapPriority::default()))));
    assert!(cache.counts(&lights).oldest >= 9);
}

#[test]
fn what_is_drawn_covers_all_that_became_stale_and_lights_that_moved_are_drawn_as_a_whole() {
    let (mut cache, lights) = drawn(&[1.0, 1.0]);
    let part = TexelRect { first: [3, 1], end: [30, 7] };
    cache.mark(0, part);
    cache.invalidate(1);
    let chosen = draw(&mut cache, &lights, &few(1, MapPriority::default()));
    // The one that moved takes all of the budget.
    assert_eq!(chosen, [MapUpdate { light: 1, part: TexelRect::whole(SIZE) }]);
    let chosen = draw(&mut cache, &lights, &MapUpdates::default());
    assert_eq!(chosen, [MapUpdate { light: 0, part }]);
}

#[test]
fn maps_come_within_the_budget_and_lights_without_one_have_no_place() {
    let (mut cache, lights) = drawn(&[1.0, 8.0, 4.0, 2.0]);
    // Another room, and back, with other sizes: two are looked up that are not there.
    cache.invalidate_all();
    let unit = cache.layout().regular[0];
    cache.want(&[0, 0, unit, 0]);
    frame(&mut cache, &lights, &MapUpdates::default());
    let few = few(1, MapPriority::default());
    for (wanted, drawn, left) in [
        ([unit, unit, unit, 0], vec![1], 1),
        ([unit, unit, unit, 0], vec![0], 0),
        ([unit, unit, unit, 0], vec![], 0),
        ([0, 0, 0, 0], vec![], 0),
        ([unit, unit, unit, unit], vec![3], 0),
    ] {
        cache.want(&wanted);
        let updates = cache.plan(&few, &lights);
        assert_eq!(updates.iter().map(|update| update.light).collect::<Vec<_>>(), drawn);
        let words = cache.words(&updates);
        let seen = words.iter().filter(|word| **word != NO_MAP).count();
        assert_eq!(seen, wanted.iter().filter(|span| **span > 0).count() - left);
        cache.note(&updates, &Snapshot::default());
        cache.advance(&lights);
        assert_eq!(cache.counts(&lights).maps as usize, left);
    }
}

/// Walks through a house of 40 rooms, each with lights that no other room looks up, in maps of several sizes, and in all more than
/// there is room for.
#[test]
fn frames_do_not_depend_on_what_was_there_and_cuts_are_over_soon() {
    const ROOM: usize = 30;
    let lights = lights_of(&(0..40 * ROOM).map(|i| 1.0 + (i % 7) as f32).collect::<Vec<_>>());
    let options = RendererOptions { memory_mib: 40, ..RendererOptions::default() };
    let spans = |cache: &MapCache, room: usize| {
        let texels: Vec<f32> = (0..lights.len())
            .map(|i| if i / ROOM == room % 40 { [20.0, 100.0, 200.0, 256.0][i % 4] } else { 0.0 })
            .collect();
        cache.spans(&texels, &lights)
    };
    let number = |index: u32| girandole_core::math::sequence::sample(index, 0, 5);
    for most in [None, Some(5)] {
        let mut cache = cache(lights.len(), options);
        let (mut drawn, mut brought_in, mut kept) = (0, 0, 0);
        for (cut, room) in (0..60).map(|cut| (cut, (number(cut) * 40.0) as usize)) {
            let wanted = spans(&cache, room);
            assert!(wanted.iter().any(|span| *span > cache.layout().regular[0]), "there is room");
            let updates = MapUpdates { most, ..MapUpdates::default() };
            for at_rest in 0..8 {
                cache.want(&wanted);
                let planned = cache.plan(&updates, &lights);
                drawn = planned.len();
                assert!(most.is_none_or(|most| drawn <= most as usize) || cut == 0);
                brought_in += drawn;
                let words = cache.words(&planned);
                cache.note(&planned, &Snapshot::default());
                cache.advance(&lights);
                if most.is_none() || at_rest == 7 {
                    let held: Vec<_> = (0..lights.len()).filter(|light| wanted[*light] > 0).collect();
                    let is_whole =
                        |&light: &usize| cache.slot(light).is_some_and(|s| s.span == wanted[light]);
                    assert!(held.iter().all(is_whole) && held.iter().all(|light| words[*light] != NO_MAP));
                    assert!((0..lights.len()).all(|l| (words[l] == NO_MAP) == (wanted[l] == 0)));
                    assert_eq!(cache.counts(&lights).maps, 0, "{cut}");
                }
            }
            kept += usize::from(drawn == 0);
        }
        // What is seen again is there still, often; and nothing is drawn at rest.
        assert!(brought_in < 60 * ROOM && brought_in > 35 * ROOM && kept == 60, "{brought_in} {kept}");
    }
}
