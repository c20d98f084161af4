//! Proof that needs no GPU: shaders parse and validate, both sides agree on every field, and a whole frame records
//! without complaint on a backend that does nothing.

use crate::layout::{
    BufferOffsets, CallersRay, CandidatesHeader, DispatchArguments, Display, DrawArguments, Frame,
    GpuMaterial, Light, LightMapUpdate, MapOccluders, MapPart, Maps, MultipassParams, PointQueueHeader,
    PreviousTransform, ShadeListHeader, TextureUse, TransferObject, Triangle, Vertex, VertexRange,
};
use crate::records::{
    Element, LeafRange, LeafRecord, Member, OccluderBox, ReceiverGrid, ShadePoint, StaleMapsHeader,
    StalePart, TextureEntry,
};
use crate::tier::{Kernels, Tier};
use crate::{
    DebugView, Mode, RenderSettings, Renderer, RendererOptions, Shading, ShadowMap, Viewport, shaders,
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
            debug, center, depth_scale, forward_depth, environment, sun_direction, sun_chord2,
            sun_radiance, sample_solid_angle, writes_radiance, mirror_solid_angle, ray_offset, columns, light_set,
            sample_area, polished_alpha, padding_b),
        fields!(BufferOffsets as "BufferOffsets": grids_at, cells_at, leaves, batches, ranges_at, chunks_at, sorted_at,
            points_at, light_maps, padding_a, padding_b, padding_c),
        fields!(MultipassParams as "MultipassParams": elements, lights_per_pass, lights_in_all, padding),
        fields!(Vertex as "Vertex": position, u1, normal, v1, tangent, uv0, color),
        fields!(Triangle as "Triangle": vertices, material),
        fields!(TextureUse as "TextureUse": matrix, shift, texture, uv_set),
        fields!(GpuMaterial as "Material": base_color, alpha, emission, alpha_cutoff, specular_color, specular,
            metallic, roughness, normal_scale, transmission, albedo, flags, base_color_texture, metallic_roughness_texture,
            specular_texture, specular_color_texture, normal_texture, emission_texture, transmission_texture),
        fields!(Light as "Light": position, profile, normal, scale, tangent, offset, intensity, atlas_slot, rectangle, lobe),
        fields!(Maps as "Maps": page, unit, padding, sizes),
        fields!(PreviousTransform as "PreviousTransform": x, y, z),
        fields!(TransferObject as "TransferObject": box_from_world_x, box_from_world_y, box_from_world_z, world_from_box_x,
            world_from_box_y, world_from_box_z, transfer_from_world_x, bands, transfer_from_world_y, channels,
            transfer_from_world_z, index, points, first_vertex, margin, vertices, mover, sides, clusters, bases),
        fields!(VertexRange as "VertexRange": first, count, padding_a, padding_b),
        fields!(LightMapUpdate as "LightMapUpdate": leaf, first, end, kind, units),
        fields!(MapOccluders as "Occluders": clusters, first_pair, slices),
        fields!(MapPart as "MapPart": position, parallel, x, first_listed, y, hidden, z, size, first, end, origin, page, texels),
        fields!(Display as "Display": size, exposure, automatic),
        fields!(CallersRay as "CallersRay": origin, t_max, direction, ignored),
        fields!(DispatchArguments as "DispatchArguments": scatter_points, shade_points, shade_points_cooperative,
            chunks),
        fields!(DrawArguments as "DrawArguments": vertex_count, instance_count, first_vertex, first_instance),
    ]
}

/// Heads of buffers that go on with words, and the name of these.
fn declared_heads() -> Vec<(&'static str, u32, Fields, &'static str)> {
    let head = |(name, size, fields): (_, _, _), rest| (name, size, fields, rest);
    vec![
        head(fields!(ShadeListHeader as "ShadeList": points, next_flat, next_curved, padding), "words"),
        head(fields!(PointQueueHeader as "PointQueue": points, chunks, next_chunk, finished), "words"),
        head(
            fields!(CandidatesHeader as "Candidates": flat_workgroups, flat_workgroups_y, flat_workgroups_z, flat_count,
                curved_workgroups, curved_workgroups_y, curved_workgroups_z, curved_count),
            "pixels",
        ),
    ]
}

/// Records among words: as the generated functions read them, fields lie side by side.
fn declared_records() -> Vec<(&'static str, u32, Fields)> {
    vec![
        fields!(ReceiverGrid as "RECEIVER_GRID": origin, columns, axis_u, rows, axis_v, front, back),
        fields!(LeafRecord as "LEAF_RECORD": light_map, texel_u, texel_v, corner, across, up, normal, mover),
        fields!(LeafRange as "LEAF_RANGE": mapped_unshadowed, unshadowed, near_unshadowed,
            near_shadowed, jointed, shadowed, mapped_shadowed, end),
        fields!(ShadePoint as "SHADE_POINT": pixel, leaf, rank),
        fields!(Element as "ELEMENT": members_at, member_count, lights_at, light_count, vertices, first_vertex),
        fields!(Member as "MEMBER": leaf, chunks_before),
        fields!(TextureEntry as "TEXTURE_ENTRY": offset, extent, levels, flags),
        fields!(StaleMapsHeader as "STALE_MAPS_HEADER": groups_at, groups, first_moving, clusters_at, triangles_at),
        fields!(StalePart as "STALE_PART": first_column, first_row, end_column, end_row,
            previous_row),
        fields!(OccluderBox as "OCCLUDER_BOX": center, half_extent),
    ]
}

fn parsed(source: &shaders::Source, kernels: &Kernels) -> naga::Module {
    let text = source.concatenated(kernels);
    let module = naga::front::wgsl::parse_str(&text)
        .unwrap_or_else(|e| panic!("{}: {}", source.name, e.emit_to_string(&text)));
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::all())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{}: {}", source.name, e.emit_to_string(&text)));
    module
}

/// Size, and name and offset of each member, of all structs in a shader.
fn reflected(module: &naga::Module) -> HashMap<String, (u32, Fields)> {
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
fn what_a_pass_uses_exists() {
    let unknown = |source: &shaders::Source| {
        source.uses.iter().copied().find(|used| !shaders::exists(used, &Kernels::ALL[0]))
    };
    for source in shaders::ALL {
        assert_eq!(unknown(source), None, "{}", source.name);
    }
    let uses: &[&str] = &["frame", "leaf_range_at", "leaf_rage_at"];
    assert_eq!(unknown(&shaders::Source { uses, ..shaders::RESOLVE }), Some("leaf_rage_at"), "the control");
}

#[test]
fn both_sides_agree_on_every_field() {
    let mut found: HashMap<String, Vec<(u32, Fields)>> = HashMap::new();
    for source in shaders::ALL {
        for kernels in Kernels::ALL {
            for (name, layout) in reflected(&parsed(source, &kernels)) {
                found.entry(name).or_default().push(layout);
            }
        }
    }
    let all = |name: &str| found.get(name).unwrap_or_else(|| panic!("no shader declares {name}"));
    for (name, size, fields) in declared() {
        for (span, members) in all(name) {
            assert_eq!((size, &fields), (*span, members), "{name}");
        }
    }
    for (name, size, mut fields, rest) in declared_heads() {
        fields.push((rest.into(), size));
        for (_, members) in all(name) {
            assert_eq!(&fields, members, "{name}");
        }
    }
    // The control: fields of equal size that change places are seen, though the size stays the same.
    let (_, size, mut swapped) = declared().remove(0);
    swapped.swap(18, 19);
    assert_eq!(size, found["Frame"][0].0);
    assert_ne!(swapped, found["Frame"][0].1);
}

/// The value of a constant that the shaders are given.
fn constant(module: &naga::Module, name: &str) -> Option<u32> {
    let (_, constant) = module.constants.iter().find(|(_, c)| c.name.as_deref() == Some(name))?;
    match module.global_expressions[constant.init] {
        naga::Expression::Literal(naga::Literal::U32(value)) => Some(value),
        _ => None,
    }
}

#[test]
fn records_are_read_where_they_are_written() {
    let modules: Vec<_> = shaders::ALL.iter().map(|s| parsed(s, &Kernels::ALL[0])).collect();
    let constant = |name: &str| modules.iter().find_map(|m| constant(m, name));
    for (name, size, fields) in declared_records() {
        assert_eq!(constant(&format!("{name}_WORDS")), Some(size / 4), "{name}");
        for (field, offset) in fields {
            let value = constant(&format!("{name}_{}", field.to_uppercase()));
            assert_eq!(value, Some(offset / 4), "{name}: {field}");
        }
    }
    // What the readers make of words: words 5 to 9 of a leaf's record are its second vector.
    let text = shaders::LIGHT_MAPS.concatenated(&Kernels::ALL[0]);
    let second = "bitcast<vec4f>(vec4u(light_lists[at + 5u], light_lists[at + 6u], light_lists[at + 7u], light_lists[at + 8u]))";
    assert!(text.contains(second), "{text}");
    assert_eq!(std::mem::offset_of!(LeafRecord, texel_v), 5 * 4);
}

/// Storage buffers and storage textures of each entry point, as pipelines count them: all that its module binds. The
/// defaults of WebGPU are 8 and 4. What a workgroup shares is 16384 bytes at most, each variable rounded up to 16: browsers count so, and
/// native devices do not ask.
#[test]
fn every_pass_stays_within_default_limits() {
    let counts = |source: &shaders::Source, kernels: &Kernels| {
        let module = parsed(source, kernels);
        let (mut buffers, mut textures, mut sampled) = (0, 0, 0);
        for (_, variable) in module.global_variables.iter() {
            match (variable.space, &module.types[variable.ty].inner) {
                (naga::AddressSpace::Storage { .. }, _) => buffers += 1,
                (_, naga::TypeInner::Image { class: naga::ImageClass::Storage { .. }, .. }) => textures += 1,
                (_, naga::TypeInner::Image { .. }) => sampled += 1,
                _ => {}
            }
        }
        (buffers, textures, sampled)
    };
    for kernels in Kernels::ALL {
        for source in shaders::ALL {
            let (buffers, textures, sampled) = counts(source, &kernels);
            // One is free for what is to come, unless lights are in storage.
            let most = if kernels.lights_in_storage { 8 } else { 7 };
            assert!(buffers <= most, "{}: {buffers} storage buffers", source.name);
            assert!(textures <= 4, "{}: {textures} storage textures", source.name);
            assert!(sampled <= 16, "{}: {sampled} textures", source.name);
            let shared = shared_bytes(&parsed(source, &kernels));
            assert!(shared <= 16384, "{}: workgroups share {shared} bytes", source.name);
        }
    }
    // The control: lights in storage are counted.
    let [with, without, ..] = Kernels::ALL.map(|kernels| counts(&shaders::SHADE_POINTS, &kernels).0);
    assert_eq!(without + 1, with);
    // And so is what is shared: set-ups of triangles, what was found, blocks with two masks each.
    let merge = shared_bytes(&parsed(&shaders::MERGE_LARGE_TRIANGLES, &Kernels::ALL[0]));
    assert_eq!(merge, 128 * 96 + 384 * 4 + 16 + 64 * 4 * 2 * 4 + 64 * 4 + 16);
}

/// What the workgroups of a module share.
fn shared_bytes(module: &naga::Module) -> u32 {
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).expect("layouts");
    let variables = module.global_variables.iter().map(|(_, variable)| variable);
    let shared = variables.filter(|variable| variable.space == naga::AddressSpace::WorkGroup);
    shared.map(|variable| layouter[variable.ty].size.next_multiple_of(16)).sum()
}

pub(crate) fn noop(features: wgpu::Features) -> (wgpu::Device, wgpu::Queue) {
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
    let visibility = VisibilityDatabase::build(&scene, &geometry, &lights, &VisibilitySettings::default());
    let visibility = std::sync::Arc::new(visibility.expect("a database"));
    let view = View::new(&scene, &scene.cameras[0], 1.5);
    let everything = crate::WANTED_FEATURES;
    for (features, shadow_map, tier) in [
        (wgpu::Features::empty(), ShadowMap::Octahedral, Tier::Gpu),
        (wgpu::Features::empty(), ShadowMap::Parabolic, Tier::Software),
        (everything, ShadowMap::Octahedral, Tier::Software),
        (everything, ShadowMap::Parabolic, Tier::Gpu),
        (everything, ShadowMap::Cube, Tier::Gpu),
    ] {
        let (device, queue) = noop(features);
        let error = first_error(&device, || {
            let options = RendererOptions { shadow_map, pcf: 2, tier: Some(tier), ..Default::default() };
            let mut renderer = Renderer::new(&device, &queue, options).expect("renderer");
            let mut viewport = Viewport::default();
            let settings = RenderSettings {
                mode: Mode::Naive,
                samples_per_axis: 2,
                lights_per_batch: Some(16),
                ..Default::default()
            };
            renderer.load(&scene, &geometry, &lights).expect("load");
            renderer.render(&mut viewport, &view, [96, 64], &settings).expect("render");
            renderer.load_visibility(&scene, &geometry, &lights, visibility.clone()).expect("visibility");
            for mode in [Mode::Visibility, Mode::LowResolution, Mode::Full] {
                for shading in [Shading::Fused, Shading::Multipass { lights_per_pass: 7 }] {
                    let settings = RenderSettings { mode, shading, ..settings };
                    renderer.render(&mut viewport, &view, [96, 64], &settings).expect("render");
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
                renderer.render(&mut viewport, &view, [96, 64], &settings).expect("render");
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
                renderer
                    .show(&viewport, &settings, &target.create_view(&Default::default()), format)
                    .expect("show");
            }
        });
        assert!(error.is_none(), "{shadow_map:?}: {error:?}");
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
