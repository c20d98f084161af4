//! What a camera cuts off is not drawn, and is there for light.

use crate::common::{Stage, look, trace};
use girandole_core::glam::Vec3;
use girandole_core::image::{Image, Region};
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::{ClipPlanes, Material, PunctualKind, View};
use girandole_core::trace::SceneTracer;
use girandole_reference::{OracleSettings, PathSettings, coverage, oracle};

const SIZE: [u32; 2] = [24, 24];

/// A closed room of 4 m, seen from 3 m outside of one of its walls; that and all others have two sides, or only that to the room.
fn room(double_sided: bool) -> Stage {
    let mut stage = Stage::default();
    let wall = stage.material(Material { double_sided, ..Material::diffuse("wall", Vec3::splat(0.6)) });
    stage.room(Vec3::splat(-2.0), Vec3::splat(2.0), wall);
    let blue = stage.material(Material::diffuse("blue", Vec3::new(0.2, 0.3, 0.7)));
    stage.quad(Vec3::new(-1.0, -1.0, 0.5), Vec3::X, Vec3::Y, blue);
    stage.punctual(PunctualKind::Point, Vec3::splat(9.0), Vec3::new(0.5, 1.0, 1.2), Vec3::ZERO);
    stage
}

fn by_samples(stage: &Stage, view: &View) -> Image {
    let geometry = stage.geometry();
    let settings = LightSettings { count: 40, ..LightSettings::default() };
    let lights = LightSet::sample(&stage.scene, &geometry, &settings).expect("lights");
    oracle(
        &SceneTracer::new(&stage.scene, &geometry),
        &lights,
        view,
        SIZE,
        &OracleSettings::default(),
        &|_| (),
    )
}

fn by_paths(stage: &Stage, view: &View) -> Image {
    trace(&stage.scene, &stage.geometry(), view, SIZE[0], PathSettings { paths: 64, ..Default::default() })
        .mean
}

/// Sum of squared differences, as a share of that of the second picture.
fn difference_in_all(a: &Image, b: &Image) -> f32 {
    let squares: f32 = b.pixels.iter().map(|b| b.length_squared()).sum();
    a.pixels.iter().zip(&b.pixels).map(|(a, b)| (*a - *b).length_squared()).sum::<f32>() / squares
}

/// Largest difference of two pictures, as a share of the mean of the second.
fn difference(a: &Image, b: &Image) -> f32 {
    let largest = a.pixels.iter().zip(&b.pixels).map(|(a, b)| (*a - *b).abs().max_element());
    largest.fold(0.0, f32::max) / (b.mean().element_sum() / 3.0)
}

#[test]
fn a_near_plane_opens_a_room_that_stays_closed_to_light() {
    let eye = Vec3::new(0.3, 0.2, 5.0);
    let outside = look(eye, Vec3::ZERO, 0.5);
    // The wall is 3 m away, all else more than 3.5 m; in the parallel view too.
    let parallel = View { orthographic: true, half_extent: outside.half_extent * 3.0, ..outside };
    for view in [outside, parallel] {
        let cut = View { clip: ClipPlanes { near: 3.5, far: f32::INFINITY }, ..view };
        for picture in [by_samples, by_paths] {
            // Cameras do not see backs of single-sided walls: the same picture but for rounding, and noise where paths are others.
            let (found, expected) = (picture(&room(true), &cut), picture(&room(false), &view));
            let error = difference_in_all(&found, &expected);
            assert!(error < 1e-3, "{error}");
            let walled = picture(&room(true), &view);
            assert!(difference_in_all(&walled, &expected) > 0.9, "the control");
        }
    }
}

#[test]
fn nothing_is_seen_beyond_a_far_plane() {
    let stage = room(true);
    let view = look(Vec3::new(0.0, 0.0, 1.9), Vec3::ZERO, 0.4);
    let to = |far: f32| View { clip: ClipPlanes { near: 0.0, far }, ..view };
    // The blue square is 1.4 m away, the wall behind it 3.9 m.
    let (all, most, few) =
        (by_samples(&stage, &view), by_samples(&stage, &to(4.0)), by_samples(&stage, &to(2.0)));
    assert!(difference(&most, &all) < 1e-5);
    let seen = |image: &Image| image.pixels.iter().filter(|p| **p != Vec3::ZERO).count();
    assert_eq!(seen(&all), 576);
    assert!((1..570).contains(&seen(&few)), "{}", seen(&few));
    for (a, b) in few.pixels.iter().zip(&all.pixels) {
        assert!(*a == Vec3::ZERO || (*a - *b).abs().max_element() < 1e-4 * b.max_element(), "{a} {b}");
    }
    let geometry = stage.geometry();
    let covered =
        coverage(&SceneTracer::new(&stage.scene, &geometry), &to(2.0), (SIZE, Region::whole(SIZE)), 1);
    let is_covered = |(share, pixel): (&f32, &Vec3)| (*share == 1.0) == (*pixel != Vec3::ZERO);
    assert!(covered.iter().zip(&few.pixels).all(is_covered));
    assert_eq!(seen(&by_paths(&stage, &to(1.0))), 0);
}
