//! Triangles in the same place, which would emit and reflect twice what is there once: rays meet only one of them.
//!
//! Triangles are *coincident* where their three positions in the world are the same, to the bit and in any order. Of those, one
//! counts that covers a side which none before it covers: single-sided ones back to back both stay. A double-sided one takes the
//! place of single-sided ones before it; else the first of them stays, and its material. Where materials differ and one of them is
//! seen through, or has holes, both stay.
//!
//! What may move on its own is compared with itself alone: static objects with each other, and what the same animated node carries.
//! What is deformed is left as it is.

use super::{Geometry, Material, NONE, NodeId, Scene};
use crate::parallel;
use glam::Vec3;

/// Bits of a triangle in the tables that tell which keys are there twice: about one in twenty seems to be and is not.
const BITS: usize = 16;

/// The bits of three positions, ascending.
type Place = [[u32; 3]; 3];

/// Sides that a triangle covers: where its positions, ascending, are clockwise, and where they are not.
type Sides = u8;

/// Drops triangles that coincide with others, and what patches are left without any.
pub(super) fn drop_doubles(scene: &Scene, geometry: &mut Geometry) {
    let doubles = doubles(scene, geometry);
    geometry.coincident = doubles.len();
    if !doubles.is_empty() {
        remove(geometry, &doubles);
    }
}

/// Indices of triangles whose sides others cover, ascending.
fn doubles(scene: &Scene, geometry: &Geometry) -> Vec<u32> {
    let groups = groups(scene);
    let group = |triangle: u32| groups[geometry.triangles[triangle as usize].object as usize];
    let keys = parallel::in_order(geometry.triangles.len(), |triangle| {
        let triangle = triangle as u32;
        match group(triangle) {
            Some(group) => key(&place(geometry, triangle).0, group),
            None => mixed(u64::from(triangle), 0),
        }
    });
    let mut suspects = met_twice(&keys);
    suspects.retain(|&triangle| group(triangle).is_some());
    suspects.sort_unstable_by_key(|&triangle| (keys[triangle as usize], triangle));
    let mut result = Vec::new();
    for run in suspects.chunk_by(|&a, &b| keys[a as usize] == keys[b as usize]) {
        find(scene, geometry, run, group, &mut result);
    }
    result.sort_unstable();
    result
}

/// What moves together has the same number; `None` for what is deformed.
fn groups(scene: &Scene) -> Vec<Option<u32>> {
    let mut is_posed = vec![false; scene.nodes.len()];
    for channel in scene.animations.iter().flat_map(|a| &a.channels) {
        is_posed[channel.node.index()] = true;
    }
    let movers = scene.inherited(
        None,
        |above: &Option<NodeId>, node| if is_posed[node.index()] { Some(node) } else { *above },
    );
    let group = |(index, object): (usize, &super::Object)| match (object.dynamic, movers[object.node.index()])
    {
        _ if scene.is_deformed(object) => None,
        (false, _) => Some(0),
        (true, Some(node)) => Some(1 + node.0),
        (true, None) => Some(1 + (scene.nodes.len() + index) as u32),
    };
    scene.objects.iter().enumerate().map(group).collect()
}

/// Where a triangle is, and whether its front is the other one of the two sides.
fn place(geometry: &Geometry, triangle: u32) -> (Place, bool) {
    // Both zeros are the same.
    let mut place = geometry.corners(triangle).map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
    let mut turned = false;
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        if place[i] > place[j] {
            place.swap(i, j);
            turned = !turned;
        }
    }
    (place, turned)
}

fn key(place: &Place, group: u32) -> u64 {
    place.as_flattened().iter().fold(u64::from(group), |hash, &word| mixed(hash, word))
}

/// A round of SplitMix64.
fn mixed(hash: u64, word: u32) -> u64 {
    let mut hash = (hash ^ u64::from(word)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    hash = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    hash ^ (hash >> 27)
}

/// Indices of keys that are there more than once, and of a few others.
fn met_twice(keys: &[u64]) -> Vec<u32> {
    let words = (keys.len() * BITS / 64).next_power_of_two();
    let (mut once, mut twice) = (vec![0u64; words], vec![0u64; words]);
    let at = |key: u64| ((key >> 6) as usize & (words - 1), 1u64 << (key & 63));
    for &key in keys {
        let (word, bit) = at(key);
        twice[word] |= once[word] & bit;
        once[word] |= bit;
    }
    let is_twice = |(_, key): &(u32, &u64)| {
        let (word, bit) = at(**key);
        twice[word] & bit != 0
    };
    (0..).zip(keys).filter(is_twice).map(|(index, _)| index).collect()
}

/// A triangle that stays for now.
struct Kept {
    triangle: u32,
    place: Place,
    sides: Sides,
    group: Option<u32>,
}

/// Adds those of some triangles, ascending and of the same key, whose sides others of them cover.
fn find(
    scene: &Scene,
    geometry: &Geometry,
    triangles: &[u32],
    group: impl Fn(u32) -> Option<u32>,
    found: &mut Vec<u32>,
) {
    if triangles.len() < 2 {
        return;
    }
    let index = |triangle: u32| geometry.triangles[triangle as usize].material;
    let material = |triangle: u32| &scene.materials[index(triangle)];
    let mut kept: Vec<Kept> = Vec::new();
    for &triangle in triangles {
        let (place, turned) = place(geometry, triangle);
        let sides = match (material(triangle).double_sided, turned) {
            (true, _) => 0b11,
            (false, turned) => 1 << u8::from(turned),
        };
        let now = Kept { triangle, place, sides, group: group(triangle) };
        let is_double = |other: &Kept| {
            let both_solid = || is_solid(material(other.triangle)) && is_solid(material(triangle));
            (other.place, other.group) == (now.place, now.group)
                && (index(other.triangle) == index(triangle) || both_solid())
        };
        let covered =
            kept.iter().filter(|other| is_double(other)).fold(0, |sides, other| sides | other.sides);
        if covered & sides == sides {
            found.push(triangle);
            continue;
        }
        kept.retain(|other| {
            let stays = other.sides & !sides != 0 || !is_double(other);
            if !stays {
                found.push(other.triangle);
            }
            stays
        });
        kept.push(now);
    }
}

/// Whether nothing is seen through a material anywhere.
fn is_solid(material: &Material) -> bool {
    !material.is_transparent() && material.alpha_cutoff.is_none()
}

/// Takes triangles, ascending, out of the flattened arrays.
fn remove(geometry: &mut Geometry, doubles: &[u32]) {
    // Of those before each triangle, and each patch, how many stay.
    let left = |triangle: u32| triangle - doubles.partition_point(|&double| double < triangle) as u32;
    let left_of = |range: &std::ops::Range<u32>| left(range.start)..left(range.end);
    let mut patches_before = vec![0];
    for patch in &mut geometry.patches {
        patch.triangles = left_of(&patch.triangles);
        let stays = u32::from(!patch.triangles.is_empty());
        patches_before.push(patches_before[patches_before.len() - 1] + stays);
    }
    geometry.patches.retain(|patch| !patch.triangles.is_empty());
    for object in &mut geometry.objects {
        object.triangles = left_of(&object.triangles);
        let patches = &object.patches;
        object.patches = patches_before[patches.start as usize]..patches_before[patches.end as usize];
    }
    let mut doubles = doubles.iter().peekable();
    let mut index = 0..;
    geometry.triangles.retain(|_| doubles.next_if_eq(&&index.next().unwrap_or(NONE)).is_none());
    for triangle in geometry.triangles.iter_mut().filter(|triangle| triangle.patch != NONE) {
        triangle.patch = patches_before[triangle.patch as usize];
    }
}
