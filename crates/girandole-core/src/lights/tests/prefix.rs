//! Some of the samples have the light of all in the mean.

use super::*;
use crate::math::sequence;
use crate::scene::builtin::{self, MovingObject};

/// Samples of very different power, anywhere.
fn set(geometry: &Geometry, seed: u32, count: u32) -> LightSet {
    let random = |i: u32, d: u32| {
        (sequence::hash(i ^ sequence::hash(d ^ sequence::hash(seed))) as f32) * 2.0_f32.powi(-32)
    };
    let sample = |i: u32| LightSample {
        position: Vec3::new(random(i, 0), random(i, 1), random(i, 2)),
        normal: Vec3::Y,
        intensity: Vec3::new(1.0, 0.5, 0.0) * 100.0_f32.powf(i as f32 / count as f32),
        profile: Profile::Cosine,
        origin: SampleOrigin::Bounce { path: i, bounce: 1, triangle: 0 },
        rectangle: None,
    };
    LightSet::from_samples(geometry, (0..count).map(sample).collect())
}

fn geometry() -> Geometry {
    Geometry::new(&builtin::build("block", MovingObject::None).expect("a room"))
}

#[test]
fn the_light_is_that_of_all_in_the_mean() {
    let geometry = geometry();
    for most in [1, 3, 16, 40] {
        let runs = 4000;
        // Of a part of the samples that no rank favours.
        let part = |set: &LightSet| -> f64 {
            set.samples().iter().step_by(3).map(|s| f64::from(s.intensity.x)).sum()
        };
        let truth = part(&set(&geometry, 0, 60));
        let estimates: Vec<f64> =
            (0..runs).map(|seed| part(&set(&geometry, seed, 60).prefix(most))).collect();
        let mean = estimates.iter().sum::<f64>() / f64::from(runs);
        let variance = estimates.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / f64::from(runs - 1);
        let z = (mean - truth) / (variance / f64::from(runs)).sqrt();
        assert!(z.abs() < 3.5, "{most}: {mean} instead of {truth}, z {z}");
        // The control: without the threshold there is too little.
        let bare: f64 = (0..200)
            .map(|seed| {
                let (all, some) = (set(&geometry, seed, 60), set(&geometry, seed, 60).prefix(most));
                let lit = some.samples().iter().zip(all.samples()).step_by(3);
                lit.filter(|(s, _)| s.intensity != Vec3::ZERO)
                    .map(|(_, a)| f64::from(a.intensity.x))
                    .sum::<f64>()
            })
            .sum();
        assert!(bare / 200.0 < 0.98 * truth, "{most}: {bare}");
    }
}

#[test]
fn smaller_numbers_are_parts_of_larger_ones() {
    let all = set(&geometry(), 7, 100);
    let lit = |most: usize| -> Vec<usize> {
        let set = all.prefix(most);
        (0..set.len()).filter(|&i| set.samples()[i].intensity != Vec3::ZERO).collect()
    };
    let mut before = lit(1);
    assert_eq!(before.len(), 1);
    for most in [2, 5, 30, 99, 100] {
        let now = lit(most);
        assert_eq!(now.len(), most);
        assert!(before.iter().all(|i| now.contains(i)), "{most}");
        before = now;
    }
    assert!(all.prefix(100) == all && all.prefix(1000) == all);
    assert_eq!(all.prefix(7).ids(), all.ids());
    assert_ne!(all.prefix(7).generation(), all.generation());
}
