//! Means of a bilinear picture over cells between lines across and down: of each cell the mean over the same places
//! along both axes, so that each axis has weights of its own, and the picture is gone through once.

use crate::image::Image;
use crate::parallel;
use glam::Vec3;
use std::collections::BTreeMap;

/// Pixels along one axis, and their shares of a mean.
pub(super) type Shares = Vec<(u32, f32)>;

/// The shares of pixels along an axis in the mean over places from 0 to 1. Around goes on at the other edge; up and
/// down do not.
pub(super) fn shares(places: impl IntoIterator<Item = f64>, pixels: u32, is_around: bool) -> Shares {
    let mut sums: BTreeMap<u32, f64> = BTreeMap::new();
    let mut count = 0.0;
    for place in places {
        let at = place * f64::from(pixels) - 0.5;
        let (low, share) = (at.floor(), at - at.floor());
        let n = i64::from(pixels);
        for (pixel, share) in [(low as i64, 1.0 - share), (low as i64 + 1, share)] {
            let pixel = if is_around { pixel.rem_euclid(n) } else { pixel.clamp(0, n - 1) };
            *sums.entry(pixel as u32).or_default() += share;
        }
        count += 1.0;
    }
    sums.into_iter().filter(|(_, sum)| *sum > 0.0).map(|(pixel, sum)| (pixel, (sum / count) as f32)).collect()
}

/// The mean of each cell of these rows, row by row, each of all the columns.
pub(super) fn means(image: &Image, rows: &[Shares], columns: &[Shares]) -> Vec<Vec3> {
    let width = image.width as usize;
    let row_means = |row: &Shares| -> Vec<Vec3> {
        let mut merged = vec![Vec3::ZERO; width];
        for &(y, share) in row {
            let pixels = &image.pixels[y as usize * width..][..width];
            for (sum, pixel) in merged.iter_mut().zip(pixels) {
                *sum += *pixel * share;
            }
        }
        let mean = |column: &Shares| column.iter().map(|&(x, share)| merged[x as usize] * share).sum();
        columns.iter().map(mean).collect()
    };
    parallel::map(rows, row_means).concat()
}

#[cfg(test)]
mod tests {
    use super::super::bilinear;
    use super::*;
    use glam::Vec2;

    #[test]
    fn means_are_those_over_places() {
        let (width, height) = (7, 5);
        let pixels = (0..35_u32).map(|i| Vec3::new((i * 7 % 11) as f32, (i % 3) as f32, 1.0)).collect();
        let image = Image { width, height, pixels };
        let cells = [3_u32, 2];
        let place =
            |cell: u32, k: u32, of: u32| (f64::from(cell) + (f64::from(k) + 0.5) / 6.0) / f64::from(of);
        let along = |of: u32, pixels: u32, is_around: bool| -> Vec<Shares> {
            (0..of).map(|cell| shares((0..6).map(|k| place(cell, k, of)), pixels, is_around)).collect()
        };
        let found = means(&image, &along(cells[1], height, false), &along(cells[0], width, true));
        for (i, found) in (0..).zip(found) {
            let mut sum = Vec3::ZERO;
            for (k, l) in (0..6).flat_map(|k| (0..6).map(move |l| (k, l))) {
                let [x, y] = [place(i % 3, k, 3), place(i / 3, l, 2)].map(|x| x as f32);
                sum += bilinear(&image, Vec2::new(x, y));
            }
            assert!(found.abs_diff_eq(sum / 36.0, 1e-4), "{i}: {found} {}", sum / 36.0);
        }
        let one = Image { width: 1, height: 1, pixels: vec![Vec3::splat(0.3)] };
        let same = means(&one, &along(2, 1, false), &along(3, 1, true));
        assert!(same.iter().all(|mean| *mean == Vec3::splat(0.3)), "to the bit");
    }
}
