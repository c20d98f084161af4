//! The reference checked against closed forms, against itself, and against pictures by an independent renderer.

mod clipping;
mod closed_form;
mod coincident;
mod common;
mod environment;
mod environment_files;
mod files;
mod lampshade;
mod light_motion;
mod many_lamps;
mod many_lights;
mod metals;
mod metrics;
mod offsets;
mod random_rooms;
mod reflected_environment;
mod reflection;
mod sphere_rows;
mod spheres;
mod transfer;
mod transparency;
mod truth;
mod visibility;
mod window;
