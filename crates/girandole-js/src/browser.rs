//! The class `Girandole`, as JavaScript sees it.

use crate::{Camera, Lit, Settings};
use girandole::{Gpu, wgpu};
use girandole_core::files;
use girandole_core::scene::{LoadOptions, Scene, builtin};
use girandole_core::slices::Slices;
use js_sys::{JSON, Promise, Uint8Array};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::cell::RefCell;
use std::path::PathBuf;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::{JsFuture, future_to_promise};
use web_sys::HtmlCanvasElement;

/// What is made between two frames takes as long, or a little longer, milliseconds.
const SLICE: f64 = 12.0;

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"
/** Settings; what is left out stays as it is. */
export interface Settings {
  /** Light samples, each with a shadow map: 1 to 65536; 300 at first. */
  lights?: number;
  /** Bounces of light; 0 = direct light alone; 5 at first. */
  bounces?: number;
  /** Another seed, other light samples. */
  seed?: number;
  /** How much work a frame avoids; "full" at first. All show the same picture. */
  mode?: "naive" | "visibility" | "low-resolution" | "full";
  /** Samples a pixel along each axis, 1 to 16; 1 at first. */
  antialiasing?: number;
  /** Rays that follow one another from what mirrors, 0 to 16; 2 at first. */
  mirrors?: number;
  /** Stops, or "auto", which it is at first. */
  exposure?: number | "auto";
  /** The tone curve; "agx" at first. */
  tonemap?: "agx" | "aces" | "none";
  /** Texels across each shadow map; at first as many as fit. */
  mapSize?: number;
  /** Budget of shadow maps, MiB; 256 at first. */
  memory?: number;
}

/** Where one looks from, in metres; +Y is up. */
export interface Camera {
  position: [number, number, number];
  /** What is in the middle of the picture. */
  target: [number, number, number];
  /** What points to the picture's top; [0, 1, 0] where it is left out. */
  up?: [number, number, number];
  /** The vertical angle of view, degrees; 60 where it is left out. */
  fov?: number;
}

/** What is known of the scene and its light. */
export interface Stats {
  scene: string;
  triangles: number;
  /** Light samples that there are, and those that shine already. */
  lights: number;
  lit: number;
  /** The share of the light that is made, 0 to 1. */
  progress: number;
  /** What there is to say of the scene and its light: one sentence each. */
  warnings: string[];
}
"#;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(typescript_type = "Settings")]
    pub type JsSettings;
    #[wasm_bindgen(typescript_type = "Camera")]
    pub type JsCamera;
    #[wasm_bindgen(typescript_type = "Stats")]
    pub type JsStats;
    #[wasm_bindgen(typescript_type = "string | Uint8Array | ArrayBuffer")]
    pub type JsSource;
    #[wasm_bindgen(typescript_type = "Promise<void>")]
    pub type JsDone;
}

/// A scene on a canvas, lit by many shadowed light samples.
#[wasm_bindgen]
pub struct Girandole(Rc<RefCell<State>>);

struct State {
    canvas: HtmlCanvasElement,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    gpu: Gpu,
    lit: Lit,
}

#[wasm_bindgen]
impl Girandole {
    /// Opens a device for a canvas. Rejects with one sentence where the browser has no WebGPU, no adapter or no device.
    pub async fn create(canvas: HtmlCanvasElement) -> Result<Girandole, JsError> {
        let instance = girandole::instance();
        let surface = instance.create_surface(wgpu::SurfaceTarget::Canvas(canvas.clone()))?;
        let gpu = Gpu::for_surface(&instance, &surface, None).await?;
        let config = surface
            .get_default_config(&gpu.adapter, canvas.width().max(1), canvas.height().max(1))
            .ok_or_else(|| JsError::new("this adapter cannot show pictures on a canvas"))?;
        surface.configure(&gpu.device, &config);
        let lit = Lit::new(&gpu.device, &gpu.queue);
        Ok(Self(Rc::new(RefCell::new(State { canvas, surface, config, gpu, lit }))))
    }

    /// Shows a scene: the name of a built-in room, the address of a `.glb`, `.gltf`, `.obj` or `.ply` file, or its bytes.
    pub fn load(&self, source: JsSource) -> JsDone {
        let state = self.0.clone();
        let source: JsValue = source.into();
        let loaded: Promise = future_to_promise(async move {
            let scene = scene(source).await?;
            state.borrow_mut().lit.show(scene);
            Ok(JsValue::UNDEFINED)
        });
        loaded.unchecked_into()
    }

    /// Chooses settings; the next calls of `render` follow them.
    pub fn set(&self, settings: JsSettings) -> Result<(), JsError> {
        let settings: Settings = given(&settings)?;
        self.0.borrow_mut().lit.set(&settings);
        Ok(())
    }

    /// Where one looks from; undefined before a scene is there.
    #[wasm_bindgen(getter, unchecked_return_type = "Camera | undefined")]
    pub fn camera(&self) -> Result<JsValue, JsError> {
        match self.0.borrow().lit.camera() {
            Some(camera) => told(&camera),
            None => Ok(JsValue::UNDEFINED),
        }
    }

    #[wasm_bindgen(setter)]
    pub fn set_camera(&self, camera: JsCamera) -> Result<(), JsError> {
        let camera: Camera = given(&camera)?;
        Ok(self.0.borrow_mut().lit.look_from(&camera)?)
    }

    /// Makes the light anew, placed for what is seen now: best once the camera rests.
    pub fn place(&self) {
        self.0.borrow_mut().lit.place();
    }

    /// Makes light for some milliseconds and draws the picture, as large as the canvas, where it is another one by now. Returns
    /// whether there is more to come: then call it again with the next frame.
    pub fn render(&self) -> Result<bool, JsError> {
        Ok(self.0.borrow_mut().render()?)
    }

    /// What is known of the scene and its light.
    pub fn stats(&self) -> Result<JsStats, JsError> {
        let stats = self.0.borrow().lit.stats();
        Ok(told(&stats)?.unchecked_into())
    }
}

impl State {
    fn render(&mut self) -> girandole::Result<bool> {
        self.gpu.poll()?;
        let Self { canvas, surface, config, gpu, lit } = self;
        let size = [canvas.width(), canvas.height()];
        if size.contains(&0) {
            return Ok(false);
        }
        if size != [config.width, config.height] {
            (config.width, config.height) = (size[0], size[1]);
            surface.configure(&gpu.device, config);
        }
        let mut shown = None;
        let until = now() + SLICE;
        let is_more = lit.render(
            (size, config.format),
            || now() < until,
            || match surface.get_current_texture() {
                wgpu::CurrentSurfaceTexture::Success(texture)
                | wgpu::CurrentSurfaceTexture::Suboptimal(texture) => {
                    let view = texture.texture.create_view(&Default::default());
                    shown = Some(texture);
                    Some(view)
                }
                _ => None,
            },
        )?;
        if let Some(texture) = shown {
            gpu.queue.present(texture);
        }
        Ok(is_more)
    }
}

/// What JavaScript gave. What is no number there is none here, and not left out.
fn given<T: DeserializeOwned>(value: &JsValue) -> Result<T, JsError> {
    let text = JSON::stringify(value).ok().and_then(|text| text.as_string()).unwrap_or_default();
    let value: Value = serde_json::from_str(&text)?;
    let nothing = value.as_object().into_iter().flatten().find(|(_, value)| value.is_null());
    if let Some((name, _)) = nothing {
        return Err(JsError::new(&format!("`{name}` is no number; leave it out or give one")));
    }
    Ok(serde_json::from_value(value)?)
}

/// The same for JavaScript.
fn told(value: &impl Serialize) -> Result<JsValue, JsError> {
    JSON::parse(&serde_json::to_string(value)?).map_err(|error| JsError::new(&format!("{error:?}")))
}

/// Milliseconds of the page's clock.
fn now() -> f64 {
    web_sys::window().and_then(|window| window.performance()).map_or(0.0, |clock| clock.now())
}

async fn scene(source: JsValue) -> Result<Scene, JsError> {
    let (name, bytes) = match source.as_string() {
        Some(name) if builtin::NAMES.contains(&name.as_str()) => {
            return Ok(builtin::build(&name, builtin::default_object(&name))?);
        }
        Some(address) => (address, None),
        None => {
            let bytes = Uint8Array::new(&source).to_vec();
            (format!("scene.{}", kind(&bytes)), Some(bytes))
        }
    };
    let path = PathBuf::from(name);
    let load = async || {
        // Each time: another scene of that name may have been loaded meanwhile.
        bytes.iter().for_each(|bytes| files::hold(&path, bytes.clone()));
        let path = path.clone();
        let mut loading =
            Slices::new(async move { Scene::load_in_slices(&path, LoadOptions::default()).await });
        loop {
            if let Some(scene) = loading.step() {
                break scene;
            }
            let_go().await;
        }
    };
    let scene = girandole::browser::gather(load).await;
    files::release();
    Ok(scene?)
}

/// Lets the browser do what waits.
async fn let_go() {
    let promise = Promise::new(&mut |resolve, _| {
        if let Some(window) = web_sys::window() {
            // Without a time there is nothing to be refused.
            let _ = window.set_timeout_with_callback(&resolve);
        }
    });
    let _ = JsFuture::from(promise).await;
}

/// What bytes are of, as the end of a file's name.
fn kind(bytes: &[u8]) -> &'static str {
    let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
    match () {
        () if bytes.starts_with(b"glTF") => "glb",
        () if bytes.starts_with(b"ply") => "ply",
        () if first == Some(&b'{') => "gltf",
        () => "obj",
    }
}
