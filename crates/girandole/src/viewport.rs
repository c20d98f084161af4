//! What the pictures of one camera keep on the device.

use crate::points::average::Average;
use crate::points::lists::PointLists;
use crate::points::multipass_plan::MultipassPlan;
use crate::points::targets::Targets;
use crate::resident::Seen;
use crate::settings::RenderSettings;
use crate::{Error, Result};
use girandole_core::Generation;
use girandole_core::lights::LightSet;
use girandole_core::scene::{LocalView, View};
use girandole_core::visibility::{VisibilityBuild, VisibilityDatabase};
use std::sync::Arc;

/// What the pictures of one camera keep on the device from frame to frame: targets of their size, lists of points, and how far the last
/// one is [refined](crate::Renderer::refine). Each camera has its own: the halves of a split screen, both eyes, a monitor, a thumbnail.
/// Light samples, visibility and shadow maps are the [`Renderer`](crate::Renderer)'s and serve them all.
///
/// ```no_run
/// # use girandole::scene::View;
/// # use girandole::{Renderer, RenderSettings, Result, Target, Viewport};
/// # fn split(
/// #     renderer: &mut Renderer,
/// #     encoder: &mut wgpu::CommandEncoder,
/// #     views: [View; 2],
/// #     targets: [Target; 2],
/// # ) -> Result<()> {
/// let mut viewports = [Viewport::default(), Viewport::default()]; // kept from frame to frame
///
/// for ((viewport, view), target) in viewports.iter_mut().zip(&views).zip(&targets) {
///     renderer.record(viewport, encoder, view, target, &RenderSettings::default())?;
/// }
/// # Ok(())
/// # }
/// ```
///
/// It takes no memory before its first frame. Where its next frame has another size, or is another device's, it is made anew.
#[derive(Default)]
pub struct Viewport {
    device: Option<wgpu::Device>,
    pub(crate) targets: Option<Targets>,
    pub(crate) lists: Option<PointLists>,
    /// What multipass shading draws.
    pub(crate) multipass: Option<MultipassPlan>,
    pub(crate) seen: Option<Seen>,
    pub(crate) last: Option<LastFrame>,
    pub(crate) refinement: Refinement,
    /// Which light set of a refinement is rendered; 0 = the picture's own.
    pub(crate) light_set: u32,
}

/// How a viewport's last frame was recorded.
pub(crate) struct LastFrame {
    /// Which of the renderer's frames it was.
    pub id: Generation,
    pub settings: RenderSettings,
    pub view: LocalView,
    /// Whether it left shadow maps stale that it looks up.
    pub is_stale: bool,
}

impl Viewport {
    /// Its targets, once something was rendered.
    ///
    /// # Errors
    /// [`Error::Scene`] before.
    pub(crate) fn rendered(&self) -> Result<&Targets> {
        self.targets.as_ref().ok_or_else(nothing_rendered)
    }

    /// Lets go of what is on another device.
    pub(crate) fn move_to(&mut self, device: &wgpu::Device) {
        if self.device.as_ref() != Some(device) {
            *self = Self { device: Some(device.clone()), light_set: self.light_set, ..Self::default() };
        }
    }
}

/// What a picture shows and how.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Picture {
    pub view: View,
    pub size: [u32; 2],
    pub settings: RenderSettings,
}

/// Light samples of a set that is not rendered yet.
pub(crate) struct NextSet {
    pub lights: LightSet,
    /// While visibility is being determined.
    pub build: Option<VisibilityBuild>,
    pub visibility: Option<Arc<VisibilityDatabase>>,
}

/// How far a viewport's picture is refined.
#[derive(Default)]
pub(crate) struct Refinement {
    /// The picture that is refined, and which version of scene and light it shows; none where there is none that can be.
    pub picture: Option<(Picture, Generation)>,
    pub average: Option<Average>,
    pub next: Option<NextSet>,
}

impl Refinement {
    /// The picture, if it shows this version of scene and light.
    pub fn picture_of(&self, version: Generation) -> Option<&Picture> {
        self.picture.as_ref().filter(|(_, of)| *of == version).map(|(picture, _)| picture)
    }

    /// Sets in the picture.
    pub fn sets(&self, version: Generation) -> u32 {
        let averaged = self.average.as_ref().map_or(0, |average| average.sets);
        if self.picture_of(version).is_some() { averaged.max(1) } else { 0 }
    }
}

pub(crate) fn nothing_rendered() -> Error {
    Error::invalid("render before showing or reading back")
}
