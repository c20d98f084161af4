//! What the tests share.

use girandole::{
    FrameStats, Gpu, Mode, RenderSettings, Renderer, RendererOptions, Result, Target, Tier, Viewport, wgpu,
};
use girandole_core::glam::{Quat, Vec3};
use girandole_core::image::Image;
use girandole_core::lights::{Clamp, LightSet, LightSettings};
use girandole_core::scene::builtin::{self, MovingObject, shapes};
use girandole_core::scene::{
    Camera, Geometry, LocalView, Material, MaterialId, Mesh, MorphTarget, NodeId, Projection, PunctualKind,
    PunctualLight, Scene, Transform, View,
};
use girandole_core::trace::SceneTracer;
use girandole_core::visibility::{VisibilityDatabase, VisibilitySettings};
use girandole_reference::OracleSettings;
use std::future::Future;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

/// A test and its name.
pub type Test = (&'static str, fn(&Context));

/// What every test gets.
#[derive(Clone)]
pub struct Context {
    pub gpu: Gpu,
    /// Variants of the kernels, but where a test asks for its own; `None` = as the device is.
    pub tier: Option<Tier>,
    /// All others share what is compiled for it, which takes seconds on software devices.
    pub first: Arc<Renderer>,
}

/// A renderer with one viewport.
pub struct OneView {
    renderer: Renderer,
    viewport: Viewport,
}

impl OneView {
    pub fn new(renderer: Renderer) -> Self {
        Self { renderer, viewport: Viewport::default() }
    }

    /// For viewports of the caller's.
    pub fn into_renderer(self) -> Renderer {
        self.renderer
    }

    pub fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        target: &Target,
        settings: &RenderSettings,
    ) -> Result<()> {
        self.renderer.record(&mut self.viewport, encoder, view, target, settings)
    }

    pub fn render(&mut self, view: &View, size: [u32; 2], settings: &RenderSettings) -> Result<()> {
        self.renderer.render(&mut self.viewport, view, size, settings)
    }

    pub fn render_set(
        &mut self,
        scene: &Scene,
        view: &View,
        size: [u32; 2],
        settings: &RenderSettings,
        set: u32,
    ) -> Result<()> {
        self.renderer.render_set(&mut self.viewport, scene, view, size, settings, set)
    }

    pub fn refine(
        &mut self,
        scene: &Scene,
        view: &View,
        size: [u32; 2],
        settings: &RenderSettings,
    ) -> Result<bool> {
        self.renderer.refine(&mut self.viewport, scene, view, size, settings)
    }

    pub fn refined_sets(&self) -> u32 {
        self.renderer.refined_sets(&self.viewport)
    }

    pub fn refined_error(&self) -> impl Future<Output = Result<Option<f64>>> + use<> {
        self.renderer.refined_error(&self.viewport)
    }

    pub fn show(
        &self,
        settings: &RenderSettings,
        target: &wgpu::TextureView,
        format: wgpu::TextureFormat,
    ) -> Result<()> {
        self.renderer.show(&self.viewport, settings, target, format)
    }

    pub fn radiance(&self) -> impl Future<Output = Result<Image>> + use<> {
        self.renderer.radiance(&self.viewport)
    }

    pub fn stats(&self) -> impl Future<Output = Result<FrameStats>> + use<> {
        self.renderer.stats(&self.viewport)
    }

    pub fn stale_error(&self) -> impl Future<Output = Result<Option<f64>>> + use<> {
        self.renderer.stale_error(&self.viewport)
    }
}

impl Deref for OneView {
    type Target = Renderer;

    fn deref(&self) -> &Renderer {
        &self.renderer
    }
}

impl DerefMut for OneView {
    fn deref_mut(&mut self) -> &mut Renderer {
        &mut self.renderer
    }
}

/// Every light at every pixel, without a bound on the geometric factor.
pub fn exact() -> RenderSettings {
    RenderSettings { mode: Mode::Naive, clamp: Clamp::Off, ..RenderSettings::default() }
}

/// A scene ready to be lit.
pub struct Stage {
    pub scene: Scene,
    pub geometry: Geometry,
    pub lights: LightSet,
}

impl Stage {
    pub fn new(scene: Scene, settings: &LightSettings) -> Self {
        let geometry = Geometry::new(&scene);
        let lights = LightSet::sample(&scene, &geometry, settings).expect("lights");
        Self { scene, geometry, lights }
    }

    pub fn builtin(name: &str, count: u32) -> Self {
        Self::new(
            with_object(name, MovingObject::Torus),
            &LightSettings { count, ..LightSettings::default() },
        )
    }

    pub fn view(&self, camera: usize, size: [u32; 2]) -> View {
        View::new(&self.scene, &self.scene.cameras[camera], size[0] as f32 / size[1] as f32)
    }

    /// The same, relative to the geometry's origin.
    pub fn local(&self, view: &View) -> LocalView {
        view.relative_to(self.geometry.origin)
    }

    pub fn visibility(&self) -> VisibilityDatabase {
        let settings = VisibilitySettings::default();
        VisibilityDatabase::build(&self.scene, &self.geometry, &self.lights, &settings).expect("visibility")
    }

    pub fn tracer(&self) -> SceneTracer<'_> {
        SceneTracer::new(&self.scene, &self.geometry)
    }

    pub fn oracle(&self, view: &View, size: [u32; 2], samples_per_axis: u32) -> Image {
        let settings = OracleSettings { samples_per_axis, clamp: Clamp::Off, ..OracleSettings::default() };
        girandole_reference::oracle(&self.tracer(), &self.lights, view, size, &settings, &|_| {})
    }
}

/// A built-in scene.
pub fn with_object(name: &str, object: MovingObject) -> Scene {
    builtin::build(name, object).expect("a built-in scene")
}

impl Context {
    pub fn new(gpu: Gpu, tier: Option<Tier>) -> Self {
        let first = Renderer::new(&gpu.device, &gpu.queue, RendererOptions::default()).expect("a renderer");
        Self { gpu, tier, first: first.into() }
    }

    /// Polls a future and the device in turn.
    pub fn wait<T>(&self, future: impl Future<Output = T>) -> T {
        self.gpu.block_on(future).expect("the device")
    }

    pub fn renderer(&self, options: RendererOptions) -> OneView {
        let options = RendererOptions { tier: options.tier.or(self.tier), ..options };
        OneView::new(self.first.another(options).expect("a renderer"))
    }

    /// A picture with exact settings.
    pub fn picture(&self, stage: &Stage, options: RendererOptions, view: &View, size: [u32; 2]) -> Image {
        let mut renderer = self.renderer(options);
        renderer.load(&stage.scene, &stage.geometry, &stage.lights).expect("load");
        self.frame(&mut renderer, view, size, &exact())
    }

    /// A renderer with a scene and its visibility.
    pub fn loaded(&self, stage: &Stage, options: RendererOptions) -> OneView {
        let mut renderer = self.renderer(options);
        self.load(&mut renderer, stage);
        renderer
    }

    /// Loads a scene and its visibility: what is compiled stays, which takes seconds on software devices.
    pub fn load(&self, renderer: &mut Renderer, stage: &Stage) {
        let (scene, geometry, lights) = (&stage.scene, &stage.geometry, &stage.lights);
        renderer.load(scene, geometry, lights).expect("load");
        renderer.load_visibility(scene, geometry, lights, stage.visibility()).expect("visibility");
    }

    /// A texture that can be drawn to, bound and read back.
    pub fn target(&self, [width, height]: [u32; 2], format: wgpu::TextureFormat) -> wgpu::Texture {
        use wgpu::TextureUsages as U;
        self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: U::RENDER_ATTACHMENT | U::TEXTURE_BINDING | U::COPY_SRC,
            view_formats: &[],
        })
    }

    pub fn frame(
        &self,
        renderer: &mut OneView,
        view: &View,
        size: [u32; 2],
        settings: &RenderSettings,
    ) -> Image {
        renderer.render(view, size, settings).expect("render");
        self.wait(renderer.radiance()).expect("radiance")
    }
}

/// A room of this size with its floor's middle at the origin, made of single inward-facing quads.
pub fn room(scene: &mut Scene, size: Vec3, material: MaterialId, leave_out: Option<usize>) {
    let mut shell = Mesh::default();
    let (low, high) =
        (Vec3::new(-size.x * 0.5, 0.0, -size.z * 0.5), Vec3::new(size.x * 0.5, size.y, size.z * 0.5));
    let mut outward = Mesh::default();
    outward.add_box(low, high, material);
    for (index, patch) in outward.patches.iter().enumerate() {
        if Some(index) != leave_out {
            let corners: Vec<Vec3> =
                patch.outline.iter().rev().map(|&v| outward.positions[v as usize]).collect();
            shell.add_polygon(&corners, material);
        }
    }
    scene.add_object("room", shell, Transform::IDENTITY);
}

/// A square emitter of this side that faces along −Y before `rotation`.
pub fn lamp(scene: &mut Scene, side: f32, radiance: f32, rotation: Quat, position: Vec3) {
    let material = scene.add_material(Material::emitter("lamp", Vec3::splat(radiance)));
    let h = side * 0.5;
    let mut mesh = Mesh::default();
    let corners =
        [Vec3::new(-h, 0.0, -h), Vec3::new(h, 0.0, -h), Vec3::new(h, 0.0, h), Vec3::new(-h, 0.0, h)];
    mesh.add_polygon(&corners, material);
    scene.add_object("lamp", mesh, Transform::rigid(rotation, position));
}

/// A sun that shines from this direction.
pub fn sun(scene: &mut Scene, from: Vec3) {
    let node = scene.add_node("sun", Transform::looking_at(from, Vec3::ZERO));
    let (name, intensity) = (String::new(), Vec3::splat(4.0));
    scene.lights.push(PunctualLight { name, node, kind: PunctualKind::Directional, intensity });
}

pub fn camera(scene: &mut Scene, eye: Vec3, target: Vec3, yfov: f32) {
    let node = scene.add_node("camera", Transform::looking_at(eye, target));
    scene.cameras.push(Camera {
        name: String::new(),
        node,
        projection: Projection::Perspective { yfov },
        clip: Default::default(),
    });
}

/// Largest difference beyond what storing a pixel in 18 bits may make, as a share of the mean.
pub fn beyond_storage(a: &Image, b: &Image) -> f32 {
    let difference = |(a, b): (&Vec3, &Vec3)| {
        let quantum = 2f32.powi(-17) * a.max_element().max(b.max_element());
        (*a - *b).abs().max_element() - quantum
    };
    a.pixels.iter().zip(&b.pixels).map(difference).fold(0.0, f32::max) / mean(a)
}

pub fn mean(image: &Image) -> f32 {
    image.mean().element_sum() / 3.0
}

/// A ball that bends: its node, which has one morph target.
pub fn bending_ball(scene: &mut Scene, material: MaterialId, at: Vec3) -> NodeId {
    let mut ball = shapes::sphere(0.25, 16, 8, material);
    let shifts = ball.positions.iter().map(|p| *p * Vec3::new(0.3, -0.6, 0.8));
    ball.morph_targets = vec![MorphTarget { positions: shifts.collect(), normals: Vec::new() }];
    scene.add_object("ball", ball, Transform::translation(at));
    let object = scene.objects.last_mut().expect("it was added");
    object.dynamic = true;
    let node = object.node;
    scene.set_morph_weights(node, &[0.0]).expect("weights");
    node
}
