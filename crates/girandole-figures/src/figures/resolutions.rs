//! Figure 5-8: the resolution of shadow maps and the number of light samples, and what each is good for.

use super::Figure;
use super::fit::{two, verdict};
use super::shadows::{DEGREES, EYE, TARGET, error, mapped, scene, small, traced};
use super::views::looking;
use crate::bench::Bench;
use crate::report::{Outcome, Picture, Plot, Table, number};
use anyhow::Result;
use girandole_core::glam::Vec3;
use girandole_core::image::Image;
use girandole_core::scene::{Scene, View};
use girandole_core::tonemap::Exposure;
use girandole_reference::metrics::Comparison;

pub const FIGURE: Figure = Figure {
    id: "5-8",
    title: "Resolution of shadow maps, and number of lights",
    thesis: "Higher map resolutions result in less aliasing and a more accurate shadow shape. Higher sample counts \
        reduce aliasing but do not improve the shadow's shape. Percentage-closer filtering could soften the edges.",
    run,
};

/// Errors of a cell of figure 5-8.
struct Cell {
    lights: u32,
    map_size: u32,
    pcf: u32,
    /// To the same samples with traced visibility: what the shadow map does.
    shape: Comparison,
    /// To the truth.
    all: Comparison,
}

/// One of the rows of figure 5-8.
struct Row {
    lights: u32,
    cells: Vec<Cell>,
    /// Of the same samples with traced visibility, to the truth: what their number does.
    aliasing: Comparison,
    strip: Image,
}

fn run(bench: &Bench) -> Result<Outcome> {
    let counts = bench.of([&[4, 8][..], &[25, 50, 100], &[25, 50, 100]]);
    let sizes = bench.of([&[64, 128][..], &[64, 128, 256, 512], &[64, 128, 256, 512]]);
    let (size, many) = (bench.of([[64, 48], [200, 150], [256, 192]]), bench.of([64, 1024, 4096]));
    let (scene, object) = scene(bench)?;
    let shown = (looking(EYE, TARGET, DEGREES, size)?, size);
    let truth = traced(&scene, shown, many)?;
    let mut rows = Vec::new();
    for &lights in counts {
        rows.push(row(bench, &scene, shown, (lights, sizes), &truth)?);
    }
    let ev = Exposure::Auto.ev(&truth);
    let mut outcome = Outcome::default();
    for row in &rows {
        let sizes: Vec<String> = sizes.iter().map(u32::to_string).collect();
        let caption = format!(
            "{} lights; maps of {} texels; of {} and {} with a filter of {PCF} texels; traced rays",
            row.lights,
            sizes.join(", "),
            sizes[1],
            sizes[sizes.len() - 1]
        );
        outcome.pictures.push(Picture::exposed(&format!("lights-{}", row.lights), &caption, &row.strip, ev));
    }
    outcome.pictures.push(Picture::exposed(
        "truth",
        &format!("Truth: {many} lights, traced rays"),
        &truth,
        ev,
    ));
    tell_maps(&mut outcome, &rows);
    outcome.settings = format!(
        "table with the {object} over its floor, {} × {} pixels each; direct light alone, samples by power, seed 0; \
         mode VD. Truth: {many} samples, traced. The error of shape is that to the same samples with traced \
         visibility, that of sampling is theirs to the truth.",
        size[0], size[1]
    );
    Ok(outcome)
}

/// Width of the percentage-closer filter in texels.
const PCF: u32 = 3;

fn row(
    bench: &Bench,
    scene: &Scene,
    (view, size): (View, [u32; 2]),
    (lights, sizes): (u32, &[u32]),
    truth: &Image,
) -> Result<Row> {
    let exact = traced(scene, (view, size), lights)?;
    let (mut cells, mut shown) = (Vec::new(), Vec::new());
    for pcf in [0, PCF] {
        for &map_size in sizes {
            let image = mapped(bench, scene, (view, size), lights, (map_size, pcf))?;
            let (shape, all) = (error(&exact, &image)?, error(truth, &image)?);
            cells.push(Cell { lights, map_size, pcf, shape, all });
            if pcf == 0 || map_size == sizes[1] || map_size == sizes[sizes.len() - 1] {
                shown.push(image);
            }
        }
    }
    let aliasing = error(truth, &exact)?;
    shown.push(exact);
    Ok(Row { lights, cells, aliasing, strip: side_by_side(&shown) })
}

/// Pictures of one size in a row, with white lines between them.
fn side_by_side(images: &[Image]) -> Image {
    let height = images.first().map_or(0, |image| image.height);
    let mut pixels = Vec::new();
    for y in 0..height as usize {
        for (i, image) in images.iter().enumerate() {
            let width = image.width as usize;
            if i > 0 {
                pixels.extend([Vec3::splat(1e3); 4]);
            }
            pixels.extend_from_slice(&image.pixels[y * width..(y + 1) * width]);
        }
    }
    Image { width: (pixels.len() / height.max(1) as usize) as u32, height, pixels }
}

/// The table, the plot, what is seen, and the verdict.
fn tell_maps(outcome: &mut Outcome, rows: &[Row]) {
    let mut table = Table::new(
        "errors",
        "Errors by number of lights, texels across a map, and width of the filter",
        &[
            "lights",
            "texels",
            "filter",
            "FLIP",
            "relMSE",
            "FLIP of shape",
            "relMSE of shape",
            "FLIP of sampling",
        ],
    );
    for row in rows {
        for Cell { lights, map_size, pcf, shape, all } in &row.cells {
            let [a, b, c, d, e] =
                [all.flip, all.rel_mse, shape.flip, shape.rel_mse, row.aliasing.flip].map(small);
            table.row([lights.to_string(), map_size.to_string(), pcf.to_string(), a, b, c, d, e]);
        }
    }
    outcome.tables.push(table);
    let mut plot = Plot::logarithmic(
        "resolution",
        "Without a filter; shape: to the same samples, traced",
        "texels across a map",
        "FLIP",
    );
    for row in rows {
        for (what, value) in
            [("shape", (|cell| cell.shape.flip) as fn(&Cell) -> f64), ("all", |cell| cell.all.flip)]
        {
            let points = row.cells.iter().filter(|cell| cell.pcf == 0);
            let points = points.map(|cell| [f64::from(cell.map_size), value(cell)]).collect();
            plot.curve(&format!("{what}, {} lights", row.lights), points);
        }
    }
    outcome.plots.push(plot);
    let claims = [sharpens(rows), reduces(rows), keeps(rows)];
    let seen: Vec<&str> = claims.iter().map(|claim| claim.1.as_str()).collect();
    outcome.seen = format!("{} {}", seen.join(" "), filtered(rows));
    outcome.verdict = verdict(claims);
}

/// Errors of shape without a filter, by resolution.
fn shapes(row: &Row) -> Vec<f64> {
    row.cells.iter().filter(|cell| cell.pcf == 0).map(|cell| cell.shape.flip).collect()
}

/// Whether each step of resolution lowers the error of shape.
fn sharpens(rows: &[Row]) -> (bool, String) {
    let holds = rows.iter().all(|row| shapes(row).windows(2).all(|pair| pair[1] < pair[0]));
    let sentence = |row: &Row| {
        let falls: Vec<String> = shapes(row).iter().map(|&flip| number(flip, 4)).collect();
        format!("with {} lights {}", row.lights, falls.join(", "))
    };
    let each: Vec<String> = rows.iter().map(sentence).collect();
    (holds, format!("From the smallest to the largest maps FLIP of shape is {}.", each.join("; ")))
}

/// Whether each step of the number of lights lowers the error of sampling.
fn reduces(rows: &[Row]) -> (bool, String) {
    let errors: Vec<f64> = rows.iter().map(|row| row.aliasing.flip).collect();
    let each: Vec<String> =
        rows.iter().map(|row| format!("{} with {}", number(row.aliasing.flip, 4), row.lights)).collect();
    (
        errors.windows(2).all(|pair| pair[1] < pair[0]),
        format!("FLIP of sampling is {} lights.", each.join(", ")),
    )
}

/// Whether the error of shape is nearer to staying, from the fewest to the most lights, than to what errors that are
/// independent from light to light would become.
fn keeps(rows: &[Row]) -> (bool, String) {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return (false, String::new()) };
    let independent = (f64::from(first.lights) / f64::from(last.lights)).sqrt();
    let kept: Vec<f64> = shapes(first).iter().zip(shapes(last)).map(|(few, many)| many / few).collect();
    let sampling = last.aliasing.flip / first.aliasing.flip;
    let each: Vec<String> = kept.iter().map(|&share| two(share)).collect();
    let sentence = format!(
        "From {} to {} lights FLIP of shape becomes {} times what it was, in the order of the maps, and FLIP of \
         sampling {} times; errors independent from light to light would become {} times.",
        first.lights,
        last.lights,
        each.join(", "),
        two(sampling),
        two(independent)
    );
    (kept.iter().all(|&share| share > independent.sqrt()), sentence)
}

/// What the filter does with the fewest lights.
fn filtered(rows: &[Row]) -> String {
    let Some(row) = rows.first() else { return String::new() };
    let (plain, filtered): (Vec<&Cell>, Vec<&Cell>) = row.cells.iter().partition(|cell| cell.pcf == 0);
    let each = plain.iter().zip(filtered).map(|(plain, filtered)| {
        let [flip, rel_mse] =
            [filtered.all.flip / plain.all.flip, filtered.all.rel_mse / plain.all.rel_mse].map(two);
        let [before, after] = [plain, filtered].map(|cell| number(100.0 * (cell.all.energy_ratio - 1.0), 1));
        format!(
            "{flip} and {rel_mse} at {} texels (energy off by {after} % in place of {before} %)",
            plain.map_size
        )
    });
    let each: Vec<String> = each.collect();
    format!(
        "With {} lights the filter multiplies FLIP and relMSE to the truth by {}.",
        row.lights,
        each.join("; ")
    )
}
