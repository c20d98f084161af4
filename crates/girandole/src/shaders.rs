//! Shader sources. A pass names the `lib/` files that it uses in one line; WGSL's module scope knows no order, so
//! they are simply put together.

macro_rules! lib {
    ($($name:ident),* $(,)?) => {
        [$((stringify!($name), include_str!(concat!("../shaders/lib/", stringify!($name), ".wgsl")))),*]
    };
}

const LIBRARY: &[(&str, &str)] = &lib!(
    atlas_depth,
    atlas_image,
    blend,
    brdf,
    elements,
    frame,
    grid,
    light,
    light_map,
    lights_storage,
    lights_uniform,
    maps,
    occluders,
    octahedral,
    order,
    packed,
    parameterisation,
    pixel_surface,
    plan,
    project,
    radiance,
    receiver,
    samples,
    scene,
    shadow,
    sum,
    surface,
    take,
    texture,
    tied,
    tonemap,
    want
);

/// A pass: its name, its source, the library files it uses.
pub(crate) struct Source {
    pub name: &'static str,
    pub text: &'static str,
    pub uses: &'static [&'static str],
    /// First line where an extension must be enabled.
    pub enable: &'static str,
}

macro_rules! source {
    ($name:ident, $enable:literal, [$($used:ident),*]) => {
        Source {
            name: stringify!($name),
            text: include_str!(concat!("../shaders/", stringify!($name), ".wgsl")),
            uses: &[$(stringify!($used)),*],
            enable: $enable,
        }
    };
}

/// A pass that reads shadow maps: where they are drawn, and from copies.
macro_rules! reads_maps {
    ($name:ident, [$($used:ident),* $(,)?]) => {
        [source!($name, "", [atlas_depth, $($used),*]), source!($name, "", [atlas_image, $($used),*])]
    };
}

pub(crate) const VISIBILITY: Source = source!(visibility, "", [frame, scene, texture]);
pub(crate) const SHADE: [Source; 2] = reads_maps!(
    shade,
    [frame, scene, texture, surface, brdf, light, maps, octahedral, parameterisation, shadow, sum]
);
pub(crate) const REFINE: Source =
    source!(refine, "", [frame, scene, brdf, grid, pixel_surface, radiance, packed, take]);
pub(crate) const CHECK: Source = source!(
    check,
    "",
    [frame, scene, texture, surface, brdf, plan, grid, pixel_surface, receiver, radiance, packed, take, want]
);
pub(crate) const EDGES: Source =
    source!(edges, "", [frame, scene, brdf, grid, pixel_surface, radiance, packed, samples, tied, blend]);
pub(crate) const BEHIND: Source = source!(
    behind,
    "",
    [
        frame,
        scene,
        texture,
        surface,
        brdf,
        plan,
        grid,
        pixel_surface,
        receiver,
        radiance,
        packed,
        samples,
        tied,
        blend,
        want
    ]
);
pub(crate) const SORT: Source = source!(sort, "", [frame, plan, grid, order, take]);
pub(crate) const SCATTER: Source = source!(scatter, "", [plan, order]);
macro_rules! gather {
    ($lights:ident) => {
        reads_maps!(
            gather,
            [
                frame,
                scene,
                texture,
                surface,
                brdf,
                light,
                maps,
                octahedral,
                parameterisation,
                shadow,
                sum,
                plan,
                light_map,
                $lights,
                radiance,
                packed,
                samples,
                take,
                tied
            ]
        )
    };
}

pub(crate) const GATHER: [Source; 2] = gather!(lights_uniform);
pub(crate) const GATHER_STORED: [Source; 2] = gather!(lights_storage);
pub(crate) const DEBUG_LEAVES: Source =
    source!(debug_leaves, "", [frame, scene, texture, surface, plan, receiver, packed]);
pub(crate) const DEBUG_LEVELS: Source = source!(debug_levels, "", [frame, packed]);
pub(crate) const DEBUG_LIGHT_MAPS: Source =
    source!(debug_light_maps, "", [frame, scene, texture, surface, plan, receiver, light_map, packed]);
pub(crate) const DEBUG_LIGHTS: Source =
    source!(debug_lights, "", [frame, scene, texture, surface, light, packed]);
pub(crate) const DEBUG_ATLAS: [Source; 2] = reads_maps!(debug_atlas, [frame, light, maps, packed]);
pub(crate) const MULTIPASS: [Source; 2] = reads_maps!(
    multipass,
    [
        frame,
        scene,
        texture,
        surface,
        brdf,
        light,
        maps,
        octahedral,
        parameterisation,
        shadow,
        sum,
        plan,
        grid,
        elements
    ]
);
pub(crate) const BATCH: Source = source!(batch, "", [plan, elements]);
pub(crate) const COLLECT: Source = source!(collect, "", [frame, scene, texture, surface, plan, light_map]);
pub(crate) const LIGHT_MAPS: Source = source!(light_maps, "", [frame, light, plan]);
pub(crate) const RESOLVE: Source =
    source!(resolve, "", [frame, scene, texture, surface, brdf, radiance, packed, samples, tied]);
pub(crate) const SHADOW_MAPS_CLIP: Source = source!(
    shadow_maps_clip,
    "enable clip_distances;\n",
    [frame, light, maps, octahedral, parameterisation, project, occluders]
);
pub(crate) const SHADOW_MAPS_DISCARD: Source =
    source!(shadow_maps_discard, "", [frame, light, maps, octahedral, parameterisation, project, occluders]);
pub(crate) const SHADOW_MAPS_MASKED: Source = source!(
    shadow_maps_masked,
    "",
    [frame, scene, texture, light, maps, octahedral, parameterisation, project, occluders]
);
pub(crate) const EXPOSURE: Source = source!(exposure, "", [packed]);
pub(crate) const TONEMAP: Source = source!(tonemap, "", [tonemap, packed]);

/// All passes, for the tests that need no GPU.
#[cfg(test)]
pub(crate) const ALL: [&Source; 30] = [
    &VISIBILITY,
    &SHADE[0],
    &SHADE[1],
    &REFINE,
    &CHECK,
    &EDGES,
    &BEHIND,
    &SORT,
    &SCATTER,
    &GATHER[0],
    &GATHER[1],
    &GATHER_STORED[0],
    &GATHER_STORED[1],
    &MULTIPASS[0],
    &MULTIPASS[1],
    &COLLECT,
    &BATCH,
    &DEBUG_LEAVES,
    &DEBUG_LEVELS,
    &DEBUG_LIGHT_MAPS,
    &DEBUG_LIGHTS,
    &DEBUG_ATLAS[0],
    &DEBUG_ATLAS[1],
    &LIGHT_MAPS,
    &RESOLVE,
    &SHADOW_MAPS_CLIP,
    &SHADOW_MAPS_DISCARD,
    &SHADOW_MAPS_MASKED,
    &EXPOSURE,
    &TONEMAP,
];

impl Source {
    /// The whole text.
    pub fn concatenated(&self) -> String {
        let mut text = String::from(self.enable);
        for (name, library) in LIBRARY {
            if self.uses.contains(name) {
                text.push_str(library);
            }
        }
        text.push_str(self.text);
        text
    }

    /// The compiled module.
    pub fn module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.name),
            source: wgpu::ShaderSource::Wgsl(self.concatenated().into()),
        })
    }
}
