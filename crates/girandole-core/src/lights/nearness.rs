//! How far candidates are apart for what is seen.
//!
//! Light on a ground 50 m away from a room comes in by its windows much as light 5 m beside it does: what matters is how far apart
//! both are from where they shine on. Up to some way about what is seen distances count as they are, beyond it as angles.
//!
//! Worked example: of a classroom what is seen lies within 6 m. A stretch of 20 m of the ground outside, 60 m away, counts as 4 m.

use super::LightSample;
use super::importance::Place;
use super::view_points::ViewPoint;
use glam::DVec3;

/// Share of the points that are seen that lie within what is taken for their extent…
const MOST: f64 = 0.9;
/// …and how many times as far distances count as they are: in a single room everywhere.
const REACH: f64 = 2.0;

/// Where that is which views see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seen {
    /// Relative to the geometry's origin.
    middle: DVec3,
    /// Up to where distances count as they are, m.
    reach: f64,
    /// First coordinate beyond which [places](Place) are none in the scene but directions.
    elsewhere: f64,
}

impl Seen {
    /// Of points, and candidates at these places that shine on them; `None` if none is seen.
    pub fn new(points: &[ViewPoint], candidates: &[LightSample], places: &[Place]) -> Option<Self> {
        let seen =
            points.iter().filter(|point| point.is_seen).map(|p| p.surface.position.as_dvec3()).collect();
        let directions = candidates.iter().zip(places).filter(|(c, _)| c.profile.is_parallel());
        let nearest = directions.map(|(_, place)| f64::from(place[0])).fold(f64::INFINITY, f64::min);
        Self::about(seen, 0.5 * nearest)
    }

    fn about(seen: Vec<DVec3>, elsewhere: f64) -> Option<Self> {
        if seen.is_empty() {
            return None;
        }
        let part = |mut values: Vec<f64>, share: f64| {
            values.sort_unstable_by(f64::total_cmp);
            values[((values.len() - 1) as f64 * share) as usize]
        };
        let middle =
            DVec3::from_array([0, 1, 2].map(|axis| part(seen.iter().map(|p| p[axis]).collect(), 0.5)));
        let extent = part(seen.iter().map(|p| p.distance(middle)).collect(), MOST);
        Some(Self { middle, reach: REACH * extent, elsewhere })
    }

    /// What distances count for about a place: 1 up to some way from what is seen, less and less beyond.
    pub fn nearness(&self, place: DVec3) -> f64 {
        let distance = place.distance(self.middle);
        if distance <= self.reach || place.x > self.elsewhere { 1.0 } else { self.reach / distance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::strata::Strata;
    use crate::math::sequence;
    use glam::{Vec2, Vec3};

    /// Points of a room 10 m across.
    fn room() -> impl Iterator<Item = Vec3> {
        (0..500).map(|i| {
            Vec3::new(sequence::sample(i, 0, 1), 0.3 * sequence::sample(i, 1, 1), sequence::sample(i, 2, 1))
                * 10.0
                - 5.0
        })
    }

    fn about_the_room(elsewhere: f64) -> Seen {
        Seen::about(room().map(|p| p.as_dvec3()).collect(), elsewhere).expect("points are seen")
    }

    #[test]
    fn distances_count_as_they_are_up_to_some_way_and_as_angles_beyond() {
        let seen = about_the_room(f64::INFINITY);
        assert!((9.0..15.0).contains(&seen.reach) && seen.middle.length() < 5.0, "{seen:?}");
        assert!(room().all(|p| seen.nearness(p.as_dvec3()) == 1.0));
        let at = |distance: f64| seen.nearness(seen.middle + DVec3::Z * distance);
        for (distance, expected) in [(0.99, 1.0), (2.0, 0.5), (10.0, 0.1)] {
            let found = at(distance * seen.reach);
            assert!((found - expected).abs() < 1e-9, "{found} at {distance}");
        }
        // Directions are as far apart wherever they are noted.
        let aside = about_the_room(50.0);
        assert_eq!(aside.nearness(DVec3::X * 1000.0), 1.0);
        assert!(aside.nearness(DVec3::Z * 1000.0) < 0.02);
    }

    #[test]
    fn a_wide_ground_outside_takes_no_strata_from_a_room() {
        // Half of the weight is in the room, half on 200 m of ground about it.
        let on_the_ground = |i: u32| {
            let at = Vec2::new(sequence::sample(i, 0, 2), sequence::sample(i, 1, 2)) * 200.0 - 100.0;
            (at.length() > 20.0).then(|| Vec3::new(at.x, -5.0, at.y))
        };
        let outside: Vec<Vec3> = (0..2000).filter_map(on_the_ground).take(500).collect();
        let places: Vec<Place> = room().chain(outside).map(|p| [p.x, p.y, p.z, 0.0, 1.0, 0.0]).collect();
        let inside = |seen: Option<Seen>| {
            let strata = Strata::new(&places, &vec![1.0; places.len()], (200, seen), &[]);
            strata.clusters().iter().filter(|(_, cluster)| cluster.items[0].index < 500).count()
        };
        let [by_angle, by_distance] = [Some(about_the_room(f64::INFINITY)), None].map(inside);
        assert!((60..120).contains(&by_angle), "{by_angle} {by_distance}");
        // Negative control: as far apart as they are, those outside take nearly all.
        assert!(by_distance < 40, "{by_distance}");
    }
}
