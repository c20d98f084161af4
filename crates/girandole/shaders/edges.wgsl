// Further samples of a pixel: what they receive is interpolated between the first samples of this pixel and of its
// neighbours on their side, those that lie on the same surface. Where none does, `edge_fallback.wgsl` decides.

@group(2) @binding(0) var surface_ids: texture_2d<u32>;
// The first sample's: irradiance and surface id; specular radiance, or the direction of light.
@group(2) @binding(1) var first_irradiance: texture_2d<f32>;
@group(2) @binding(2) var first_directional: texture_2d<f32>;
// This sample's.
@group(2) @binding(3) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(4) var fine_directional: texture_storage_2d<rgba32float, write>;
@group(2) @binding(5) var<storage, read_write> partial_sums: array<vec4f>;
@group(2) @binding(6) var<storage, read_write> candidates: array<atomic<u32>>; // see lib/grid.wgsl
@group(2) @binding(7) var picture: texture_storage_2d<rg32uint, write>;

override HAS_SPECULAR: bool = false;

// Neighbouring pixels of an invocation: they share first samples, and mostly their material. Lanes of a GPU do better side
// by side.
override RUN: u32 = 1u;

// The first samples of a column in the two rows that a sample lies between.
struct Column { near: FirstSample, far: FirstSample }

fn column_at(x: i32, rows: vec2i) -> Column {
  return Column(first_sample_at(vec2i(x, rows.x)), first_sample_at(vec2i(x, rows.y)));
}

@compute @workgroup_size(64, 1)
fn interpolate_edges(@builtin(global_invocation_id) invocation: vec3u) {
  let last = last_point();
  let start = vec2u(RUN * invocation.x, invocation.y);
  if any(start > last) { return; }
  // The row below the band is the next band's.
  if WRITES_RADIANCE && start.y + frame.band.x >= frame.band.y { return; }
  let shift = shift_of_sample();
  let side = side_of(shift);
  let t = abs(shift);
  let rows = i32(start.y) + vec2i(0, side.y);
  // Of the columns to the left and right of the sample, its pixel's own is one.
  let own_is_left = side.x > 0;
  let weight_left = select(t.x, 1.0 - t.x, own_is_left);
  var diffuse = NO_DIFFUSE_MATERIAL;
  var unresolved = 0u; // a bit each
  var left = column_at(i32(start.x) + min(side.x, 0), rows);
  for (var x = start.x; x < min(start.x + RUN, last.x + 1u); x++) {
    let right = column_at(i32(x) + max(side.x, 0), rows);
    let at = vec2u(x, start.y);
    let pixel = at + vec2u(0u, frame.band.x);
    let shown = textureLoad(surface_ids, pixel, 0).xy;
    let surface_id = shown.x;
    var blend: Blend;
    add_first_sample(&blend, left.near, surface_id, weight_left * (1.0 - t.y));
    add_first_sample(&blend, right.near, surface_id, (1.0 - weight_left) * (1.0 - t.y));
    add_first_sample(&blend, left.far, surface_id, weight_left * t.y);
    add_first_sample(&blend, right.far, surface_id, (1.0 - weight_left) * t.y);
    if surface_id == 0u || (blend.weight > 0.0 && (surface_id & SHINY) == 0u) {
      store_blend(at, shown, blend, &diffuse);
    } else {
      unresolved |= 1u << (x - start.x);
    }
    left = right;
  }
  if unresolved != 0u {
    let count = countOneBits(unresolved);
    var slot = atomicAdd(&candidates[3], count);
    atomicMax(&candidates[0], (slot + count + 63u) / 64u);
    for (; unresolved != 0u; unresolved &= unresolved - 1u) {
      atomicStore(&candidates[FIRST_CANDIDATE + slot], (start.y << 16u) | (start.x + firstTrailingBit(unresolved)));
      slot++;
    }
  }
}

// The first samples themselves, where those that follow store radiance.
@compute @workgroup_size(64, 1)
fn resolve_first_samples(@builtin(global_invocation_id) invocation: vec3u) {
  let start = vec2u(RUN * invocation.x, invocation.y);
  if start.x >= frame.size.x || start.y + frame.band.x >= frame.band.y { return; }
  var diffuse = NO_DIFFUSE_MATERIAL;
  for (var x = start.x; x < min(start.x + RUN, frame.size.x); x++) {
    let at = vec2u(x, start.y);
    let one = first_sample_at(vec2i(at));
    var blend = Blend(one.irradiance.xyz, one.directional, 1.0);
    store_blend(at, textureLoad(surface_ids, at + vec2u(0u, frame.band.x), 0).xy, blend, &diffuse);
  }
}
