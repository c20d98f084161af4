//! Which kernels frames are sure to need, in the order in which they are compiled ahead: first those of shadow maps, which are drawn first;
//! then what takes long. What few frames need is compiled when one does.

use super::{AdaptivePasses, Passes, RadiancePasses, ScenePasses};
use crate::device::context::Context;
use crate::device::kernel::Shared;
use crate::passes::Compiler;
use crate::passes::layers::Layers;
use crate::passes::mirrors::Mirrors;
use crate::passes::resolve::Resolve;
use crate::passes::shade_naive::ShadeNaive;
use crate::settings::{Mode, RenderSettings, Shading};

impl Passes {
    /// Has compiled what every scene needs. Whether all is there.
    pub fn order(&self, shared: &Shared) -> bool {
        let are_there = self.shadow_maps.order(shared);
        self.visibility_buffer.order(shared) & are_there
    }
}

impl ScenePasses {
    /// Has compiled what frames with these settings need. Whether all is there.
    pub fn order(&self, context: &Context, settings: &RenderSettings) -> bool {
        let (compiler, shared) = (Compiler::new(context, self.features), &context.shared);
        let mut is_resolved = true;
        let mut are_there = if settings.mode == Mode::Naive {
            self.naive.get_or_init(|| ShadeNaive::new(&compiler)).order(shared)
        } else {
            let adaptive = self.adaptive.get_or_init(|| AdaptivePasses::new(&compiler));
            let to_radiance = adaptive.to_radiance(settings);
            is_resolved = to_radiance.is_none();
            adaptive.order(shared, settings, to_radiance)
        };
        if is_resolved {
            are_there &= self.resolve.get_or_init(|| Resolve::new(&compiler)).order(shared);
        }
        if self.features.transparent && settings.debug.is_none() {
            are_there &= self.layers.get_or_init(|| Layers::new(&compiler)).order(shared);
        }
        if self.features.mirrors && settings.mirrors > 0 && settings.debug.is_none() {
            are_there &= self.mirrors.get_or_init(|| Mirrors::new(&compiler)).order(shared);
            let compiler = compiler.mirrored();
            are_there &= if settings.mode == Mode::Naive {
                self.naive_mirrored.get_or_init(|| ShadeNaive::new(&compiler)).order(shared)
            } else {
                let adaptive = self.adaptive_mirrored.get_or_init(|| AdaptivePasses::new(&compiler));
                let of_ends = RenderSettings { samples_per_axis: 1, light_maps: Some(false), ..*settings };
                adaptive.order(shared, &of_ends, None)
            };
        }
        are_there
    }
}

impl AdaptivePasses {
    /// The passes that store radiance, if frames with these settings have any use for them: nothing but the picture needs what its
    /// pixels receive, unless further samples need that of the first ones.
    pub(super) fn to_radiance(&self, settings: &RenderSettings) -> Option<&RadiancePasses> {
        let stores_radiance = settings.debug.is_none()
            && settings.mode.has_low_resolution()
            && settings.shading == Shading::Fused;
        self.to_radiance.as_ref().filter(|_| stores_radiance)
    }

    fn order(
        &self,
        shared: &Shared,
        settings: &RenderSettings,
        to_radiance: Option<&RadiancePasses>,
    ) -> bool {
        let are_few = settings.mode.has_low_resolution();
        let mut are_there = true;
        if settings.shading == Shading::Fused {
            are_there &= self.to_irradiance.shade_points.order(shared, are_few);
        }
        if are_few {
            are_there &= self.to_irradiance.refine.order(shared);
            are_there &= to_radiance.is_none_or(|passes| passes.points.refine.order(shared));
        }
        if are_few && settings.samples_per_axis > 1 {
            let passes = to_radiance.map_or(&self.to_irradiance, |passes| &passes.points);
            are_there &= passes.edges.order(shared);
            are_there &= to_radiance.is_none_or(|passes| passes.first_samples.order(shared));
        }
        are_there &= self.append_all_points.order(shared);
        are_there &= self.sort_points.order(shared);
        if settings.uses_light_maps() {
            are_there &= self.light_maps.order(shared);
        }
        are_there
    }
}
