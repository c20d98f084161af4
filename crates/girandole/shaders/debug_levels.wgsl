// Debug view: where points were shaded. The coarsest grid is blue, finer ones green, yellow and red, what was
// interpolated is a dim picture of the light.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> partial_sums: array<vec4f>;
@group(2) @binding(3) var irradiance: texture_2d<f32>;
@group(2) @binding(2) var picture: texture_storage_2d<rg32uint, write>;

@compute @workgroup_size(TILE, TILE)
fn show_levels(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let index = band_index(pixel);
  let sum = partial_sums[2u * index];
  let arrived = textureLoad(irradiance, vec2u(pixel.x, pixel.y - frame.band.x), 0).xyz;
  let dim = 0.3 * arrived / (1.0 + max(arrived.x, max(arrived.y, arrived.z)));
  let id = textureLoad(triangle_ids, pixel, 0).x;
  var color = select(vec3f(0.0), dim, id != 0u);
  if id != 0u {
    if sum.w == 1.0 { color = vec3f(0.9, 0.05, 0.03); }
    if sum.w == 2.0 { color = vec3f(0.9, 0.6, 0.02); }
    if sum.w == 4.0 { color = vec3f(0.05, 0.7, 0.1); }
    if sum.w == 8.0 { color = vec3f(0.1, 0.3, 1.0); }
  }
  textureStore(picture, pixel, pack_radiance(color));
}
