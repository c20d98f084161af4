// Debug view: each leaf receiver in its colour, a little darker where the surface turns away.

@group(2) @binding(0) var<storage, read> surfaces: array<vec4u>;
@group(2) @binding(1) var<storage, read> colors: array<vec4f>;
@group(2) @binding(2) var radiance: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let surface = surfaces[band_index(pixel)];
  if surface.x == 0u {
    textureStore(radiance, pixel, vec4f(0.0));
    return;
  }
  let facing = abs(dot(unpack_normal(surface.y), normalize(pixel_ray(vec2f(pixel) + frame.offset).direction)));
  textureStore(radiance, pixel, vec4f(colors[surface.z & LEAF].xyz * (0.6 + 0.4 * facing), 1.0));
}
