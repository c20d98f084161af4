//! Direct samples on emitters.

use super::emission::Emissions;
use super::emitters::{EnvironmentPoint, Source};
use super::guide::Guides;
use super::source_tree::SourceTree;
use super::{BoundingSphere, LightSample, Profile, Rectangle, SampleOrigin};
use crate::math::sequence;
use crate::scene::{Geometry, Scene};
use crate::trace::ray_offset_distance;
use glam::DVec2;

/// How many samples each of the weights gets: in proportion, and at least one. `count` is no less than their number.
pub(super) fn allocate(weights: &[f64], count: u32) -> Vec<u32> {
    let total: f64 = weights.iter().sum();
    let mut counts: Vec<u32> = vec![1; weights.len()];
    let spare = f64::from(count) - weights.len() as f64;
    // Whole samples of what is due beyond the first, then the largest remainders.
    let due: Vec<f64> = weights.iter().map(|w| (w / total * f64::from(count) - 1.0).max(0.0)).collect();
    let due_total: f64 = due.iter().sum();
    let mut rest = Vec::new();
    for (i, d) in due.iter().enumerate() {
        let share = if due_total > 0.0 { d / due_total * spare } else { 0.0 };
        counts[i] += share as u32;
        rest.push((share - f64::from(share as u32), i));
    }
    rest.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut left = count - counts.iter().sum::<u32>();
    for &(_, i) in rest.iter().cycle() {
        if left == 0 {
            break;
        }
        counts[i] += 1;
        left -= 1;
    }
    counts
}

/// Where a point of the unit square goes, and the density of such points there.
type Guide<'a> = &'a dyn Fn([f64; 2]) -> ([f64; 2], f64);

/// `count` samples on emitting surfaces (Barczak §4.1), emitter by emitter.
///
/// Each emitter gets samples in proportion to its weight and keeps all its energy: with `n` of them on an emitter,
/// `I = Le(y) / (n · p_A(y))`. Where there are more emitters than samples, they share one distribution.
pub(super) fn area(
    scene: (&Scene, &Geometry),
    emissions: &Emissions,
    (groups, guides): (&[Vec<Source>], &Guides),
    weights: &[f64],
    count: u32,
    seed: u32,
) -> Vec<Vec<LightSample>> {
    let of = |sources: Vec<Source>, guide: Guide, count: u32, seed: u32| {
        let mut samples = Vec::new();
        if let Some(tree) = SourceTree::new(sources) {
            on_tree(scene, emissions, (&tree, guide), count, seed, &mut samples);
        }
        samples
    };
    if groups.len() > count as usize {
        return vec![of(groups.concat(), &|at| (at, 1.0), count, seed)];
    }
    let each = (0..).zip(groups).zip(allocate(weights, count));
    let of_group = |((i, group), n): ((u32, &Vec<Source>), u32)| {
        let guide = |at| guides.direction(i as usize, at);
        of(group.clone(), &guide, n, sequence::hash(seed ^ sequence::hash(i)))
    };
    each.map(of_group).collect()
}

/// The weight of each emitter, by the weights of a pilot's samples, emitter by emitter; its power where they share them.
pub(super) fn worth(power: &[f64], pilot: &[Vec<LightSample>], weights: &[f64]) -> Vec<f64> {
    if pilot.len() < power.len() {
        return power.to_vec();
    }
    let mut weights = weights.iter();
    let worth: Vec<f64> = pilot.iter().map(|samples| weights.by_ref().take(samples.len()).sum()).collect();
    mixture(power, &worth)
}

/// Shares of a whole by what things are worth, a fifth of it by power alone; all of it where nothing is worth anything.
pub(super) fn mixture(power: &[f64], worth: &[f64]) -> Vec<f64> {
    const BY_POWER: f64 = 0.2;
    let (all_power, all_worth) = (power.iter().sum::<f64>(), worth.iter().sum::<f64>());
    if all_worth <= 0.0 {
        return power.to_vec();
    }
    let share = |(p, w): (&f64, &f64)| BY_POWER * p / all_power + (1.0 - BY_POWER) * w / all_worth;
    power.iter().zip(worth).map(share).collect()
}

/// Samples of one distribution. Points that turn out black are passed over; then the number of tries divides (all but
/// the one that brought a sample too many, which makes it unbiased: Haldane 1945).
fn on_tree(
    (scene, geometry): (&Scene, &Geometry),
    emissions: &Emissions,
    (tree, guide): (&SourceTree, Guide),
    count: u32,
    seed: u32,
    samples: &mut Vec<LightSample>,
) {
    let first = samples.len();
    let most = 4096 + count.saturating_mul(64);
    let mut tries = 0;
    while tries < most {
        let (at, density) = guide([0, 1].map(|d| f64::from(sequence::sample(tries, d, seed))));
        let (source, at) = tree.choose(DVec2::from_array(at));
        let direction = source.direction(scene, emissions, at).filter(|s| s.radiance.max_element() > 0.0);
        if let Some(EnvironmentPoint { direction, radiance, solid_angle }) = direction {
            if samples.len() - first == count as usize {
                break;
            }
            let (center, distance) = (geometry.center(), geometry.extent());
            let solid_angle = solid_angle / (tree.probability(source) * density);
            samples.push(LightSample {
                position: center + direction * distance,
                normal: -direction,
                intensity: (radiance.as_dvec3() * solid_angle).as_vec3(),
                profile: Profile::Distant {
                    distance,
                    shown: BoundingSphere::of_scene(geometry),
                    solid_angle: solid_angle as f32,
                },
                origin: SampleOrigin::Environment { point: tries, sun: source.is_sun() },
                rectangle: None,
            });
        }
        let point = source.point((scene, geometry), emissions, at).filter(|s| s.radiance.max_element() > 0.0);
        if let Some(point) = point {
            if samples.len() - first == count as usize {
                break;
            }
            let pdf_area = tree.probability(source) / point.area;
            let position = point.position + point.normal * ray_offset_distance(geometry, point.position);
            samples.push(LightSample {
                position,
                normal: point.normal,
                intensity: (point.radiance.as_dvec3() / pdf_area).as_vec3(),
                profile: Profile::Cosine,
                origin: SampleOrigin::Emitter { triangle: point.triangle, point: tries },
                rectangle: Some(Rectangle::square(position, point.normal, (1.0 / pdf_area) as f32)),
            });
        }
        tries += 1;
    }
    let scale = 1.0 / f64::from(tries.max(1));
    for sample in &mut samples[first..] {
        sample.intensity = (sample.intensity.as_dvec3() * scale).as_vec3();
        if let Profile::Distant { solid_angle, .. } = &mut sample.profile {
            *solid_angle *= scale as f32;
        }
        if let Some(rectangle) = &mut sample.rectangle {
            rectangle.half_axes = rectangle.half_axes.map(|axis| axis * scale.sqrt() as f32);
        }
    }
}
