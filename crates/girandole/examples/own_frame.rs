//! One encoder, two renderers: a triangle of the program's own with depth, then a lit room round it, into an HDR target;
//! `own_frame.exr` shows both.

use girandole::core::glam::{DAffine3, DVec3, Mat4, Vec3};
use girandole::core::illumination::{Illumination, IlluminationSettings};
use girandole::core::image::Image;
use girandole::core::scene::{View, builtin};
use girandole::core::tonemap::{Exposure, Tonemap};
use girandole::{Gpu, RenderSettings, Renderer, RendererOptions, Target, wgpu};

const SIZE: [u32; 2] = [640, 480];
const SHADER: &str = "
@group(0) @binding(0) var<uniform> clip_from_world: mat4x4f;
@vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
  let corners = array(vec3f(-1.5, 0.2, 0.5), vec3f(1.5, 0.2, -1.0), vec3f(0.0, 2.2, -0.2));
  return clip_from_world * vec4f(corners[i], 1.0);
}
@fragment fn color() -> @location(0) vec4f { return vec4f(0.1, 1.5, 0.4, 1.0); }";
