//! What a shader module binds, and which of its entry points use it, read from its text: quickly, and in browsers without a compiler of
//! our own. It knows the WGSL that we write; a test holds it to what naga says of every module.

use std::collections::{BTreeMap, BTreeSet};

/// What a module binds.
pub(super) struct Reflection {
    variables: Vec<Variable>,
    /// Names of variables and functions in each function, and the stage of entry points.
    functions: BTreeMap<String, (Vec<String>, Option<wgpu::ShaderStages>)>,
}

struct Variable {
    group: u32,
    binding: u32,
    name: String,
    ty: wgpu::BindingType,
}

impl Reflection {
    /// Of a module's text.
    pub fn of(text: &str) -> Self {
        let tokens: Vec<&str> = Tokens(text).collect();
        let mut variables: Vec<Variable> = Vec::new();
        let mut functions: Vec<(&str, BTreeSet<&str>, Option<wgpu::ShaderStages>)> = Vec::new();
        let mut attributes: Vec<&[&str]> = Vec::new();
        let mut rest = &tokens[..];
        while let Some((&first, after)) = rest.split_first() {
            let length = match first {
                "@" if after.get(1) == Some(&"(") => through(rest, ["(", ")"]),
                "@" => 2,
                "fn" | "struct" => through(rest, ["{", "}"]),
                _ => rest.iter().position(|token| *token == ";").map_or(rest.len(), |end| end + 1),
            };
            let (item, next) = rest.split_at(length.min(rest.len()));
            rest = next;
            match first {
                "@" => attributes.push(&item[1..]),
                "var" => variables.extend(Variable::of(item, &attributes)),
                "fn" => {
                    let names = item[2..].iter().zip(&item[1..]);
                    let names = names.filter(|(name, before)| is_word(name) && **before != ".");
                    let names: BTreeSet<&str> = names.map(|(name, _)| *name).collect();
                    functions.push((item[1], names, stage(&attributes)));
                }
                _ => {}
            }
            if first != "@" {
                attributes.clear();
            }
        }
        let of_functions = functions.iter().map(|(name, ..)| name.to_string());
        let known: BTreeSet<String> =
            of_functions.chain(variables.iter().map(|variable| variable.name.clone())).collect();
        let functions = functions.into_iter().map(|(name, names, stage)| {
            let names = names.into_iter().filter(|name| known.contains(*name)).map(str::to_owned).collect();
            (name.to_owned(), (names, stage))
        });
        Self { functions: functions.collect(), variables }
    }

    /// The bindings of a group that any of these entry points uses.
    pub fn bindings(&self, group: u32, entries: &[&str]) -> Vec<(String, wgpu::BindGroupLayoutEntry)> {
        let used: Vec<_> = entries.iter().map(|entry| self.used(entry)).collect();
        let with_stages = |variable: &Variable| {
            let by = used.iter().filter(|(_, names)| names.contains(&variable.name.as_str()));
            (variable.name.clone(), variable.entry(by.map(|(stage, _)| *stage).collect()))
        };
        let all = self.variables.iter().filter(|variable| variable.group == group).map(with_stages);
        all.filter(|(_, entry)| !entry.visibility.is_empty()).collect()
    }

    /// All bindings of a group, for these stages.
    pub fn group(&self, group: u32, stages: wgpu::ShaderStages) -> Vec<(String, wgpu::BindGroupLayoutEntry)> {
        let all = self.variables.iter().filter(|variable| variable.group == group);
        all.map(|variable| (variable.name.clone(), variable.entry(stages))).collect()
    }

    /// An entry point's stage, and all names in it and in what it calls.
    fn used<'a>(&'a self, entry: &'a str) -> (wgpu::ShaderStages, BTreeSet<&'a str>) {
        let mut names = BTreeSet::new();
        let mut open: Vec<&str> = vec![entry];
        while let Some(name) = open.pop() {
            if names.insert(name)
                && let Some((called, _)) = self.functions.get(name)
            {
                open.extend(called.iter().map(String::as_str));
            }
        }
        let stage = self.functions.get(entry).and_then(|(_, stage)| *stage);
        (stage.unwrap_or(wgpu::ShaderStages::NONE), names)
    }
}

impl Variable {
    /// Of a declaration, `var<space> name: type;`, if it has these attributes of a binding.
    fn of(item: &[&str], attributes: &[&[&str]]) -> Option<Self> {
        let number = |name: &str| {
            let attribute = attributes.iter().find(|attribute| attribute[0] == name)?;
            attribute.get(2)?.trim_end_matches('u').parse().ok()
        };
        let colon = item.iter().position(|token| *token == ":")?;
        let (declared, ty) = (&item[1..colon], &item[colon + 1..item.len() - 1]);
        let (&name, space) = declared.split_last()?;
        Some(Self {
            group: number("group")?,
            binding: number("binding")?,
            name: name.into(),
            ty: binding_type(&words(space), &words(ty))?,
        })
    }

    fn entry(&self, visibility: wgpu::ShaderStages) -> wgpu::BindGroupLayoutEntry {
        wgpu::BindGroupLayoutEntry { binding: self.binding, visibility, ty: self.ty, count: None }
    }
}

/// What the layout says of a variable; nothing for what no shader of ours binds.
fn binding_type(space: &[&str], ty: &[&str]) -> Option<wgpu::BindingType> {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let storage = |read_only| Some(buffer(wgpu::BufferBindingType::Storage { read_only }));
    match space {
        ["uniform"] => Some(buffer(wgpu::BufferBindingType::Uniform)),
        ["storage"] | ["storage", "read"] => storage(true),
        ["storage", "read_write"] => storage(false),
        _ => texture_type(ty),
    }
}

fn texture_type(ty: &[&str]) -> Option<wgpu::BindingType> {
    let (&name, of) = ty.split_first()?;
    let view_dimension = if name.ends_with("_array") {
        wgpu::TextureViewDimension::D2Array
    } else {
        wgpu::TextureViewDimension::D2
    };
    let sampled = |sample_type, multisampled| {
        Some(wgpu::BindingType::Texture { sample_type, view_dimension, multisampled })
    };
    let kind = || match of {
        ["u32"] => Some(wgpu::TextureSampleType::Uint),
        ["f32"] => Some(wgpu::TextureSampleType::Float { filterable: false }),
        _ => None,
    };
    match name {
        "texture_2d" | "texture_2d_array" => sampled(kind()?, false),
        "texture_multisampled_2d" => sampled(kind()?, true),
        "texture_depth_2d" | "texture_depth_2d_array" => sampled(wgpu::TextureSampleType::Depth, false),
        "texture_depth_multisampled_2d" => sampled(wgpu::TextureSampleType::Depth, true),
        "texture_storage_2d" | "texture_storage_2d_array" => {
            let [format, access] = of else { return None };
            Some(wgpu::BindingType::StorageTexture {
                access: match *access {
                    "read" => wgpu::StorageTextureAccess::ReadOnly,
                    "write" => wgpu::StorageTextureAccess::WriteOnly,
                    _ => wgpu::StorageTextureAccess::ReadWrite,
                },
                format: match *format {
                    "rgba32float" => wgpu::TextureFormat::Rgba32Float,
                    "r32uint" => wgpu::TextureFormat::R32Uint,
                    "rg32uint" => wgpu::TextureFormat::Rg32Uint,
                    "rgba32uint" => wgpu::TextureFormat::Rgba32Uint,
                    "r32float" => wgpu::TextureFormat::R32Float,
                    _ => return None,
                },
                view_dimension,
            })
        }
        _ => None,
    }
}

/// The stage of a function with these attributes, if it is an entry point.
fn stage(attributes: &[&[&str]]) -> Option<wgpu::ShaderStages> {
    attributes.iter().find_map(|attribute| match attribute[0] {
        "vertex" => Some(wgpu::ShaderStages::VERTEX),
        "fragment" => Some(wgpu::ShaderStages::FRAGMENT),
        "compute" => Some(wgpu::ShaderStages::COMPUTE),
        _ => None,
    })
}

fn words<'t>(tokens: &[&'t str]) -> Vec<&'t str> {
    tokens.iter().copied().filter(|token| is_word(token)).collect()
}

fn is_word(token: &str) -> bool {
    token.starts_with(is_of_word)
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// How many tokens there are up to the end of the first block between these.
fn through(tokens: &[&str], [open, close]: [&str; 2]) -> usize {
    let mut depth = 0;
    let is_end = |token: &&str| {
        depth += i32::from(**token == *open) - i32::from(**token == *close);
        depth == 0 && **token == *close
    };
    tokens.iter().position(is_end).map_or(tokens.len(), |end| end + 1)
}

/// Words and signs, without comments.
struct Tokens<'t>(&'t str);

impl<'t> Iterator for Tokens<'t> {
    type Item = &'t str;

    fn next(&mut self) -> Option<&'t str> {
        let after = |text: &'t str, end: &str| text.split_once(end).map_or("", |(_, after)| after);
        loop {
            self.0 = self.0.trim_start();
            self.0 = match self.0 {
                line if line.starts_with("//") => after(line, "\n"),
                block if block.starts_with("/*") => after(block, "*/"),
                _ => break,
            };
        }
        let first = self.0.chars().next()?;
        let length = if is_of_word(first) {
            self.0.find(|c| !is_of_word(c)).unwrap_or(self.0.len())
        } else {
            first.len_utf8()
        };
        let (token, rest) = self.0.split_at(length);
        self.0 = rest;
        Some(token)
    }
}

#[cfg(test)]
mod tests;
