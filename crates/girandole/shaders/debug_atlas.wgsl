// Debug view: the first page of the shadow atlas, near blockers bright.

@group(2) @binding(0) var picture: texture_storage_2d<rg32uint, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let page = textureDimensions(atlas).xy;
  // The whole page, its aspect kept.
  let scale = max(vec2f(page) / vec2f(frame.size), vec2f(0.0));
  let texel = vec2u(vec2f(pixel) * max(scale.x, scale.y));
  var value = 0.0;
  if all(texel < page) {
    let stored = atlas_at(texel, 0u);
    // Stored is near / distance; shown is distance, on the scale of the scene.
    if stored > 0.0 { value = exp(-4.0 * NEAR / stored / frame.far); }
  }
  textureStore(picture, pixel, pack_radiance(vec3f(value)));
}

override NEAR: f32;
