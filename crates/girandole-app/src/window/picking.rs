//! What is seen at a place of the picture.

use super::selection::Selected;
use super::session::Session;
use girandole_core::Generation;
use girandole_core::glam::{DVec3, Vec2};
use girandole_core::scene::View;
use girandole_core::trace::HeldHierarchies;

/// Without a first click, nothing is traced in scenes of more triangles: their hierarchy takes a moment.
const EAGER: usize = 300_000;

/// Finds out what is seen, by a hierarchy that is kept.
#[derive(Default)]
pub struct Picker {
    hierarchies: HeldHierarchies,
    has_hierarchy: bool,
    /// What was seen last at the pointer.
    hovered: Option<(Place, Option<Selected>)>,
}

#[derive(Clone, Copy, PartialEq)]
struct Place {
    view: View,
    at: Vec2,
    scene: Generation,
}

impl Picker {
    /// The object that is seen at a place of the picture (NDC, +Y up), and where. What is seen through is not there:
    /// backs of one-sided surfaces, and what a mask cuts out.
    pub fn pick(&mut self, session: &Session, view: &View, at: Vec2) -> Option<(Selected, DVec3)> {
        let mut found = None;
        session.trace(&mut self.hierarchies, |tracer| {
            self.has_hierarchy = true;
            let geometry = tracer.geometry();
            let (origin, direction) = view.relative_to(geometry.origin).ray(at);
            let behind = tracer.closest_visible_within(origin, direction, view.clip.reach());
            let reach = behind.map_or(view.clip.reach(), |hit| hit.t);
            let through = tracer.transparent_hits(origin, direction, reach).into_iter();
            let hit = through.chain(behind).find(|hit| tracer.is_visible(hit.triangle, direction));
            found = hit.map(|hit| {
                let object = geometry.triangles[hit.triangle as usize].object as usize;
                let point = geometry.origin + (origin + direction * hit.t).as_dvec3();
                (Selected::Object(object.into()), point)
            });
        });
        found
    }

    /// What is at the pointer, looked up where something may have changed; `None` where that would take long.
    pub fn hover(&mut self, session: &Session, view: &View, at: Vec2) -> Option<Selected> {
        let light = session.illumination()?;
        if !self.has_hierarchy && light.geometry().triangles.len() > EAGER {
            return None;
        }
        let place = Place { view: *view, at, scene: light.generation() };
        match self.hovered {
            Some((known, seen)) if known == place => seen,
            _ => {
                let seen = self.pick(session, view, at).map(|(selected, _)| selected);
                self.hovered = Some((place, seen));
                seen
            }
        }
    }

    /// Traces in the scene that is open, by the same hierarchy.
    pub fn hierarchies(&mut self) -> &mut HeldHierarchies {
        self.has_hierarchy = true;
        &mut self.hierarchies
    }
}
