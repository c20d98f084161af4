//! Built-in rooms: a living room, to be looked at, those of the thesis's experiments (Barczak 2006, chapters
//! 5 and 6), modelled from its text, two with mirrors, and four with what is hard to light in rooms that people have.
//!
//! All surfaces of the thesis's are exactly Lambertian. A room's shell is made of single quads that face inwards,
//! furniture of boxes (all of them patches); what stands on something has no hidden bottom face. Lengths in
//! metres, +Y up.

mod interiors;
mod living_room;
mod mirrors;
mod rooms;
pub mod shapes;
mod teapot;

pub use teapot::teapot;

use crate::scene::{Mesh, Scene};
use crate::{Error, Result};

/// The rooms that [`build`] knows; the first is the one that the program opens by default.
pub const NAMES: [&str; 12] = [
    "living-room",
    "area-lights",
    "table",
    "pillars",
    "block",
    "gap",
    "mirrors",
    "mirror-corridor",
    "blinds",
    "moulding",
    "shelf",
    "hall",
];

/// Those of the thesis.
pub const EXPERIMENTS: [&str; 5] = ["area-lights", "table", "pillars", "block", "gap"];

/// What may move about in a built-in room; its object is marked [`dynamic`](crate::scene::Object::dynamic).
#[derive(Clone, Debug, Default)]
pub enum MovingObject {
    /// Nothing.
    #[default]
    None,
    /// The thesis's torus of 820 vertices.
    Torus,
    /// Newell's teapot.
    Teapot,
    /// A red toy balloon on a string.
    Balloon,
    /// Any mesh with +Y up (see [`load_model`](crate::scene::load_model)); it is scaled to fit and takes on the
    /// material of the room's object.
    Model(Box<Mesh>),
}

/// The object that a room is best shown with, when the user asks for none in particular.
pub fn default_object(name: &str) -> MovingObject {
    match name {
        "living-room" => MovingObject::Balloon,
        "table" | "pillars" => MovingObject::Torus,
        "block" | "gap" => MovingObject::Teapot,
        _ => MovingObject::None,
    }
}

/// Builds a room. Its first camera has the room's name; others show it from elsewhere.
///
/// # Errors
/// [`Error::Unknown`] for a name that is not in [`NAMES`]; [`Error::Invalid`] for a model without extent.
pub fn build(name: &str, object: MovingObject) -> Result<Scene> {
    match name {
        "living-room" => living_room::build(object),
        "area-lights" => rooms::area_lights(object),
        "table" => rooms::table(object),
        "pillars" => rooms::pillars(object),
        "block" => rooms::block(object),
        "gap" => rooms::gap(object),
        "mirrors" => mirrors::room(object),
        "mirror-corridor" => mirrors::corridor(object),
        "blinds" => interiors::blinds(object),
        "moulding" => interiors::moulding(object),
        "shelf" => interiors::shelf(object),
        "hall" => interiors::hall(object),
        _ => Err(Error::Unknown { kind: "built-in scene", name: name.into(), known: NAMES.join(", ") }),
    }
}

#[cfg(test)]
mod tests;
