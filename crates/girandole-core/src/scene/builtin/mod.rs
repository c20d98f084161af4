//! The built-in rooms.
