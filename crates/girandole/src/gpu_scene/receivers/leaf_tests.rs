//! What is decided about a leaf is a function of the lights as they are, however they came there; and what its lists hold.

use super::leaf::{LeafLight, LeafPlace, LightsThenNow};
use crate::gpu_scene::pairs::{Pair, Relation, set_states};
use crate::shader_constants::{NEAR_SHADOWED, NEAR_UNSHADOWED, NO_PART};
use girandole_core::glam::{Vec3, vec3};
use girandole_core::lights::{Clamp, LightSample, LightSet, LightSettings};
use girandole_core::scene::Geometry;
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::visibility::{State, VisibilityDatabase, VisibilitySettings};

/// Of lights of which static blockers leave this, and nothing else blocks any.
fn pairs_of(standing: &[State]) -> Vec<Pair> {
    let mut pairs = vec![Pair::default(); standing.len()];
    set_states(&mut pairs, standing, standing);
    pairs
}

fn relations(pairs: &[Pair]) -> Vec<Relation> {
    pairs.iter().map(|pair| pair.relation()).collect()
}

#[test]
fn leaves_follow_lights_without_a_trace() {
    let scene = builtin::build("table", MovingObject::Torus).expect("a room");
    let geometry = Geometry::new(&scene);
    let settings = LightSettings { count: 40, candidates: 4, ..LightSettings::default() };
    let lights = LightSet::sample(&scene, &geometry, &settings).expect("lights");
    let settings = VisibilitySettings::default();
    let database = VisibilityDatabase::build(&scene, &geometry, &lights, &settings).expect("visibility");
    let mut seed = 3u32;
    let mut random = move |n: usize| {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as usize % n
    };
    let [mut others, mut same, mut new_units] = [0; 3];
    for leaf in (0..database.receivers().leaves.len()).step_by(7) {
        let place = LeafPlace::of((&scene, &geometry), &database, leaf);
        let mut then = lights.samples().to_vec();
        let mut standing_then = database.standing_states(leaf as u32).to_vec();
        let mut pairs = pairs_of(&standing_then);
        let mut light = LeafLight::new(&place, &then, &mut pairs);
        for step in 0..30 {
            let (mut now, mut standing) = (then.clone(), standing_then.clone());
            let mut changed = vec![random(now.len()), random(now.len())];
            changed.sort_unstable();
            changed.dedup();
            for &index in &changed {
                let LightSample { position, normal, .. } = lights.samples()[random(now.len())];
                let intensity = Vec3::splat(10f32.powi(random(7) as i32 - 4)) * random(4) as f32;
                // Once, brighter than anything.
                let intensity = intensity * if step == 20 { 1e9 } else { 1.0 };
                now[index] = LightSample { position, normal, intensity, ..now[index] };
                standing[index] = [State::Unoccluded, State::Partial, State::Full][random(3)];
            }
            let (before, units) = (relations(&pairs), light.units());
            let samples = LightsThenNow { then: &then, now: &now };
            let differ = light.follow(&place, samples, &standing, &changed, &mut pairs);
            set_states(&mut pairs, &standing, &standing);
            let mut fresh_pairs = pairs_of(&standing);
            let fresh = LeafLight::new(&place, &now, &mut fresh_pairs);
            assert!(pairs == fresh_pairs, "leaf {leaf}, step {step}");
            let after = relations(&pairs);
            assert_eq!(light.units(), fresh.units(), "leaf {leaf}, step {step}");
            let unchanged = (0..now.len()).filter(|index| !changed.contains(index));
            let count = unchanged.filter(|&index| after[index] != before[index]).count();
            assert!(differ || count == 0, "leaf {leaf}, step {step}");
            others += usize::from(count > 0);
            same += usize::from(count == 0);
            new_units += usize::from(place.has_map && units != light.units());
            (then, standing_then) = (now, standing);
        }
    }
    // The controls: all of it happens.
    assert!(others > 100 && same > 100 && new_units > 10, "{others} {same} {new_units}");
}

/// A part of what a light stands for lights a receiver from before its plane while the light itself lies behind. The leaf's lists hold
/// all such pairs though visibility, which asks for the light's place, says that nothing arrives.
#[test]
fn lists_hold_lights_that_leaves_cut() {
    let scene = builtin::build("table", MovingObject::Torus).expect("a room");
    let geometry = Geometry::new(&scene);
    let settings = LightSettings { count: 100, ..LightSettings::default() };
    let lights = LightSet::sample(&scene, &geometry, &settings).expect("lights");
    let settings = VisibilitySettings::default();
    let database = VisibilityDatabase::build(&scene, &geometry, &lights, &settings).expect("visibility");
    let arrives = |light: &LightSample, point: Vec3, normal: Vec3| {
        let factor = light.geometric_factor(point, normal, normal, Clamp::Own);
        !light.is_before(point, normal, normal) && factor.is_some_and(|(g, _)| g > 1e-4)
    };
    let mut seed = 7u32;
    let mut random = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    let [mut everywhere, mut somewhere, mut not] = [0; 3];
    for leaf in 0..database.receivers().leaves.len() {
        let place = LeafPlace::of((&scene, &geometry), &database, leaf);
        let mut pairs = pairs_of(database.standing_states(leaf as u32));
        LeafLight::new(&place, lights.samples(), &mut pairs);
        let record = place.record(0);
        let [corner, across, up, normal] =
            [record.corner, record.across, record.up, record.normal].map(Vec3::from);
        let (center, radius) = place.bounds();
        let is_patch = normal != Vec3::ZERO;
        let mut point_of = || {
            let [a, b, c] = [random(), random(), random()];
            if is_patch {
                return (corner + across * (0.5 + 0.5 * a) + up * (0.5 + 0.5 * b), normal);
            }
            let towards = vec3(a, b, c).normalize_or(Vec3::Y);
            (
                center + towards * (radius * random().abs()),
                vec3(random(), random(), random()).normalize_or(Vec3::Y),
            )
        };
        let points: Vec<(Vec3, Vec3)> = (0..16).map(|_| point_of()).collect();
        for (light, relation) in lights.samples().iter().zip(relations(&pairs)) {
            let part = relation.part(State::Full);
            let is_lit = points.iter().any(|&(point, normal)| arrives(light, point, normal));
            if is_lit {
                let expected = if is_patch { NEAR_UNSHADOWED } else { NEAR_SHADOWED };
                assert_eq!(part, expected, "leaf {leaf}: {light:?}");
                *(if is_patch { &mut everywhere } else { &mut somewhere }) += 1;
            }
            if part == NEAR_UNSHADOWED {
                let behind = points.iter().all(|&(point, _)| (light.position - point).dot(normal) < 1e-4);
                assert!(behind, "leaf {leaf}: {light:?} is looked up for nowhere");
            }
            not += usize::from(relation.is_near && part == NO_PART);
        }
    }
    // The controls: all of it happens.
    assert!(everywhere > 100 && somewhere > 100 && not > 100, "{everywhere} {somewhere} {not}");
}
