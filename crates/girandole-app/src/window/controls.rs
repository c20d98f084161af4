//! What hands do to the picture: walk, look, orbit, pick.

use super::camera::{Eye, moved, orbited, turned};
use super::gizmo::{self, Under};
use super::selection::Selected;
use super::session::Session;
use super::tools::Tools;
use super::{keys, outline, touch};
use egui::{PointerButton, Rect, Response, Ui};
use girandole::DebugView;
use girandole_core::glam::{DVec3, Vec2, Vec3};
use girandole_core::scene::View;

/// How much faster one walks with Shift.
const FAST: f32 = 4.0;
/// The longest step in time that one walks at once, seconds, however slow frames are.
const LONGEST_STEP: f32 = 0.25;
/// Radians of a drag by one point.
const RADIANS_PER_POINT: f32 = 0.004;

/// Lets the keyboard and the pointer over the picture act.
pub fn act(ui: &Ui, response: &Response, session: &mut Session, tools: &mut Tools) {
    let view = session.view(tools.picture_size);
    let mut next = view;
    if response.is_pointer_button_down_on() {
        // Whoever was typing into the panel is done with it.
        ui.memory_mut(|memory| memory.focused().into_iter().for_each(|id| memory.surrender_focus(id)));
    }
    // Not by the response: egui itself ends a drag at Escape, which is to undo it.
    if !ui.input(|input| input.pointer.any_down()) {
        (tools.is_cancelled, tools.eye_before) = (false, None);
    }
    if response.drag_started() {
        (tools.is_cancelled, tools.eye_before) = (false, Some(session.eye));
    }
    let stick = touch::stick(ui, response.rect);
    if keys::are_free(ui, tools) {
        keys::act(ui, session, tools);
        if session.view(tools.picture_size) == view {
            next = moved(&next, walk(ui, stick, (session, tools)));
        } else {
            next = session.view(tools.picture_size);
        }
    }
    outline::paint(ui.painter(), response.rect, session, tools);
    let under = gizmo::act(ui.painter(), response, session, tools);
    let is_gizmos = under == Under::Handle && response.dragged_by(PointerButton::Primary);
    if !(is_gizmos || tools.is_cancelled) {
        next = drag(ui, response, (session, tools), &next);
    }
    if next != view
        && let Some(eye) = Eye::free(&next)
        && session.view(tools.picture_size) != next
    {
        session.eye = eye;
    }
    let lamp = if let Under::Lamp(lamp) = under { Some(lamp) } else { None };
    if response.clicked()
        && under != Under::Handle
        && let Some(at) = response.interact_pointer_pos()
    {
        let seen = || tools.picker.pick(session, &view, place(response.rect, at)).map(|(seen, _)| seen);
        let picked = lamp.or_else(seen);
        tools.select(picked);
        let is_asked_for = response.double_clicked() || ui.input(|input| input.modifiers.alt);
        tools.is_locked = picked.is_some_and(|it| !is_asked_for && it.is_structure(session, &view));
    }
    if under != Under::Handle {
        hover(ui, response, lamp, &view, (session, tools));
    }
    let is_in_hand = ui.input(|input| input.pointer.any_down()) || ui.ctx().text_edit_focused();
    if !is_in_hand {
        session.end_step();
    }
}

/// Shows the name of what is under the pointer.
fn hover(
    ui: &Ui,
    response: &Response,
    lamp: Option<Selected>,
    view: &View,
    (session, tools): (&Session, &mut Tools),
) {
    let Some(at) = response.hover_pos().filter(|_| !ui.input(|input| input.pointer.any_down())) else {
        return;
    };
    if session.settings.debug == Some(DebugView::Atlas) {
        return;
    }
    let seen = || tools.picker.hover(session, view, place(response.rect, at));
    let hovered = lamp.or_else(seen).filter(|hovered| hovered.is_there(session));
    // What is picked is named in the panel, and has handles that are not to be covered.
    if let Some(selected) = hovered.filter(|hovered| tools.selected != Some(*hovered)) {
        gizmo::name(ui.painter(), response.rect, at, &selected.name(session));
    }
}

/// Gives up the drag at hand, as if it had never been; without one, nothing is picked any more.
pub fn let_go(session: &mut Session, tools: &mut Tools) {
    let Some(eye) = tools.eye_before.take() else { return tools.select(None) };
    if tools.drag.take().is_some() {
        session.cancel_step();
    } else {
        session.eye = eye;
    }
    tools.is_cancelled = true;
}

/// How far the keys that are down, and the stick, lead in this frame, in metres to the right, up and ahead.
fn walk(ui: &Ui, stick: Vec3, (session, tools): (&Session, &mut Tools)) -> Vec3 {
    let (by, is_fast) = keys::walked(ui, &mut tools.walk);
    let by = by + stick;
    if by == Vec3::ZERO {
        return Vec3::ZERO;
    }
    ui.ctx().request_repaint();
    let seconds = ui.input(|input| input.unstable_dt.min(LONGEST_STEP));
    let speed = session.scene.frame_of_reference().scale * tools.pace * if is_fast { FAST } else { 1.0 };
    by * speed * seconds
}

/// Where a drag or the wheel leads.
fn drag(ui: &Ui, response: &Response, (session, tools): (&Session, &mut Tools), view: &View) -> View {
    let by = response.drag_delta();
    let (right, up) = (by.x * RADIANS_PER_POINT, -by.y * RADIANS_PER_POINT);
    if response.drag_started()
        && let Some(at) = response.interact_pointer_pos()
    {
        tools.pivot = Some(pivot(session, tools, view, place(response.rect, at)));
    }
    if let Some(led) = touch::pinched(ui, response.rect, view, tools.pivot) {
        return led;
    }
    if response.dragged_by(PointerButton::Primary) {
        return turned(view, right, up);
    }
    if let Some(pivot) = tools.pivot {
        if response.dragged_by(PointerButton::Secondary) {
            return orbited(view, pivot, right, up);
        }
        if response.dragged_by(PointerButton::Middle) {
            let distance = (pivot - view.eye).as_vec3().dot(view.forward);
            let height = if view.orthographic { view.half_extent.y } else { distance * view.half_extent.y };
            let metres = 2.0 * height / response.rect.height();
            return moved(view, Vec3::new(-by.x, by.y, 0.0) * metres);
        }
    }
    let wheel = if response.hovered() { ui.input(|i| i.smooth_scroll_delta().y) } else { 0.0 };
    let speed = session.scene.frame_of_reference().scale * tools.pace;
    moved(view, Vec3::Z * (wheel * speed * 0.01))
}

/// Where a point of the window is in the picture: NDC, +Y up.
pub fn place(picture: Rect, at: egui::Pos2) -> Vec2 {
    let share = (at - picture.min) / picture.size();
    Vec2::new(2.0 * share.x - 1.0, 1.0 - 2.0 * share.y)
}

/// What is orbited: what is seen there, or else a point in the middle of the scene's size.
fn pivot(session: &Session, tools: &mut Tools, view: &View, at: Vec2) -> DVec3 {
    let ahead = || moved(view, Vec3::Z * session.scene.frame_of_reference().scale * 0.3).eye;
    tools.picker.pick(session, view, at).map_or_else(ahead, |(_, point)| point)
}

#[cfg(test)]
mod tests;
