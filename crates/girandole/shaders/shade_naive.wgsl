// Naive shading: every pixel of the band sums every light of the batch, each with its shadow map. Sums are kept in
// order of lights, in groups of GROUP, so the size of batches (whole groups) and bands changes nothing.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
// Two elements a pixel: irradiance, specular radiance; and the weights of samples of the environment, those that are seen and all.
@group(2) @binding(3) var<storage, read_write> partial_sums: array<vec4f>;
@group(2) @binding(4) var<uniform> maps: Maps;
// The sums as a picture, after the last batch.
@group(2) @binding(5) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(6) var fine_directional: texture_storage_2d<rgba32float, write>;

fn begin(pixel: vec2u) -> PointSums {
  var sums: PointSums;
  let inside = pixel.x < frame.size.x && is_drawn(pixel.x) && pixel.y < frame.band.y;
  let id = select(0u, textureLoad(triangle_ids, min(pixel, frame.size - 1u), 0).x, inside);
  sums.is_surface = id > 0u;
  if !sums.is_surface { return sums; }
  if branch_value(frame.first_light, pixel.x) > 0u {
    let index = 2u * band_index(pixel);
    sums.irradiance = partial_sums[index].xyz;
    sums.specular = partial_sums[index + 1u].xyz;
    sums.seen_weight = partial_sums[index].w;
    sums.weight = partial_sums[index + 1u].w;
  }
  sums.shading = shading_at(pixel, id - 1u);
  if reflects_environment(sums) {
    for (var i = 0u; i < branch_value(frame.end_light - frame.first_light, pixel.x); i++) { sums.weight += weight_in(lights[i], sums.shading); }
  }
  return sums;
}

fn end(pixel: vec2u, sums: PointSums) {
  if !sums.is_surface { return; }
  if branch_value(frame.last_batch, pixel.x) != 0u {
    let point = pixel - vec2u(0u, frame.band.x);
    textureStore(fine_irradiance, point, vec4f(sums.irradiance, 1.0));
    if HAS_SPECULAR { textureStore(fine_directional, point, directional_of(sums)); }
  } else {
    let index = 2u * band_index(pixel);
    partial_sums[index] = vec4f(sums.irradiance, sums.seen_weight);
    partial_sums[index + 1u] = vec4f(sums.specular, sums.weight);
  }
}

// Those of the upper pixel, then those of the lower one: what is long is compiled once.
fn add_all_deferred(upper: ptr<function, PointSums>, lower: ptr<function, PointSums>, first: u32) {
  for (var i = 0u; i < 2u; i++) {
    while any((*upper).deferred != vec4u(0u)) {
      add_in_full(upper, lights[first + next_deferred(upper) - frame.first_light], true, false);
    }
    exchange(upper, lower);
  }
}

// Adds a light by its depth test. Returns its bit if it has to be added in full later.
fn add_unless_near(sums: ptr<function, PointSums>, light: Light, texel: ShadowTexel, stored: f32, bit: u32) -> u32 {
  let a = arriving(light, (*sums).shading);
  let deferred = add_depth_tested(sums, light, texel, stored, select(bit, 0u, a.is_near), 0.0);
  return select(deferred, bit, a.is_near);
}

// An invocation shades two pixels, one above the other: lights are read once for both.
@compute @workgroup_size(TILE, TILE / 2u)
fn shade_naive(@builtin(global_invocation_id) invocation: vec3u) {
  let upper_pixel = vec2u(invocation.x, 2u * invocation.y + frame.band.x);
  let lower_pixel = upper_pixel + vec2u(0u, 1u);
  var upper: PointSums;
  var lower: PointSums;
  for (var i = 0u; i < 2u; i++) {
    upper = lower;
    lower = begin(select(lower_pixel, upper_pixel, i == 0u));
  }
  if !upper.is_surface && !lower.is_surface { return; }
  let end_light = branch_value(frame.end_light, upper_pixel.x);
  for (var first = branch_value(frame.first_light, upper_pixel.x); first < end_light; first += GROUP) {
    for (var word = 0u; word < GROUP / 32u; word++) {
      let start = first + 32u * word;
      let end = min(start + 32u, end_light);
      var upper_bits = 0u;
      var lower_bits = 0u;
      for (var i = start; i < end; i++) {
        let light = lights[i - frame.first_light];
        let bit = 1u << (i - start);
        // Both texels are fetched before either is used: this loop is bound by memory latency.
        let upper_texel = shadow_texel_of(light, upper.shading);
        let lower_texel = shadow_texel_of(light, lower.shading);
        let upper_depth = shadow_lookup(upper_texel);
        let lower_depth = shadow_lookup(lower_texel);
        upper_bits |= add_unless_near(&upper, light, upper_texel, upper_depth, bit);
        lower_bits |= add_unless_near(&lower, light, lower_texel, lower_depth, bit);
      }
      upper.deferred[word] = upper_bits;
      lower.deferred[word] = lower_bits;
    }
    add_all_deferred(&upper, &lower, first);
  }
  for (var i = 0u; i < 2u; i++) {
    end(select(lower_pixel, upper_pixel, i == 0u), upper);
    upper = lower;
  }
}
