//! A scene with its light on the GPU.

use crate::Result;
use crate::device::context::Context;
use crate::maps::atlas::Atlas;
use crate::maps::layout::AtlasLayout;
use crate::maps::occluders::{CullCounts, Occluders};
use crate::points::multipass_plan::MultipassPlan;
use crate::scene::geometry::{GpuScene, gpu_lights};
use crate::scene::lights::GpuLights;
use crate::scene::receivers::Receivers;
use crate::shader_constants::DIRECTIONAL;
use girandole_core::Generation;
use girandole_core::glam::DVec3;
use girandole_core::lights::{Clamp, LightSet};
use girandole_core::scene::{Geometry, NONE, Scene};

/// What a scene and its lights need of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SceneFeatures {
    /// Some material has a specular lobe.
    pub specular: bool,
    /// All lights fall off with the cosine.
    pub only_cosine_lights: bool,
    /// Some material has a texture.
    pub textures: bool,
    /// Some surface has normals that vary.
    pub curved: bool,
}

/// A scene and its lights on the GPU, with what is derived from both.
pub(crate) struct Resident {
    pub geometry: GpuScene,
    pub features: SceneFeatures,
    pub lights: GpuLights,
    pub atlas: Atlas,
    /// World position that positions are relative to.
    pub origin: DVec3,
    /// What epsilons are relative to, metres.
    pub scale: f32,
    /// Length of the bounds' diagonal, metres.
    pub extent: f32,
    /// Which version of the scene this is, and which light samples.
    pub generations: [Generation; 2],
    /// What visibility determination says; every mode but the naive one needs it.
    pub receivers: Option<Receivers>,
    /// What multipass shading draws.
    pub multipass: Option<MultipassPlan>,
    /// What was drawn when shadow maps were drawn; nothing while they are stale.
    pub culling: Option<CullCounts>,
    /// The bound of the geometric factor that light maps were summed with; nothing while they are stale.
    pub light_maps: Option<LightMapBound>,
}

/// A bound of the geometric factor, m⁻²; none = exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LightMapBound(pub Clamp);

impl Resident {
    /// # Errors
    /// [`crate::Error::TooLarge`] where buffers or the atlas exceed the device's limits or the memory budget.
    pub fn new(context: &Context, scene: &Scene, geometry: &Geometry, lights: &LightSet) -> Result<Self> {
        let Context { device, options, shared, .. } = context;
        let radius = geometry.radius();
        let mut samples = gpu_lights(lights, radius);
        let directional: Vec<bool> = samples.iter().map(|l| l.profile == DIRECTIONAL).collect();
        let layout = AtlasLayout::new(&directional, shared.tuning.copy_maps, options, &device.limits())?;
        for (light, slot) in samples.iter_mut().zip(&layout.slots) {
            light.atlas_slot = layout.place(slot);
        }
        let features = SceneFeatures {
            specular: scene.materials.iter().any(|m| m.specular > 0.0 || m.metallic > 0.0),
            only_cosine_lights: samples.iter().all(|l| l.profile == 0),
            textures: !scene.textures.is_empty(),
            curved: is_curved(scene, geometry),
        };
        let occluders = Occluders::new(scene, geometry, &samples, options.skip_non_blockers);
        Ok(Self {
            geometry: GpuScene::new((device, &context.queue), &shared.scene, scene, geometry)?,
            features,
            atlas: Atlas::new(device, shared.tuning.copy_maps, layout, scene, geometry, occluders)?,
            lights: GpuLights::new(device, samples)?,
            origin: geometry.origin,
            scale: geometry.diagonal(),
            extent: geometry.extent(),
            generations: [geometry.generation(), lights.generation()],
            receivers: None,
            multipass: None,
            culling: None,
            light_maps: None,
        })
    }
}

/// Whether some surface has normals that vary from point to point.
fn is_curved(scene: &Scene, geometry: &Geometry) -> bool {
    geometry.triangles.iter().any(|t| {
        let [a, b, c] = t.vertices.map(|v| geometry.normals[v as usize]);
        a.dot(b).min(b.dot(c)) < 0.99999
            || scene.materials[t.material as usize].normal_texture.is_some()
            || t.patch == NONE
    })
}
