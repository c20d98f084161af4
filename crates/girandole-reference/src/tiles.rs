//! Pictures computed tile by tile on all cores. A pixel's value depends on its position only, never on the order.

#[cfg(feature = "parallel")]
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Pixels on a tile's side: neighbouring pixels share the scratch memory of a thread.
const TILE: u32 = 16;

/// All pixels of a picture, row by row from the top. Each tile starts with a `scratch` of its own; `progress` is
/// called with the share of finished tiles, 0 to 1, by the thread that finishes one.
pub(crate) fn render<S, T: Copy + Default + Send>(
    size: [u32; 2],
    progress: &(dyn Fn(f32) + Sync),
    scratch: impl Fn() -> S + Sync,
    pixel: impl Fn(&mut S, [u32; 2]) -> T + Sync,
) -> Vec<T> {
    let [width, height] = size;
    let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
    let count = columns as usize * rows as usize;
    let done = AtomicUsize::new(0);
    #[cfg(feature = "parallel")]
    let indices = (0..count).into_par_iter();
    #[cfg(not(feature = "parallel"))]
    let indices = 0..count;
    let tiles: Vec<Vec<T>> = indices
        .map(|index| {
            let [x, y] = corner(index, columns);
            let mut scratch = scratch();
            let mut values = Vec::with_capacity((TILE * TILE) as usize);
            for y in y..height.min(y + TILE) {
                for x in x..width.min(x + TILE) {
                    values.push(pixel(&mut scratch, [x, y]));
                }
            }
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / count as f32);
            values
        })
        .collect();
    let mut result = vec![T::default(); width as usize * height as usize];
    for (index, tile) in tiles.iter().enumerate() {
        let [x, y] = corner(index, columns);
        let run = (width - x).min(TILE) as usize;
        for (row, values) in tile.chunks(run).enumerate() {
            let start = (y as usize + row) * width as usize + x as usize;
            result[start..start + run].copy_from_slice(values);
        }
    }
    result
}

/// Does something to each row of so many values, on all cores; rows count from 0.
pub(crate) fn for_each_row<T: Send>(values: &mut [T], width: usize, f: impl Fn(u32, &mut [T]) + Sync + Send) {
    let width = width.max(1);
    #[cfg(feature = "parallel")]
    values.par_chunks_mut(width).enumerate().for_each(|(row, values)| f(row as u32, values));
    #[cfg(not(feature = "parallel"))]
    values.chunks_mut(width).enumerate().for_each(|(row, values)| f(row as u32, values));
}

fn corner(index: usize, columns: u32) -> [u32; 2] {
    let index = index as u32;
    [index % columns * TILE, index / columns * TILE]
}
