//! Numbers for the difference of pictures.

use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_reference::metrics::{CompareOptions, HeatMap, compare, heat_map};

fn picture(width: u32, height: u32, pixel: impl Fn(u32, u32) -> Vec3) -> Image {
    let at = |i: u32| pixel(i % width, i / width);
    Image { width, height, pixels: (0..width * height).map(at).collect() }
}

fn gradient() -> Image {
    picture(40, 30, |x, y| Vec3::new(x as f32 / 40.0, y as f32 / 30.0, 0.3))
}

#[test]
fn equal_pictures_do_not_differ() {
    let image = gradient();
    let same = compare(&image, &image, &CompareOptions::default()).expect("comparable");
    assert_eq!((same.valid_pixels, same.energy_ratio, same.non_finite), (1200, 1.0, 0));
    assert_eq!((same.rel_mse, same.rmse, same.flip, same.worst_error), (0.0, 0.0, 0.0, 0.0));
    let map = heat_map(&image, &image, &CompareOptions::default(), HeatMap::Relative).expect("comparable");
    assert!(map.pixels.iter().all(|p| p.max_element() < 0.01), "black");
    // Negative control: hardly different pictures do.
    let other = picture(40, 30, |x, y| gradient().pixels[(y * 40 + x) as usize] * 1.02);
    let differ = compare(&image, &other, &CompareOptions::default()).expect("comparable");
    assert!(differ.rel_mse > 0.0 && differ.rmse > 0.0 && differ.flip > 0.0);
}

#[test]
fn numbers_by_hand() {
    // Four pixels: off by 0.1 in red at r = 0, by 0.3 everywhere at r = 1 (test is lower), and twice not at all.
    let reference = picture(4, 1, |x, _| Vec3::splat([0.0, 1.0, 1.0, 0.5][x as usize]));
    let mut test = reference.clone();
    test.pixels[0] = Vec3::X * 0.1;
    test.pixels[1] = Vec3::splat(0.7);
    let first = 0.01 / 0.01 / 3.0;
    let second = 0.09 / 1.01;
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} for {b}");
    let found = compare(&reference, &test, &CompareOptions::default()).expect("comparable");
    assert_eq!(found.valid_pixels, 4);
    near(found.rel_mse, (first + second) / 4.0);
    near(found.rmse, ((0.01 + 3.0 * 0.09) / 12f64).sqrt());
    near(found.energy_ratio, (7.5 + 0.1 - 0.9) / 7.5);
    assert_eq!(found.worst_pixel, [0, 0]);
    near(found.worst_error, first);
    // A quarter is one pixel: the worst goes.
    let trimmed = CompareOptions { trim: 0.25, ..CompareOptions::default() };
    let found = compare(&reference, &test, &trimmed).expect("comparable");
    near(found.rel_mse, second / 3.0);
    near(found.worst_error, first);
    // An emitter, then background, then an edge are left out.
    let mask = picture(4, 1, |x, _| [Vec3::X, Vec3::Y * 0.01, Vec3::Z, Vec3::ZERO][x as usize]);
    let masked = CompareOptions { mask: Some(mask), ..CompareOptions::default() };
    let found = compare(&reference, &test, &masked).expect("comparable");
    assert_eq!((found.valid_pixels, found.rel_mse, found.flip), (1, 0.0, 0.0));
    let edges = CompareOptions { keep_edges: true, ..masked };
    assert_eq!(compare(&reference, &test, &edges).expect("comparable").valid_pixels, 2);
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let image = gradient();
    let refuse = |test: &Image, options: &CompareOptions| {
        compare(&image, test, options).expect_err("must be refused").to_string()
    };
    let plain = CompareOptions::default();
    assert!(refuse(&picture(30, 40, |_, _| Vec3::ONE), &plain).contains("30×40"));
    let mut bad = image.clone();
    bad.pixels[45].y = f32::NAN;
    bad.pixels[46].x = f32::INFINITY;
    let sentence = refuse(&bad, &plain);
    assert!(sentence.contains("2 pixels") && sentence.contains("(5, 1) of the test picture"), "{sentence}");
    assert!(refuse(&image, &CompareOptions { trim: 1.0, ..plain.clone() }).contains("trim"));
    assert!(refuse(&image, &CompareOptions { trim: f32::NAN, ..plain.clone() }).contains("trim"));
    let all = CompareOptions { mask: Some(picture(40, 30, |_, _| Vec3::X)), ..plain.clone() };
    assert!(refuse(&image, &all).contains("mask"));
    let small = CompareOptions { mask: Some(picture(4, 3, |_, _| Vec3::X)), ..plain.clone() };
    assert!(refuse(&image, &small).contains("mask"));
    // Where they do not count, they are counted.
    let corner = picture(40, 30, |_, y| if y == 1 { Vec3::X } else { Vec3::ZERO });
    let options = CompareOptions { mask: Some(corner), ..plain.clone() };
    let found = compare(&image, &bad, &options).expect("comparable");
    assert_eq!((found.non_finite, found.rel_mse, found.flip), (2, 0.0, 0.0));
    // A heat map shows them.
    let map = heat_map(&image, &bad, &plain, HeatMap::Relative).expect("comparable");
    assert_eq!(map.pixels[45], Vec3::new(0.0, 1.0, 1.0));
}

#[test]
fn flip_grows_with_the_difference() {
    let black = picture(32, 32, |_, _| Vec3::ZERO);
    let white = picture(32, 32, |_, _| Vec3::ONE);
    let flip = |a: &Image, b: &Image| {
        let found = compare(a, b, &CompareOptions::default()).expect("comparable");
        assert!((0.0..=1.0).contains(&found.flip));
        found.flip
    };
    assert!(flip(&white, &black) > 0.8, "{}", flip(&white, &black));
    let grey = gradient();
    let noisy = |amount: f32| {
        picture(40, 30, |x, y| {
            let sign = if (x * 7 + y * 13) % 5 < 2 { 1.0 } else { -1.0 };
            (grey.pixels[(y * 40 + x) as usize] + amount * sign).max(Vec3::ZERO)
        })
    };
    let (small, large) = (flip(&grey, &noisy(0.02)), flip(&grey, &noisy(0.2)));
    assert!(0.0 < small && small < large && large < 1.0, "{small} {large}");
    // Exposure is the reference's: both a thousand times as bright look the same.
    let scaled = |image: &Image| Image { pixels: image.pixels.iter().map(|p| *p * 1e3).collect(), ..*image };
    let bright = flip(&scaled(&grey), &scaled(&noisy(0.2)));
    assert!((bright - large).abs() < 0.01, "{bright} {large}");
}

#[test]
fn heat_maps_show_where() {
    let image = gradient();
    let mut test = image.clone();
    test.pixels[30 + 40 * 20] += 5.0;
    for kind in [HeatMap::Relative, HeatMap::Flip] {
        let map = heat_map(&image, &test, &CompareOptions::default(), kind).expect("comparable");
        assert_eq!((map.width, map.height), (40, 30));
        let hot = map.pixels[30 + 40 * 20];
        assert!(hot.element_sum() > 0.2, "{hot}");
        assert!(map.pixels[5].max_element() < 0.01, "{}", map.pixels[5]);
    }
}

#[test]
fn outliers_are_beyond_ten_times_what_is_about_them() {
    let reference = picture(9, 5, |x, y| Vec3::splat(if (x, y) == (7, 2) { 3.0 } else { 0.2 }));
    let count = |places: &[(u32, u32)], value: f32, mask: Option<Image>| {
        let mut test = reference.clone();
        for (x, y) in places {
            test.pixels[(y * 9 + x) as usize].y = value;
        }
        let options = CompareOptions { mask, ..CompareOptions::default() };
        compare(&reference, &test, &options).expect("comparable").outliers
    };
    // Beside each other, in corners too; but not beside what is bright.
    assert_eq!(count(&[(0, 0), (1, 0), (2, 2), (7, 1)], 2.1, None), 3);
    assert_eq!(count(&[(0, 0), (2, 2)], 1.9, None), 0);
    assert_eq!(count(&[(6, 2), (7, 2)], 31.0, None), 2);
    assert_eq!(count(&[(0, 0), (2, 2)], 2.1, Some(picture(9, 5, |x, _| Vec3::X * f32::from(x == 0)))), 1);
    // Where all is dark, what is no brighter than the eye could tell is none.
    let black = Image::new(9, 5);
    let dim = picture(9, 5, |_, _| Vec3::splat(0.09));
    assert_eq!(compare(&black, &dim, &CompareOptions::default()).expect("comparable").outliers, 0);
}
