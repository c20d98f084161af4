//! Girandole's renderer as a component for web pages. [`Lit`] is what it does with a device; `browser.rs` is the class that JavaScript
//! sees, there in browsers alone.

mod lit;
mod settings;

#[cfg(target_arch = "wasm32")]
mod browser;
#[cfg(test)]
mod tests;

pub use lit::{Lit, Stats};
pub use settings::{Camera, Settings};
