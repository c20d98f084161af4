//! A program with a window of its own (winit) and a device of its own (wgpu) that has its scene lit: an object of its own turns,
//! its own pass clears the frame in the encoder that ours is recorded into.
//!
//! `cargo run --release --example embed -p girandole -- 10` closes the window after 10 frames.

use girandole::glam::{Quat, Vec3};
use girandole::light::{IlluminationSettings, Rewalk};
use girandole::scene::builtin::{self, MovingObject};
use girandole::scene::{Scene, Transform, View};
use girandole::{MapUpdates, RenderSettings, Renderer, RendererOptions, Target, Viewport, wgpu};
use std::error::Error;
use std::sync::Arc;
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::{Window, WindowId};

/// What the program has anyway, and the renderer.
struct Program {
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    device: wgpu::Device,
    queue: wgpu::Queue,
    scene: Scene,
    renderer: Renderer,
    viewport: Viewport,
    frame: u32,
}

impl Program {
    async fn new(window: Arc<Window>) -> Result<Self, Box<dyn Error>> {
        // Instance, adapter and device are the program's; the renderer says what it can do with.
        let instance = girandole::instance();
        let surface = instance.create_surface(window.clone())?;
        let options =
            wgpu::RequestAdapterOptions { compatible_surface: Some(&surface), ..Default::default() };
        let adapter = instance.request_adapter(&options).await?;
        let device = wgpu::DeviceDescriptor {
            required_features: adapter.features() & girandole::WANTED_FEATURES,
            required_limits: girandole::wanted_limits(&adapter),
            ..Default::default()
        };
        let (device, queue) = adapter.request_device(&device).await?;
        let size = window.inner_size();
        let config = surface
            .get_default_config(&adapter, size.width.max(1), size.height.max(1))
            .ok_or("the adapter cannot show pictures in this window")?;
        surface.configure(&device, &config);

        // The scene is opened once; samples stay while things move.
        let mut scene = builtin::build("table", MovingObject::Torus)?;
        let mut renderer = Renderer::new(&device, &queue, RendererOptions::default())?;
        let light = IlluminationSettings { rewalk: Rewalk::Off, ..Default::default() };
        scene.take_changes();
        renderer.open(&scene, &light)?;
        let viewport = Viewport::default();
        Ok(Self { window, surface, config, device, queue, scene, renderer, viewport, frame: 0 })
    }

    fn resize(&mut self, width: u32, height: u32) {
        if width > 0 && height > 0 {
            (self.config.width, self.config.height) = (width, height);
            self.surface.configure(&self.device, &self.config);
        }
    }

    fn draw(&mut self) -> Result<(), Box<dyn Error>> {
        let surface = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(texture) => texture,
            // Hidden, or of another size by now: the next frame may do.
            _ => {
                self.surface.configure(&self.device, &self.config);
                return Ok(());
            }
        };
        let color = surface.texture.create_view(&Default::default());

        // Something moves: the renderer is told what changed since the last frame.
        let torus = self.scene.objects.iter().find(|object| object.dynamic).ok_or("nothing moves")?;
        let rotation = Quat::from_rotation_y(0.05 * self.frame as f32);
        let place =
            Transform::Parts { translation: Vec3::new(0.0, 1.25, 0.0), rotation, scale: Vec3::splat(0.5) };
        self.scene.set_transform(torus.node, place)?;
        let changes = self.scene.take_changes();
        self.renderer.update(&self.scene, &changes)?;

        // One encoder: the program's own pass, and our picture over its background.
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let sky = wgpu::Color { r: 0.02, g: 0.03, b: 0.08, a: 1.0 };
        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(sky), store: wgpu::StoreOp::Store };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &color,
                depth_slice: None,
                resolve_target: None,
                ops,
            })],
            ..Default::default()
        });
        let size = [self.config.width, self.config.height];
        let view = View::new(&self.scene, self.scene.camera("0")?, size[0] as f32 / size[1] as f32);
        let target = Target { keep_background: true, ..Target::new(&color, self.config.format, size) };
        // A hundred shadow maps a frame keep up well enough, and take a third of the time of all.
        let updates = MapUpdates { most: Some(100), ..Default::default() };
        let settings = RenderSettings { updates, ..Default::default() };
        self.renderer.record(&mut self.viewport, &mut encoder, &view, &target, &settings)?;
        self.window.pre_present_notify();
        self.queue.submit([encoder.finish()]);
        self.queue.present(surface);
        self.frame += 1;
        Ok(())
    }
}

/// What winit calls.
#[derive(Default)]
struct Handler {
    program: Option<Program>,
    /// After so many frames the window closes.
    frames: Option<u32>,
    failed: Option<Box<dyn Error>>,
}

impl Handler {
    fn open(event_loop: &ActiveEventLoop) -> Result<Program, Box<dyn Error>> {
        let window = event_loop.create_window(Window::default_attributes().with_title("embedded"))?;
        pollster::block_on(Program::new(Arc::new(window)))
    }

    fn check<T>(&mut self, event_loop: &ActiveEventLoop, result: Result<T, Box<dyn Error>>) -> Option<T> {
        result
            .map_err(|error| {
                self.failed = Some(error);
                event_loop.exit();
            })
            .ok()
    }
}

impl ApplicationHandler for Handler {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        self.program = self.check(event_loop, Self::open(event_loop));
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(program) = &mut self.program else { return };
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::Resized(size) => program.resize(size.width, size.height),
            WindowEvent::RedrawRequested => {
                let drawn = program.draw();
                program.window.request_redraw();
                if self.frames.is_some_and(|frames| program.frame >= frames) {
                    event_loop.exit();
                }
                self.check(event_loop, drawn);
            }
            _ => {}
        }
    }
}

fn main() {
    let frames = std::env::args().nth(1).and_then(|frames| frames.parse().ok());
    let mut handler = Handler { frames, ..Handler::default() };
    let run = || -> Result<(), Box<dyn Error>> {
        EventLoop::new()?.run_app(&mut handler)?;
        handler.failed.map_or(Ok(()), Err)
    };
    if let Err(error) = run() {
        eprintln!("error: {error}");
        std::process::exit(2);
    }
}
