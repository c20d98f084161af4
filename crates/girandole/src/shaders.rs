//! Shader sources. A pass names the `lib/` files and [records](crate::records) that it uses; WGSL's module scope has no
//! order, so they are simply put together, after the [constants](crate::shader_constants).

#[cfg(any(test, target_arch = "wasm32"))]
mod terse;

use crate::records::RECORDS;
use crate::shader_constants;
use crate::tier::Kernels;
use std::collections::BTreeSet;

/// The text of a file. Pages fetch it without what is for readers.
macro_rules! text {
    ($path:expr) => {{
        const WHOLE: &str = include_str!($path);
        #[cfg(not(target_arch = "wasm32"))]
        const TEXT: &str = WHOLE;
        #[cfg(target_arch = "wasm32")]
        const TEXT: &str = {
            const TERSE: [u8; terse::of::<0>(WHOLE).1] = terse::of(WHOLE).0;
            terse::text(&TERSE)
        };
        TEXT
    }};
}

macro_rules! lib {
    ($folder:literal, $($name:ident),* $(,)?) => {
        &[$((stringify!($name), text!(concat!("../shaders/", $folder, "/", stringify!($name), ".wgsl")))),*]
    };
}

/// What only software devices have for themselves.
const SOFTWARE: &[(&str, &str)] = lib!(
    "software",
    atlas_image,
    branch_non_uniform,
    loads_batched,
    ray_stack_registers,
    ray_texels_image,
    workgroups_persistent
);

const LIBRARY: &[(&str, &str)] = lib!(
    "lib",
    alpha_mask,
    append_point,
    atlas_texture,
    blend,
    blockers,
    branch_uniform,
    brdf,
    buffer_offsets,
    candidates,
    candidates_atomic,
    color,
    diffuse_material,
    direction,
    edge_sample,
    environment,
    environment_place,
    environment_share,
    frame,
    grid,
    harmonics,
    hit_camera,
    hit_mirror,
    light,
    light_lists,
    light_map,
    lights_storage,
    lights_uniform,
    loads_unordered,
    map_lists,
    map_masked,
    map_opaque,
    map_parts,
    map_set_up,
    map_texels,
    maps,
    mirror_image,
    no_mirror_image,
    mirror_share,
    multipass_params,
    no_reflected_environment,
    octahedral,
    previous_transform,
    packed,
    parallel_map,
    parameterisation,
    transforms_current,
    transforms_previous,
    point_queue,
    point_queue_atomic,
    point_spacing,
    point_sums,
    polished,
    prefix_scan,
    ray_stack_array,
    ray_texels_texture,
    rays,
    receiver,
    rectangle,
    reflected_environment,
    reflection,
    samples,
    scene,
    shade_chunk,
    shade_list,
    shadow,
    sums_previous,
    surface,
    test_candidate,
    texture,
    tonemap,
    transfer_object,
    vertex_range,
    workgroups_one_each,
);

/// A pass: its name, its source, what it uses.
pub(crate) struct Source {
    pub name: &'static str,
    pub text: &'static str,
    /// Files of the library; `atlas`, `lights`, `branch`, `loads`, `ray_stack`, `ray_texels`, `workgroups`, `hit` and `reflection_beyond`, of which
    /// [`Kernels`] choose the variant; records, as `name_at` to read and `set_name` to write them.
    pub uses: &'static [&'static str],
}

macro_rules! sources {
    ($($constant:ident = $($folder:literal /)? $name:ident [$($used:ident)*];)*) => {
        $(pub(crate) const $constant: Source = Source {
            name: stringify!($name),
            text: text!(concat!("../shaders/", $($folder, "/",)? stringify!($name), ".wgsl")),
            uses: &[$(stringify!($used)),*],
        };)*

        /// All passes.
        pub(crate) const ALL: &[&Source] = &[$(&$constant),*];
    };
}

sources! {
    VISIBILITY_BUFFER = visibility_buffer [frame scene texture texture_entry_at];
    SHADE_NAIVE = shade_naive [
        frame scene texture texture_entry_at surface hit reflection brdf color light lights_uniform maps octahedral
        parameterisation atlas parallel_map shadow rectangle mirror_share environment_share point_sums branch
    ];
    APPEND_ALL_POINTS = append_all_points [
        frame scene texture texture_entry_at surface hit buffer_offsets grid receiver receiver_grid_at shade_list set_shade_point
        append_point
    ];
    REFINE = refine [frame scene brdf grid polished candidates_atomic diffuse_material packed workgroups];
    TEST_CANDIDATES = test_candidates [
        frame scene texture texture_entry_at surface hit brdf buffer_offsets grid polished receiver receiver_grid_at diffuse_material
        packed branch shade_list set_shade_point append_point candidates test_candidate
    ];
    TEST_CANDIDATES_PERSISTENT = "software" / test_candidates_persistent [
        frame scene texture texture_entry_at surface hit brdf buffer_offsets grid polished receiver receiver_grid_at diffuse_material
        packed branch shade_list set_shade_point append_point candidates test_candidate workgroups_persistent
    ];
    EDGES = edges [
        frame scene brdf grid polished diffuse_material packed samples branch blend candidates_atomic edge_sample
    ];
    EDGES_RUNS = "software" / edges_runs [
        frame scene brdf grid polished diffuse_material packed samples branch blend candidates_atomic edge_sample
    ];
    EDGE_FALLBACK = edge_fallback [
        frame scene texture texture_entry_at surface hit brdf buffer_offsets grid polished receiver receiver_grid_at diffuse_material
        packed samples branch blend shade_list set_shade_point append_point candidates
    ];
    PREFIX_SUM = prefix_sum [
        frame buffer_offsets shade_list point_queue candidates prefix_scan workgroups
    ];
    SCATTER_POINTS = scatter_points [buffer_offsets shade_list shade_point_at point_queue];
    SHADE_POINTS = shade_points [
        frame scene texture texture_entry_at surface hit reflection brdf color light lights maps octahedral parameterisation
        atlas parallel_map shadow rectangle transforms_current mirror_share environment_share point_sums buffer_offsets light_lists leaf_record_at leaf_range_at light_map
        diffuse_material packed samples branch loads point_queue grid point_spacing shade_chunk
    ];
    SHADE_POINTS_PREVIOUS = shade_points [
        frame scene texture texture_entry_at surface hit reflection brdf color light lights maps octahedral parameterisation
        atlas parallel_map shadow rectangle previous_transform transforms_previous sums_previous mirror_share environment_share point_sums buffer_offsets light_lists leaf_record_at leaf_range_at light_map
        diffuse_material packed samples branch loads point_queue grid point_spacing shade_chunk
    ];
    SHADE_POINTS_PERSISTENT = "software" / shade_points_persistent [
        frame scene texture texture_entry_at surface hit reflection brdf color light lights maps octahedral parameterisation
        atlas parallel_map shadow rectangle transforms_current mirror_share environment_share point_sums buffer_offsets light_lists leaf_record_at leaf_range_at light_map
        diffuse_material packed samples branch loads point_queue_atomic grid point_spacing shade_chunk workgroups_persistent
    ];
    SHADE_POINTS_PREVIOUS_PERSISTENT = "software" / shade_points_persistent [
        frame scene texture texture_entry_at surface hit reflection brdf color light lights maps octahedral parameterisation
        atlas parallel_map shadow rectangle previous_transform transforms_previous sums_previous mirror_share environment_share point_sums buffer_offsets light_lists leaf_record_at leaf_range_at light_map
        diffuse_material packed samples branch loads point_queue_atomic grid point_spacing shade_chunk workgroups_persistent
    ];
    INCIDENT_LIGHT = incident_light [
        frame light lights maps octahedral parameterisation atlas parallel_map shadow previous_transform brdf rectangle branch harmonics transfer_object
    ];
    TRANSFER_VERTICES = transfer_vertices [scene branch transfer_object vertex_range];
    TRANSFER = transfer [
        frame scene texture texture_entry_at surface hit brdf grid diffuse_material packed samples branch vertex_range
    ];
    MULTIPASS = multipass [
        frame scene texture texture_entry_at surface hit reflection brdf color light maps octahedral parameterisation atlas
        parallel_map shadow rectangle mirror_share environment_share point_sums buffer_offsets grid point_queue multipass_params element_at member_at
    ];
    MULTIPASS_ARGUMENTS = multipass_arguments [
        buffer_offsets point_queue multipass_params element_at set_element member_at set_member prefix_scan
    ];
    MULTIPASS_COLLECT = multipass_collect [
        frame scene texture texture_entry_at surface hit reflection brdf color light mirror_share environment_share buffer_offsets
        point_queue branch grid point_spacing light_lists leaf_record_at leaf_range_at light_map
    ];
    LIGHT_MAPS = light_maps [frame light buffer_offsets light_lists leaf_record_at leaf_range_at];
    LAYERS = layers [
        frame scene texture texture_entry_at surface hit reflection brdf diffuse_material packed branch no_mirror_image
        reflection_beyond
    ];
    LAYERS_MIRRORING = layers [
        frame scene texture texture_entry_at surface hit reflection brdf diffuse_material packed branch mirror_image
        reflection_beyond
    ];
    RESOLVE = resolve [
        frame scene texture texture_entry_at surface hit reflection brdf diffuse_material packed samples branch
        reflection_beyond
    ];
    SMALL_MAP_TRIANGLES = small_map_triangles [parallel_map map_parts map_set_up map_opaque map_lists map_texels];
    SMALL_MAP_TRIANGLES_MASKED = small_map_triangles [
        frame scene texture texture_entry_at parallel_map map_parts map_set_up alpha_mask map_masked map_lists map_texels
    ];
    LARGE_MAP_TRIANGLES = large_map_triangles [parallel_map map_parts map_set_up map_opaque map_lists map_texels];
    LARGE_MAP_TRIANGLES_MASKED = large_map_triangles [
        frame scene texture texture_entry_at parallel_map map_parts map_set_up alpha_mask map_masked map_lists map_texels
    ];
    MERGE_LARGE_TRIANGLES = merge_large_triangles [parallel_map map_parts map_set_up map_opaque map_lists];
    MERGE_LARGE_TRIANGLES_MASKED = merge_large_triangles [
        frame scene texture texture_entry_at parallel_map map_parts map_set_up alpha_mask map_masked map_lists
    ];
    TRACE_RAYS = trace_rays [scene texture texture_entry_at alpha_mask ray_stack ray_texels rays];
    EXPOSURE = exposure [packed color];
    CALLER_DEPTH = caller_depth [frame];
    AVERAGE = average [frame packed branch];
    BACKGROUND = background [frame packed environment_place environment];
    TONEMAP = tonemap [tonemap packed];
    STALE_ERROR = stale_error [
        frame scene texture texture_entry_at surface hit reflection brdf color light maps octahedral parameterisation atlas
        parallel_map shadow rectangle previous_transform transforms_previous mirror_share environment_share point_sums packed buffer_offsets receiver receiver_grid_at light_lists leaf_record_at leaf_range_at stale_maps_header_at
        stale_part_at occluder_box_at blockers
    ];
    DEBUG_LEAVES = debug_leaves [
        frame scene texture texture_entry_at surface hit buffer_offsets receiver receiver_grid_at packed
    ];
    DEBUG_LEVELS = debug_levels [frame packed];
    DEBUG_LIGHT_MAPS = debug_light_maps [
        frame scene texture texture_entry_at surface hit buffer_offsets receiver receiver_grid_at light_lists leaf_record_at
        leaf_range_at light_map packed
    ];
    DEBUG_LIGHTS = debug_lights [frame scene texture texture_entry_at surface hit light packed];
    DEBUG_ATLAS = debug_atlas [frame light maps atlas packed];
    TRACE_MIRRORS = trace_mirrors [
        frame scene texture texture_entry_at surface hit reflection brdf alpha_mask ray_stack ray_texels rays direction mirror_share mirror_image branch
        reflection_beyond
    ];
    ADD_MIRRORED = add_mirrored [
        frame scene texture texture_entry_at surface hit reflection brdf diffuse_material mirror_image reflection_beyond
    ];
    PUT_MIRRORS = put_mirrors [
        frame scene texture texture_entry_at surface hit reflection brdf packed mirror_share mirror_image branch
    ];
}

/// Name and WGSL of every module that can be put together, for whichever device: for compilers to be tried with.
pub fn shaders() -> BTreeSet<(&'static str, String)> {
    let of = |kernels: Kernels| ALL.iter().map(move |source| (source.name, source.concatenated(&kernels)));
    Kernels::ALL.into_iter().flat_map(of).collect()
}

/// Group 1 by itself.
pub(crate) const SCENE: Source = Source { name: "scene", text: "", uses: &["scene"] };

/// The shading of points on a device; `then`: where shadows on dynamic objects are looked up where these were.
pub(crate) fn shade_points(kernels: &Kernels, then: bool) -> &'static Source {
    let software = if then { &SHADE_POINTS_PREVIOUS_PERSISTENT } else { &SHADE_POINTS_PERSISTENT };
    kernels.tier.choose(shade_points_cooperative(then), software)
}

/// That in which lanes share points.
pub(crate) fn shade_points_cooperative(then: bool) -> &'static Source {
    if then { &SHADE_POINTS_PREVIOUS } else { &SHADE_POINTS }
}

/// The test of candidates on a device.
pub(crate) fn test_candidates(kernels: &Kernels) -> &'static Source {
    kernels.tier.choose(&TEST_CANDIDATES, &TEST_CANDIDATES_PERSISTENT)
}

/// Anti-aliasing on a device.
pub(crate) fn edges(kernels: &Kernels) -> &'static Source {
    kernels.tier.choose(&EDGES, &EDGES_RUNS)
}

/// The file of the library that kernels have.
fn variant(used: &'static str, kernels: &Kernels) -> &'static str {
    match used {
        "atlas" => kernels.tier.choose("atlas_texture", "atlas_image"),
        "lights" if kernels.lights_in_storage => "lights_storage",
        "lights" => "lights_uniform",
        "hit" => {
            if kernels.mirrored {
                "hit_mirror"
            } else {
                "hit_camera"
            }
        }
        "reflection_beyond" if kernels.reflects_environment => "reflected_environment",
        "reflection_beyond" => "no_reflected_environment",
        "branch" => kernels.tier.choose("branch_uniform", "branch_non_uniform"),
        "loads" => kernels.tier.choose("loads_unordered", "loads_batched"),
        "ray_stack" => kernels.tier.choose("ray_stack_array", "ray_stack_registers"),
        "ray_texels" => kernels.tier.choose("ray_texels_texture", "ray_texels_image"),
        "workgroups" => kernels.tier.choose("workgroups_one_each", "workgroups_persistent"),
        file => file,
    }
}

/// Such a file's text.
fn library(file: &str) -> Option<&'static str> {
    LIBRARY.iter().chain(SOFTWARE).find(|(name, _)| *name == file).map(|(_, text)| *text)
}

/// Whether there is such a file, record or choice.
#[cfg(test)]
pub(crate) fn exists(used: &'static str, kernels: &Kernels) -> bool {
    library(variant(used, kernels)).is_some()
        || RECORDS.iter().any(|r| used == format!("{}_at", r.snake) || used == format!("set_{}", r.snake))
}

impl Source {
    /// The whole text.
    pub fn concatenated(&self, kernels: &Kernels) -> String {
        let mut text = shader_constants::declarations();
        for record in &RECORDS {
            let reads = self.uses.contains(&format!("{}_at", record.snake).as_str());
            let writes = self.uses.contains(&format!("set_{}", record.snake).as_str());
            if reads || writes {
                text += &record.declaration();
            }
            if reads {
                text += &record.reader();
            }
            if writes {
                text += &record.writer();
            }
        }
        if kernels.mirrored && self.uses.contains(&"hit") && !self.uses.contains(&"direction") {
            text += library("direction").unwrap_or_default();
        }
        if kernels.reflects_environment && self.uses.contains(&"reflection_beyond") {
            text += library("environment_place").unwrap_or_default();
        }
        for used in self.uses {
            text += library(variant(used, kernels)).unwrap_or_default();
        }
        text + self.text
    }
}
