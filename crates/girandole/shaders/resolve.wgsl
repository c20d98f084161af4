// After the last batch of lights: radiance of this sub-pixel sample, added to those before it; after the last sample,
// written out.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var irradiance: texture_2d<f32>;
@group(2) @binding(4) var directional: texture_2d<f32>; // specular radiance, or the direction of light
@group(2) @binding(2) var<storage, read_write> partial_sums: array<vec4f>;
@group(2) @binding(3) var picture: texture_storage_2d<rg32uint, write>;

override HAS_SPECULAR: bool; // whether any material has a specular lobe

@compute @workgroup_size(TILE, TILE)
fn resolve(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  var sent = vec3f(0.0);
  let id = textureLoad(triangle_ids, pixel, 0).x;
  if id > 0u {
    let m = materials[triangles[id - 1u].material];
    var hit: Hit;
    if varies(m) { hit = with_coordinates(pixel, hit_at(pixel, id - 1u)); }
    let point = vec2u(pixel.x, pixel.y - frame.band.x);
    // Of a single-sided surface only the front is ever seen.
    var diffuse = diffuse_material(triangles[id - 1u].material);
    if HAS_TEXTURES {
      diffuse.albedo = reflection(hit, m).albedo / PI;
      diffuse.emission *= emission_factor(hit, m);
    }
    var other = vec4f(0.0);
    if HAS_SPECULAR { other = textureLoad(directional, point, 0); }
    sent = radiance_of(diffuse, textureLoad(irradiance, point, 0).xyz, other) + reflected_environment(pixel, id - 1u, -other.w);
  }
  add_sample(pixel, sent, id > 0u);
}
