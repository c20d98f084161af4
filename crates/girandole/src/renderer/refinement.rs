//! Refinement: pictures of further light sets of a scene at rest, averaged until they are as good as a path tracer's.
//!
//! Each set is sampled anew, and rendered with settings that leave less of what an average keeps
//! ([`RenderSettings::of_set`], [`LightSet::sample_set`]), by rays that go through other points of their pixels: edges
//! are smooth in the end. Set 0 is the ordinary picture, bit for bit.

use super::{Renderer, nothing_loaded};
use crate::device::context::Context;
use crate::device::recorder::Recorder;
use crate::device::timers::Timers;
use crate::gpu_scene::light_source::LightSource;
use crate::points::average::Average;
use crate::resident::{Lighting, Resident};
use crate::settings::RenderSettings;
use crate::viewport::{NextSet, Picture, Refinement, Viewport, nothing_rendered};
use crate::{Error, Result};
use girandole_core::Generation;
use girandole_core::glam::DVec2;
use girandole_core::lights::LightSet;
use girandole_core::scene::{Scene, View};
use girandole_core::visibility::VisibilityBuild;
use std::future::Future;
use std::sync::Arc;

/// Distances of the rays of one set from those of the one before, pixels (the R2 sequence: Roberts 2018).
const JITTER: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// What of set 0 was on the device before a later set came there.
pub(super) enum SetAside {
    /// Its light; the scene and its shadow atlas stay where they are.
    Lighting(Box<Lighting>),
    /// All of it, where a later set differs in more: in its number of samples, or in what may block them.
    Resident(Box<Resident>),
}

impl Renderer {
    /// Does the next piece of work to refine the picture of a scene at rest: the picture itself ([`Renderer::render`]); then, call by
    /// call, the light samples of another light set, a slice of their visibility, and their picture, which is averaged with those
    /// before it. Returns whether the picture is another one now: [`Renderer::show`] and [`Renderer::radiance`] give the average. Work
    /// on the device is submitted, not waited for.
    ///
    /// Where scene, light, view, size or settings are others by now (but for exposure and tone curve), and while shadow maps are
    /// stale, it begins anew; so it does after each [`Renderer::render`]. As often as it is called, so far the error falls:
    ///
    /// ```no_run
    /// # use girandole::scene::{Scene, View};
    /// # use girandole::{Renderer, RenderSettings, Result, Viewport};
    /// # fn refined(renderer: &mut Renderer, viewport: &mut Viewport, scene: &Scene, view: &View) -> Result<()> {
    /// while renderer.refined_sets(viewport) < 16 {
    ///     renderer.refine(viewport, scene, view, [1024, 768], &RenderSettings::default())?;
    /// }
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::Scene`] before [`Renderer::open`], where the scene changed since without an [update](Renderer::update), and for
    /// [debug views](RenderSettings::debug); otherwise as for [`Renderer::render`] and [`Renderer::open`].
    pub fn refine(
        &mut self,
        viewport: &mut Viewport,
        scene: &Scene,
        view: &View,
        size: [u32; 2],
        settings: &RenderSettings,
    ) -> Result<bool> {
        let illumination = self.illumination.as_ref().ok_or_else(not_open)?;
        illumination.geometry().belongs_to(scene)?;
        if settings.debug.is_some() {
            return Err(Error::invalid("a debug view cannot be refined; show the picture"));
        }
        if settings.region.is_some() {
            return Err(Error::invalid("a part of a picture is not refined; render its sets one by one"));
        }
        let picture = Picture { view: *view, size, settings: settings.of_radiance() };
        let is_stale = viewport.last.as_ref().is_none_or(|last| last.is_stale);
        if viewport.refinement.picture_of(self.version) != Some(&picture) || is_stale {
            self.render(viewport, view, size, settings)?;
            return Ok(true);
        }
        let (geometry, light) = (illumination.geometry(), illumination.settings());
        let mut next = match viewport.refinement.next.take() {
            Some(next) => next,
            None => {
                let set = viewport.refinement.sets(self.version);
                let lights = LightSet::sample_set(scene, geometry, &light.lights, &light.views, set)?;
                let determined = light.visibility.as_ref();
                let begin = |wanted| VisibilityBuild::new((scene, geometry), &lights, wanted, &[*view]);
                let build = determined.map(begin);
                viewport.refinement.next =
                    Some(NextSet { lights, build: build.transpose()?, visibility: None });
                return Ok(false);
            }
        };
        let Some(mut build) = next.build.take() else {
            self.average_in(viewport, scene, &next, &picture)?;
            return Ok(true);
        };
        if build.is_done() {
            next.visibility = Some(Arc::new(build.end(scene, geometry)?));
        } else {
            build.step();
            next.build = Some(build);
        }
        viewport.refinement.next = Some(next);
        Ok(false)
    }

    /// Renders the picture of one light set alone, of those that [`Renderer::refine`] averages: set 0 is that of [`Renderer::render`].
    /// Whoever adds them up can share the work with others. It depends on no other set.
    ///
    /// # Errors
    /// As for [`Renderer::refine`], which begins anew afterwards.
    pub fn render_set(
        &mut self,
        viewport: &mut Viewport,
        scene: &Scene,
        view: &View,
        size: [u32; 2],
        settings: &RenderSettings,
        set: u32,
    ) -> Result<()> {
        let illumination = self.illumination.as_ref().ok_or_else(not_open)?;
        let (geometry, light) = (illumination.geometry(), illumination.settings());
        geometry.belongs_to(scene)?;
        if set == 0 {
            return self.render(viewport, view, size, settings);
        }
        let lights = LightSet::sample_set(scene, geometry, &light.lights, &light.views, set)?;
        let determined = light.visibility.as_ref();
        let build = determined.map(|wanted| {
            VisibilityBuild::new((scene, geometry), &lights, wanted, &[*view])?.end(scene, geometry)
        });
        let next = NextSet { build: None, visibility: build.transpose()?.map(Arc::new), lights };
        viewport.refinement = Refinement::default();
        self.light_with(scene, &next)?;
        let picture = Picture { view: *view, size, settings: *settings };
        self.frame_of_set(viewport, &picture, set)
    }

    fn frame_of_set(&mut self, viewport: &mut Viewport, picture: &Picture, set: u32) -> Result<()> {
        let Picture { size, settings, .. } = picture;
        viewport.light_set = set;
        let done = self.frame(viewport, None, &jittered(picture, set), *size, &settings.of_set(set), None);
        viewport.light_set = 0;
        done
    }

    /// How many light sets are averaged in a viewport's last picture: 1 unless it was [refined](Renderer::refine), 0 without a picture of
    /// [`Renderer::render`].
    pub fn refined_sets(&self, viewport: &Viewport) -> u32 {
        viewport.refinement.sets(self.version)
    }

    /// The error of the refined picture, estimated by how much its sets differ: the mean over pixels and channels of σ² / (L² +
    /// 0.01), where L is the average radiance and σ² the variance of that average. That is the relMSE to be expected against
    /// the average of ever more sets; what these have in common is not part of it. `None` where less than two sets are
    /// averaged. The future completes while the device is polled; it owns what it needs.
    ///
    /// # Errors
    /// [`Error::Device`] where the device was lost.
    pub fn refined_error(&self, viewport: &Viewport) -> impl Future<Output = Result<Option<f64>>> + use<> {
        let Context { device, queue, shared, .. } = &self.context;
        let average = viewport.refinement.average.as_ref();
        let average = average.filter(|average| average.sets > 1 && self.refined_sets(viewport) > 1);
        let parts = average.zip(viewport.targets.as_ref());
        let estimate = parts.map(|(average, targets)| {
            let pass = self.passes.averaging(&self.context);
            let timers = Timers::none();
            let mut recorder = Recorder::submitting(device, queue, &shared.frame, &timers);
            let estimate = pass.estimate(&mut recorder, targets, average);
            recorder.finish();
            estimate
        });
        async move {
            match estimate {
                Some(estimate) => estimate.mean().await.map(Some),
                None => Ok(None),
            }
        }
    }

    /// A viewport's picture is drawn from the start: by set 0, and if it is given, to be refined.
    pub(super) fn restart(&mut self, viewport: &mut Viewport, picture: Option<Picture>) {
        self.bring_set_0_back();
        let average = viewport.refinement.average.take().map(|average| Average { sets: 0, ..average });
        let picture = picture.map(|picture| (picture, self.version));
        viewport.refinement = Refinement { picture, average, next: None };
    }

    /// Scene or light become others: no viewport's picture shows them.
    pub(super) fn change(&mut self) {
        self.bring_set_0_back();
        self.version = Generation::fresh();
        self.last_frame = None;
    }

    fn bring_set_0_back(&mut self) {
        match (self.set_aside.take(), &mut self.scene) {
            (Some(SetAside::Lighting(lighting)), Some(scene)) => drop(scene.swap_lighting(*lighting)),
            (Some(SetAside::Resident(resident)), scene) => *scene = Some(*resident),
            _ => {}
        }
    }

    /// Renders the next set of a picture and averages it in.
    fn average_in(
        &mut self,
        viewport: &mut Viewport,
        scene: &Scene,
        next: &NextSet,
        picture: &Picture,
    ) -> Result<()> {
        let set = viewport.refinement.sets(self.version);
        if set == 1 {
            self.add_picture(viewport)?;
        }
        let rendered = self
            .light_with(scene, next)
            .and_then(|()| self.frame_of_set(viewport, picture, set))
            .and_then(|()| self.add_picture(viewport));
        if rendered.is_err() {
            // The picture may be that of one set alone by now.
            self.restart(viewport, None);
        }
        rendered
    }

    /// Puts the light of a later set on the device.
    fn light_with(&mut self, scene: &Scene, next: &NextSet) -> Result<()> {
        let NextSet { lights, visibility, .. } = next;
        let geometry = self.illumination.as_ref().ok_or_else(not_open)?.geometry();
        let source = LightSource {
            scene,
            geometry,
            lights,
            visibility: visibility.as_ref(),
            transfers: &self.transfers,
        };
        let resident = self.scene.as_mut().ok_or_else(nothing_loaded)?;
        let aside = &mut self.set_aside;
        if let Some(lighting) = resident.lighting(&self.context, source)? {
            let before = resident.swap_lighting(lighting);
            aside.get_or_insert(SetAside::Lighting(Box::new(before)));
            return Ok(());
        }
        let mut before = std::mem::replace(resident, Resident::lit(&self.context, source)?);
        match aside.take() {
            Some(SetAside::Resident(resident)) => before = *resident,
            Some(SetAside::Lighting(lighting)) => drop(before.swap_lighting(*lighting)),
            None => {}
        }
        *aside = Some(SetAside::Resident(Box::new(before)));
        Ok(())
    }

    /// Averages the picture with those before it, and has the average take its place.
    fn add_picture(&self, viewport: &mut Viewport) -> Result<()> {
        let Context { device, queue, shared, timers, .. } = &self.context;
        let Viewport { targets, refinement: Refinement { average, .. }, .. } = viewport;
        let targets = targets.as_ref().ok_or_else(nothing_rendered)?;
        if average.as_ref().is_some_and(|average| average.size != targets.size) {
            *average = None;
        }
        let average = average.get_or_insert_with(|| Average::new(device, targets));
        let pass = self.passes.averaging(&self.context);
        let mut recorder = Recorder::submitting(device, queue, &shared.frame, timers);
        pass.add(&mut recorder, targets, average);
        pass.show(&mut recorder, targets, average);
        recorder.finish();
        Ok(())
    }
}

/// The view with rays through other points of their pixels, and with several samples a pixel, of their part of it. Those of
/// set 0 stay where they are.
fn jittered(picture: &Picture, set: u32) -> View {
    let cells = picture.size.map(|pixels| f64::from(pixels * picture.settings.samples_per_axis));
    let [x, y] = JITTER.map(|step| (0.5 + f64::from(set) * step).fract() - 0.5);
    let shift = DVec2::new(2.0 * x / cells[0], 2.0 * y / cells[1]).as_vec2();
    View { center: picture.view.center + shift, ..picture.view }
}

fn not_open() -> Error {
    Error::invalid("open a scene before refining its picture")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RendererOptions;
    use crate::layout_tests::noop;
    use girandole_core::glam::Vec2;
    use girandole_core::illumination::IlluminationSettings;
    use girandole_core::lights::LightSettings;
    use girandole_core::scene::builtin::{self, MovingObject};

    #[test]
    fn set_0_comes_back_whatever_came_after_it() {
        let scene = builtin::build("table", MovingObject::None).expect("a built-in scene");
        let lights = LightSettings { count: 8, candidates: 1, ..LightSettings::default() };
        let settings = IlluminationSettings { lights, ..IlluminationSettings::default() };
        let (device, queue) = noop(wgpu::Features::empty());
        let mut renderer = Renderer::new(&device, &queue, RendererOptions::default()).expect("a renderer");
        renderer.open(&scene, &settings).expect("open");
        let geometry = renderer.illumination().expect("open").geometry().clone();
        let held = |renderer: &Renderer| {
            let resident = renderer.scene.as_ref().expect("a scene");
            assert_eq!(resident.lights.samples.len(), resident.atlas.cache.len());
            (resident.lights.samples.len(), resident.generations, resident.receivers.is_some())
        };
        let before = held(&renderer);
        // Sets of as many samples share the atlas; those of others cannot.
        for counts in [&[8, 8][..], &[12], &[8, 12, 8], &[12, 8, 12, 12]] {
            for (set, &count) in (1..).zip(counts) {
                let settings = LightSettings { count, ..lights };
                let lights = LightSet::sample_set(&scene, &geometry, &settings, &[], set).expect("lights");
                renderer
                    .light_with(&scene, &NextSet { lights, build: None, visibility: None })
                    .expect("lights that fit");
                let now = held(&renderer);
                assert!(now.0 == count as usize && now.1 != before.1 && !now.2, "{counts:?}: {now:?}");
            }
            renderer.bring_set_0_back();
            assert_eq!(held(&renderer), before, "{counts:?}");
            assert_eq!(renderer.stale().maps, 8, "{counts:?}");
        }
    }

    #[test]
    fn rays_go_through_other_points_of_their_pixels() {
        let scene = builtin::build("table", MovingObject::None).expect("a built-in scene");
        let view = View::new(&scene, &scene.cameras[0], 1.5);
        let settings = RenderSettings { samples_per_axis: 2, ..RenderSettings::default() };
        let picture = Picture { view, size: [60, 40], settings };
        assert_eq!(jittered(&picture, 0), view);
        // In pixels; a quarter is half of a sample's part of its pixel.
        let shift = |set| (jittered(&picture, set).center - view.center) * Vec2::new(30.0, 20.0);
        let shifts: Vec<Vec2> = (0..64).map(shift).collect();
        assert!(shifts.iter().all(|s| s.abs().max_element() <= 0.25 + 1e-6), "{shifts:?}");
        let mean = shifts.iter().copied().sum::<Vec2>() / 64.0;
        assert!(mean.length() < 0.015, "{mean}");
        let apart = |i: usize| shifts[..i].iter().all(|s| s.distance(shifts[i]) > 0.02);
        assert!((0..64).all(apart), "rays go the same way twice");
    }
}
