// Debug view: the shadow maps of all lights, in rows; near blockers bright, where there is none dark blue.

@group(2) @binding(0) var picture: texture_storage_2d<rg32uint, write>;
@group(2) @binding(2) var<storage, read> lights: array<Light>;
@group(2) @binding(3) var<uniform> maps: Maps;

const NOTHING = vec3f(0.004, 0.006, 0.02);

// Pixels across a map: as many as leave room for all.
fn side_of_map(count: u32) -> u32 {
  var side = u32(sqrt(f32(frame.size.x) * f32(frame.size.y) / f32(count)));
  while side > 1u && (frame.size.x / side) * (frame.size.y / side) < count { side--; }
  return max(side, 1u);
}

@compute @workgroup_size(TILE, TILE)
fn show_atlas(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let side = side_of_map(frame.end_light);
  let row = frame.size.x / side;
  let cell = pixel / side;
  let index = cell.y * row + cell.x;
  var shown = vec3f(0.0);
  // A line between neighbours, where there is room for one.
  let inner = select(side, side - 1u, side > 8u);
  let place = pixel % side;
  if cell.x < row && index < frame.end_light && all(place < vec2u(inner)) {
    let light = lights[index];
    let texel = vec2u((vec2f(place) + 0.5) / f32(inner) * map_size(light));
    let stored = select(atlas_at(map_origin(light) + texel, map_page(light)), 0.0, light.atlas_slot == NO_MAP);
    // Stored is near / distance.
    let nearness = 1.0 - clamp(NEAR / max(stored, 1e-20) / frame.far, 0.0, 1.0);
    shown = select(NOTHING, vec3f(pow(nearness, 12.0)), stored > 0.0);
  }
  textureStore(picture, pixel, pack_radiance(shown));
}

override NEAR: f32;
