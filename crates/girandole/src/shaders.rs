//! Shader sources. A pass names the `lib/` files that it uses in one line; WGSL's module scope knows no order, so
//! they are simply put together.

macro_rules! lib {
    ($($name:ident),* $(,)?) => {
        [$((stringify!($name), include_str!(concat!("../shaders/lib/", stringify!($name), ".wgsl")))),*]
    };
}

const LIBRARY: &[(&str, &str)] = &lib!(
    brdf,
    frame,
    light,
    occluders,
    octahedral,
    parameterisation,
    project,
    scene,
    shadow,
    surface,
    texture,
    tonemap
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

pub(crate) const VISIBILITY: Source = source!(visibility, "", [frame, scene, texture]);
pub(crate) const SHADE: Source =
    source!(shade, "", [frame, scene, texture, surface, brdf, light, octahedral, parameterisation, shadow]);
pub(crate) const RESOLVE: Source = source!(resolve, "", [frame, scene, texture, surface, brdf]);
pub(crate) const SHADOW_MAPS_CLIP: Source = source!(
    shadow_maps_clip,
    "enable clip_distances;\n",
    [frame, light, octahedral, parameterisation, project, occluders]
);
pub(crate) const SHADOW_MAPS_DISCARD: Source =
    source!(shadow_maps_discard, "", [frame, light, octahedral, parameterisation, project, occluders]);
pub(crate) const SHADOW_MAPS_MASKED: Source = source!(
    shadow_maps_masked,
    "",
    [frame, scene, texture, light, octahedral, parameterisation, project, occluders]
);
pub(crate) const EXPOSURE: Source = source!(exposure, "", []);
pub(crate) const TONEMAP: Source = source!(tonemap, "", [tonemap]);

/// All passes, for the tests that need no GPU.
#[cfg(test)]
pub(crate) const ALL: [&Source; 8] = [
    &VISIBILITY,
    &SHADE,
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
