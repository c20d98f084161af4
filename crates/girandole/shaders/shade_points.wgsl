// Fused shading: each point walks the lights of its leaf receiver (Barczak §4.3.1). Points are sorted by leaf, so that
// neighbours walk the same list. A list has four kinds of lights: those in the light map that nothing blocks,
// which are done; those that nothing blocks and that are not in the map, summed without a look; those that something
// may block, summed by what their shadow map says; and the same in the light map, subtracted where they are blocked
// (§4.3.2). `lights` are declared in lib/lights_uniform.wgsl or lib/lights_storage.wgsl.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
// What earlier batches of lights gave, two elements a pixel: irradiance; specular radiance, or the direction of light.
// And the samples, see lib/samples.wgsl.
@group(2) @binding(3) var<storage, read_write> partial_sums: array<vec4f>;
@group(2) @binding(4) var<uniform> maps: Maps;
@group(2) @binding(5) var<storage, read_write> point_queue: array<atomic<u32>>;
@group(2) @binding(6) var<storage, read> light_lists: array<u32>;
@group(2) @binding(7) var<storage, read> light_maps: array<vec4f>;
@group(2) @binding(8) var<uniform> offsets: BufferOffsets;
// The grid of points: irradiance and surface id; the second element.
@group(2) @binding(9) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(10) var fine_directional: texture_storage_2d<rgba32float, write>;
@group(2) @binding(11) var surface_ids: texture_2d<u32>;
@group(2) @binding(12) var picture: texture_storage_2d<rg32uint, write>;

// In `point_queue`, for lib/work_queue.wgsl: the next chunk, and how many have left.
const NEXT_ITEM = 2u;
const DONE = 3u;

fn queue_word(at: u32) -> u32 { return atomicLoad(&point_queue[at]); }

fn begin(index: u32, leaf: u32) -> PointSums {
  var state: PointSums;
  state.is_surface = index != NONE;
  if !state.is_surface { return state; }
  let pixel = vec2u(index % frame.size.x, index / frame.size.x + frame.band.x);
  state.shading = shading_at(pixel, textureLoad(triangle_ids, pixel, 0).x - 1u);
  if non_uniform(frame.first_light, index) > 0u {
    state.irradiance = partial_sums[2u * index].xyz;
    let second = partial_sums[2u * index + 1u];
    if second.w > 0.0 { state.light_direction = second.xyz; } else { state.specular = second.xyz; }
    // In this order: with the uniform first, Mesa 22.3 crashes when it binds the kernel.
  } else if light_lists[leaf * LEAF_WORDS] != NO_MAP && non_uniform(offsets.light_maps, index) != 0u {
    state.irradiance = mapped_irradiance(leaf * LEAF_WORDS, state.shading.position);
  }
  return state;
}

fn end(index: u32, state: PointSums) {
  if !state.is_surface { return; }
  let is_direction = HAS_CURVED && state.shading.reflection.f90 <= 0.0;
  let second = select(vec4f(state.specular, 0.0), vec4f(state.light_direction, 1.0), is_direction);
  if non_uniform(frame.debug | (frame.last_batch ^ 1u), index) != 0u {
    partial_sums[2u * index] = vec4f(state.irradiance, f32(frame.step));
    partial_sums[2u * index + 1u] = second;
  }
  if non_uniform(frame.last_batch, index) != 0u {
    let at = vec2u(index % frame.size.x, index / frame.size.x);
    let pixel = at + vec2u(0u, frame.band.x);
    let irradiance = max(state.irradiance, vec3f(0.0));
    let shown = textureLoad(surface_ids, pixel, 0).xy;
    if WRITES_RADIANCE {
      add_sample(pixel, radiance_of(diffuse_material(shown.y), irradiance, second));
    } else {
      let point = (at + frame.step - 1u) / frame.step;
      textureStore(fine_irradiance, point, vec4f(irradiance, f32(shown.x)));
      if HAS_CURVED || HAS_SPECULAR { textureStore(fine_directional, point, second); }
    }
  }
}

fn resolve_ambiguous(state: ptr<function, PointSums>, first: u32) {
  while any((*state).ambiguous != vec4u(0u)) { add_slope_corrected(state, lights[light_lists[first + next_ambiguous(state)]]); }
}

@compute @workgroup_size(WIDTH)
fn shade_points(@builtin(global_invocation_id) invocation: vec3u, @builtin(num_workgroups) groups: vec3u) {
  let chunks = queue_word(1u);
  var chunk = invocation.x;
  for (var taken = 0u; taken < select(1u, MAX_ITEMS, PERSISTENT_THREADS); taken++) {
    if PERSISTENT_THREADS { chunk = atomicAdd(&point_queue[NEXT_ITEM], 1u); }
    if chunk >= chunks { break; }
    shade_chunk(chunk);
  }
  if PERSISTENT_THREADS && atomicAdd(&point_queue[DONE], 1u) + 1u == WIDTH * groups.x {
    atomicStore(&point_queue[NEXT_ITEM], 0u);
    atomicStore(&point_queue[DONE], 0u);
  }
}

// Two points of a leaf: lights are read once for both.
fn shade_chunk(chunk: u32) {
  let record = queue_word(offsets.chunks_at + chunk);
  let leaf = record & 0xffffffu;
  let slot = offsets.sorted_at + chunk * CHUNK;
  let first_index = queue_word(slot);
  let second_index = select(NONE, queue_word(slot + 1u), (record >> 24u) > 1u);
  var one = begin(first_index, leaf);
  var other = begin(second_index, leaf);
  if !one.is_surface && !other.is_surface { return; }
  let range = offsets.ranges_at + (leaf * offsets.batches + frame.batch) * RANGE;
  let has_maps = offsets.light_maps != 0u;
  let unshadowed = light_lists[range + select(0u, 1u, has_maps)];
  let shadowed = light_lists[range + 2u];
  let end_of_list = light_lists[range + 4u];
  let subtracted = select(end_of_list, light_lists[range + 3u], has_maps);
  for (var i = unshadowed; i < shadowed; i++) {
    let light = lights[light_lists[i]];
    add(&one, light, arriving(light, one.shading), 1.0);
    add(&other, light, arriving(light, other.shading), 1.0);
  }
  for (var first = shadowed; first < end_of_list; first += GROUP) {
    for (var word = 0u; word < 4u; word++) {
      let start = first + 32u * word;
      let end = min(start + 32u, end_of_list);
      var one_bits = 0u;
      var other_bits = 0u;
      // Two lights at a time, the last one alone where they are odd.
      for (var i = start; i < end; i += 2u) {
        let light = lights[light_lists[i]];
        let next = lights[light_lists[min(i + 1u, end - 1u)]];
        let bit = 1u << (i - start);
        let next_bit = select(0u, bit << 1u, i + 1u < end);
        let counted = select(0.0, 1.0, i >= subtracted);
        let next_counted = select(0.0, 1.0, i + 1u >= subtracted);
        // Memory is what this loop waits for: four texels are on their way at once. None is asked for before all places
        // are counted, which compilers would not see to by themselves.
        var one_texel = shadow_texel_of(light, one.shading);
        let other_texel = shadow_texel_of(light, other.shading);
        let one_next = shadow_texel_of(next, one.shading);
        let other_next = shadow_texel_of(next, other.shading);
        one_texel.at += (other_texel.at | one_next.at | other_next.at) >> vec3u(31u);
        let one_look = shadow_lookup(one_texel);
        let other_look = shadow_lookup(other_texel);
        let one_next_look = shadow_lookup(one_next);
        let other_next_look = shadow_lookup(other_next);
        one_bits |= add_depth_tested(&one, light, one_texel, one_look, bit, counted);
        other_bits |= add_depth_tested(&other, light, other_texel, other_look, bit, counted);
        one_bits |= add_depth_tested(&one, next, one_next, one_next_look, next_bit, next_counted);
        other_bits |= add_depth_tested(&other, next, other_next, other_next_look, next_bit, next_counted);
      }
      one.ambiguous[word] = one_bits;
      other.ambiguous[word] = other_bits;
    }
    resolve_ambiguous(&one, first);
    resolve_ambiguous(&other, first);
  }
  end(first_index, one);
  end(second_index, other);
}

// Where points are few, a device with thousands of lanes has more of them: LANES lanes share a point's light_lists.
const LANES = 16u;

var<workgroup> shares: array<vec3f, 64>;
var<workgroup> second_shares: array<vec3f, 64>;

fn add_light(state: ptr<function, PointSums>, light: Light, counted: f32) {
  let shadow_texel = shadow_texel_of(light, (*state).shading);
  if add_depth_tested(state, light, shadow_texel, shadow_lookup(shadow_texel), 1u, counted) != 0u { add_slope_corrected(state, light); }
}

@compute @workgroup_size(64)
fn shade_points_cooperative(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
  let lane = local.x % LANES;
  let slot = (group.y * WIDE_GROUPS + group.x) * (64u / LANES) + local.x / LANES;
  let chunk = slot / CHUNK;
  let record = select(0u, queue_word(offsets.chunks_at + chunk), chunk < queue_word(1u));
  let leaf = record & 0xffffffu;
  let exists = slot % CHUNK < (record >> 24u);
  let index = select(NONE, queue_word(offsets.sorted_at + slot), exists);
  var state = begin(index, leaf);
  if exists {
    // What there is so far counts once.
    if lane > 0u {
      state.irradiance = vec3f(0.0);
      state.specular = vec3f(0.0);
      state.light_direction = vec3f(0.0);
    }
    let range = offsets.ranges_at + (leaf * offsets.batches + frame.batch) * RANGE;
    let has_maps = offsets.light_maps != 0u;
    let shadowed = light_lists[range + 2u];
    let end_of_list = light_lists[range + 4u];
    let subtracted = select(end_of_list, light_lists[range + 3u], has_maps);
    for (var i = light_lists[range + select(0u, 1u, has_maps)] + lane; i < shadowed; i += LANES) {
      let light = lights[light_lists[i]];
      add(&state, light, arriving(light, state.shading), 1.0);
    }
    for (var i = shadowed + lane; i < end_of_list; i += LANES) {
      add_light(&state, lights[light_lists[i]], select(0.0, 1.0, i >= subtracted));
    }
  }
  let is_direction = HAS_CURVED && state.shading.reflection.f90 <= 0.0;
  shares[local.x] = state.irradiance;
  second_shares[local.x] = select(state.specular, state.light_direction, is_direction);
  workgroupBarrier();
  if lane > 0u || !exists { return; }
  // In order of lanes, so that sums repeat.
  for (var i = 1u; i < LANES; i++) {
    state.irradiance += shares[local.x + i];
    let second = second_shares[local.x + i];
    if is_direction { state.light_direction += second; } else { state.specular += second; }
  }
  end(index, state);
}

const WIDE_GROUPS = 32768u; // of a row of workgroups
