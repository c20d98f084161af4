// What surfaces that let light through send and leave of what lies behind, layer by layer from the nearest (Porter and Duff
// 1984), and then behind them the picture. Three elements a pixel:
//
//   what a sample's layers so far let through
//   sums over samples: radiance of their layers
//                      what these let through

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var irradiance: texture_2d<f32>;
@group(2) @binding(2) var directional: texture_2d<f32>;
@group(2) @binding(6) var<storage, read_write> layer_sums: array<vec4f>;
@group(2) @binding(4) var picture: texture_2d<u32>;
@group(2) @binding(5) var with_layers: texture_storage_2d<rg32uint, write>;

override HAS_SPECULAR: bool; // whether any material has a specular lobe

// Adds layer `frame.batch`.
@compute @workgroup_size(TILE, TILE)
fn add_layer(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let at = 3u * band_index(pixel);
  var passed = vec4f(1.0);
  let batch = branch_value(frame.batch, pixel.x);
  if batch > 0u { passed = layer_sums[at]; }
  var sent = vec4f(0.0);
  let id = textureLoad(triangle_ids, pixel, 0).x;
  if id > 0u {
    let m = materials[triangles[id - 1u].material];
    let hit = with_coordinates(pixel, hit_at(pixel, id - 1u));
    let r = reflection(hit, m);
    let point = vec2u(pixel.x, pixel.y - frame.band.x);
    let diffuse = DiffuseMaterial(triangles[id - 1u].material, r.albedo / PI, m.emission * emission_factor(hit, m));
    var other = vec4f(0.0);
    if HAS_SPECULAR { other = textureLoad(directional, point, 0); }
    let radiance = radiance_of(diffuse, textureLoad(irradiance, point, 0).xyz, other);
    sent = passed * vec4f(radiance + reflected_environment(pixel, id - 1u, -other.w) + mirrored_at(pixel), 0.0);
    passed *= vec4f(transmittance(r, abs(dot(shading_normal(hit, m), hit.wo))), 1.0);
  }
  layer_sums[at] = passed;
  if branch_value(frame.sample, pixel.x) == 0u && batch == 0u {
    layer_sums[at + 1u] = sent;
    layer_sums[at + 2u] = vec4f(0.0);
  } else {
    layer_sums[at + 1u] += sent;
  }
  if branch_value(frame.last_batch, pixel.x) != 0u { layer_sums[at + 2u] += passed; }
}

@compute @workgroup_size(TILE, TILE)
fn put_before(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let at = 3u * band_index(pixel);
  let sent = layer_sums[at + 1u].xyz / f32(frame.samples);
  let passed = layer_sums[at + 2u].xyz / f32(frame.samples);
  let words = textureLoad(picture, pixel, 0).xy;
  let radiance = sent + passed * unpack_radiance(words);
  let left = dot(passed, vec3f(1.0 / 3.0)) * (1.0 - coverage_of(words));
  textureStore(with_layers, pixel, pack_pixel(radiance, select(1.0 - left, 0.0, left >= 1.0)));
}
