//! The part of Girandole that needs no GPU: scenes and their import, light samples, ray tracing, and the
//! mathematics that the renderer's shaders mirror.
//!
//! Units: metres, radians, W/(sr·m²) for radiance, W/sr for intensity, linear Rec. 709 RGB for colours.
//! World space is right-handed with +Y up; a camera looks along its −Z.

pub mod brdf;
pub mod elements;
pub mod error;
pub mod files;
mod generation;
pub mod illumination;
pub mod image;
pub mod lights;
pub mod math;
mod parallel;
pub mod scene;
pub mod slices;
pub mod tonemap;
pub mod trace;
pub mod transfer;
pub mod visibility;

pub use error::{Error, Result};
pub use generation::Generation;
pub use glam;
