// The light that arrives at the points of a grid in an object's box, as spherical harmonics in the object's own space: each light
// sample a directional light there (Barczak §4.4.1; the grid is his suggestion in §4.4.2).
//
// What the object itself hides is part of its transfer and must not count twice. It is in the shadow maps all the same, for the sake of
// everything else. So a map is not looked up at the point, but where the ray to the light leaves the object's box: what is
// seen there from the light is in front of the object. Samples on the object itself are left out, for the same reason.

@group(2) @binding(4) var<uniform> maps: Maps;
@group(2) @binding(6) var<storage, read> light_objects: array<u32>; // the object that each light lies on
@group(2) @binding(7) var<storage, read_write> incident: array<vec4f>; // for each point its coefficients
@group(2) @binding(8) var<storage, read_write> arrivals: array<Arrival>; // for each point the lights of a batch
@group(2) @binding(14) var<uniform> previous_rows: array<vec4u, BATCH / 4u>;

// What arrives from a light: from which direction in the object's space, unit, and its irradiance on a plane that faces it.
struct Arrival { direction: vec3f, padding_a: f32, irradiance: vec3f, padding_b: f32 }

// Where a ray from a point in the object's box leaves it, as a share of the ray.
fn exit_from_box(position: vec3f, ray: vec3f) -> f32 {
  let d = vec3f(
    dot(object.box_from_world_x.xyz, ray), dot(object.box_from_world_y.xyz, ray), dot(object.box_from_world_z.xyz, ray));
  let side = select(-object.margin, 1.0 + object.margin, d > vec3f(0.0));
  let t = select((side - box_from_world(position)) / d, vec3f(1e30), abs(d) < vec3f(1e-12));
  return min(t.x, min(t.y, t.z));
}

// How much of a light is seen from the place where a ray to it leaves the object's box.
fn seen_from(light: Light, index: u32, place: vec3f) -> f32 {
  var position = place;
  let row = previous_rows[index / 4u][index % 4u];
  if row != NONE && object.mover != NONE {
    // The map shows the object where it was, and so its box.
    position = position_at(previous_transforms[row + object.mover], place);
  }
  var to_light = light.position - position;
  if is_parallel(light) { to_light = -light.normal; }
  let facing = normalize(to_light);
  let r = receiver(light, position, facing, dot(facing, light.position - position));
  if !is_parallel(light) && dot(light.normal, to_light) >= 0.0 { return 1.0; }
  if FILTER > 0u { return filtered(light, r); }
  let texel = texel_of(light, r.uv);
  return select(0.0, 1.0, passes_shadow_test(light, r, texel, stored_at(light, texel), false));
}

// What arrives at a point from the light of an index in the batch.
fn arrival_at(position: vec3f, index: u32) -> Arrival {
  let light = lights[index];
  let nothing = Arrival(vec3f(0.0, 0.0, 1.0), 0.0, vec3f(0.0), 0.0);
  let sent_by = light_objects[frame.first_light + index];
  if sent_by == object.index { return nothing; }
  var to_light = light.position - position;
  if is_parallel(light) { to_light = -light.normal; }
  let r2 = dot(to_light, to_light);
  let cos_light = -dot(light.normal, to_light);
  if cos_light <= 0.0 || r2 <= 0.0 { return nothing; }
  let facing = to_light * inverseSqrt(r2);
  var wi = facing;
  let sent = sent_along(light, to_light, cos_light, r2);
  var g = geometric_factor(light, dot(facing, to_light), sent, r2);
  if is_near(light, r2) {
    let mean = rectangle_mean(light, position, facing);
    let vector = mix(mean.vector, to_light * (sent / (r2 * r2)), mean.point_share);
    g = max(dot(vector, facing), 0.0);
    if g <= 0.0 { return nothing; }
    wi = normalize(vector);
  }
  // Parallel light is as long as the box is wide at most.
  let ray = select(to_light, to_light * (2.0 * frame.far), is_parallel(light));
  let exit = exit_from_box(position, ray);
  var seen = 1.0;
  if exit < 1.0 { seen = seen_from(light, index, position + ray * exit); }
  let direction = vec3f(
    dot(object.transfer_from_world_x, wi), dot(object.transfer_from_world_y, wi), dot(object.transfer_from_world_z, wi));
  return Arrival(direction, 0.0, light.intensity * (g * seen), 0.0);
}

// What arrives at each point from each light of the batch.
@compute @workgroup_size(WORKGROUP)
fn arrive(@builtin(workgroup_id) group: vec3u, @builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x >= branch_value(frame.end_light - frame.first_light, invocation.x) { return; }
  arrivals[group.y * BATCH + invocation.x] = arrival_at(grid_position(group.y), invocation.x);
}

// Adds it to the coefficients of each point, in order of lights, so that sums repeat.
@compute @workgroup_size(WORKGROUP)
fn project_arrivals(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
  let coefficients = branch_value(object.bands * object.bands, local.x);
  if local.x >= coefficients { return; }
  let l = u32(sqrt(f32(local.x) + 0.5));
  let m = i32(local.x) - i32(l * (l + 1u));
  let slot = group.y * coefficients + local.x;
  var sum = vec3f(0.0);
  if branch_value(frame.first_light, local.x) > 0u { sum = incident[slot].xyz; }
  let count = branch_value(frame.end_light - frame.first_light, local.x);
  for (var i = 0u; i < count; i++) {
    let arrival = arrivals[group.y * BATCH + i];
    if any(arrival.irradiance > vec3f(0.0)) { sum += arrival.irradiance * harmonic(arrival.direction, l, m); }
  }
  incident[slot] = vec4f(sum, 0.0);
}
