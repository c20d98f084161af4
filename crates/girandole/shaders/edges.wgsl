// Further samples of a pixel: what they receive is interpolated between the first samples of this pixel and of its
// neighbours on their side, those that lie on the same surface. Where none does, `behind.wgsl` decides.

@group(2) @binding(0) var keys: texture_2d<u32>;
// The first sample's: irradiance and key; specular radiance, or the direction of light.
@group(2) @binding(1) var first_light: texture_2d<f32>;
@group(2) @binding(2) var first_second: texture_2d<f32>;
// This sample's.
@group(2) @binding(3) var fine_light: texture_storage_2d<rgba32float, write>;
@group(2) @binding(4) var fine_second: texture_storage_2d<rgba32float, write>;
@group(2) @binding(5) var<storage, read_write> sums: array<vec4f>;
@group(2) @binding(6) var<storage, read_write> open: array<atomic<u32>>; // see lib/grid.wgsl
@group(2) @binding(7) var picture: texture_storage_2d<rg32uint, write>;

override SPECULAR: bool = false;

// Neighbouring pixels of an invocation: they share first samples, and mostly their paint. Lanes of a GPU do better side
// by side.
override RUN: u32 = 1u;

// The first samples of a column in the two rows that a sample lies between.
struct Column { near: First, far: First }

fn column_at(x: i32, rows: vec2i) -> Column {
  return Column(first_at(vec2i(x, rows.x)), first_at(vec2i(x, rows.y)));
}

@compute @workgroup_size(64, 1)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let last = last_point();
  let start = vec2u(RUN * invocation.x, invocation.y);
  if any(start > last) { return; }
  // The row below the band is the next band's.
  if FINAL && start.y + frame.band.x >= frame.band.y { return; }
  let shift = shift_of_sample();
  let side = side_of(shift);
  let t = abs(shift);
  let rows = i32(start.y) + vec2i(0, side.y);
  // Of the columns to the left and right of the sample, its pixel's own is one.
  let own_is_left = side.x > 0;
  let weight_left = select(t.x, 1.0 - t.x, own_is_left);
  var paint = NO_PAINT;
  var left_open = 0u; // a bit each
  var left = column_at(i32(start.x) + min(side.x, 0), rows);
  for (var x = start.x; x < min(start.x + RUN, last.x + 1u); x++) {
    let right = column_at(i32(x) + max(side.x, 0), rows);
    let at = vec2u(x, start.y);
    let pixel = at + vec2u(0u, frame.band.x);
    let shown = textureLoad(keys, pixel, 0).xy;
    let key = shown.x;
    var blend: Blend;
    add_first(&blend, left.near, key, weight_left * (1.0 - t.y));
    add_first(&blend, right.near, key, (1.0 - weight_left) * (1.0 - t.y));
    add_first(&blend, left.far, key, weight_left * t.y);
    add_first(&blend, right.far, key, (1.0 - weight_left) * t.y);
    if key == 0u || (blend.weight > 0.0 && (key & SHINY) == 0u) {
      store_blend(at, shown, blend, &paint);
    } else {
      left_open |= 1u << (x - start.x);
    }
    left = right;
  }
  if left_open != 0u {
    let count = countOneBits(left_open);
    var slot = atomicAdd(&open[3], count);
    atomicMax(&open[0], (slot + count + 63u) / 64u);
    for (; left_open != 0u; left_open &= left_open - 1u) {
      atomicStore(&open[FIRST_PLACE + slot], start.y << 16u | (start.x + firstTrailingBit(left_open)));
      slot++;
    }
  }
}

// The first samples themselves, where those that follow store radiance.
@compute @workgroup_size(64, 1)
fn first(@builtin(global_invocation_id) invocation: vec3u) {
  let start = vec2u(RUN * invocation.x, invocation.y);
  if start.x >= frame.size.x || start.y + frame.band.x >= frame.band.y { return; }
  var paint = NO_PAINT;
  for (var x = start.x; x < min(start.x + RUN, frame.size.x); x++) {
    let at = vec2u(x, start.y);
    let one = first_at(vec2i(at));
    var blend = Blend(one.light.xyz, one.second, 1.0);
    store_blend(at, textureLoad(keys, at + vec2u(0u, frame.band.x), 0).xy, blend, &paint);
  }
}
