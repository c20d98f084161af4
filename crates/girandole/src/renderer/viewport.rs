//! What the pictures of one camera keep on the device.

use super::refinement::Refinement;
use crate::points::lists::PointLists;
use crate::points::multipass_plan::MultipassPlan;
use crate::points::targets::Targets;
use crate::resident::Seen;
use crate::settings::RenderSettings;
use girandole_core::Generation;
use girandole_core::scene::LocalView;

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
    pub(super) refinement: Refinement,
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
    /// Lets go of what is on another device.
    pub(super) fn move_to(&mut self, device: &wgpu::Device) {
        if self.device.as_ref() != Some(device) {
            *self = Self { device: Some(device.clone()), ..Self::default() };
        }
    }
}
