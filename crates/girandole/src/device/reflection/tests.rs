//! What the text says is what a compiler says.

use super::Reflection;
use crate::shaders;
use crate::tier::Kernels;

/// What naga says of a module.
struct Compiled {
    ir: naga::Module,
    info: naga::valid::ModuleInfo,
}

type Bindings = Vec<(String, wgpu::BindGroupLayoutEntry)>;

impl Compiled {
    fn of(text: &str) -> Self {
        let ir = naga::front::wgsl::parse_str(text).expect("it compiles");
        let flags = naga::valid::ValidationFlags::all();
        let info = naga::valid::Validator::new(flags, naga::valid::Capabilities::all()).validate(&ir);
        Self { info: info.expect("it is valid"), ir }
    }

    fn bindings(&self, group: u32, entries: &[&str]) -> Bindings {
        let mut found = Vec::new();
        for (handle, global) in self.ir.global_variables.iter() {
            let Some(binding) = global.binding.filter(|b| b.group == group) else { continue };
            let mut visibility = wgpu::ShaderStages::empty();
            for (index, entry) in self.ir.entry_points.iter().enumerate() {
                let uses = !self.info.get_entry_point(index)[handle].is_empty();
                if uses && entries.contains(&entry.name.as_str()) {
                    visibility |= stage(entry.stage);
                }
            }
            if !visibility.is_empty() {
                let ty = binding_type(&self.ir, global).expect("we bind such things");
                let entry =
                    wgpu::BindGroupLayoutEntry { binding: binding.binding, visibility, ty, count: None };
                found.push((global.name.clone().unwrap_or_default(), entry));
            }
        }
        sorted(found)
    }
}

fn stage(stage: naga::ShaderStage) -> wgpu::ShaderStages {
    match stage {
        naga::ShaderStage::Vertex => wgpu::ShaderStages::VERTEX,
        naga::ShaderStage::Fragment => wgpu::ShaderStages::FRAGMENT,
        _ => wgpu::ShaderStages::COMPUTE,
    }
}

/// What the layout says of a global variable; nothing for what no shader of ours binds.
fn binding_type(ir: &naga::Module, global: &naga::GlobalVariable) -> Option<wgpu::BindingType> {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    match global.space {
        naga::AddressSpace::Uniform => Some(buffer(wgpu::BufferBindingType::Uniform)),
        naga::AddressSpace::Storage { access } => Some(buffer(wgpu::BufferBindingType::Storage {
            read_only: !access.contains(naga::StorageAccess::STORE),
        })),
        naga::AddressSpace::Handle => match ir.types[global.ty].inner {
            naga::TypeInner::Image { dim: naga::ImageDimension::D2, arrayed, class } => {
                let view_dimension = if arrayed {
                    wgpu::TextureViewDimension::D2Array
                } else {
                    wgpu::TextureViewDimension::D2
                };
                image_type(class, view_dimension)
            }
            _ => None,
        },
        _ => None,
    }
}

fn image_type(
    class: naga::ImageClass,
    view_dimension: wgpu::TextureViewDimension,
) -> Option<wgpu::BindingType> {
    let sampled = |sample_type, multisampled| {
        Some(wgpu::BindingType::Texture { sample_type, view_dimension, multisampled })
    };
    match class {
        naga::ImageClass::Sampled { kind: naga::ScalarKind::Uint, multi } => {
            sampled(wgpu::TextureSampleType::Uint, multi)
        }
        naga::ImageClass::Sampled { kind: naga::ScalarKind::Float, multi } => {
            sampled(wgpu::TextureSampleType::Float { filterable: false }, multi)
        }
        naga::ImageClass::Depth { multi } => sampled(wgpu::TextureSampleType::Depth, multi),
        naga::ImageClass::Storage { format, access } => Some(wgpu::BindingType::StorageTexture {
            access: if access.contains(naga::StorageAccess::LOAD | naga::StorageAccess::STORE) {
                wgpu::StorageTextureAccess::ReadWrite
            } else if access.contains(naga::StorageAccess::STORE) {
                wgpu::StorageTextureAccess::WriteOnly
            } else {
                wgpu::StorageTextureAccess::ReadOnly
            },
            format: match format {
                naga::StorageFormat::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
                naga::StorageFormat::R32Uint => wgpu::TextureFormat::R32Uint,
                naga::StorageFormat::Rg32Uint => wgpu::TextureFormat::Rg32Uint,
                naga::StorageFormat::Rgba32Uint => wgpu::TextureFormat::Rgba32Uint,
                naga::StorageFormat::R32Float => wgpu::TextureFormat::R32Float,
                _ => return None,
            },
            view_dimension,
        }),
        _ => None,
    }
}

fn sorted(mut bindings: Bindings) -> Bindings {
    bindings.sort_unstable_by_key(|(_, entry)| entry.binding);
    bindings
}

/// The entry points and which groups they may use.
fn agree(text: &str) -> Result<usize, String> {
    let (compiled, reflection) = (Compiled::of(text), Reflection::of(text));
    let entries: Vec<&str> = compiled.ir.entry_points.iter().map(|entry| entry.name.as_str()).collect();
    let alone = entries.iter().map(|entry| vec![*entry]);
    for entries in alone.chain([entries.clone()]) {
        for group in 0..3 {
            let expected = compiled.bindings(group, &entries);
            let found = sorted(reflection.bindings(group, &entries));
            if found != expected {
                return Err(format!("{entries:?}, group {group}: {found:?}, not {expected:?}"));
            }
        }
    }
    Ok(entries.len())
}

#[test]
fn all_that_modules_bind_is_what_their_compiler_says() {
    for kernels in Kernels::ALL {
        for source in shaders::ALL {
            let entries =
                agree(&source.concatenated(&kernels)).unwrap_or_else(|e| panic!("{}: {e}", source.name));
            assert!(entries > 0, "{}", source.name);
        }
        let scene = shaders::SCENE.concatenated(&kernels);
        let all = wgpu::ShaderStages::all();
        let compiled = Compiled::of(&scene);
        let global = |(_, global): (_, &naga::GlobalVariable)| {
            let binding = global.binding.filter(|b| b.group == 1)?.binding;
            let ty = binding_type(&compiled.ir, global)?;
            let entry = wgpu::BindGroupLayoutEntry { binding, visibility: all, ty, count: None };
            Some((global.name.clone()?, entry))
        };
        let expected = sorted(compiled.ir.global_variables.iter().filter_map(global).collect());
        assert!(expected.len() > 3 && sorted(Reflection::of(&scene).group(1, all)) == expected);
    }
}

#[test]
fn names_in_comments_members_and_what_is_not_called_are_no_uses() {
    let module = |body: &str| {
        format!(
            "struct Pair {{ texels: u32, other: u32 }};
            @group(2) @binding(0) var<storage, read> pairs: array<Pair>; // texels
            @group(2) @binding(3) var texels: texture_2d<u32>; /* }} */
            @group(2) @binding(1) var<storage, read_write> sums: array<atomic<u32>>;
            fn texel(at: vec2u) -> u32 {{ return textureLoad(texels, at, 0).x; }}
            fn pair(i: u32) -> u32 {{ return pairs[i].texels + pairs[i].other; }}
            @compute @workgroup_size(8, 8)
            fn main(@builtin(global_invocation_id) id: vec3u) {{ atomicAdd(&sums[0], pair(id.x)); {body}
            }}
            @compute @workgroup_size(8)
            fn other() {{ atomicStore(&sums[1], 1u); }}"
        )
    };
    let bindings = |body: &str| {
        let text = module(body);
        assert_eq!(agree(&text), Ok(2));
        let found = sorted(Reflection::of(&text).bindings(2, &["main"]));
        found.into_iter().map(|(name, _)| name).collect::<Vec<_>>()
    };
    assert_eq!(bindings("// texel(id.xy)"), ["pairs", "sums"]);
    assert_eq!(bindings("/* texels */ let x = pairs[0].texels;"), ["pairs", "sums"]);
    assert_eq!(bindings("atomicAdd(&sums[1], texel(id.xy));"), ["pairs", "sums", "texels"]);
    // The control: a name that hides another one is taken for it, and naga says so.
    assert!(agree(&module("let texels = 1u; atomicAdd(&sums[1], texels);")).is_err());
}
