// Fused shading: each point sums the lights of its leaf receiver (Barczak §4.3.1). Points are sorted by leaf, so that
// neighbours read the same list. A list has five kinds of lights: unblocked ones in the light map, which are done;
// unblocked ones that are not in the map, summed without a shadow test; those that something may block, summed where
// their shadow map finds them lit; those of these behind a joint of walls, which take a closer look; and the same as the third
// kind in the light map, subtracted where it finds them dark (§4.3.2). Those of the second and third kind for whose rectangle some
// point of the leaf is near, and those behind joints, have a loop of their own.
//
// A pass that uses it declares `point_queue`; `lights` and `atlas` are declared in lib/lights_*.wgsl, lib/atlas_*.wgsl.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
// The sums of earlier batches of lights, two elements a pixel: irradiance; specular radiance, or the direction of light.
// And the samples, see lib/samples.wgsl.
@group(2) @binding(3) var<storage, read_write> partial_sums: array<vec4f>;
@group(2) @binding(4) var<uniform> maps: Maps;
@group(2) @binding(6) var<storage, read> light_lists: array<u32>;
@group(2) @binding(7) var<storage, read> light_maps: array<vec4f>;
@group(2) @binding(8) var<uniform> offsets: BufferOffsets;
// The grid of points: irradiance and surface id; specular radiance, or the direction of light.
@group(2) @binding(9) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(10) var fine_directional: texture_storage_2d<rgba32float, write>;
@group(2) @binding(11) var surface_ids: texture_2d<u32>;
@group(2) @binding(12) var picture: texture_storage_2d<rg32uint, write>;

// A point of the band by its index, NONE = no point.
fn begin(index: u32, leaf: u32) -> PointSums {
  var sums: PointSums;
  sums.is_surface = index != NONE;
  if !sums.is_surface { return sums; }
  let pixel = vec2u(index % frame.size.x, index / frame.size.x + frame.band.x);
  sums.shading = shading_at(pixel, textureLoad(triangle_ids, pixel, 0).x - 1u);
  if branch_value(frame.first_light, index) > 0u {
    sums.irradiance = partial_sums[2u * index].xyz;
    let directional = partial_sums[2u * index + 1u];
    if directional.w > 0.0 { sums.light_direction = directional.xyz; } else { sums.specular = directional.xyz; }
    if REFLECTS_ENVIRONMENT {
      sums.seen_weight = partial_sums[2u * index].w;
      sums.weight = max(-directional.w, 0.0);
    }
    // In this order: with the uniform first, Mesa 22.3 crashes when it binds the kernel.
  } else if has_light_map(leaf) && branch_value(offsets.light_maps, index) != 0u {
    sums.irradiance = mapped_irradiance(leaf, sums.shading.position);
  }
  return sums;
}

fn end(index: u32, leaf: u32, sums: PointSums) {
  if !sums.is_surface { return; }
  let directional = directional_of(sums);
  if branch_value(frame.debug | (frame.last_batch ^ 1u), index) != 0u {
    let is_last = select(true, frame.last_batch != 0u, REFLECTS_ENVIRONMENT);
    partial_sums[2u * index] = vec4f(sums.irradiance, select(sums.seen_weight, f32(frame.step), is_last));
    partial_sums[2u * index + 1u] = vec4f(directional.xyz, select(-sums.weight, directional.w, is_last | (directional.w > 0.0)));
  }
  if branch_value(frame.last_batch, index) != 0u {
    let at = vec2u(index % frame.size.x, index / frame.size.x);
    let pixel = at + vec2u(0u, frame.band.x);
    var irradiance = max(sums.irradiance, vec3f(0.0));
    if HAS_MIRRORS && shows_no_light(sums.shading.reflection) { irradiance = vec3f(0.0); }
    let surface = textureLoad(surface_ids, pixel, 0).xy;
    if branch_value(frame.writes_radiance, index) != 0u {
      add_sample(pixel, radiance_of(diffuse_material(surface.y), irradiance, directional), true);
    } else {
      let point = (at + frame.step - 1u) / frame.step;
      textureStore(fine_irradiance, point,
        vec4f(irradiance, spaced_surface_id(surface.x, pixel, sums.shading.position, sums.shading.ng, leaf)));
      if HAS_CURVED || HAS_SPECULAR { textureStore(fine_directional, point, directional); }
    }
  }
}

// Adds the weights of the batch's samples of the environment, seen or not: those of one lane of `lanes`.
fn add_weights(sums: ptr<function, PointSums>, lane: u32, lanes: u32) {
  if !reflects_environment(*sums) { return; }
  let count = branch_value(frame.end_light - frame.first_light, lane);
  for (var i = lane; i < count; i += lanes) {
    (*sums).weight += weight_in(lights[i], (*sums).shading);
  }
}

// Adds to one point, and then to the other, the lights of a list from `first_near` on that may be near, and those of a group that are
// ambiguous, of which `first` is the first entry of the list. Both are rare, and take the longest code by far: it is compiled once.
fn add_rare(
  one: ptr<function, PointSums>,
  other: ptr<function, PointSums>,
  list: LightList,
  first_near: u32,
  first: u32,
) {
  for (var point = 0u; point < 2u; point++) {
    var near = first_near;
    while near < list.shadowed || any((*one).deferred != vec4u(0u)) {
      var entry = near;
      if near < list.shadowed { near++; } else { entry = first + next_deferred(one); }
      let is_jointed = entry >= list.jointed && entry < list.shadowed;
      add_in_full(one, lights[listed_light(entry)], entry >= list.near_shadowed, is_jointed);
    }
    exchange(one, other);
  }
}

// The points of a chunk, two at most: lights are read once for both.
fn shade_chunk(index: u32) {
  let chunk = point_queue.words[offsets.chunks_at + index];
  let leaf = chunk_leaf(chunk);
  let slot = offsets.sorted_at + index * CHUNK;
  let all = light_list(leaf);
  var one: PointSums;
  var other: PointSums;
  for (var i = chunk_points(chunk); i > 0u; i--) {
    other = one;
    one = begin(point_queue.words[slot + i - 1u], leaf);
    add_weights(&one, 0u, 1u);
    add_looked_up_previously(&one, leaf, all, 0u, 1u);
  }
  if !one.is_surface && !other.is_surface { return; }
  let list = remaining(leaf, all);
  for (var i = list.unshadowed; i < list.near_unshadowed; i++) {
    let light = lights[listed_light(i)];
    add(&one, light, arriving(light, one.shading), 1.0);
    add(&other, light, arriving(light, other.shading), 1.0);
  }
  var first_near = list.near_unshadowed;
  for (var first = list.shadowed; first < list.end || first_near < list.shadowed; first += GROUP) {
    for (var word = 0u; word < GROUP / 32u; word++) {
      let start = first + 32u * word;
      let end = min(start + 32u, list.end);
      var one_bits = 0u;
      var other_bits = 0u;
      // Two lights at a time, the last one alone where they are odd: four texels are fetched at once, as this loop is
      // bound by memory latency.
      for (var i = start; i < end; i += 2u) {
        let light = lights[listed_light(i)];
        let next = lights[listed_light(min(i + 1u, end - 1u))];
        let bit = 1u << (i - start);
        let next_bit = select(0u, bit << 1u, i + 1u < end);
        let counted = select(0.0, 1.0, i >= list.subtracted);
        let next_counted = select(0.0, 1.0, i + 1u >= list.subtracted);
        var one_texel = shadow_texel_of(light, one.shading);
        let other_texel = shadow_texel_of(light, other.shading);
        let one_next_texel = shadow_texel_of(next, one.shading);
        let other_next_texel = shadow_texel_of(next, other.shading);
        let others = other_texel.in_atlas | one_next_texel.in_atlas | other_next_texel.in_atlas;
        one_texel.in_atlas = address_after(one_texel.in_atlas, others);
        let one_depth = shadow_lookup(one_texel);
        let other_depth = shadow_lookup(other_texel);
        let one_next_depth = shadow_lookup(one_next_texel);
        let other_next_depth = shadow_lookup(other_next_texel);
        one_bits |= add_depth_tested(&one, light, one_texel, one_depth, bit, counted);
        other_bits |= add_depth_tested(&other, light, other_texel, other_depth, bit, counted);
        one_bits |= add_depth_tested(&one, next, one_next_texel, one_next_depth, next_bit, next_counted);
        other_bits |= add_depth_tested(&other, next, other_next_texel, other_next_depth, next_bit, next_counted);
      }
      one.deferred[word] = one_bits;
      other.deferred[word] = other_bits;
    }
    add_rare(&one, &other, list, first_near, first);
    first_near = list.shadowed;
  }
  for (var i = chunk_points(chunk); i > 0u; i--) {
    end(point_queue.words[slot + chunk_points(chunk) - i], leaf, one);
    one = other;
  }
}
