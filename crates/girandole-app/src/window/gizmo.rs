//! Handles at what is picked: arrows to move it along the world's axes, a disc to move it in the picture's plane,
//! rings to turn it, boxes to scale it. Lamps have marks, which can be picked.

use super::controls::place;
use super::selection::Selected;
use super::session::Session;
use super::tools::Tools;
use egui::{Painter, PointerButton, Rect, Response};
use girandole::DebugView;
use girandole_core::glam::DAffine3;
use girandole_core::scene::{Edit, NamedIndex, PunctualKind, Transform, View};

mod handles;
mod lamps;

use handles::{Grip, Handles, Ray};

/// A drag at a handle of something.
#[derive(Clone, Copy, Debug)]
pub struct Drag {
    target: Selected,
    grip: Grip,
}

/// What is under the pointer besides the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Under {
    Nothing,
    Handle,
    Lamp(Selected),
}

/// Shows the handles of what is picked and the marks of lamps, and lets handles be dragged. Returns what the pointer
/// is on.
pub fn act(painter: &Painter, response: &Response, session: &mut Session, tools: &mut Tools) -> Under {
    // The atlas shows no scene.
    if session.settings.debug == Some(DebugView::Atlas) {
        tools.drag = None;
        return Under::Nothing;
    }
    let view = session.view(tools.picture_size);
    let painter = painter.with_clip_rect(response.rect);
    let pointer = response.ctx.input(|input| input.pointer.interact_pos());
    let is_over = response.hovered() || response.is_pointer_button_down_on();
    let marks = lamps::marks(session, &view, response.rect);
    let lamp = pointer.filter(|_| is_over && tools.drag.is_none()).and_then(|at| lamps::at(&marks, at));
    for mark in &marks {
        let this = Some(Selected::Light(mark.lamp));
        mark.paint(&painter, tools.selected == this, lamp == this);
    }
    let is_handle = handle(&painter, response, &view, (session, tools));
    match lamp {
        _ if is_handle => Under::Handle,
        Some(lamp) => Under::Lamp(lamp),
        None => Under::Nothing,
    }
}

/// Shows the handles, and lets them be dragged. Returns whether the pointer is on one.
fn handle(
    painter: &Painter,
    response: &Response,
    view: &View,
    (session, tools): (&mut Session, &mut Tools),
) -> bool {
    let movable = tools.selected.filter(|_| !tools.is_locked);
    let place_of = |selected: Selected| Some((selected, selected.node(session)?, selected.center(session)?));
    let Some((selected, node, center)) = movable.and_then(place_of) else {
        tools.drag = None;
        return false;
    };
    let world = session.scene.world_from_node(node);
    let handles = Handles::new((view, response.rect), center, &world, kinds(selected, session));
    let pointer = response.ctx.input(|input| input.pointer.interact_pos());
    let pressed = response.ctx.input(|input| input.pointer.press_origin());
    let under = |at: Option<egui::Pos2>| at.and_then(|at| handles.at(at));
    if response.drag_started_by(PointerButton::Primary)
        && let Some((handle, at)) = under(pressed).zip(pressed)
    {
        let from = Ray::new(view, place(response.rect, at));
        tools.drag = Some(Drag { target: selected, grip: Grip { handle, center, from, world } });
        session.end_step();
    }
    // A slow frame may hold the end of a drag together with its last steps.
    let primary = PointerButton::Primary;
    if !response.dragged_by(primary) && !response.drag_stopped_by(primary) {
        tools.drag = None;
    }
    let is_over = response.hovered() || tools.drag.is_some();
    let highlighted = tools.drag.map(|drag| drag.grip.handle).or_else(|| under(pointer.filter(|_| is_over)));
    handles.paint(painter, highlighted);
    if let (Some(Drag { target, grip }), Some(at)) = (tools.drag, pointer) {
        let to = Ray::new(view, place(response.rect, at));
        let grid = snaps(response, tools).then(|| grid(session, tools));
        grip.moved(view, to, grid).into_iter().for_each(|world| put(session, target, world));
    }
    highlighted.is_some()
}

/// Whether something can be turned, and scaled.
fn kinds(selected: Selected, session: &Session) -> (bool, bool) {
    match selected.light(session) {
        Some(light) => (light.kind != PunctualKind::Point, false),
        None => (true, true),
    }
}

/// Whether drags go by steps at the moment.
fn snaps(response: &Response, tools: &Tools) -> bool {
    tools.snaps != response.ctx.input(|input| input.modifiers.command)
}

/// The step of a snapped move, metres: what was asked for, or about a fiftieth of the scene's size.
pub fn grid(session: &Session, tools: &Tools) -> f64 {
    let suitable =
        || 10f64.powf((f64::from(session.scene.frame_of_reference().scale) * 0.02).log10().round());
    tools.grid.filter(|step| *step > 0.0).unwrap_or_else(suitable)
}

/// The name of what is under the pointer, beside it.
pub fn name(painter: &Painter, rect: Rect, at: egui::Pos2, text: &str) {
    use egui::{Align2, Color32, FontId, vec2};
    let font = FontId::proportional(13.0);
    let galley = painter.layout_no_wrap(text.into(), font, Color32::WHITE);
    let size = galley.size() + vec2(12.0, 6.0);
    // Beside the pointer, within the picture.
    let corner = at + vec2(14.0, 18.0);
    let corner = corner.min(rect.max - size).max(rect.min);
    let frame = Align2::LEFT_TOP.anchor_size(corner, size);
    painter.rect_filled(frame, 4.0, Color32::from_black_alpha(190));
    painter.galley(frame.min + vec2(6.0, 3.0), galley, Color32::WHITE);
}

/// Puts something's node elsewhere in the world.
fn put(session: &mut Session, target: Selected, world: DAffine3) {
    let Some(node) = target.node(session) else { return };
    let parent = session.scene.nodes[node].parent;
    let above = parent.map_or(DAffine3::IDENTITY, |parent| session.scene.world_from_node(parent));
    let local = Transform::Affine(above.inverse() * world);
    if session.scene.nodes[node].local != local {
        let node = NamedIndex::node(&session.scene, node);
        session.edit(Edit::SetTransform { node, transform: local });
    }
}
