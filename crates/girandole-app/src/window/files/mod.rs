//! Files that the window opens and writes: chosen by dialogs, remembered, opened and written beside.

mod purpose;

// Browsers have neither dialogs for files nor folders.
#[cfg(not(target_arch = "wasm32"))]
mod chooser;
#[cfg(not(target_arch = "wasm32"))]
mod desk;
#[cfg(not(target_arch = "wasm32"))]
mod dialog;
#[cfg(not(target_arch = "wasm32"))]
mod recent;

#[cfg(not(target_arch = "wasm32"))]
pub use desk::Files;
pub use purpose::{Ask, Purpose};
