// Fused shading, see lib/shade_chunk.wgsl.

@group(2) @binding(5) var<storage, read> point_queue: PointQueue;

// A chunk an invocation.
@compute @workgroup_size(WORKGROUP)
fn shade_points(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x < point_queue.chunks { shade_chunk(invocation.x); }
}

var<workgroup> irradiances: array<vec3f, WORKGROUP>;
var<workgroup> directionals: array<vec3f, WORKGROUP>;
var<workgroup> weights: array<vec2f, WORKGROUP>; // of samples of the environment: those that are seen, and all

fn add_light(sums: ptr<function, PointSums>, light: Light, counted: f32) {
  let texel = shadow_texel_of(light, (*sums).shading);
  if add_depth_tested(sums, light, texel, shadow_lookup(texel), 1u, counted) != 0u { add_slope_corrected(sums, light); }
}

// Where points are few: LANES lanes share the list of a point.
@compute @workgroup_size(WORKGROUP)
fn shade_points_cooperative(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
  let lane = local.x % LANES;
  let slot = (group.y * GROUPS_PER_ROW + group.x) * (WORKGROUP / LANES) + local.x / LANES;
  let in_queue = slot / CHUNK < point_queue.chunks;
  let chunk = select(0u, point_queue.words[offsets.chunks_at + slot / CHUNK], in_queue);
  let leaf = chunk_leaf(chunk);
  let exists = slot % CHUNK < chunk_points(chunk);
  let index = select(NONE, point_queue.words[offsets.sorted_at + slot], exists);
  var sums = begin(index, leaf);
  if exists {
    // The sums of earlier batches count once.
    if lane > 0u {
      sums.irradiance = vec3f(0.0);
      sums.specular = vec3f(0.0);
      sums.light_direction = vec3f(0.0);
      sums.seen_weight = 0.0;
      sums.weight = 0.0;
    }
    add_weights(&sums, lane, LANES);
    let all = light_list(leaf);
    add_looked_up_previously(&sums, leaf, all, lane, LANES);
    let list = remaining(leaf, all);
    for (var i = list.unshadowed + lane; i < list.near_unshadowed; i += LANES) {
      let light = lights[listed_light(i)];
      add(&sums, light, arriving(light, sums.shading), 1.0);
    }
    for (var i = list.near_unshadowed + lane; i < list.shadowed; i += LANES) {
      add_in_full(&sums, lights[listed_light(i)], i >= list.near_shadowed, i >= list.jointed);
    }
    for (var i = list.shadowed + lane; i < list.end; i += LANES) {
      add_light(&sums, lights[listed_light(i)], select(0.0, 1.0, i >= list.subtracted));
    }
  }
  let is_direction = HAS_CURVED && sums.shading.reflection.f90 <= 0.0;
  irradiances[local.x] = sums.irradiance;
  directionals[local.x] = select(sums.specular, sums.light_direction, is_direction);
  if REFLECTS_ENVIRONMENT { weights[local.x] = vec2f(sums.seen_weight, sums.weight); }
  workgroupBarrier();
  if lane > 0u || !exists { return; }
  // In order of lanes, so that sums repeat.
  for (var i = 1u; i < LANES; i++) {
    sums.irradiance += irradiances[local.x + i];
    let directional = directionals[local.x + i];
    if is_direction { sums.light_direction += directional; } else { sums.specular += directional; }
    if REFLECTS_ENVIRONMENT {
      sums.seen_weight += weights[local.x + i].x;
      sums.weight += weights[local.x + i].y;
    }
  }
  end(index, leaf, sums);
}
