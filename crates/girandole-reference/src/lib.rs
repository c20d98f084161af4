//! Ground truth on the CPU, to check the renderer against: a plain path tracer, the exact many-light sum with traced
//! visibility for a given light set, and the comparison of pictures.
//!
//! It shares the scene, the tracer and the reflection model with the renderer, never its light sampling, so that an
//! error in one cannot hide in the other.

mod coverage;
pub mod image_file;
pub mod metrics;
mod oracle;
mod path;
mod provenance;
mod sum;
mod tiles;

pub use coverage::coverage;
pub use oracle::{
    OracleSettings, Reflected, oracle, oracle_pixel, oracle_with_states, oracle_with_transfer, radiance,
    visible,
};
pub use path::{
    Estimate, Irradiance, Opening, PathSettings, ProgressivePathTracer, irradiance, path_trace,
    path_trace_through,
};
pub use provenance::{Difference, Provenance};
pub use sum::PictureSum;
