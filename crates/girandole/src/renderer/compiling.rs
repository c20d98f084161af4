//! Compilation ahead of frames.

use super::{Renderer, nothing_loaded};
use crate::Result;
use crate::checks::check;
use crate::device::compiled::{Compilation, CompiledKernel};
use crate::device::context::Context;
use crate::device::loop_steps;
use crate::device::recorder::Recorder;
use crate::frame::record_frame;
use crate::prepare::{ScenePasses, allocate, prepare};
use crate::resident::SceneFeatures;
use crate::settings::RenderSettings;
use crate::viewport::Viewport;
use girandole_core::scene::{Geometry, Scene, View};

impl Renderer {
    /// Begins to compile what frames of this scene with these settings will need, on threads of its own, and returns at once: the
    /// sooner the better, before light is sampled. What is missing when a frame is recorded is compiled then, or waited for. Without the
    /// feature `parallel`, as in browsers, it does nothing.
    pub fn compile_for(&self, scene: &Scene, geometry: &Geometry, settings: &RenderSettings) {
        if !cfg!(feature = "parallel") {
            return;
        }
        let context = &self.context;
        self.passes.order(&context.shared);
        // Kernels are kept by what they are made of, not by who ordered them.
        ScenePasses::new(SceneFeatures::expected(scene, geometry)).order(context, settings);
    }

    /// Whether a frame with these settings of the scene that is loaded finds its kernels compiled, but for small ones; begins to compile
    /// them as [`Renderer::compile_for`] does where it would not: for windows, which show something else meanwhile. It is `true` where
    /// frames compile what they need by themselves.
    pub fn is_compiled_for(&self, settings: &RenderSettings) -> bool {
        let Some(scene_passes) = &self.scene_passes else { return true };
        let are_there = self.passes.order(&self.context.shared);
        scene_passes.order(&self.context, settings) & are_there
    }

    /// Has the device compile what a frame like this will use, and submits that; it draws nothing. Kernels that
    /// [`Renderer::compile_for`] began are waited for. Some drivers, Mesa's software one among them, do half of their compilation
    /// when a kernel is first used: whoever wants to know how long that takes, or to have it behind him, rehearses and waits for the
    /// device.
    ///
    /// # Errors
    /// As for [`Renderer::render`].
    pub fn rehearse(&mut self, view: &View, size: [u32; 2], settings: &RenderSettings) -> Result<()> {
        self.change();
        let context = &self.context;
        let (Some(scene), Some(scene_passes)) = (&mut self.scene, &self.scene_passes) else {
            return Err(nothing_loaded());
        };
        check(size, settings, scene.lights.count(), &context.device.limits())?;
        loop_steps::check(context.shared.kernels.tier, context.options.pcf, scene.lights.count())?;
        let view = &view.relative_to(scene.origin);
        context.timers.reset();
        let mut viewport = Viewport::default();
        allocate(context, scene, &mut viewport, view, size, settings)?;
        let passes = (&self.passes, scene_passes);
        scene.map_updates.clear();
        let prepared = prepare(context, passes, scene, &viewport, settings)?;
        let Context { device, queue, shared, timers, .. } = context;
        let mut recorder = Recorder::submitting(device, queue, &shared.frame, timers);
        recorder.is_rehearsal = true;
        record_frame(&mut recorder, &prepared, view, settings, None)?;
        recorder.finish();
        context.timers.reset();
        Ok(())
    }

    /// How far the kernels are that frames need, as far as that is known: after [`Renderer::compile_for`], or once a frame was recorded.
    pub fn compilation(&self) -> Compilation {
        self.context.shared.compiled.compilation()
    }

    /// The kernels that were compiled so far, in the order in which they were done.
    pub fn kernels(&self) -> Vec<CompiledKernel> {
        self.context.shared.compiled.kernels()
    }
}
