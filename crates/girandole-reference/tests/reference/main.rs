//! The reference checked against closed forms, against itself, and against pictures by an independent renderer.

mod closed_form;
mod common;
mod environment;
mod files;
mod light_motion;
mod many_lights;
mod metals;
mod metrics;
mod reflected_environment;
mod reflection;
mod spheres;
mod transfer;
mod transparency;
mod truth;
mod visibility;
mod window;
