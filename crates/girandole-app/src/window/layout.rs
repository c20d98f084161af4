//! What is where in the window: the panel on the right, the picture beside it, and the bar below them, where messages cover
//! nothing.

use super::clock::{Duration, Instant};
use super::controls;
use super::frames::Frames;
use super::keys;
use super::messages::Messages;
use super::panel;
use super::session::Session;
use super::tools::Tools;
use super::waits::What;
use egui::{Align, Align2, Color32, Layout, Rect, Sense, Ui, Vec2};

/// Width of the panel, points.
pub const PANEL_WIDTH: f32 = 320.0;

/// Height of the bar, points.
pub const BAR_HEIGHT: f32 = 26.0;

/// Colour of messages.
const MESSAGE: Color32 = Color32::from_rgb(250, 200, 120);

/// How far from the line between picture and truth it can be taken hold of, points.
const GRIP: f32 = 6.0;

/// What a desktop takes of a screen beside a window: its frame and bars, points.
const DESKTOP: [f32; 2] = [16.0, 88.0];

/// Pixels of a window whose picture has so many, or as many as the screen has room for.
pub fn window_size(picture: [u32; 2], screen: Option<[u32; 2]>, scale: f64) -> [u32; 2] {
    let pixels = |points: f32| (f64::from(points) * scale).round() as u32;
    let wanted = [picture[0] + pixels(PANEL_WIDTH), picture[1] + pixels(BAR_HEIGHT)];
    let Some(screen) = screen.filter(|size| size.iter().all(|&pixels| pixels > 0)) else { return wanted };
    [0, 1].map(|axis| wanted[axis].min(screen[axis].saturating_sub(pixels(DESKTOP[axis])).max(1)))
}

/// Lays a frame out and lets it act on the session.
pub fn show(ui: &mut Ui, session: &mut Session, tools: &mut Tools, frames: &mut Frames) {
    if let Some(sentence) = session.notice.take() {
        tools.messages.say(sentence, Instant::now());
    }
    egui::Panel::bottom("bar").exact_size(BAR_HEIGHT).resizable(false).show(ui, |ui| bar(ui, session, tools));
    tools.shows_panel = tools.panel.unwrap_or(ui.max_rect().width() >= 2.0 * PANEL_WIDTH);
    if tools.shows_panel {
        egui::Panel::right("panel")
            .exact_size(PANEL_WIDTH)
            .resizable(false)
            .show(ui, |ui| panel::show(ui, session, tools, frames));
    }
    egui::CentralPanel::no_frame().show(ui, |ui| picture(ui, session, tools));
    keys::sheet(ui, tools);
}

/// The picture, which is there already, and what hands do to it.
fn picture(ui: &mut Ui, session: &mut Session, tools: &mut Tools) {
    let scale = ui.pixels_per_point();
    let room = ui.max_rect();
    let pixels = (room.size() * scale).round().max(Vec2::ONE);
    tools.picture_size = [pixels.x as u32, pixels.y as u32];
    let rect = Rect::from_min_size(room.min, pixels / scale);
    let response = ui.interact(rect, ui.scope_id().with("picture"), Sense::click_and_drag());
    if session.is_blank {
        // Keys count already, and those that are held are known once there is a scene.
        if keys::are_free(ui, tools) {
            keys::act(ui, session, tools);
            keys::walked(ui, &mut tools.walk);
        }
        return;
    }
    controls::act(ui, &response, session, tools);
    truth(ui, rect, tools);
}

/// The truth over the right part of the picture, and the line between the two, which can be dragged.
fn truth(ui: &mut Ui, rect: Rect, tools: &mut Tools) {
    let Some(texture) = tools.truth.texture().map(egui::TextureHandle::id) else { return };
    let split = &mut tools.truth.split.0;
    let line = |share: f32| rect.left() + rect.width() * share;
    let grip = Rect::from_x_y_ranges(line(*split) - GRIP..=line(*split) + GRIP, rect.y_range());
    let response = ui.interact(grip, ui.scope_id().with("split"), Sense::drag());
    if response.dragged() {
        *split = (*split + response.drag_delta().x / rect.width()).clamp(0.02, 0.98);
    }
    let response = response.on_hover_and_drag_cursor(egui::CursorIcon::ResizeHorizontal);
    let x = line(*split);
    let right = Rect::from_x_y_ranges(x..=rect.right(), rect.y_range());
    let uv = Rect::from_min_max(egui::pos2(*split, 0.0), egui::pos2(1.0, 1.0));
    let painter = ui.painter();
    painter.image(texture, right, uv, Color32::WHITE);
    let color = if response.hovered() { Color32::YELLOW } else { Color32::WHITE };
    painter.vline(x, rect.y_range(), egui::Stroke::new(1.5, color));
    let font = egui::FontId::proportional(14.0);
    for (align, at, text) in
        [(Align2::RIGHT_BOTTOM, x - 8.0, "girandole"), (Align2::LEFT_BOTTOM, x + 8.0, "the truth")]
    {
        let at = egui::pos2(at, rect.bottom() - 8.0);
        painter.text(at + Vec2::splat(1.0), align, text, font.clone(), Color32::BLACK);
        painter.text(at, align, text, font.clone(), Color32::WHITE);
    }
}

/// The line at the window's foot: what is being waited for and how far that is, what is to be known, and where keys are explained.
fn bar(ui: &mut Ui, session: &mut Session, tools: &mut Tools) {
    let now = Instant::now();
    ui.horizontal_centered(|ui| {
        waits(ui, tools, now);
        if let Some((share, doing)) = session.progress() {
            progress(ui, session, share, doing);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let panel = if tools.shows_panel { "Hide panel" } else { "Panel" };
            if ui.small_button(panel).on_hover_text("All settings (H)").clicked() {
                tools.panel = Some(!tools.shows_panel);
            }
            if ui.small_button("F1 keys").on_hover_text("Shows what keys and the mouse do").clicked() {
                tools.shows_keys = !tools.shows_keys;
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| message(ui, &mut tools.messages, now));
        });
    });
}

/// Says what is being waited for, and lets what can be ended be ended.
fn waits(ui: &mut Ui, tools: &mut Tools, now: Instant) {
    for wait in &tools.waits {
        let left = wait.said_in(now);
        if left > Duration::ZERO {
            ui.ctx().request_repaint_after(left);
            continue;
        }
        match wait.share {
            Some(share) => drop(ui.add(bar_of(share, &wait.sentence(now)))),
            None => {
                ui.add(egui::Spinner::new().size(BAR_HEIGHT - 10.0));
                ui.label(wait.sentence(now));
            }
        }
        let ends = match wait.what {
            What::Opening => "Cancel",
            What::Choosing => "Type a path instead",
            What::Compiling => continue,
        };
        if ui.small_button(ends).clicked() {
            tools.cancels = Some(wait.what);
        }
    }
}

fn bar_of(share: f32, text: &str) -> egui::ProgressBar {
    let bar = egui::ProgressBar::new(share).desired_width(180.0).desired_height(BAR_HEIGHT - 8.0);
    bar.text(egui::RichText::new(text).small())
}

/// Says how far light is that is being made, and lets it be cancelled.
fn progress(ui: &mut Ui, session: &mut Session, share: f32, doing: &str) {
    ui.add(bar_of(share, doing));
    if session.is_paused() {
        if ui.small_button("Go on").clicked() {
            session.resume();
        }
    } else if ui.small_button("Cancel").on_hover_text("Leaves the light that was there").clicked() {
        session.cancel();
    }
}

/// Says what is to be known, for a while, or until it is clicked away.
fn message(ui: &mut Ui, messages: &mut Messages, now: Instant) {
    let Some((sentence, left)) = messages.shown(now) else { return };
    let sentence = sentence.to_owned();
    ui.ctx().request_repaint_after(left);
    let is_read = ui.small_button("×").on_hover_text("Clears this message").clicked();
    let label = egui::Label::new(egui::RichText::new(&sentence).color(MESSAGE)).truncate();
    if ui.add(label).on_hover_text(&sentence).hovered() {
        messages.hold(now);
    }
    if is_read {
        messages.dismiss();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_no_larger_than_the_screen() {
        let of = |screen, scale| window_size([1024, 768], screen, scale);
        assert_eq!(of(None, 1.0), [1344, 794]);
        assert_eq!(of(Some([1920, 1080]), 1.0), [1344, 794]);
        assert_eq!(of(Some([0, 0]), 1.0), [1344, 794], "a screen that is not known");
        assert_eq!(of(Some([3840, 2160]), 2.0), [1664, 820]);
        for [width, height] in [[1024, 600], [800, 600], [1366, 768]] {
            let size = of(Some([width, height]), 1.0);
            assert!(size[0] + 16 <= width && size[1] + 88 <= height, "{size:?}");
        }
    }
}
