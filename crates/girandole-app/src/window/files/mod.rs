//! Files that the window opens and writes: chosen by dialogs, remembered, opened and written beside.

mod chooser;
mod desk;
mod dialog;
mod purpose;
mod recent;

pub use desk::Files;
pub use purpose::{Ask, Purpose};
