//! Debug views: they take the place of the picture.

use super::{Band, Groups, Kernel, Layouts, shadow_maps};
use crate::bind::Slot::{Float, Ids, Picture, Read, Uniform};
use crate::gpu_scene::storage;
use crate::receivers::Receivers;
use crate::selection::PointLists;
use crate::settings::DebugView;
use crate::shader_constants::GROUPS_PER_ROW;
use crate::targets::Targets;
use crate::{Result, shaders};
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
    pub targets: &'a Targets,
    pub atlas: &'a wgpu::TextureView,
    pub lights: &'a wgpu::Buffer,
    /// Where in the atlas maps are.
    pub maps: &'a wgpu::Buffer,
    /// There in all modes but the naive one.
    pub selected: Option<(&'a Receivers, &'a PointLists)>,
}

impl Debug {
    pub fn new(device: &wgpu::Device, layouts: &Layouts) -> Self {
        let maps = shadow_maps::slot(&layouts.tuning);
        let kernel = |source, entry, slots: &[_], constants: &[_]| {
            Kernel::new(device, layouts, source, entry, slots, constants)
        };
        Self {
            leaves: kernel(&shaders::DEBUG_LEAVES, "show_leaves", &[Ids, Read, Read, Uniform, Picture], &[]),
            levels: kernel(&shaders::DEBUG_LEVELS, "show_levels", &[Ids, Read, Picture, Float], &[]),
            light_maps: kernel(
                &shaders::DEBUG_LIGHT_MAPS,
                "show_light_maps",
                &[Ids, Read, Read, Read, Uniform, Picture],
                &[],
            ),
            lights: kernel(&shaders::DEBUG_LIGHTS, "show_lights", &[Read, Ids, Picture], &[]),
            atlas: kernel(
                &shaders::DEBUG_ATLAS,
                "show_atlas",
                &[Picture, maps, Read, Uniform],
                &[("NEAR", shadow_maps::NEAR)],
            ),
        }
    }

    /// Records a view over a band of the picture; `lights` is how many the frame's step has.
    pub fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        band: Band,
        (view, lights): (DebugView, u32),
        inputs: DebugInputs,
    ) -> Result<()> {
        let ids = wgpu::BindingResource::TextureView(&inputs.targets.ids);
        let picture = wgpu::BindingResource::TextureView(&inputs.targets.picture_view);
        let tiles = Groups::tiles(band.size);
        let mut run = |kernel: &Kernel, resources: &[wgpu::BindingResource], groups| {
            kernel.record(device, encoder, None, band, resources, groups);
        };
        match (view, inputs.selected) {
            (DebugView::LightPositions, _) => {
                let groups = Groups::Count([lights.min(GROUPS_PER_ROW), lights.div_ceil(GROUPS_PER_ROW)]);
                run(&self.lights, &[inputs.lights.as_entire_binding(), ids, picture], groups);
            }
            (DebugView::Atlas, _) => {
                let atlas = wgpu::BindingResource::TextureView(inputs.atlas);
                let [lights, maps] = [inputs.lights, inputs.maps].map(|b| b.as_entire_binding());
                run(&self.atlas, &[picture, atlas, lights, maps], tiles);
            }
            (DebugView::Levels, Some(_)) => {
                let light = wgpu::BindingResource::TextureView(&inputs.targets.grids[0][0]);
                run(&self.levels, &[ids, inputs.targets.sums.as_entire_binding(), picture, light], tiles);
            }
            (DebugView::LightMaps, Some((receivers, selection))) => {
                let buffers = [
                    &receivers.receivers,
                    &receivers.lists,
                    &receivers.light_maps,
                    selection.offsets_buffer(),
                ];
                let [a, b, c, d] = buffers.map(|b| b.as_entire_binding());
                run(&self.light_maps, &[ids, a, b, c, d, picture], tiles);
            }
            (DebugView::Receivers | DebugView::States(_), Some((receivers, selection))) => {
                let colors = storage(device, "colours", &leaf_colors(view, receivers))?;
                let buffers = [&receivers.receivers, &colors, selection.offsets_buffer()];
                let [a, b, c] = buffers.map(|b| b.as_entire_binding());
                run(&self.leaves, &[ids, a, b, c, picture], tiles);
            }
            // Refused before.
            (_, None) => {}
        }
        Ok(())
    }
}

/// A colour for each leaf, linear.
fn leaf_colors(view: DebugView, receivers: &Receivers) -> Vec<[f32; 4]> {
    let lights = receivers.lights as usize;
    (0..receivers.leaves as usize)
        .map(|leaf| match view {
            DebugView::States(Some(light)) => match receivers.states[leaf * lights + light as usize] {
                State::Unoccluded => [0.05, 0.6, 0.1, 1.0],
                State::Partial => [0.9, 0.6, 0.02, 1.0],
                State::Full => [0.25, 0.03, 0.05, 1.0],
            },
            // From black by way of red and yellow to white: the share of lights that need a look.
            DebugView::States(None) => {
                let [_, _, added, subtracted] = receivers.parts[leaf];
                let share = (added + subtracted) as f32 / receivers.lights.max(1) as f32 * 3.0;
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
