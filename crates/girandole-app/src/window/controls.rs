//! What hands do to the picture: walk, look, orbit, pick.

use super::camera::{Eye, moved, orbited, turned};
use super::gizmo;
use super::session::Session;
use super::tools::Tools;
use egui::{Event, InputState, Key, Modifiers, PointerButton, Response, Ui};
use girandole_core::glam::{DVec3, Vec2, Vec3};
use girandole_core::scene::{Geometry, ObjectId, View};
use girandole_core::trace::SceneTracer;

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
    if !ui.ctx().text_edit_focused() {
        keys(ui, session, tools);
        next = moved(&next, walk(ui, session, tools));
    }
    let is_handled = gizmo::act(ui.painter(), response, session, tools);
    if !(is_handled && response.dragged_by(PointerButton::Primary)) {
        next = drag(ui, response, (session, tools), &next);
    }
    if next != view
        && let Some(eye) = Eye::free(&next)
    {
        session.eye = eye;
    }
    if response.clicked()
        && !is_handled
        && let Some(at) = response.interact_pointer_pos()
    {
        tools.selected = pick(session, &view, place(response, at)).map(|(object, _)| object);
    }
}

fn keys(ui: &Ui, session: &mut Session, tools: &mut Tools) {
    let pressed = |key| ui.input(|input| input.key_pressed(key));
    if pressed(Key::Space) {
        session.playback.playing = !session.playback.playing;
    }
    if pressed(Key::F12) {
        tools.saves = true;
    }
    if pressed(Key::F9) {
        tools.copies = true;
    }
    if pressed(Key::T) {
        tools.truth.against = tools.truth.against.next();
    }
    if pressed(Key::V) {
        session.next_debug_view();
    }
    if pressed(Key::H) {
        tools.shows_panel = !tools.shows_panel;
    }
    tools.quits |= ui.input_mut(|input| input.consume_key(Modifiers::COMMAND, Key::Q));
    if pressed(Key::Escape) {
        tools.selected = None;
    }
}

/// Brings the keys that one walks by up to date: those that are down, but for those of a shortcut, whichever of its keys is let go
/// first.
fn hold(walk: &mut Vec<Key>, input: &InputState) {
    walk.retain(|key| input.key_down(*key));
    for event in &input.events {
        if let Event::Key { key, pressed: true, repeat: false, modifiers, .. } = event
            && !(modifiers.command || modifiers.alt || walk.contains(key))
            && input.key_down(*key)
        {
            walk.push(*key);
        }
    }
}

/// How far the keys that are down lead in this frame, in metres to the right, up and ahead.
fn walk(ui: &Ui, session: &Session, tools: &mut Tools) -> Vec3 {
    ui.input(|input| hold(&mut tools.walk, input));
    let is_down = |key: Key| f32::from(u8::from(tools.walk.contains(&key)));
    let axis = |plus: Key, minus: Key| is_down(plus) - is_down(minus);
    let by = Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
    if by == Vec3::ZERO || ui.input(|i| i.modifiers.command || i.modifiers.alt) {
        return Vec3::ZERO;
    }
    ui.ctx().request_repaint();
    let (seconds, fast) = ui.input(|i| (i.unstable_dt.min(LONGEST_STEP), i.modifiers.shift));
    let speed = session.scene.frame_of_reference().scale * tools.pace * if fast { FAST } else { 1.0 };
    by * speed * seconds
}

/// Where a drag or the wheel leads.
fn drag(ui: &Ui, response: &Response, (session, tools): (&Session, &mut Tools), view: &View) -> View {
    let by = response.drag_delta();
    let (right, up) = (by.x * RADIANS_PER_POINT, -by.y * RADIANS_PER_POINT);
    if response.drag_started()
        && let Some(at) = response.interact_pointer_pos()
    {
        tools.pivot = Some(pivot(session, view, place(response, at)));
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
pub fn place(response: &Response, at: egui::Pos2) -> Vec2 {
    let share = (at - response.rect.min) / response.rect.size();
    Vec2::new(2.0 * share.x - 1.0, 1.0 - 2.0 * share.y)
}

/// The object that is seen at a place of the picture, and where.
pub fn pick(session: &Session, view: &View, at: Vec2) -> Option<(ObjectId, DVec3)> {
    let geometry = session.renderer()?.illumination()?.geometry();
    let (origin, direction) = view.relative_to(geometry.origin).ray(at);
    let tracer = SceneTracer::new(&session.scene, geometry);
    let behind = tracer.closest_visible(origin, direction);
    let reach = behind.map_or(f32::INFINITY, |hit| hit.t);
    let through = tracer.transparent_hits(origin, direction, reach).into_iter();
    let hit = through.chain(behind).find(|hit| tracer.is_visible(hit.triangle, direction))?;
    let point = geometry.origin + (origin + direction * hit.t).as_dvec3();
    Some((object_of(geometry, hit.triangle)?, point))
}

fn object_of(geometry: &Geometry, triangle: u32) -> Option<ObjectId> {
    geometry.objects.iter().position(|o| o.triangles.contains(&triangle)).map(Into::into)
}

/// What is orbited: what is seen there, or else a point in the middle of the scene's size.
fn pivot(session: &Session, view: &View, at: Vec2) -> DVec3 {
    let ahead = || moved(view, Vec3::Z * session.scene.frame_of_reference().scale * 0.3).eye;
    pick(session, view, at).map_or_else(ahead, |(_, point)| point)
}

#[cfg(test)]
mod tests;
