//! The device: adapters, pipelines with their bindings, recording, timers, read-backs.

pub(crate) mod buffers;
pub(crate) mod compiled;
pub(crate) mod context;
/// In browsers there are none: what belongs to a device cannot be shared between threads there.
#[cfg(feature = "parallel")]
mod crew;
mod gpu;
pub(crate) mod kernel;
pub(crate) mod loop_steps;
pub(crate) mod mirror;
mod module;
pub(crate) mod readback;
pub(crate) mod recorder;
mod reflection;
pub(crate) mod timers;

pub use gpu::{AdapterReport, Gpu, WANTED_FEATURES, adapters, instance, wanted_limits};
