//! What is where in the window: the panel on the right, the picture beside it, and what is said over it.

use super::controls;
use super::frames::Frames;
use super::panel;
use super::session::Session;
use super::tools::Tools;
use egui::{Align2, Color32, Frame, Rect, Sense, Ui, Vec2};

/// Width of the panel, points.
pub const PANEL_WIDTH: f32 = 320.0;

/// How far from the line between picture and truth it can be taken hold of, points.
const GRIP: f32 = 6.0;

/// Lays a frame out and lets it act on the session.
pub fn show(ui: &mut Ui, session: &mut Session, tools: &mut Tools, frames: &mut Frames) {
    if tools.shows_panel {
        egui::Panel::right("panel")
            .exact_size(PANEL_WIDTH)
            .resizable(false)
            .show(ui, |ui| panel::show(ui, session, tools, frames));
    }
    egui::CentralPanel::no_frame().show(ui, |ui| picture(ui, session, tools));
    if let Some((share, doing)) = session.progress() {
        progress(ui, session, share, doing);
    }
    notice(ui, session);
}

/// The picture, which is there already, and what hands do to it.
fn picture(ui: &mut Ui, session: &mut Session, tools: &mut Tools) {
    let scale = ui.pixels_per_point();
    let room = ui.max_rect();
    let pixels = (room.size() * scale).round().max(Vec2::ONE);
    tools.picture_size = [pixels.x as u32, pixels.y as u32];
    let rect = Rect::from_min_size(room.min, pixels / scale);
    let response = ui.interact(rect, ui.scope_id().with("picture"), Sense::click_and_drag());
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

/// Says how far light is that is being made, at the picture's top, and lets it be cancelled.
fn progress(ui: &Ui, session: &mut Session, share: f32, doing: &str) {
    let corner = ui.max_rect().left_top() + Vec2::splat(12.0);
    egui::Area::new(egui::Id::unique("progress")).fixed_pos(corner).show(ui.ctx(), |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            ui.horizontal(|ui| {
                ui.add(egui::ProgressBar::new(share).desired_width(160.0).text(doing));
                if session.is_paused() {
                    if ui.button("Go on").clicked() {
                        session.resume();
                    }
                } else if ui.button("Cancel").on_hover_text("Leaves the light that was there").clicked() {
                    session.cancel();
                }
            });
        });
    });
}

/// Says what went wrong or is to be known, at the picture's bottom, until it is clicked away.
fn notice(ui: &Ui, session: &mut Session) {
    let Some(sentence) = session.notice.clone() else { return };
    let corner = ui.max_rect().left_bottom() + Vec2::new(12.0, -12.0);
    let area = egui::Area::new(egui::Id::unique("notice")).pivot(Align2::LEFT_BOTTOM).fixed_pos(corner);
    area.show(ui.ctx(), |ui| {
        Frame::popup(ui.style()).fill(Color32::from_rgb(60, 40, 20)).show(ui, |ui| {
            ui.set_max_width(560.0);
            ui.horizontal_wrapped(|ui| {
                if ui.button("×").on_hover_text("Clears this message").clicked() {
                    session.notice = None;
                }
                ui.label(sentence);
            });
        });
    });
}
