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
    scatter_point,
    packed,
    parameterisation,
    surface_id,
    buffer_offsets,
    project,
    diffuse_material,
    receiver,
    samples,
    scene,
    shadow,
    point_sums,
    surface,
    work_queue,
    texture,
    non_uniform,
    tonemap,
    append_point
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

pub(crate) const VISIBILITY_BUFFER: Source = source!(visibility_buffer, "", [frame, scene, texture]);
pub(crate) const SHADE_NAIVE: [Source; 2] = reads_maps!(
    shade_naive,
    [frame, scene, texture, surface, brdf, light, maps, octahedral, parameterisation, shadow, point_sums]
);
pub(crate) const REFINE: Source =
    source!(refine, "", [frame, scene, brdf, grid, surface_id, diffuse_material, packed, work_queue]);
pub(crate) const TEST_CANDIDATES: Source = source!(
    test_candidates,
    "",
    [
        frame,
        scene,
        texture,
        surface,
        brdf,
        buffer_offsets,
        grid,
        surface_id,
        receiver,
        diffuse_material,
        packed,
        work_queue,
        append_point
    ]
);
pub(crate) const EDGES: Source = source!(
    edges,
    "",
    [frame, scene, brdf, grid, surface_id, diffuse_material, packed, samples, non_uniform, blend]
);
pub(crate) const EDGE_FALLBACK: Source = source!(
    edge_fallback,
    "",
    [
        frame,
        scene,
        texture,
        surface,
        brdf,
        buffer_offsets,
        grid,
        surface_id,
        receiver,
        diffuse_material,
        packed,
        samples,
        non_uniform,
        blend,
        append_point
    ]
);
pub(crate) const PREFIX_SUM: Source =
    source!(prefix_sum, "", [frame, buffer_offsets, grid, scatter_point, work_queue]);
pub(crate) const SCATTER_POINTS: Source = source!(scatter_points, "", [buffer_offsets, scatter_point]);
macro_rules! gather {
    ($lights:ident) => {
        reads_maps!(
            shade_points,
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
                point_sums,
                buffer_offsets,
                light_map,
                $lights,
                diffuse_material,
                packed,
                samples,
                work_queue,
                non_uniform
            ]
        )
    };
}

pub(crate) const SHADE_POINTS: [Source; 2] = gather!(lights_uniform);
pub(crate) const SHADE_POINTS_STORED: [Source; 2] = gather!(lights_storage);
pub(crate) const DEBUG_LEAVES: Source =
    source!(debug_leaves, "", [frame, scene, texture, surface, buffer_offsets, receiver, packed]);
pub(crate) const DEBUG_LEVELS: Source = source!(debug_levels, "", [frame, packed]);
pub(crate) const DEBUG_LIGHT_MAPS: Source = source!(
    debug_light_maps,
    "",
    [frame, scene, texture, surface, buffer_offsets, receiver, light_map, packed]
);
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
        point_sums,
        buffer_offsets,
        grid,
        elements
    ]
);
pub(crate) const MULTIPASS_ARGUMENTS: Source = source!(multipass_arguments, "", [buffer_offsets, elements]);
pub(crate) const MULTIPASS_COLLECT: Source =
    source!(multipass_collect, "", [frame, scene, texture, surface, buffer_offsets, light_map]);
pub(crate) const LIGHT_MAPS: Source = source!(light_maps, "", [frame, light, buffer_offsets]);
pub(crate) const RESOLVE: Source = source!(
    resolve,
    "",
    [frame, scene, texture, surface, brdf, diffuse_material, packed, samples, non_uniform]
);
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
    &VISIBILITY_BUFFER,
    &SHADE_NAIVE[0],
    &SHADE_NAIVE[1],
    &REFINE,
    &TEST_CANDIDATES,
    &EDGES,
    &EDGE_FALLBACK,
    &PREFIX_SUM,
    &SCATTER_POINTS,
    &SHADE_POINTS[0],
    &SHADE_POINTS[1],
    &SHADE_POINTS_STORED[0],
    &SHADE_POINTS_STORED[1],
    &MULTIPASS[0],
    &MULTIPASS[1],
    &MULTIPASS_COLLECT,
    &MULTIPASS_ARGUMENTS,
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
