//! Small functions that stand in Rust and in WGSL under one name, compared on dense grids.

use crate::common::{Context, Test};
use girandole_core::glam::{Vec2, Vec3, Vec4};
use girandole_core::lights::{BoundingSphere, Clamp, LightSample, Profile, Rectangle, SampleOrigin};
use girandole_core::math::warp;
use girandole_core::scene::LightId;
use girandole_core::{brdf, math, tonemap};
use std::f32::consts::PI;
use wgpu::util::DeviceExt;

#[path = "../../src/shader_constants.rs"]
mod shader_constants;

pub fn tests() -> Vec<Test> {
    vec![
        ("mirror_octahedral", octahedral),
        ("mirror_brdf", specular),
        ("mirror_lobes", lobes),
        ("mirror_geometric_factor", geometric_factor),
        ("mirror_reflection", reflection),
        ("mirror_tone_curves", tone_curves),
        ("mirror_harmonics", harmonics),
        ("parameterisations_invert", parameterisations),
        ("packed_radiance_is_exact_to_18_bits", packed),
    ]
}

/// Runs `map(input) -> vec4f` of `source` over inputs.
fn run(context: &Context, source: &str, inputs: &[[Vec4; 2]], constants: &[(&str, f64)]) -> Vec<Vec4> {
    let device = &context.gpu.device;
    let text = format!(
        "{}{source}\n@group(0) @binding(0) var<storage, read> inputs: array<array<vec4f, 2>>;\n\
         @group(0) @binding(1) var<storage, read_write> outputs: array<vec4f>;\n\
         @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {{\n\
         if id.x < arrayLength(&inputs) {{ outputs[id.x] = map(inputs[id.x][0], inputs[id.x][1]); }} }}",
        shader_constants::declarations()
    );
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
        cache: None,
    });
    let floats: Vec<f32> = inputs.iter().flatten().flat_map(|v| v.to_array()).collect();
    let bytes: Vec<u8> = floats.iter().flat_map(|f| f.to_le_bytes()).collect();
    let input = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: &bytes,
        usage: wgpu::BufferUsages::STORAGE,
    });
    let size = inputs.len() as u64 * 16;
    let buffer = |usage| {
        device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    };
    let output = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let readable = buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: input.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: output.as_entire_binding() },
        ],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups((inputs.len() as u32).div_ceil(64), 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&output, 0, &readable, 0, size);
    context.gpu.queue.submit([encoder.finish()]);
    readable.map_async(wgpu::MapMode::Read, .., |result| result.expect("map"));
    context.gpu.wait().expect("the device");
    let view = readable.get_mapped_range(..).expect("mapped");
    let floats: Vec<f32> =
        view.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    floats.chunks_exact(4).map(Vec4::from_slice).collect()
}

/// Directions over the upper hemisphere, the seams of the octahedron among them.
fn directions() -> Vec<Vec3> {
    let n = 48;
    let mut all = Vec::new();
    for i in 0..=n {
        for j in 0..4 * n {
            let (z, phi) = (i as f32 / n as f32, j as f32 / (4 * n) as f32 * std::f32::consts::TAU);
            let r = (1.0 - z * z).max(0.0).sqrt();
            all.push(Vec3::new(r * phi.cos(), r * phi.sin(), z));
        }
    }
    all
}

fn largest_difference(a: &[Vec4], b: impl Iterator<Item = Vec4>) -> f32 {
    a.iter().zip(b).map(|(a, b)| (*a - b).abs().max_element()).fold(0.0, f32::max)
}

fn harmonics(context: &Context) {
    let bands = math::sh::MAX_BANDS;
    let directions =
        (0..64).map(|i| warp::sphere(Vec2::new((i as f32 + 0.5) / 64.0, (i as f32 * 0.618_034).fract())));
    let mut values = vec![0.0; math::sh::coefficient_count(bands)];
    let (mut inputs, mut expected) = (Vec::new(), Vec::new());
    for direction in directions {
        math::sh::basis(direction, bands, &mut values);
        let mut index = 0;
        for l in 0..bands as i32 {
            for m in -l..=l {
                inputs.push([direction.extend(l as f32), Vec4::splat(m as f32)]);
                expected.push(values[index]);
                index += 1;
            }
        }
    }
    let source = include_str!("../../shaders/lib/harmonics.wgsl").to_owned()
        + "fn map(a: vec4f, b: vec4f) -> vec4f { return vec4f(harmonic(a.xyz, u32(a.w), i32(b.x))); }";
    let found = run(context, &source, &inputs, &[]);
    let wrong = |found: &[Vec4], sign: f32| {
        let pairs = found.iter().zip(&expected);
        pairs.map(|(found, expected)| (found.x * sign - expected).abs()).fold(0.0, f32::max)
    };
    assert!(wrong(&found, 1.0) < 2e-5, "{}", wrong(&found, 1.0));
    assert!(wrong(&found, -1.0) > 0.1, "the control");
}

fn octahedral(context: &Context) {
    let directions = directions();
    let inputs: Vec<_> = directions.iter().map(|d| [d.extend(0.0), Vec4::ZERO]).collect();
    let library = include_str!("../../shaders/lib/octahedral.wgsl");
    let encoded = format!(
        "{library} fn map(a: vec4f, b: vec4f) -> vec4f {{ return vec4f(octahedral_encode(a.xyz / (abs(a.x) + abs(a.y) + a.z)), 0.0, 0.0); }}"
    );
    let gpu = run(context, &encoded, &inputs, &[]);
    let cpu = || directions.iter().map(|d| math::octahedral::encode(*d));
    assert!(largest_difference(&gpu, cpu().map(|uv| uv.extend(0.0).extend(0.0))) < 1e-6);
    let decoded = format!(
        "{library} fn map(a: vec4f, b: vec4f) -> vec4f {{ return vec4f(octahedral_decode(a.xy), 0.0); }}"
    );
    let inputs: Vec<_> = cpu().map(|uv| [uv.extend(0.0).extend(0.0), Vec4::ZERO]).collect();
    let gpu = run(context, &decoded, &inputs, &[]);
    let back = cpu().map(|uv| math::octahedral::decode(uv).extend(0.0));
    assert!(largest_difference(&gpu, back) < 1e-6);
    // The control: another texel's direction is not taken for the same.
    let shifted = cpu().map(|uv| math::octahedral::decode(uv + Vec2::splat(1.0 / 512.0)).extend(0.0));
    assert!(largest_difference(&gpu, shifted) > 1e-3);
}

/// What lobes are widened by, and what they weigh samples of an environment by.
fn lobes(context: &Context) {
    let reflected = Vec3::new(0.48, 0.6, 0.64);
    let mut inputs = Vec::new();
    let mut expected = Vec::new();
    for wi in directions().into_iter().step_by(5) {
        for (alpha, solid_angle) in [(0.002, 0.05), (0.1, 0.003), (0.7, 0.5)] {
            inputs.push([wi.extend(alpha), Vec4::splat(solid_angle)]);
            let weight = brdf::sample_weight(reflected, wi, alpha, solid_angle);
            let gain = brdf::widened_gain(wi.z, alpha, brdf::widened_alpha(alpha, solid_angle));
            let seen = brdf::footprint_alpha(alpha, [wi * solid_angle, Vec3::splat(0.1)]);
            // The largest weight is far above 1.
            let weight = weight * 0.25 * solid_angle;
            expected.push(Vec4::new(weight, gain, brdf::resolved_share(alpha, solid_angle), seen));
        }
    }
    let source = format!(
        "{} fn map(a: vec4f, b: vec4f) -> vec4f {{ let reflected = vec3f(0.48, 0.6, 0.64); \
         return vec4f(sample_weight(reflected, a.xyz, a.w, b.x) * 0.25 * b.x, \
         widened_gain(a.z, a.w, widened_alpha(a.w, b.x)), resolved_share(a.w, b.x), \
         footprint_alpha(a.w, a.xyz * b.x, vec3f(0.1))); }}",
        include_str!("../../shaders/lib/brdf.wgsl")
    );
    let found =
        |source: &str| largest_difference(&run(context, source, &inputs, &[]), expected.iter().copied());
    assert!(found(&source) < 1e-4, "{}", found(&source));
    // The control: other constants are seen.
    assert!(found(&source.replace("3.29", "3.0")) > 1e-3);
    assert!(found(&source.replace("1.0 / 16.0", "1.0 / 12.0")) > 1e-3);
}

fn specular(context: &Context) {
    let (f0, f90) = (Vec3::new(0.04, 0.5, 0.9), 1.0);
    let mut inputs = Vec::new();
    let mut expected = Vec::new();
    for wi in directions().into_iter().step_by(7) {
        for (wo, alpha) in [(Vec3::new(0.6, 0.0, 0.8), 0.09), (Vec3::new(0.0, -0.28, 0.96), 0.6)] {
            inputs.push([wi.extend(alpha), wo.extend(0.0)]);
            expected.push(brdf::specular_brdf(Vec3::Z, wo, wi, f0, f90, alpha).extend(0.0));
        }
    }
    let source = format!(
        "{} fn map(a: vec4f, b: vec4f) -> vec4f {{ return vec4f(specular_brdf(vec3f(0.0, 0.0, 1.0), b.xyz, a.xyz, \
         vec3f(0.04, 0.5, 0.9), 1.0, a.w), 0.0); }}",
        include_str!("../../shaders/lib/brdf.wgsl")
    );
    let relative = |source: &str| {
        run(context, source, &inputs, &[])
            .iter()
            .zip(&expected)
            .map(|(a, b)| (*a - *b).abs().max_element() / (1.0 + b.max_element()))
            .fold(0.0, f32::max)
    };
    assert!(relative(&source) < 1e-4, "{}", relative(&source));
    // The control: another Fresnel exponent is seen.
    assert!(relative(&source.replace("x * x * x * x * x", "x * x * x * x")) > 1e-3);
}

/// Points and normals about a light of each profile, on both sides of it: bounded, and near its rectangle, some of which the
/// receiver's plane cuts.
fn geometric_factor(context: &Context) {
    let (position, normal, bound) = (Vec3::new(0.5, 2.0, -0.25), Vec3::new(0.36, -0.48, 0.8), 0.3);
    let (tangent, bitangent) = warp::frame(normal);
    let rectangle = Rectangle {
        center: position + tangent * 0.1 - bitangent * 0.05,
        half_axes: [(tangent * 0.8 + bitangent * 0.6) * 0.4, (bitangent * 0.8 - tangent * 0.6) * 0.25],
        is_open: true,
    };
    let reach = rectangle.reach() + rectangle.center.distance(position);
    let spot = Profile::Spot { scale: 1.25, offset: -0.125 };
    let mut inputs = Vec::new();
    for distance in [0.05, 0.3, 0.9, 1.2, 2.7, 8.1] {
        for d in directions().into_iter().step_by(3) {
            for sign in [1.0, -1.0] {
                let point = position + d * (distance * sign);
                let facing = directions()[inputs.len() * 7 % 9000];
                inputs.push([point.extend(0.0), facing.extend(0.0)]);
            }
        }
    }
    let distant = Profile::Distant {
        distance: 3.0,
        shown: BoundingSphere { center: Vec3::ZERO, radius: 1.0, core: 1.0 },
        solid_angle: 0.1,
    };
    let lobe = Profile::Lobe { axis: Vec3::new(0.9, -0.3, 0.8), matt: 0.2 };
    let profiles = [Profile::Cosine, Profile::Hemisphere, spot, Profile::Directional, distant, lobe];
    // With a rectangle that is open and not.
    let kinds = [(Clamp::At(bound), true), (Clamp::Own, true), (Clamp::Own, false)];
    let cases = profiles.into_iter().enumerate().flat_map(|p| kinds.map(|kind| (p, kind)));
    for ((index, profile), (clamp, is_open)) in cases {
        let origin = SampleOrigin::Punctual { light: LightId(0) };
        let sample = LightSample {
            position,
            normal,
            intensity: Vec3::ONE,
            profile,
            origin,
            rectangle: matches!(profile, Profile::Cosine | Profile::Lobe { .. })
                .then_some(Rectangle { is_open, ..rectangle }),
        };
        let (scale, offset) = match profile {
            Profile::Spot { scale, offset } => (scale, offset),
            Profile::Cosine | Profile::Lobe { .. } => {
                (0.25 / 0.4 * if is_open { 1.0 } else { -1.0 }, reach * reach)
            }
            _ => (0.0, 0.0),
        };
        let expected = inputs.iter().map(|[p, n]| {
            let n = n.truncate();
            sample.geometric_factor(p.truncate(), n, n, clamp).map_or(0.0, |(g, _)| g)
        });
        let solid_angle = |p: Vec4| if clamp == Clamp::Own { sample.solid_angle(p.truncate()) } else { 0.0 };
        let seen_as = match profile {
            Profile::Distant { .. } => "vec4f(0.1, 0.0, 0.0, 0.0)",
            _ => "vec4f(0.1, -0.05, 0.32, 0.24)",
        };
        let frame_clamp = if clamp == Clamp::Own { 0.0 } else { bound };
        // Lobes are cosines with an axis.
        let index = if index == 5 { 0 } else { index };
        let (axis, matt) = profile.lobe().unwrap_or((Vec3::ZERO, 1.0));
        let vector = |v: Vec3| format!("vec3f({:?}, {:?}, {:?})", v.x, v.y, v.z);
        let source = format!(
            "struct Bound {{ clamp: f32 }} const frame = Bound({frame_clamp:?}); const PI = {PI:?}; {} {} \
             fn map(a: vec4f, b: vec4f) -> vec4f {{ \
             var light: Light; light.position = {}; light.profile = {index}u; light.normal = {}; light.tangent = {}; \
             light.scale = {scale:?}; light.offset = {offset:?}; light.rectangle = {seen_as}; \
             light.lobe = vec4f({}, {matt:?}); \
             var to_light = light.position - a.xyz; if light.profile >= DIRECTIONAL {{ to_light = -light.normal; }} \
             let cosines = vec2f(dot(b.xyz, to_light), -dot(light.normal, to_light)); \
             let r2 = dot(to_light, to_light); \
             let is_before = cosines.x > 0.0; \
             let sent = sent_along(light, to_light, cosines.y, r2); \
             var g = select(0.0, geometric_factor(light, cosines.x, sent, r2), is_before); \
             if is_near(light, r2) && (is_before || is_open(light)) {{ let mean = rectangle_mean(light, a.xyz, b.xyz); \
             let of_place = to_light * select(0.0, sent / (r2 * r2), is_before); \
             g = max(dot(mix(mean.vector, of_place, mean.point_share), b.xyz), 0.0); }} \
             return vec4f(select(0.0, g, cosines.y > 0.0), solid_angle_of(light, a.xyz), 0.0, 0.0); }}",
            include_str!("../../shaders/lib/light.wgsl"),
            include_str!("../../shaders/lib/rectangle.wgsl"),
            vector(position),
            vector(normal),
            vector(tangent),
            vector(axis),
        )
        .replace("override HAS_LOBES: bool = false", "const HAS_LOBES = true");
        let difference = |source: &str| {
            let found = run(context, source, &inputs, &[]);
            let relative =
                found.iter().zip(expected.clone()).map(|(found, g)| (found.x - g).abs() / (1.0 + g));
            relative.fold(0.0, f32::max)
        };
        assert!(difference(&source) < 3e-5, "{profile:?} {clamp:?}: {}", difference(&source));
        for (found, [p, _]) in run(context, &source, &inputs, &[]).iter().zip(&inputs) {
            let wanted = solid_angle(*p);
            assert!(
                (found.y - wanted).abs() <= 1e-4 * wanted.max(1e-3),
                "{profile:?}: {} for {wanted}",
                found.y
            );
        }
        assert!(expected.clone().filter(|g| *g > 0.0).count() * 8 > inputs.len(), "{profile:?}: mostly dark");
        // The controls: a fall-off that is not squared, no bound, the point instead of the rectangle, no lobe.
        let wrong = source
            .replace("falloff *= falloff;", "")
            .replace(", bound)", ", 1e30)")
            .replace("if is_near(light, r2)", "if false")
            .replace("along2 * along2", "0.0");
        let differs = match profile {
            Profile::Directional | Profile::Distant { .. } => false,
            Profile::Hemisphere => clamp != Clamp::Own,
            Profile::Cosine | Profile::Lobe { .. } | Profile::Spot { .. } => true,
        };
        assert!(!differs || difference(&wrong) > 1e-3, "{profile:?} {clamp:?}");
        // One edge of the rectangle that is not cut.
        let uncut = source.replacen("add_clipped_edge(&sums, c - u - v", "add_edge(&sums, c - u - v", 1);
        let uncut = uncut.replacen("c + u - v, normal)", "c + u - v)", 1);
        // A light whose place counts behind the receiver, too.
        let everywhere = source.replace("sent / (r2 * r2), is_before)", "sent / (r2 * r2), true)");
        assert!(everywhere != source);
        let with_part_behind = source.replace("&& (is_before || is_open(light))", "");
        assert!(with_part_behind != source);
        let controls = if is_open { vec![uncut, everywhere] } else { vec![uncut, with_part_behind] };
        for wrong in controls {
            assert!(sample.rectangle.is_none() || clamp != Clamp::Own || difference(&wrong) > 1e-3);
        }
    }
}

fn reflection(context: &Context) {
    let mut inputs = Vec::new();
    let steps = [0.0, 0.3, 0.5, 0.9, 1.0];
    for metallic in steps {
        for roughness in [0.0, 0.04, 0.3, 0.7, 1.0] {
            for specular in steps {
                for tint in [0.0, 0.4, 1.0, 30.0] {
                    for base in [Vec3::new(0.8, 0.3, 0.0), Vec3::ONE] {
                        inputs
                            .push([base.extend(metallic), Vec4::new(roughness, specular, tint, 0.5 * tint)]);
                    }
                }
            }
        }
    }
    let surfaces: Vec<_> = inputs
        .iter()
        .map(|[a, b]| {
            let tint = Vec3::new(b.z, b.w, 1.0);
            brdf::Surface::from_metallic_roughness(a.truncate(), a.w, b.x, b.y, tint)
        })
        .collect();
    // What has no texture: the structs of the scene without its bindings, and samples of 1.
    let (structs, _) = include_str!("../../shaders/lib/scene.wgsl").split_once("@group").expect("bindings");
    let source = |result: &str| {
        format!(
            "{structs} struct Hit {{ unused: u32 }} const HAS_TEXTURES = true; \
             fn sample_at(use_: TextureUse, hit: Hit) -> vec4f {{ return vec4f(1.0); }} \
             fn vertex_tint(hit: Hit, m: Material, flags: u32) -> vec3f {{ return vec3f(1.0); }} {} \
             fn map(a: vec4f, b: vec4f) -> vec4f {{ var m: Material; m.base_color = a.xyz; m.metallic = a.w; \
             m.roughness = b.x; m.specular = b.y; m.specular_color = vec3f(b.z, b.w, 1.0); \
             let r = reflection(Hit(), m); return {result}; }}",
            include_str!("../../shaders/lib/reflection.wgsl")
        )
    };
    let difference = |source: &str, expected: fn(&brdf::Surface) -> Vec4| {
        largest_difference(&run(context, source, &inputs, &[]), surfaces.iter().map(expected))
    };
    let albedo = source("vec4f(r.albedo, r.f90)");
    assert!(difference(&albedo, |s| s.albedo.extend(s.f90)) < 1e-6);
    assert!(difference(&source("vec4f(r.f0, r.alpha)"), |s| s.f0.extend(s.alpha)) < 1e-6);
    // The control: another mean of Fresnel's factor is seen.
    assert!(difference(&albedo.replace("0.00367", "0.0057"), |s| s.albedo.extend(s.f90)) > 1e-3);
}

fn tone_curves(context: &Context) {
    let colors: Vec<Vec3> = (0..4000)
        .map(|i| {
            let y = 2f32.powf(i as f32 / 200.0 - 14.0);
            Vec3::new(y, y * (0.1 + (i % 7) as f32 * 0.15), y * (0.05 + (i % 11) as f32 * 0.09))
        })
        .collect();
    let inputs: Vec<_> = colors.iter().map(|c| [c.extend(0.0), Vec4::ZERO]).collect();
    let library = include_str!("../../shaders/lib/tonemap.wgsl");
    let curves = [tonemap::Tonemap::Agx, tonemap::Tonemap::Aces, tonemap::Tonemap::None];
    let difference = |index: usize, curve: tonemap::Tonemap| {
        let source = format!(
            "{library} fn map(a: vec4f, b: vec4f) -> vec4f {{ let c = tone_curve(a.xyz); \
             return vec4f(srgb_encode(c.x), srgb_encode(c.y), srgb_encode(c.z), 0.0); }}"
        );
        let shown = colors
            .iter()
            .map(|c| Vec3::from_array(curve.apply(*c).to_array().map(tonemap::srgb_encode)).extend(0.0));
        largest_difference(&run(context, &source, &inputs, &[("CURVE", index as f64)]), shown)
    };
    for (index, curve) in curves.into_iter().enumerate() {
        // Half a step of an 8-bit display.
        assert!(difference(index, curve) < 0.5 / 255.0, "{curve:?}: {}", difference(index, curve));
    }
    assert!(difference(0, curves[1]) > 0.02, "the control: two curves are told apart");
}

fn packed(context: &Context) {
    let mut colors = vec![Vec3::ZERO, Vec3::splat(f32::INFINITY), Vec3::new(-1.0, f32::NAN, 2.0)];
    colors.extend((0..6000).map(|i| {
        let y = 2f32.powf(i as f32 / 26.0 - 105.0);
        y * Vec3::new(1.0, (i % 13) as f32 / 12.0, 1.0 / (1 + i % 600) as f32)
    }));
    // All bits of the mantissa: what rounds up to the next power of two.
    colors.extend((0..64).map(|i| Vec3::new(f32::from_bits(0x3fff_ffff - i), 1.0, 0.0)));
    let inputs: Vec<_> = colors.iter().map(|c| [c.extend(0.0), Vec4::ZERO]).collect();
    let library = include_str!("../../shaders/lib/packed.wgsl");
    let error = |library: &str| {
        let source = format!(
            "{library} fn map(a: vec4f, b: vec4f) -> vec4f {{ return vec4f(unpack_radiance(pack_radiance(a.xyz).xy), 0.0); }}"
        );
        let back = run(context, &source, &inputs, &[]);
        assert_eq!(back[0], Vec4::ZERO);
        assert!(back[1].x > 2.9e38 && back[1].is_finite(), "{}", back[1]);
        assert!(back[2].x == 0.0 && (back[2].z - 2.0).abs() < 1e-5 && !back[2].is_nan(), "{}", back[2]);
        let errors = colors.iter().zip(&back).skip(3);
        errors.map(|(c, b)| (b.truncate() - *c).abs().max_element() / c.max_element()).fold(0.0, f32::max)
    };
    assert!(error(library) <= 2f32.powi(-18), "{}", error(library));
    // The control: what truncates instead of rounding errs more.
    let truncating = library.replace(" + 0.5), vec3u(0x3ffffu)", "), vec3u(0x3ffffu)");
    assert!(error(&truncating) > 2f32.powi(-18), "{}", error(&truncating));
}

/// `decode(encode(p)) · norm(p) = p` for all three.
fn parameterisations(context: &Context) {
    let inputs: Vec<_> = directions().iter().map(|d| [(*d * 3.0).extend(0.0), Vec4::ZERO]).collect();
    let source = |shift: f32| {
        format!(
            "{} {} fn map(a: vec4f, b: vec4f) -> vec4f {{ let uv = encode(a.xyz / norm(a.xyz)) + {shift:?}; \
             return vec4f(decode(uv) * norm(a.xyz), f32(is_mapped(uv))); }}",
            include_str!("../../shaders/lib/octahedral.wgsl"),
            include_str!("../../shaders/lib/parameterisation.wgsl")
        )
    };
    for kind in 0..3 {
        let constants = [("PARAMETERISATION", f64::from(kind))];
        let error = |shift: f32| {
            run(context, &source(shift), &inputs, &constants)
                .iter()
                .zip(&inputs)
                .map(|(out, [p, _])| (out.truncate() - p.truncate()).length())
                .fold(0.0, f32::max)
        };
        assert!(error(0.0) < 1e-3, "{kind}: {}", error(0.0));
        assert!(error(0.01) > 0.01, "the control: a shift is seen");
    }
}
