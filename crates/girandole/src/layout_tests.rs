//! Proof that needs no GPU: shaders parse and validate, both sides agree on every field, and a whole frame records
//! without complaint on a backend that does nothing.

use crate::layout::{
    BufferOffsets, DIRECTIONAL, Display, Frame, GpuMaterial, Item, Light, Maps, MultipassParams, TextureUse,
    Triangle, Vertex,
};
use crate::passes::{BATCH, GROUP};
use crate::{
    DebugView, Mode, RenderSettings, Renderer, RendererOptions, Shading, ShadowMap, elements, point_lists,
    receivers, shaders, surface_ids,
};
use girandole_core::lights::{LightSet, LightSettings};
use girandole_core::scene::builtin::{self, MovingObject};
use girandole_core::scene::{Geometry, Material, Texture, TextureRef, View};
use girandole_core::visibility::{VisibilityDatabase, VisibilitySettings};
use std::collections::HashMap;
use std::mem::offset_of;

type Fields = Vec<(String, u32)>;

macro_rules! fields {
    ($type:ty as $name:literal: $($field:ident),* $(,)?) => {
        (
            $name,
            size_of::<$type>() as u32,
            vec![$((stringify!($field).to_string(), offset_of!($type, $field) as u32)),*],
        )
    };
}

fn declared() -> Vec<(&'static str, u32, Fields)> {
    vec![
        fields!(Frame as "Frame": eye, orthographic, right, half_width, up, half_height, forward, depth_bias, size, band,
            offset, first_light, end_light, clamp, far, sample, samples, last_row, step, batch, last_batch, tolerance,
            debug, center, depth_scale, forward_depth, padding),
        fields!(BufferOffsets as "BufferOffsets": grids_at, cells_at, leaves, batches, ranges_at, chunks_at, sorted_at, points_at,
            light_maps, padding_a, padding_b, padding_c),
        fields!(MultipassParams as "MultipassParams": elements, lights_per_pass, lights_in_all, padding),
        fields!(Vertex as "Vertex": position, u1, normal, v1, tangent, uv0, padding),
        fields!(Triangle as "Triangle": vertices, material),
        fields!(TextureUse as "TextureUse": matrix, shift, texture, uv_set),
        fields!(GpuMaterial as "Material": base_color, alpha, emission, alpha_cutoff, specular_color, specular,
            metallic, roughness, normal_scale, double_sided, albedo, padding, base_color_texture, metallic_roughness_texture,
            specular_texture, specular_color_texture, normal_texture, emission_texture),
        fields!(Light as "Light": position, profile, normal, scale, tangent, offset, intensity, atlas_slot),
        fields!(Maps as "Maps": page, size, parallel_size, texel, parallel_texel),
        fields!(Item as "Item": light, face_cluster),
        fields!(Display as "Display": size, exposure, automatic),
    ]
}

/// Size, and name and offset of each member, of all structs in a shader.
fn reflected(source: &shaders::Source) -> HashMap<String, (u32, Fields)> {
    let text = source.concatenated(&crate::DeviceTuning {
        persistent_threads: true,
        copy_maps: true,
        non_uniform_branches: true,
        edge_runs: true,
        cooperative_points: true,
        lights_in_storage: false,
    });
    let module = naga::front::wgsl::parse_str(&text)
        .unwrap_or_else(|e| panic!("{}: {}", source.name, e.emit_to_string(&text)));
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::all())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{}: {}", source.name, e.emit_to_string(&text)));
    module
        .types
        .iter()
        .filter_map(|(_, ty)| match (&ty.name, &ty.inner) {
            (Some(name), naga::TypeInner::Struct { members, span }) => {
                let fields = members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset)).collect();
                Some((name.clone(), (*span, fields)))
            }
            _ => None,
        })
        .collect()
}

#[test]
fn both_sides_agree_on_every_field() {
    let mut found = HashMap::new();
    for source in shaders::ALL {
        found.extend(reflected(source));
    }
    for (name, size, fields) in declared() {
        let (span, members) = found.get(name).unwrap_or_else(|| panic!("no shader declares {name}"));
        assert_eq!((size, &fields), (*span, members), "{name}");
    }
    // The control: fields of equal size that change places are seen, though the size stays the same.
    let (_, size, mut swapped) = declared().remove(0);
    swapped.swap(18, 19);
    assert_eq!(size, found["Frame"].0);
    assert_ne!(swapped, found["Frame"].1);
}

/// Numbers that shaders need at compile time, where an `override` will not do.
#[test]
fn both_sides_agree_on_constants() {
    let has = |source: &shaders::Source, declaration: String| {
        source
            .concatenated(&crate::DeviceTuning {
                persistent_threads: true,
                copy_maps: true,
                non_uniform_branches: true,
                edge_runs: true,
                cooperative_points: true,
                lights_in_storage: false,
            })
            .contains(&declaration)
    };
    let group = |n: u32| format!("const GROUP = {n}u;");
    assert!(has(&shaders::SHADE_NAIVE, group(GROUP)));
    assert!(has(&shaders::SHADE_NAIVE, format!("lights: array<Light, {BATCH}>;")));
    assert!(has(&shaders::SHADE_NAIVE, format!("const DIRECTIONAL = {DIRECTIONAL}u;")));
    assert!(has(&shaders::RESOLVE, format!("const MIN_ALPHA = {:?};", girandole_core::brdf::MIN_ALPHA)));
    assert_eq!(BATCH % GROUP, 0);
    let number = |source, name: &str, n: u32| {
        assert!(has(source, format!("const {name} = {n}u;")), "{name} = {n}");
        assert!(!has(source, format!("const {name} = {}u;", n + 1)), "the control: {name}");
    };
    number(&shaders::SHADE_POINTS, "SIDE", receivers::SIDE);
    number(&shaders::SHADE_POINTS, "LEAF_WORDS", receivers::LEAF_WORDS as u32);
    number(&shaders::SHADE_POINTS, "RANGE", receivers::RANGE as u32);
    number(&shaders::SHADE_POINTS, "CHUNK", point_lists::CHUNK);
    number(&shaders::PREFIX_SUM, "COUNTS", point_lists::HEADER);
    number(&shaders::PREFIX_SUM, "FIRSTS", point_lists::HEADER);
    number(&shaders::PREFIX_SUM, "EXTRA_ROW", point_lists::TALLY_ROWS - 1);
    number(&shaders::TEST_CANDIDATES, "POINT_WORDS", point_lists::POINT_WORDS);
    number(&shaders::REFINE, "CURVED_HEADER", point_lists::CURVED_HEADER);
    number(&shaders::REFINE, "FIRST_CANDIDATE", point_lists::FIRST_CANDIDATE);
    let flag =
        |source, name: &str, n: u32| assert!(has(source, format!("const {name} = {n:#x}u;")), "{name}");
    flag(&shaders::REFINE, "CURVED", surface_ids::CURVED);
    flag(&shaders::REFINE, "SHINY", surface_ids::SHINY);
    flag(&shaders::TEST_CANDIDATES, "CLUSTERED", receivers::CLUSTERED);
    flag(&shaders::SHADE_POINTS, "NO_MAP", girandole_core::scene::NONE);
    assert!(has(&shaders::PREFIX_SUM, "(CHUNK * next + 3u) / 4u".into()), "64 lanes are 4 points");
    number(&shaders::DEBUG_LIGHTS, "ROW", crate::layout::LIGHT_MARKER_ROW);
    number(&shaders::SHADE_POINTS, "LANES", 16);
    number(&shaders::SHADE_POINTS, "WIDE_GROUPS", 32768);
    assert!(has(&shaders::PREFIX_SUM, "min(groups, 32768u)".into()));
    assert!(has(&shaders::LIGHT_MAPS, format!("group.y * {}u", crate::layout::LIGHT_MAP_GROUPS)));
    number(&shaders::MULTIPASS, "ELEMENT_WORDS", elements::ELEMENT_WORDS as u32);
    assert!(!has(&shaders::SHADE_NAIVE, group(GROUP + 1)), "the control: another number is seen");
}

fn noop(features: wgpu::Features) -> (wgpu::Device, wgpu::Queue) {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::NOOP;
    // Its offset alignment is 1, which the check of indirect calls does not know.
    descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    descriptor.backend_options.noop.enable = true;
    let instance = wgpu::Instance::new(descriptor);
    pollster::block_on(async {
        let adapter = instance.request_adapter(&Default::default()).await.expect("a no-op adapter");
        let wanted = wgpu::DeviceDescriptor { required_features: features, ..Default::default() };
        adapter.request_device(&wanted).await.expect("a no-op device")
    })
}

/// The first validation error of whatever `work` does.
fn first_error(device: &wgpu::Device, work: impl FnOnce()) -> Option<wgpu::Error> {
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    work();
    pollster::block_on(scope.pop())
}

#[test]
fn a_whole_frame_records_without_error() {
    let mut scene = builtin::build("table", MovingObject::Torus).expect("table");
    // One masked and one textured material, so that every pipeline has something to draw.
    scene.textures.push(Texture {
        name: "checker".into(),
        width: 2,
        height: 2,
        texels: vec![[255; 4], [0; 4], [0; 4], [255; 4]],
        color_space: girandole_core::scene::ColorSpace::Srgb,
        wrap: Default::default(),
        filter: Default::default(),
    });
    let last = scene.materials.len() - 1;
    scene.materials[last] = Material {
        base_color_texture: Some(TextureRef::new(0)),
        alpha_cutoff: Some(0.5),
        ..scene.materials[last].clone()
    };
    let geometry = Geometry::new(&scene);
    let settings = LightSettings { count: 40, ..Default::default() };
    let lights = LightSet::sample(&scene, &geometry, &settings).expect("lights");
    let visibility = VisibilityDatabase::build(&scene, &geometry, &lights, &VisibilitySettings::default())
        .expect("visibility");
    let view = View::new(&scene, &scene.cameras[0], 1.5);
    let everything = crate::WANTED_FEATURES;
    for features in [wgpu::Features::empty(), everything] {
        for shadow_map in [ShadowMap::Octahedral, ShadowMap::Parabolic, ShadowMap::Cube] {
            let (device, queue) = noop(features);
            let error = first_error(&device, || {
                let options = RendererOptions { shadow_map, pcf: 2, ..Default::default() };
                let mut renderer = Renderer::new(&device, &queue, options).expect("renderer");
                let settings = RenderSettings {
                    mode: Mode::Naive,
                    samples_per_axis: 2,
                    lights_per_batch: Some(16),
                    ..Default::default()
                };
                renderer.load(&scene, &geometry, &lights).expect("load");
                renderer.render(&view, [96, 64], &settings).expect("render");
                renderer.load_visibility(&scene, &geometry, &lights, &visibility).expect("visibility");
                for mode in [Mode::Visibility, Mode::LowResolution, Mode::Full] {
                    for shading in [Shading::Fused, Shading::Multipass { lights_per_pass: 7 }] {
                        let settings = RenderSettings { mode, shading, ..settings };
                        renderer.render(&view, [96, 64], &settings).expect("render");
                    }
                }
                for debug in [
                    DebugView::Receivers,
                    DebugView::States(None),
                    DebugView::States(Some(0)),
                    DebugView::LightMaps,
                    DebugView::Levels,
                    DebugView::LightPositions,
                    DebugView::Atlas,
                ] {
                    let settings = RenderSettings { mode: Mode::Full, debug: Some(debug), ..settings };
                    renderer.render(&view, [96, 64], &settings).expect("render");
                }
                for format in [
                    wgpu::TextureFormat::Rgba8UnormSrgb,
                    wgpu::TextureFormat::Bgra8Unorm,
                    wgpu::TextureFormat::Rgba16Float,
                ] {
                    let target = device.create_texture(&wgpu::TextureDescriptor {
                        label: None,
                        size: wgpu::Extent3d { width: 96, height: 64, depth_or_array_layers: 1 },
                        mip_level_count: 1,
                        sample_count: 1,
                        dimension: wgpu::TextureDimension::D2,
                        format,
                        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                        view_formats: &[],
                    });
                    renderer.show(&settings, &target.create_view(&Default::default()), format).expect("show");
                }
            });
            assert!(error.is_none(), "{shadow_map:?}: {error:?}");
        }
    }
    // The control: an error is reported as one.
    let (device, _) = noop(wgpu::Features::empty());
    let wrong = || {
        let _ = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl("fn broken( {".into()),
        });
    };
    assert!(first_error(&device, wrong).is_some());
}
