// How much shadow maps that are stale change some pixels of the picture. A workgroup takes one of them, well spread over the
// picture (Roberts's R2 sequence); its lanes share the lights.
//
// What a stale texel would show is found by a ray from the light through its centre, as the rasteriser would, and goes
// through the same tests as what it shows.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(2) var<storage, read> lights: array<Light>;
@group(2) @binding(3) var picture: texture_2d<u32>;
@group(2) @binding(4) var<uniform> maps: Maps;
@group(2) @binding(5) var<storage, read> stale_maps: array<u32>;
@group(2) @binding(6) var<storage, read> receivers: array<u32>;
@group(2) @binding(7) var<storage, read> light_lists: array<u32>;
@group(2) @binding(8) var<uniform> offsets: BufferOffsets;
// A texel for each pixel: how much its luminance is off, and its luminance.
@group(2) @binding(9) var errors: texture_storage_2d<rgba32float, write>;

// Whatever is hit may bend.
const ANY_BEND = 1e9;
// What depths differ by, as a share, that are the same but for rounding.
const SAME_DEPTH = 1e-4;

var<workgroup> sums: array<f32, WORKGROUP>;

// `mover`: which dynamic object it shows, NONE where that does not matter.
struct SparsePixel { pixel: vec2u, id: u32, shading: Shading, albedo: vec3f, mover: u32 }

fn pixel_of(group: vec3u) -> SparsePixel {
  let index = f32(group.y * textureDimensions(errors).x + group.x);
  let at = fract(0.5 + index * vec2f(0.7548777, 0.5698403));
  var p: SparsePixel;
  p.mover = NONE;
  p.pixel = min(vec2u(at * vec2f(frame.size)), frame.size - 1u);
  p.id = textureLoad(triangle_ids, p.pixel, 0).x;
  if p.id > 0u {
    let m = materials[triangles[p.id - 1u].material];
    var hit: Hit;
    if varies(m) { hit = with_coordinates(p.pixel, hit_at(p.pixel, p.id - 1u)); }
    p.shading = shading_at(p.pixel, p.id - 1u);
    p.albedo = reflection(hit, m).albedo / PI;
  }
  return p;
}

// The ray that a texel's centre stands for.
fn texel_ray(light: Light, uv: vec2f) -> PixelRay {
  let bitangent = cross(light.normal, light.tangent);
  if is_parallel(light) {
    let across = place_shown(parallel_map_of(light), uv * 2.0 - 1.0) / light.scale;
    return PixelRay(light.position + light.tangent * across.x + bitangent * across.y, light.normal);
  }
  let d = decode(uv);
  return PixelRay(light.position, light.tangent * d.x + bitangent * d.y + light.normal * d.z);
}

// What a map stores for a nearness along the ray of its texel.
fn stored_nearness(light: Light, nearness: f32) -> f32 {
  if nearness <= 0.0 { return 0.0; }
  if is_parallel(light) { return 1.0 - 0.5 * light.offset / nearness; }
  return NEAR * nearness;
}

// Whether the light would be seen in a map that is up to date.
fn would_be_lit(light: Light, at: ShadowTexel, stored: f32, is_lit: bool) -> bool {
  // What lets the light pass now is no static object.
  let first_group = select(0u, stale_maps_header_at(0u).first_moving, is_lit);
  let blocker = nearest_blocker(texel_ray(light, centre_of(light, at.texel)), first_group);
  let now = stored_nearness(light, blocker.nearness);
  if is_lit && now <= stored { return true; }
  if abs(now - stored) <= SAME_DEPTH * stored { return is_lit; }
  let answer = depth_test(light, at.receiver, at.texel, now);
  if answer == AMBIGUOUS && is_parallel(light) {
    let here = nearest_blocker(texel_ray(light, at.receiver.uv), first_group);
    return is_lit_behind(light, at.receiver, stored_nearness(light, here.nearness), ANY_BEND);
  }
  if answer == AMBIGUOUS {
    let extrapolated = NEAR * dot(blocker.plane, texel_ray(light, at.receiver.uv).direction);
    return is_lit_behind(light, at.receiver, extrapolated, ANY_BEND);
  }
  return answer == LIT;
}

fn previous_row(index: u32) -> u32 {
  return stale_part_at(STALE_MAPS_HEADER_WORDS + index * STALE_PART_WORDS).previous_row;
}

// How much too bright a light makes a pixel.
fn excess(index: u32, p: SparsePixel) -> f32 {
  let part = stale_part_at(STALE_MAPS_HEADER_WORDS + index * STALE_PART_WORDS);
  if part.first_column >= part.end_column { return 0.0; }
  let light = lights[index];
  let at = shadow_texel_of(light, p.shading);
  let is_before = at.texel < vec2u(part.first_column, part.first_row);
  let is_behind = at.texel >= vec2u(part.end_column, part.end_row);
  if any(is_before) || any(is_behind) || arriving(light, p.shading).g <= 0.0 { return 0.0; }
  let stored = stored_at(light, at.texel);
  var is_lit = passes_shadow_test(light, at.receiver, at.texel, stored, false);
  let would = would_be_lit(light, at, stored, is_lit);
  if p.mover != NONE {
    let then = previous_shadow_texel(light, index, p.shading, p.mover);
    is_lit = passes_shadow_test(light, then.receiver, then.texel, stored_at(light, then.texel), false);
  }
  if is_lit == would { return 0.0; }
  let a = arriving_in_full(light, p.shading);
  var radiance = light.intensity * a.g * p.albedo;
  if HAS_SPECULAR {
    if p.shading.reflection.f90 > 0.0 && a.g > 0.0 { radiance += specular_radiance(light, a, p.shading); }
  }
  return luminance(radiance) * select(-1.0, 1.0, is_lit);
}

// Adds up what the lanes found, always in the same order.
fn store(group: vec3u, lane: u32, p: SparsePixel, sum: f32) {
  sums[lane] = sum;
  workgroupBarrier();
  if lane > 0u { return; }
  var all = 0.0;
  for (var i = 0u; i < WORKGROUP; i++) { all += sums[i]; }
  let words = textureLoad(picture, p.pixel, 0).xy;
  let shown = luminance(unpack_radiance(words));
  textureStore(errors, group.xy, vec4f(abs(all) * coverage_of(words), shown, 0.0, 0.0));
}

// Where every light is looked up.
@compute @workgroup_size(WORKGROUP)
fn of_all_lights(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  let p = pixel_of(group);
  var sum = 0.0;
  if p.id > 0u {
    for (var i = lane; i < frame.end_light; i += WORKGROUP) { sum += excess(i, p); }
  }
  store(group, lane, p, sum);
}

// Where those are looked up that something may block.
@compute @workgroup_size(WORKGROUP)
fn of_listed_lights(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
  var p = pixel_of(group);
  var sum = 0.0;
  if p.id > 0u {
    let leaf = leaf_of(p.pixel, p.id);
    p.mover = mover_of(leaf);
    for (var batch = 0u; batch < offsets.batches; batch++) {
      let range = leaf_range_at(offsets.ranges_at + (leaf * offsets.batches + batch) * LEAF_RANGE_WORDS);
      for (var i = range.near_shadowed + lane; i < range.end; i += WORKGROUP) {
        sum += excess(batch * BATCH + listed_light(i), p);
      }
    }
  }
  store(group, lane, p, sum);
}
