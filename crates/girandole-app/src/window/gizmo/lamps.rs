//! Marks where punctual lights are, which have no surface to be seen, or to be clicked.

use super::handles::screen;
use crate::window::selection::Selected;
use crate::window::session::Session;
use egui::{Color32, Painter, Pos2, Rect, Shape, Stroke};
use girandole_core::glam::{DVec3, Vec3};
use girandole_core::scene::{LightId, PunctualKind, PunctualLight, View};

/// Radius of a mark, points; of those of many lamps.
const RADIUS: f32 = 6.0;
const SMALL: f32 = 2.5;
/// More of them have small marks.
const MANY: usize = 40;
/// Length of what shows where a spot or parallel light shines, in halves of the picture's height.
const LENGTH: f64 = 0.12;
const RAYS: u32 = 8;

/// A lamp on the screen.
pub struct Mark {
    pub lamp: LightId,
    at: Pos2,
    radius: f32,
    color: Color32,
    /// Ends of the lines that show where it shines.
    lines: Vec<Pos2>,
}

/// All that are before the eye and within the picture.
pub fn marks(session: &Session, view: &View, rect: Rect) -> Vec<Mark> {
    let scene = &session.scene;
    let radius = if scene.placed_lights().count() > MANY { SMALL } else { RADIUS };
    let mark = |(lamp, light): (LightId, &PunctualLight)| {
        let world = scene.world_from_node(light.node);
        let center = world.translation;
        let at = screen(view, rect, center).filter(|at| rect.expand(radius).contains(*at))?;
        let forward = world.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Y);
        let distance = (center - view.eye).dot(view.forward.as_dvec3()).max(1e-6);
        let half_height = f64::from(view.half_extent.y) * if view.orthographic { 1.0 } else { distance };
        let length = half_height * LENGTH;
        let ends: Vec<DVec3> = match light.kind {
            PunctualKind::Point => Vec::new(),
            PunctualKind::Directional => vec![center + forward * (2.0 * length)],
            PunctualKind::Spot { outer, .. } => {
                let (sin, cos) = f64::from(outer).sin_cos();
                let aside = forward.any_orthonormal_vector();
                let other = forward.cross(aside);
                let edge = |d: DVec3| center + (forward * cos + d * sin) * (1.5 * length);
                vec![edge(aside), edge(other), edge(-aside), edge(-other)]
            }
        };
        let lines = ends.into_iter().filter_map(|end| screen(view, rect, end)).collect();
        Some(Mark { lamp, at, radius, color: color(light.intensity), lines })
    };
    scene.placed_lights().filter_map(mark).collect()
}

/// How a lamp's mark looks: by its colour, grey where it is off.
fn color(light: Vec3) -> Color32 {
    let strongest = light.max_element();
    if strongest <= 0.0 {
        return Color32::from_gray(110);
    }
    let [r, g, b] = (light / strongest).map(|x| 90.0 + 165.0 * x.sqrt()).to_array();
    Color32::from_rgb(r as u8, g as u8, b as u8)
}

impl Mark {
    pub fn is_at(&self, pointer: Pos2) -> bool {
        self.at.distance(pointer) < self.radius + 4.0
    }

    pub fn paint(&self, painter: &Painter, is_selected: bool, is_hovered: bool) {
        let Self { at, radius, ref lines, .. } = *self;
        let color = if is_hovered { Color32::YELLOW } else { self.color };
        let color = if is_selected || is_hovered { color } else { color.gamma_multiply(0.75) };
        let shadow = Stroke::new(3.0, Color32::from_black_alpha(130));
        for stroke in [shadow, Stroke::new(1.3, color)] {
            for i in 0..if radius > SMALL { RAYS } else { 0 } {
                let along = egui::Vec2::angled(std::f32::consts::TAU * i as f32 / RAYS as f32);
                painter.line_segment([at + along * (radius + 1.5), at + along * (radius + 5.0)], stroke);
            }
            if is_selected || is_hovered {
                for end in lines {
                    painter.line_segment([at, *end], stroke);
                }
                if lines.len() > 2 {
                    painter.add(Shape::closed_line(lines.clone(), stroke));
                }
            }
        }
        let rim = Stroke::new(if is_selected { 2.0 } else { 1.0 }, Color32::BLACK);
        painter.circle(at, radius * 0.75, color, rim);
    }
}

/// The lamp whose mark is under the pointer.
pub fn at(marks: &[Mark], pointer: Pos2) -> Option<Selected> {
    let near = marks.iter().filter(|mark| mark.is_at(pointer));
    let nearest = near.min_by(|a, b| a.at.distance(pointer).total_cmp(&b.at.distance(pointer)));
    nearest.map(|mark| Selected::Light(mark.lamp))
}
