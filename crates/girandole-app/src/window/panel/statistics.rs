//! Times of the last frames, and what the last one did.

use crate::window::clock::{Duration, Instant};
use crate::window::frames::{AT_REST, FrameTimes, Frames, REMEMBERED};
use crate::window::session::Session;
use egui::{Color32, Grid, Rect, Sense, Ui, Vec2};
use girandole::FrameStats;

/// Height of the graph, points.
const HEIGHT: f32 = 48.0;

/// The parts of a frame, each in a colour of its own.
fn parts(times: &FrameTimes) -> [(&'static str, Color32, f64); 4] {
    [
        ("device", Color32::from_rgb(90, 150, 230), times.device),
        ("record", Color32::from_rgb(110, 200, 120), times.record),
        ("update", Color32::from_rgb(240, 180, 70), times.update),
        ("panel", Color32::from_rgb(210, 110, 160), times.panel),
    ]
}

/// What a picture takes, in numbers and as a graph.
pub fn rate(ui: &mut Ui, frames: &Frames) {
    ui.horizontal(|ui| {
        let rate = frames.rate(Instant::now());
        let (time, often) = match rate {
            None => ("no picture yet".into(), String::new()),
            Some((ms, None)) => (milliseconds(ms), "at rest".into()),
            Some((ms, Some(rate))) => (milliseconds(ms), frames_a_second(rate)),
        };
        ui.strong(time).on_hover_text("What a picture takes, the mean of the last two seconds");
        ui.label(often).on_hover_text("Pictures a second, as they are shown");
        if rate.is_some_and(|(_, often)| often.is_some()) {
            ui.ctx().request_repaint_after(Duration::from_secs_f64(AT_REST));
        }
    });
    graph(ui, frames);
}

/// So many milliseconds, in as many digits as are of use.
fn milliseconds(ms: f64) -> String {
    match ms {
        ..10.0 => format!("{ms:.1} ms"),
        ..1e4 => format!("{ms:.0} ms"),
        _ => format!("{:.1} s", ms / 1e3),
    }
}

fn frames_a_second(rate: f64) -> String {
    if rate < 10.0 { format!("{rate:.1} frames/s") } else { format!("{rate:.0} frames/s") }
}

/// The parts of the last frame, and the counts.
pub fn show(ui: &mut Ui, session: &mut Session, frames: &mut Frames) {
    if let Some(last) = frames.history.back() {
        ui.horizontal_wrapped(|ui| {
            for (name, color, ms) in parts(last) {
                ui.colored_label(color, format!("{name} {ms:.0} ms"));
            }
        });
    }
    let explanation =
        "Times each pass on the device. On software devices that takes about a tenth of a frame.";
    if ui.checkbox(&mut frames.times_passes, "Time passes").on_hover_text(explanation).changed() {
        session.time_passes(frames.times_passes);
    }
    if let Some(stats) = &frames.stats {
        counts(ui, stats, frames.stale_error);
    }
}

fn graph(ui: &mut Ui, frames: &Frames) {
    let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), HEIGHT), Sense::hover());
    let highest = scale(frames);
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let width = rect.width() / REMEMBERED as f32;
    for (index, times) in frames.history.iter().rev().enumerate() {
        let right = rect.right() - width * index as f32;
        let mut bottom = rect.bottom();
        for (_, color, ms) in parts(times) {
            let top = bottom - (ms / highest) as f32 * rect.height();
            let bar = Rect::from_x_y_ranges(right - width..=right, top..=bottom);
            painter.rect_filled(bar, 0.0, color);
            bottom = top;
        }
    }
    let font = egui::FontId::proportional(11.0);
    let corner = rect.left_top() + Vec2::new(4.0, 2.0);
    painter.text(corner, egui::Align2::LEFT_TOP, format!("{highest:.0} ms"), font, ui.visuals().text_color());
    response
        .on_hover_text("The last pictures, by what took how long; one in twenty may reach beyond the graph.");
}

/// What the graph's height stands for, milliseconds: one frame of twenty may reach beyond.
fn scale(frames: &Frames) -> f64 {
    let mut totals: Vec<f64> = frames.history.iter().map(FrameTimes::total).collect();
    totals.sort_by(f64::total_cmp);
    totals.get((totals.len() * 19 / 20).saturating_sub(1)).map_or(1.0, |ms| ms.max(1.0))
}

fn counts(ui: &mut Ui, stats: &FrameStats, stale_error: Option<f64>) {
    Grid::new("counts").num_columns(2).striped(true).show(ui, |ui| {
        let pairs = stats.pairs;
        let mut line = |name: &str, value: String| {
            ui.label(name);
            ui.label(value);
            ui.end_row();
        };
        line("light samples", stats.lights.to_string());
        line("map size", format!("{} texels", stats.map_size));
        line("atlas", format!("{} pages, {} MiB", stats.atlas_pages, stats.atlas_bytes >> 20));
        line("maps drawn", stats.maps_drawn.to_string());
        line("maps stale", format!("{}, up to {} frames", stats.stale.maps, stats.stale.oldest));
        if let Some(error) = stale_error {
            line("stale error", format!("{:.2} %", error * 100.0));
        }
        line("points shaded", stats.points.iter().sum::<u64>().to_string());
        line("pairs looked up", pairs.looked_up.to_string());
        line("pairs unshadowed", pairs.unshadowed.to_string());
        line("pairs in light maps", pairs.mapped.to_string());
        line("pairs left out", pairs.skipped.to_string());
        if stats.passes[0] > 0 {
            line("passes", format!("{} of {}", stats.passes[0], stats.passes[1]));
        }
        line("receivers", format!("{}, {} with light maps", stats.leaves[0], stats.leaves[1]));
        for (pass, ms) in &stats.gpu_ms {
            line(&pass.trim_end_matches("_gpu_ms").replace('_', " "), format!("{ms:.2} ms"));
        }
    });
}
