//! Rays that the caller asks about.

use super::{Renderer, nothing_loaded};
use crate::Result;
use crate::device::context::Context;
use crate::device::recorder::Recorder;
use crate::layout::CallersRay;
use crate::passes::Compiler;
use crate::passes::trace_rays::TraceRays;
use girandole_core::scene::{Geometry, Scene};
use girandole_core::trace::{Hit, Ray};
use std::future::Future;

impl Renderer {
    /// Traces rays through the scene that is loaded, on the device: what [`SceneTracer::closest_hit`](girandole_core::trace::SceneTracer::closest_hit)
    /// says of each, in single precision. They should start within the scene's bounds, and have directions of about unit length. Hierarchies are
    /// built when they are first needed, and follow what moves. The future is like that of [`Renderer::stats`].
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) before [`Renderer::load`] and for another scene or version;
    /// [`Error::TooLarge`](crate::Error::TooLarge) beyond the device's limits; [`Error::Device`](crate::Error::Device) where the device was lost.
    pub fn closest_hits(
        &mut self,
        scene: &Scene,
        geometry: &Geometry,
        rays: &[Ray],
    ) -> Result<impl Future<Output = Result<Vec<Option<Hit>>>> + use<>> {
        self.trace(scene, geometry, rays, false)
    }

    /// Whether each ray meets anything, as [`Renderer::closest_hits`]: some hit, not the first one.
    ///
    /// # Errors
    /// As [`Renderer::closest_hits`].
    pub fn any_hits(
        &mut self,
        scene: &Scene,
        geometry: &Geometry,
        rays: &[Ray],
    ) -> Result<impl Future<Output = Result<Vec<Option<Hit>>>> + use<>> {
        self.trace(scene, geometry, rays, true)
    }

    fn trace(
        &mut self,
        scene: &Scene,
        geometry: &Geometry,
        rays: &[Ray],
        is_any: bool,
    ) -> Result<impl Future<Output = Result<Vec<Option<Hit>>>> + use<>> {
        geometry.belongs_to(scene)?;
        let Context { device, queue, shared, timers, .. } = &self.context;
        let resident = self.scene.as_mut().ok_or_else(nothing_loaded)?;
        resident.trace_with(&self.context, scene, geometry)?;
        let Some(hierarchies) = &resident.rays else { return Err(nothing_loaded()) };
        let rays: Vec<CallersRay> = rays.iter().map(CallersRay::from).collect();
        let pass =
            self.trace_rays.get_or_init(|| TraceRays::new(&Compiler::new(&self.context, resident.features)));
        timers.reset();
        let mut recorder = Recorder::submitting(device, queue, &shared.frame, timers);
        let traced = pass.record(&mut recorder, &resident.geometry, hierarchies, &rays, is_any)?;
        recorder.finish();
        Ok(traced.hits())
    }
}
