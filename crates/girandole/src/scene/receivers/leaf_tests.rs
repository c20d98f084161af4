//! What is decided about a leaf is a function of the lights as they are, however they came there.

use super::leaf::{LeafLight, LeafPlace, LightsThenNow, Relation};
use girandole_core::glam::Vec3;
use girandole_core::lights::{LightSample, LightSet, LightSettings};
use girandole_core::scene::Geometry;
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::visibility::{State, VisibilityDatabase, VisibilitySettings};

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
        let mut relations = vec![Relation::default(); then.len()];
        let mut light = LeafLight::new(&place, &then, &standing_then, &mut relations);
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
            let (before, units) = (relations.clone(), light.units());
            let samples = LightsThenNow { then: &then, now: &now };
            let states = [&standing_then[..], &standing];
            let differ = light.follow(&place, samples, states, &changed, &mut relations);
            let mut fresh_relations = vec![Relation::default(); now.len()];
            let fresh = LeafLight::new(&place, &now, &standing, &mut fresh_relations);
            assert!(relations == fresh_relations, "leaf {leaf}, step {step}");
            assert_eq!(light.units(), fresh.units(), "leaf {leaf}, step {step}");
            let unchanged = (0..now.len()).filter(|index| !changed.contains(index));
            let count = unchanged.filter(|&index| relations[index] != before[index]).count();
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
