// After the last batch of lights: radiance of this sub-pixel sample, added to those before it; after the last sample,
// written out.

@group(2) @binding(0) var ids: texture_2d<u32>;
@group(2) @binding(1) var light: texture_2d<f32>; // irradiance
@group(2) @binding(4) var second: texture_2d<f32>; // specular radiance, or the direction of light
@group(2) @binding(2) var<storage, read_write> sums: array<vec4f>;
@group(2) @binding(3) var picture: texture_storage_2d<rg32uint, write>;

override SPECULAR: bool; // whether any material has a specular lobe

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  var sent = vec3f(0.0);
  let id = textureLoad(ids, pixel, 0).x;
  if id > 0u {
    let m = materials[triangles[id - 1u].material];
    var hit: Hit;
    if has_textures(m) { hit = with_coordinates(pixel, hit_at(pixel, id - 1u)); }
    let point = vec2u(pixel.x, pixel.y - frame.band.x);
    // Of a single-sided surface only the front is ever seen.
    var paint = paint_of(triangles[id - 1u].material);
    if TEXTURES {
      paint.albedo = reflection(hit, m).albedo / PI;
      paint.emission *= sample_at(m.emission_texture, hit).xyz;
    }
    var other = vec4f(0.0);
    if SPECULAR { other = textureLoad(second, point, 0); }
    sent = radiance_of(paint, textureLoad(light, point, 0).xyz, other);
  }
  add_sample(pixel, sent);
}
