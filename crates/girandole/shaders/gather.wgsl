// Fused shading: each point walks the lights of its leaf receiver (Barczak §4.3.1). Points are sorted by leaf, so that
// neighbours walk the same list. A list has four kinds of lights: those in the light map that nothing blocks,
// which are done; those that nothing blocks and that are not in the map, summed without a look; those that something
// may block, summed by what their shadow map says; and the same in the light map, subtracted where they are blocked
// (§4.3.2). `lights` are declared in lib/lights_uniform.wgsl or lib/lights_storage.wgsl.

@group(2) @binding(0) var ids: texture_2d<u32>;
// What earlier batches of lights gave, two elements a pixel: irradiance; specular radiance, or the direction of light.
// And the samples, see lib/samples.wgsl.
@group(2) @binding(3) var<storage, read_write> sums: array<vec4f>;
@group(2) @binding(4) var<uniform> maps: Maps;
@group(2) @binding(5) var<storage, read_write> queue: array<atomic<u32>>;
@group(2) @binding(6) var<storage, read> lists: array<u32>;
@group(2) @binding(7) var<storage, read> light_maps: array<vec4f>;
@group(2) @binding(8) var<uniform> plan: Plan;
// The grid of points: irradiance and key of the surface; the second element.
@group(2) @binding(9) var fine_light: texture_storage_2d<rgba32float, write>;
@group(2) @binding(10) var fine_second: texture_storage_2d<rgba32float, write>;
@group(2) @binding(11) var keys: texture_2d<u32>;
@group(2) @binding(12) var picture: texture_storage_2d<rg32uint, write>;

// In `queue`, for lib/take.wgsl: the next chunk, and how many have left.
const CURSOR = 2u;
const LEFT = 3u;

fn queued(at: u32) -> u32 { return atomicLoad(&queue[at]); }

fn begin(index: u32, leaf: u32) -> State {
  var state: State;
  state.is_surface = index != NONE;
  if !state.is_surface { return state; }
  let pixel = vec2u(index % frame.size.x, index / frame.size.x + frame.band.x);
  state.shading = shading_at(pixel, textureLoad(ids, pixel, 0).x - 1u);
  if tied(frame.first_light, index) > 0u {
    state.irradiance = sums[2u * index].xyz;
    let second = sums[2u * index + 1u];
    if second.w > 0.0 { state.toward = second.xyz; } else { state.glossy = second.xyz; }
    // In this order: with the uniform first, Mesa 22.3 crashes when it binds the kernel.
  } else if lists[leaf * LEAF_WORDS] != NO_MAP && tied(plan.light_maps, index) != 0u {
    state.irradiance = mapped_irradiance(leaf * LEAF_WORDS, state.shading.position);
  }
  return state;
}

fn end(index: u32, state: State) {
  if !state.is_surface { return; }
  let is_direction = CURVED && state.shading.reflection.f90 <= 0.0;
  let second = select(vec4f(state.glossy, 0.0), vec4f(state.toward, 1.0), is_direction);
  if tied(frame.debug | (frame.last_batch ^ 1u), index) != 0u {
    sums[2u * index] = vec4f(state.irradiance, f32(frame.step));
    sums[2u * index + 1u] = second;
  }
  if tied(frame.last_batch, index) != 0u {
    let at = vec2u(index % frame.size.x, index / frame.size.x);
    let pixel = at + vec2u(0u, frame.band.x);
    let irradiance = max(state.irradiance, vec3f(0.0));
    let shown = textureLoad(keys, pixel, 0).xy;
    if FINAL {
      add_sample(pixel, radiance_of(paint_of(shown.y), irradiance, second));
    } else {
      let point = (at + frame.step - 1u) / frame.step;
      textureStore(fine_light, point, vec4f(irradiance, f32(shown.x)));
      if CURVED || SPECULAR { textureStore(fine_second, point, second); }
    }
  }
}

fn second_looks(state: ptr<function, State>, first: u32) {
  while any((*state).doubtful != vec4u(0u)) { second_sum(state, lights[lists[first + next_doubtful(state)]]); }
}

@compute @workgroup_size(WIDTH)
fn main(@builtin(global_invocation_id) invocation: vec3u, @builtin(num_workgroups) groups: vec3u) {
  let chunks = queued(1u);
  var chunk = invocation.x;
  for (var taken = 0u; taken < select(1u, QUOTA, TAKES); taken++) {
    if TAKES { chunk = atomicAdd(&queue[CURSOR], 1u); }
    if chunk >= chunks { break; }
    shade_chunk(chunk);
  }
  if TAKES && atomicAdd(&queue[LEFT], 1u) + 1u == WIDTH * groups.x {
    atomicStore(&queue[CURSOR], 0u);
    atomicStore(&queue[LEFT], 0u);
  }
}

// Two points of a leaf: lights are read once for both.
fn shade_chunk(chunk: u32) {
  let record = queued(plan.chunks_at + chunk);
  let leaf = record & 0xffffffu;
  let slot = plan.sorted_at + chunk * CHUNK;
  let first_index = queued(slot);
  let second_index = select(NONE, queued(slot + 1u), (record >> 24u) > 1u);
  var one = begin(first_index, leaf);
  var other = begin(second_index, leaf);
  if !one.is_surface && !other.is_surface { return; }
  let range = plan.ranges_at + (leaf * plan.batches + frame.batch) * RANGE;
  let has_maps = plan.light_maps != 0u;
  let unshadowed = lists[range + select(0u, 1u, has_maps)];
  let shadowed = lists[range + 2u];
  let end_of_list = lists[range + 4u];
  let subtracted = select(end_of_list, lists[range + 3u], has_maps);
  for (var i = unshadowed; i < shadowed; i++) {
    let light = lights[lists[i]];
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
        let light = lights[lists[i]];
        let next = lights[lists[min(i + 1u, end - 1u)]];
        let bit = 1u << (i - start);
        let next_bit = select(0u, bit << 1u, i + 1u < end);
        let known = select(0.0, 1.0, i >= subtracted);
        let next_known = select(0.0, 1.0, i + 1u >= subtracted);
        // Memory is what this loop waits for: four texels are on their way at once. None is asked for before all places
        // are known, which compilers would not see to by themselves.
        var one_aim = aim_at(light, one.shading);
        let other_aim = aim_at(light, other.shading);
        let one_next = aim_at(next, one.shading);
        let other_next = aim_at(next, other.shading);
        one_aim.at += (other_aim.at | one_next.at | other_next.at) >> vec3u(31u);
        let one_look = look(one_aim);
        let other_look = look(other_aim);
        let one_next_look = look(one_next);
        let other_next_look = look(other_next);
        one_bits |= first_sum(&one, light, one_aim, one_look, bit, known);
        other_bits |= first_sum(&other, light, other_aim, other_look, bit, known);
        one_bits |= first_sum(&one, next, one_next, one_next_look, next_bit, next_known);
        other_bits |= first_sum(&other, next, other_next, other_next_look, next_bit, next_known);
      }
      one.doubtful[word] = one_bits;
      other.doubtful[word] = other_bits;
    }
    second_looks(&one, first);
    second_looks(&other, first);
  }
  end(first_index, one);
  end(second_index, other);
}

// Where points are few, a device with thousands of lanes has more of them: LANES lanes share a point's lists.
const LANES = 16u;

var<workgroup> shares: array<vec3f, 64>;
var<workgroup> second_shares: array<vec3f, 64>;

fn sum_now(state: ptr<function, State>, light: Light, known: f32) {
  let aim = aim_at(light, (*state).shading);
  if first_sum(state, light, aim, look(aim), 1u, known) != 0u { second_sum(state, light); }
}

@compute @workgroup_size(64)
fn wide(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
  let lane = local.x % LANES;
  let slot = (group.y * WIDE_GROUPS + group.x) * (64u / LANES) + local.x / LANES;
  let chunk = slot / CHUNK;
  let record = select(0u, queued(plan.chunks_at + chunk), chunk < queued(1u));
  let leaf = record & 0xffffffu;
  let exists = slot % CHUNK < (record >> 24u);
  let index = select(NONE, queued(plan.sorted_at + slot), exists);
  var state = begin(index, leaf);
  if exists {
    // What there is so far counts once.
    if lane > 0u {
      state.irradiance = vec3f(0.0);
      state.glossy = vec3f(0.0);
      state.toward = vec3f(0.0);
    }
    let range = plan.ranges_at + (leaf * plan.batches + frame.batch) * RANGE;
    let has_maps = plan.light_maps != 0u;
    let shadowed = lists[range + 2u];
    let end_of_list = lists[range + 4u];
    let subtracted = select(end_of_list, lists[range + 3u], has_maps);
    for (var i = lists[range + select(0u, 1u, has_maps)] + lane; i < shadowed; i += LANES) {
      let light = lights[lists[i]];
      add(&state, light, arriving(light, state.shading), 1.0);
    }
    for (var i = shadowed + lane; i < end_of_list; i += LANES) {
      sum_now(&state, lights[lists[i]], select(0.0, 1.0, i >= subtracted));
    }
  }
  let is_direction = CURVED && state.shading.reflection.f90 <= 0.0;
  shares[local.x] = state.irradiance;
  second_shares[local.x] = select(state.glossy, state.toward, is_direction);
  workgroupBarrier();
  if lane > 0u || !exists { return; }
  // In order of lanes, so that sums repeat.
  for (var i = 1u; i < LANES; i++) {
    state.irradiance += shares[local.x + i];
    let second = second_shares[local.x + i];
    if is_direction { state.toward += second; } else { state.glossy += second; }
  }
  end(index, state);
}

const WIDE_GROUPS = 32768u; // of a row of workgroups
