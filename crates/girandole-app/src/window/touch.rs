//! Fingers: one looks around, as the mouse does; two pan and pinch; a stick leads on.

use super::camera::moved;
use egui::{Area, Color32, Id, Pos2, Rect, Sense, Ui, Vec2};
use girandole_core::glam::{DVec3, Vec3};
use girandole_core::scene::View;

/// Radius of the stick, points, and how far it is from the picture's corner.
const RADIUS: f32 = 48.0;
const MARGIN: f32 = 16.0;
const COLOR: Color32 = Color32::from_rgba_premultiplied(70, 70, 70, 70);

/// Where two fingers lead: the plane of the pivot, or what is as far away as that, follows them. `None` where there are not two.
pub fn pinched(ui: &Ui, picture: Rect, view: &View, pivot: Option<DVec3>) -> Option<View> {
    let touch = ui.input(|input| input.multi_touch())?;
    let distance = pivot.map_or(1.0, |pivot| (pivot - view.eye).as_vec3().dot(view.forward).max(0.0));
    let height = if view.orthographic { view.half_extent.y } else { distance * view.half_extent.y };
    let pan = touch.translation_delta * (2.0 * height / picture.height());
    let ahead = distance * (1.0 - 1.0 / touch.zoom_delta.max(0.1));
    Some(moved(view, Vec3::new(-pan.x, pan.y, ahead)))
}

/// The stick in the picture's corner, where there is a touch screen: which way it leads, to the right, up and ahead, 1 at most.
pub fn stick(ui: &Ui, picture: Rect) -> Vec3 {
    if !ui.input(egui::InputState::has_touch_screen) || picture.height() < 4.0 * RADIUS {
        return Vec3::ZERO;
    }
    let center = picture.left_bottom() + Vec2::new(MARGIN + RADIUS, -MARGIN - RADIUS);
    let rect = Rect::from_center_size(center, Vec2::splat(2.0 * RADIUS));
    let area = Area::new(Id::unique("stick")).fixed_pos(rect.min).movable(false).constrain(false);
    let shown = area.show(ui.ctx(), |ui| {
        let (_, response) = ui.allocate_exact_size(rect.size(), Sense::drag());
        let at = response.interact_pointer_pos().filter(|_| response.is_pointer_button_down_on());
        let by = at.map_or(Vec2::ZERO, |at| offset(at, center));
        ui.painter().circle_stroke(center, RADIUS - 1.0, (2.0, COLOR));
        ui.painter().circle_filled(center + by * (RADIUS * 0.6), RADIUS * 0.4, COLOR);
        by
    });
    Vec3::new(shown.inner.x, 0.0, -shown.inner.y)
}

/// How far the stick is from its middle, 1 at most.
fn offset(at: Pos2, center: Pos2) -> Vec2 {
    let by = (at - center) / RADIUS;
    by / by.length().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Event, RawInput, TouchDeviceId, TouchId, TouchPhase};

    #[test]
    fn the_stick_leads_no_further_than_its_rim() {
        let center = egui::pos2(100.0, 100.0);
        assert_eq!(offset(egui::pos2(124.0, 100.0), center), Vec2::new(0.5, 0.0));
        assert_eq!(offset(egui::pos2(100.0, 500.0), center), Vec2::new(0.0, 1.0));
    }

    #[test]
    fn two_fingers_that_part_lead_ahead_and_two_that_move_shift_the_view() {
        let none = girandole_core::scene::builtin::MovingObject::None;
        let scene = girandole_core::scene::builtin::build("table", none).expect("a room");
        let view = View::new(&scene, &scene.cameras[0], 1.0);
        let pivot = moved(&view, Vec3::Z * 2.0).eye;
        let picture = Rect::from_min_size(Pos2::ZERO, Vec2::splat(400.0));
        let finger = |id: u64, phase, x: f32, y: f32| Event::Touch {
            device_id: TouchDeviceId(0),
            id: TouchId(id),
            phase,
            pos: egui::pos2(x, y),
            force: None,
        };
        let context = egui::Context::default();
        let led = |time: f64, events: Vec<Event>| {
            let input =
                RawInput { time: Some(time), screen_rect: Some(picture), events, ..RawInput::default() };
            let mut led = None;
            context
                .run_ui(input, |ui| led = pinched(ui, picture, &view, Some(pivot)))
                .drop_without_applying_deltas();
            led.map(|led| {
                let by = (led.eye - view.eye).as_vec3();
                Vec3::new(by.dot(view.right), by.dot(view.up), by.dot(view.forward))
            })
        };
        // The first finger is the pointer, too.
        let first =
            vec![Event::PointerMoved(egui::pos2(150.0, 200.0)), finger(1, TouchPhase::Start, 150.0, 200.0)];
        assert_eq!(led(0.0, first), None, "one finger");
        let still = led(0.1, vec![finger(2, TouchPhase::Start, 250.0, 200.0)]).expect("two fingers");
        assert!(still.length() < 1e-6, "{still}");
        let apart =
            vec![finger(1, TouchPhase::Move, 100.0, 200.0), finger(2, TouchPhase::Move, 300.0, 200.0)];
        let ahead = led(0.2, apart).expect("two fingers");
        assert!((ahead - Vec3::Z).length() < 1e-4, "twice as large is half as far: {ahead}");
        let shifted =
            vec![finger(1, TouchPhase::Move, 140.0, 200.0), finger(2, TouchPhase::Move, 340.0, 200.0)];
        let shift = led(0.3, shifted).expect("two fingers");
        let metres = 40.0 * 2.0 * 2.0 * view.half_extent.y / 400.0;
        assert!((shift - Vec3::new(-metres, 0.0, 0.0)).length() < 1e-4, "{shift}");
    }
}
