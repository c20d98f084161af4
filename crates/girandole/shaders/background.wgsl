// Puts the environment behind the picture, as far as no surface is seen.

@group(2) @binding(0) var environment: texture_2d<f32>;
@group(2) @binding(1) var picture: texture_2d<u32>;
@group(2) @binding(2) var with_background: texture_storage_2d<rg32uint, write>;

@compute @workgroup_size(TILE, TILE)
fn background(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = invocation.xy;
  if any(pixel >= frame.size) { return; }
  let words = textureLoad(picture, pixel, 0).xy;
  let coverage = coverage_of(words);
  var radiance = unpack_radiance(words);
  if coverage < 1.0 {
    let ray = pixel_ray(vec2f(pixel) + 0.5);
    radiance += (1.0 - coverage) * environment_from(normalize(ray.direction));
  }
  textureStore(with_background, pixel, pack_pixel(radiance, 1.0));
}
