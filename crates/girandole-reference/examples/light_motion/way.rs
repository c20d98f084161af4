//! A way through a scene that runs into nothing.

use girandole_core::glam::{DVec3, Vec3};
use girandole_core::scene::{NONE, View};
use girandole_core::trace::SceneTracer;
use std::collections::{HashMap, VecDeque};

/// Metres between places.
const STEP: f64 = 0.25;
/// Metres that are left to what stands about.
const MARGIN: f64 = 0.2;
/// Metres a second.
const PACE: f64 = 1.4;
/// Places that one looks ahead.
const AHEAD: f64 = 1.5;

/// Views along the way from where a view is to the farthest place within `reach` metres of it: so many
/// frames, and so many a second.
pub fn walk(tracer: &SceneTracer, start: &View, reach: f64, (frames, fps): (u32, u32)) -> Vec<View> {
    let origin = tracer.geometry().origin;
    let at = |[x, z]: [i32; 2]| start.eye + DVec3::new(f64::from(x), 0.0, f64::from(z)) * STEP;
    let local = |p: DVec3| (p - origin).as_vec3();
    let is_free = |from: DVec3, to: DVec3| {
        let ahead = (to - from).normalize();
        let beside = ahead.cross(DVec3::Y) * MARGIN;
        [DVec3::ZERO, beside, -beside, DVec3::NEG_Y * 0.5].into_iter().all(|shift| {
            let (from, to): (Vec3, Vec3) = (local(from + shift), local(to + shift + ahead * MARGIN));
            !tracer.occluded(from, NONE, to, NONE)
        })
    };
    // Breadth first: the last place found is the farthest.
    let mut from: HashMap<[i32; 2], [i32; 2]> = HashMap::from([([0, 0], [0, 0])]);
    let mut open = VecDeque::from([[0, 0]]);
    let mut last = [0, 0];
    while let Some(place) = open.pop_front() {
        last = place;
        for [dx, dz] in [[1, 0], [-1, 0], [0, 1], [0, -1]] {
            let next = [place[0] + dx, place[1] + dz];
            let is_near = at(next).distance(start.eye) <= reach;
            if is_near && !from.contains_key(&next) && is_free(at(place), at(next)) {
                from.insert(next, place);
                open.push_back(next);
            }
        }
    }
    let mut places = vec![last];
    while let Some(&place) = places.last()
        && from[&place] != place
    {
        places.push(from[&place]);
    }
    places.reverse();
    // Along straight pieces between places, corners rounded.
    let along = |distance: f64| {
        let place = (distance / STEP).clamp(0.0, (places.len() - 1) as f64);
        let first = (place as usize).min(places.len().saturating_sub(2));
        let second = (first + 1).min(places.len() - 1);
        at(places[first]).lerp(at(places[second]), place - first as f64)
    };
    let rounded = |distance: f64| {
        let offsets = (-4..=4).map(|i| f64::from(i) * 0.1);
        offsets.map(|offset| along(distance + offset)).sum::<DVec3>() / 9.0
    };
    let ahead = start.eye + start.forward.as_dvec3();
    (0..frames)
        .map(|frame| {
            let distance = f64::from(frame) * PACE / f64::from(fps.max(1));
            let eye = rounded(distance);
            // From where the camera looks at first to where one goes.
            let turned = (distance / AHEAD).min(1.0);
            let target = ahead.lerp(rounded(distance + AHEAD), turned);
            let forward = (target - eye).normalize();
            let right = forward.cross(DVec3::Y).normalize();
            let [right, up, forward] = [right, right.cross(forward), forward].map(DVec3::as_vec3);
            View { eye, right, up, forward, ..*start }
        })
        .collect()
}
