//! Girandole lights scenes with hundreds to thousands of light samples, each with its own shadow map: soft shadows
//! from area lights, and indirect light that is blocked by what stands in its way. No ray-tracing hardware, no
//! denoiser, no history, no bake; every frame stands by itself and repeats bit for bit.
//!
//! A picture in three steps: a [`Scene`](scene::Scene), a [`Renderer`] on the caller's device that opens it, and a
//! frame into the caller's encoder and [`Target`].
//!
//! ```no_run
//! use girandole::light::IlluminationSettings;
//! use girandole::scene::builtin::{self, MovingObject};
//! use girandole::scene::{MaterialId, View};
//! use girandole::{RenderSettings, Renderer, RendererOptions, Target, Viewport};
//!
//! # fn picture(device: &wgpu::Device, queue: &wgpu::Queue, color: &wgpu::TextureView) -> Result<(), Box<dyn std::error::Error>> {
//! let mut scene = builtin::build("pillars", MovingObject::Torus)?; // or Scene::load("room.glb".as_ref())?
//! let mut renderer = Renderer::new(device, queue, RendererOptions::default())?;
//! renderer.open(&scene, &IlluminationSettings::default())?; // samples its light, determines visibility
//!
//! let view = View::new(&scene, &scene.cameras[0], 1024.0 / 768.0); // or View::from_matrices(…)
//! let target = Target::new(color, wgpu::TextureFormat::Bgra8UnormSrgb, [1024, 768]);
//! let mut viewport = Viewport::default(); // one for each camera
//! let mut encoder = device.create_command_encoder(&Default::default());
//! renderer.record(&mut viewport, &mut encoder, &view, &target, &RenderSettings::default())?;
//! queue.submit([encoder.finish()]);
//!
//! // What changes is followed, and where the camera goes.
//! scene.set_emission(MaterialId(0), girandole::glam::Vec3::ONE)?;
//! let changes = scene.take_changes();
//! renderer.follow(&scene, &changes, &[view])?;
//! # Ok(())
//! # }
//! ```
//!
//! | way in | |
//! |---|---|
//! | a scene from a file, a built-in one, one made in code | [`scene`] |
//! | how it is lit, and what follows when it changes | [`light`], [`Renderer::follow`] |
//! | a frame on a target of yours, with depth; one that is submitted in parts | [`Renderer::record`], [`Renderer::render`] |
//! | several cameras | [`Viewport`] |
//! | a picture that gets better while everything rests | [`Renderer::refine`] |
//! | a device without a window, and pictures read back and saved | [`Gpu`], [`image`] |
//!
//! Depth is reversed unless [`View::from_matrices`](scene::View::from_matrices) was given a projection that says otherwise; [`Target`]
//! documents what comes in and goes out. Light samples and visibility of the caller's own making go through [`Renderer::load`] and
//! [`Renderer::load_visibility`]; they are made with the crate `girandole-core`, of the same version, whose scenes these are. The
//! crate's folder `examples` has whole programs.
//!
//! What a device has to have: WebGPU's default limits and compute shaders. What the renderer uses where the device was
//! created with it: [`WANTED_FEATURES`] and [`wanted_limits`]; [`Renderer::new`] says what it does without. The
//! renderer never blocks: it records or submits work, and read-backs are futures that own what they need.

pub use girandole_core::glam;
pub use wgpu;

/// Scenes: what is lit, and from where it is seen.
///
/// A scene is loaded ([`Scene::load`](scene::Scene::load): glTF, OBJ, PLY), [built in](scene::builtin), or made:
///
/// ```
/// use girandole::glam::{Vec3, vec3};
/// use girandole::scene::{Camera, Material, Mesh, Projection, Scene, Transform, View};
///
/// let mut scene = Scene::default();
/// let wall = scene.add_material(Material::diffuse("wall", Vec3::splat(0.7)));
/// let lamp = scene.add_material(Material::emitter("lamp", Vec3::splat(20.0))); // W/(sr·m²)
/// let mut room = Mesh::default();
/// room.add_box(vec3(-2.0, 0.0, -2.0), vec3(2.0, 0.1, 2.0), wall); // metres
/// room.add_box(vec3(-0.5, 2.0, -0.5), vec3(0.5, 2.1, 0.5), lamp);
/// scene.add_object("room", room, Transform::IDENTITY);
///
/// let node = scene.add_node("camera", Transform::looking_at(vec3(0.0, 1.5, 5.0), vec3(0.0, 1.0, 0.0)));
/// let projection = Projection::Perspective { yfov: 0.9 }; // radians
/// let camera = Camera { name: "camera".into(), node, projection, clip: Default::default() };
/// let view = View::new(&scene, &camera, 4.0 / 3.0);
/// ```
pub mod scene {
    #[cfg(feature = "import")]
    #[doc(inline)]
    pub use girandole_core::scene::Edits;
    #[doc(inline)]
    pub use girandole_core::scene::{
        Camera, Environment, LightId, Material, MaterialId, Mesh, NodeId, Object, ObjectId, Projection,
        PunctualKind, PunctualLight, Scene, SceneChanges, Texture, TextureRef, Transform, View, builtin,
    };
}

/// How scenes are lit, and how their light follows them.
///
/// ```
/// use girandole::light::{IlluminationSettings, LightSettings, Rewalk};
///
/// // More samples are finer light; held ones stay where they are while things move.
/// let lights = LightSettings { count: 1024, ..LightSettings::default() };
/// let settings = IlluminationSettings { lights, rewalk: Rewalk::Off, ..IlluminationSettings::default() };
/// ```
pub mod light {
    #[doc(inline)]
    pub use girandole_core::illumination::{Illumination, IlluminationSettings, Rewalk};
    #[doc(inline)]
    pub use girandole_core::lights::{Clamp, LightSettings, Pace};
    #[doc(inline)]
    pub use girandole_core::visibility::VisibilitySettings;
}

/// Pictures of linear radiance, and how they are shown.
///
/// ```
/// use girandole::image::{Exposure, Image, Tonemap, to_srgb8};
///
/// let radiance = Image::new(640, 480); // as Renderer::radiance gives it
/// let rgb: Vec<u8> = to_srgb8(&radiance, Exposure::Auto.ev(&radiance), Tonemap::Agx);
/// assert_eq!(rgb.len(), 640 * 480 * 3);
/// ```
pub mod image {
    #[doc(inline)]
    pub use girandole_core::image::{Image, Region};
    #[doc(inline)]
    pub use girandole_core::tonemap::{Exposure, Tonemap, to_srgb8};
}

/// What the README shows compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(all(target_arch = "wasm32", feature = "webgpu"))]
pub mod browser;
mod checks;
mod device;
mod error;
mod frame;
mod gpu_scene;
mod layout;
mod maps;
mod packed;
mod parallel;
mod parallel_map;
mod passes;
mod points;
mod prepare;
mod rays;
mod records;
mod renderer;
mod resident;

mod settings;
mod shader_constants;
mod shaders;
mod stats;
mod tier;
mod viewport;

#[cfg(test)]
mod layout_tests;
#[cfg(test)]
mod order_test;

pub use device::compiled::{Compilation, CompiledKernel};
#[doc(hidden)]
pub use device::instance;
pub use device::{AdapterReport, Gpu, WANTED_FEATURES, adapters, wanted_limits};
pub use error::{Error, Remedy, Result};
#[doc(hidden)]
pub use shaders::shaders;
pub use tier::Tier;

pub use maps::cache::StaleCounts;
pub use renderer::Renderer;
pub use settings::{
    DebugView, MapPriority, MapUpdates, Mode, RenderSettings, RendererOptions, Shading, ShadowMap, Target,
};
pub use stats::{FrameStats, PairCounts, TransferCounts};
pub use viewport::Viewport;
