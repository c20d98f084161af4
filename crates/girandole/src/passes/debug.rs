//! Debug views: they take the place of the picture.

use super::visibility_buffer::Seen;
use super::{BandSample, Compiler, GridView, LightMapsView, MapsView};
use crate::device::buffers::storage;
use crate::device::kernel::{Groups, Kernel, buffer, texture};
use crate::device::recorder::Recorder;
use crate::gpu_scene::lights::GpuLights;
use crate::gpu_scene::receivers::Receivers;
use crate::points::lists::PointLists;
use crate::settings::DebugView;
use crate::shader_constants::{JOINTED, MAPPED_SHADOWED, NEAR_SHADOWED, SHADOWED};
use crate::{Error, Result, shaders};
use girandole_core::visibility::State;

pub(crate) struct Debug {
    leaves: Kernel,
    levels: Kernel,
    light_maps: Kernel,
    lights: Kernel,
    atlas: Kernel,
}

/// What a view may show, beside the picture.
#[derive(Clone, Copy)]
pub(crate) struct DebugInputs<'a> {
    pub view: DebugView,
    pub seen: Seen<'a>,
    pub maps: MapsView<'a>,
    pub lights: &'a GpuLights,
    pub lit: GridView<'a>,
    /// There in all modes but the naive one.
    pub adaptive: Option<(LightMapsView<'a>, &'a PointLists)>,
}

impl Debug {
    pub fn new(compiler: &Compiler) -> Self {
        Self {
            leaves: compiler.kernel(&shaders::DEBUG_LEAVES, "show_leaves"),
            levels: compiler.kernel(&shaders::DEBUG_LEVELS, "show_levels"),
            light_maps: compiler.kernel(&shaders::DEBUG_LIGHT_MAPS, "show_light_maps"),
            lights: compiler.kernel(&shaders::DEBUG_LIGHTS, "show_lights"),
            atlas: compiler.kernel(&shaders::DEBUG_ATLAS, "show_atlas"),
        }
    }

    /// Writes a view over a band of the picture.
    ///
    /// # Errors
    /// [`Error::Scene`] for a view of receivers in the naive mode, [`Error::TooLarge`] beyond the device's limits.
    pub fn record(&self, recorder: &mut Recorder, band: &BandSample, inputs: DebugInputs) -> Result<()> {
        let tiles = Groups::tiles(band.size());
        let mut resources = vec![
            texture("triangle_ids", inputs.seen.triangle_ids),
            texture("atlas", inputs.maps.atlas),
            buffer("maps", inputs.maps.maps),
            buffer("lights", &inputs.lights.buffer),
            texture("irradiance", inputs.lit.irradiance),
            buffer("partial_sums", &band.targets.partial_sums),
            texture("picture", &band.targets.picture_view),
        ];
        if let Some((light_maps, lists)) = inputs.adaptive {
            let receivers = light_maps.receivers;
            resources.extend([
                buffer("receivers", receivers.receivers()),
                buffer("light_lists", receivers.light_lists()),
                buffer("light_maps", &receivers.light_maps.maps),
                buffer("offsets", lists.offsets(light_maps.used)),
            ]);
        }
        let colors;
        let (kernel, groups) = match (inputs.view, inputs.adaptive) {
            (DebugView::LightPositions, _) => (&self.lights, tiles),
            (DebugView::Atlas, _) => (&self.atlas, tiles),
            (DebugView::Levels, Some(_)) => (&self.levels, tiles),
            (DebugView::LightMaps, Some(_)) => (&self.light_maps, tiles),
            (DebugView::Receivers | DebugView::States(_), Some((light_maps, _))) => {
                colors =
                    storage(recorder.device, "colours", &leaf_colors(inputs.view, light_maps.receivers))?;
                resources.push(buffer("colors", &colors));
                (&self.leaves, tiles)
            }
            (_, None) => {
                return Err(Error::invalid(
                    "the naive mode has no receivers and levels to show; choose another mode",
                ));
            }
        };
        kernel.record(recorder, band.groups(), "debug_gpu_ms", &resources, groups);
        Ok(())
    }
}

/// A colour for each leaf, linear.
fn leaf_colors(view: DebugView, receivers: &Receivers) -> Vec<[f32; 4]> {
    (0..receivers.leaf_count() as usize)
        .map(|leaf| match view {
            DebugView::States(Some(light)) => match receivers.pairs.row(leaf)[light as usize].state() {
                State::Unoccluded => [0.05, 0.6, 0.1, 1.0],
                State::Partial => [0.9, 0.6, 0.02, 1.0],
                State::Full => [0.25, 0.03, 0.05, 1.0],
            },
            // From black by way of red and yellow to white: the share of lights that need a look.
            DebugView::States(None) => {
                let parts = [NEAR_SHADOWED, JOINTED, SHADOWED, MAPPED_SHADOWED];
                let looked_up: u32 =
                    parts.iter().map(|&part| receivers.lists.parts[leaf][part as usize]).sum();
                let share = looked_up as f32 / receivers.light_count().max(1) as f32 * 3.0;
                let [r, g, b] = [0.0, 1.0, 2.0].map(|from| (share - from).clamp(0.0, 1.0));
                [r, g, b, 1.0]
            }
            _ => {
                let hash = (leaf as u32).wrapping_mul(0x9e37_79b9);
                let [r, g, b] = [8, 16, 24].map(|shift| 0.1 + 0.8 * (hash >> shift & 0xff) as f32 / 255.0);
                [r, g, b, 1.0]
            }
        })
        .collect()
}
