//! The light samples of a sequence, from frame to frame.

use super::view;
use crate::args::{Mode, RenderArgs, RewalkArg};
use crate::engine::{Job, Picture, Ready, illumination};
use crate::transfer::Transferred;
use anyhow::Result;
use girandole_core::illumination::{Illumination, IlluminationSettings};
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::{Geometry, Scene, View};
use girandole_core::visibility::VisibilitySettings;

/// Moments of an animation that light samples are placed for where the camera moves.
const VIEWS: u32 = 8;

/// The light samples of a sequence.
pub enum Light {
    /// Those of the scene as it was at first, which follow it; on the device, only what changes is made anew.
    OnDevice,
    Following(Box<Illumination>),
    /// Other ones at each frame.
    Fresh(Box<IlluminationSettings>, Option<Box<Illumination>>),
    /// None: the path tracer has its own.
    None,
}

impl Light {
    pub fn new(
        scene: &mut Scene,
        engine: &mut Ready,
        transfers: &[Transferred],
        (args, to_come): (&RenderArgs, &[View]),
    ) -> Result<Self> {
        let lights = args.light_settings();
        let needs_visibility = matches!(engine, Ready::Gpu(_)) && args.mode != Mode::Naive;
        let visibility = needs_visibility.then(VisibilitySettings::default);
        let settings = IlluminationSettings { lights, visibility, ..IlluminationSettings::default() };
        if matches!(engine, Ready::Path) {
            return Ok(Self::None);
        }
        if args.motion.rewalk == RewalkArg::All {
            return Ok(Self::Fresh(Box::new(settings), None));
        }
        // Whatever the range of frames is: samples that are held are placed for all of the camera's way.
        let is_held = args.motion.rewalk == RewalkArg::Off;
        let (mut posed, mut views) = (scene.clone(), Vec::new());
        for moment in 0..if is_held { VIEWS } else { 1 } {
            posed.set_time(scene.duration() * f64::from(moment) / f64::from(VIEWS))?;
            let view = view(&posed, args)?;
            if !views.contains(&view) {
                views.push(view);
            }
        }
        if !is_held {
            scene.set_time(0.0)?;
            views.extend(to_come.iter().filter(|&view| *view != views[0]).copied().collect::<Vec<View>>());
        }
        let settings = IlluminationSettings {
            lights: LightSettings { walk_dynamic: !is_held, ..lights },
            views: args.lights.placement.views(&views).to_vec(),
            rewalk: args.motion.rewalk(),
            ..settings
        };
        scene.take_changes();
        match engine {
            Ready::Gpu(device) => {
                device.open_scene(scene, &settings, transfers, args).map(|()| Self::OnDevice)
            }
            _ => Ok(Self::Following(Box::new(illumination(scene, &settings, args)?))),
        }
    }

    /// Takes the scene as it stands, the view that samples go over to, and those to come.
    fn follow(
        &mut self,
        scene: &mut Scene,
        engine: &mut Ready,
        (args, to_come): (&RenderArgs, &[View]),
    ) -> Result<()> {
        let changes = scene.take_changes();
        match (&mut *self, &mut *engine) {
            (Self::OnDevice, Ready::Gpu(device)) => device.follow(scene, &changes)?,
            (Self::Following(light), _) => light.update(scene, &changes)?,
            _ => {}
        }
        if !matches!(args.motion.rewalk, RewalkArg::Paths(_)) {
            return Ok(());
        }
        let view = [view(scene, args)?];
        let views = args.lights.placement.views(&view);
        match (self, engine) {
            (Self::OnDevice, Ready::Gpu(device)) => device.place_on_way(scene, views, to_come)?,
            (Self::Following(light), _) => light.place_on_way(scene, views, to_come)?,
            _ => {}
        }
        Ok(())
    }

    /// Passes over a frame that is not rendered.
    pub fn skip(
        &mut self,
        scene: &mut Scene,
        engine: &mut Ready,
        seen: (&RenderArgs, &[View]),
    ) -> Result<()> {
        self.follow(scene, engine, seen)?;
        match (self, engine) {
            (Self::OnDevice, Ready::Gpu(device)) => device.skip_frame(&view(scene, seen.0)?, seen.0),
            _ => Ok(()),
        }
    }

    /// The scene as it stands.
    pub fn picture(
        &mut self,
        scene: &mut Scene,
        engine: &mut Ready,
        transfers: &[Transferred],
        (args, to_come): (&RenderArgs, &[View]),
    ) -> Result<Picture> {
        let (view, clamp) = (view(scene, args)?, args.quality.clamp.0);
        let job = |scene, geometry, lights, visibility| Job {
            scene,
            geometry,
            lights,
            visibility,
            transfers,
            view,
            clamp,
            args,
        };
        self.follow(scene, engine, (args, to_come))?;
        match (self, engine) {
            (Self::OnDevice, Ready::Gpu(device)) => device.picture(&view, args),
            (Self::OnDevice | Self::None, engine) => {
                let geometry = Geometry::new(scene);
                let lights = LightSet::from_samples(&geometry, Vec::new());
                engine.render(&job(scene, &geometry, &lights, None))
            }
            (Self::Following(light), engine) => {
                engine.render(&job(scene, light.geometry(), light.lights(), light.visibility()))
            }
            (Self::Fresh(settings, light), engine) => {
                settings.views = args.lights.placement.views(&[view]).to_vec();
                let light = light.insert(Box::new(Illumination::new(scene, settings)?));
                engine.render(&job(scene, light.geometry(), light.lights(), light.visibility()))
            }
        }
    }

    /// What the samples warn of.
    pub fn warnings<'a>(&'a self, engine: &'a Ready) -> &'a [String] {
        match (self, engine) {
            (Self::OnDevice, Ready::Gpu(device)) => device.warnings(),
            (Self::Following(light) | Self::Fresh(_, Some(light)), _) => &light.lights().warnings,
            _ => &[],
        }
    }
}
