// Where to shade (Barczak §4.3.3, and beyond): the picture is a pyramid of grids of points, each with half the step of
// the one before. The coarsest grid is shaded. A point of a finer one is interpolated between its neighbours on the
// coarser one where they lie on the same surface and the light that they receive changes little or evenly, and shaded
// where not. So edges, contacts and the shadows of strong lights are found by halving, and what is interpolated is
// continuous, because neighbouring cells share the points between them.
//
// With FINAL, points are the picture's pixels, and what is stored is their radiance.
//
// This pass settles the simple cases, nearly all of them: a plane, in nearly even light. `check.wgsl` looks at the rest.

@group(2) @binding(0) var keys: texture_2d<u32>;
// The coarser grid: irradiance and key; specular radiance, or the direction of light.
@group(2) @binding(1) var coarse_light: texture_2d<f32>;
@group(2) @binding(2) var coarse_second: texture_2d<f32>;
@group(2) @binding(3) var fine_light: texture_storage_2d<rgba32float, write>;
@group(2) @binding(4) var fine_second: texture_storage_2d<rgba32float, write>;
@group(2) @binding(5) var<storage, read_write> open: array<atomic<u32>>; // see lib/grid.wgsl
@group(2) @binding(6) var picture: texture_storage_2d<rg32uint, write>;

override CURVED: bool = false;
override SPECULAR: bool = false;

struct Known { light: vec4f, second: vec4f }

fn known(point: vec2u) -> Known {
  var second = vec4f(0.0);
  if SPECULAR { second = textureLoad(coarse_second, point, 0); }
  return Known(textureLoad(coarse_light, point, 0), second);
}

// Writes a point, given its pixel's key and material; pixels of a cell mostly share their paint.
fn store(point: vec2u, pixel: vec2u, value: Known, shown: vec2u, paint: ptr<function, Paint>) {
  if FINAL {
    if shown.y != (*paint).material { *paint = paint_of(shown.y); }
    let radiance = radiance_of(*paint, value.light.xyz, value.second);
    textureStore(picture, pixel, pack_radiance(select(vec3f(0.0), radiance, shown.x != 0u)));
  } else {
    textureStore(fine_light, point, select(vec4f(0.0), vec4f(value.light.xyz, f32(shown.x)), shown.x != 0u));
    if SPECULAR { textureStore(fine_second, point, value.second); }
  }
}

const SETTLED = 0u;
const OPEN = 1u;
const OPEN_BENT = 2u;

// Writes a place between neighbours of which `least` and `most` are the extremes; whether that settles it.
fn settle(point: vec2u, at: vec2u, value: Known, least: Known, most: Known, exists: bool, paint: ptr<function, Paint>) -> u32 {
  if !exists { return SETTLED; }
  let pixel = at + vec2u(0u, frame.band.x);
  let shown = textureLoad(keys, pixel, 0).xy;
  let key = shown.x;
  var range = most.light - least.light;
  if SPECULAR { range = max(range, vec4f((most.second - least.second).xyz * PI, 0.0)); }
  let same = least.light.w == most.light.w && u32(least.light.w) == key && (key & (BENT | SHINY)) == 0u;
  let stands = same && max(range.x, max(range.y, range.z)) <= allowed_range(value.light.xyz);
  store(point, pixel, value, shown, paint);
  return select(SETTLED, select(OPEN, OPEN_BENT, CURVED && (key & BENT) != 0u), key != 0u && !stands);
}

fn leave_open(slot: u32, at: vec2u) {
  atomicStore(&open[slot], at.y << 16u | at.x);
}

fn lowest(a: Known, b: Known) -> Known { return Known(min(a.light, b.light), min(a.second, b.second)); }
fn highest(a: Known, b: Known) -> Known { return Known(max(a.light, b.light), max(a.second, b.second)); }
fn blend(a: Known, b: Known, t: f32) -> Known { return Known(mix(a.light, b.light, t), mix(a.second, b.second, t)); }

// One invocation for a cell of the coarser grid: its first corner, and the three places between its corners.
@compute @workgroup_size(64, 1)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let coarse = grid_size(2u * frame.step);
  let fine = grid_size(frame.step);
  if any(invocation.xy >= coarse) { return; }
  let next = min(invocation.xy + 1u, coarse - 1u);
  let is_last = invocation.xy == coarse - 1u;
  let corner = select(2u * invocation.xy, fine - 1u, is_last);
  let at = place_of(invocation.xy, 2u * frame.step);
  let middle = at + frame.step;
  // Where the grids end there may be no place between the last two points.
  var exists = !is_last & (middle < last_point());
  let t = f32(frame.step) / max(vec2f(place_of(next, 2u * frame.step) - at), vec2f(1.0));
  let a = known(invocation.xy);
  let b = known(vec2u(next.x, invocation.y));
  let c = known(vec2u(invocation.x, next.y));
  let d = known(next);
  var paint = NO_PAINT;
  if FINAL {
    // The row below the band is the next band's.
    let rows = frame.band.y - frame.band.x;
    exists &= vec2<bool>(at.y < rows, middle.y < rows);
    if at.y < rows {
      let pixel = at + vec2u(0u, frame.band.x);
      store(corner, pixel, a, textureLoad(keys, pixel, 0).xy, &paint);
    }
  } else {
    textureStore(fine_light, corner, a.light);
    if SPECULAR || (CURVED && (u32(a.light.w) & BENT) != 0u) {
      textureStore(fine_second, corner, textureLoad(coarse_second, invocation.xy, 0));
    }
  }
  let ab = blend(a, b, t.x);
  let ac = blend(a, c, t.y);
  let abcd = blend(ab, blend(c, d, t.x), t.y);
  let right = vec2u(middle.x, at.y);
  let below = vec2u(at.x, middle.y);
  let open_right = settle(corner + vec2u(1u, 0u), right, ab, lowest(a, b), highest(a, b), exists.x, &paint);
  let open_below = settle(corner + vec2u(0u, 1u), below, ac, lowest(a, c), highest(a, c), exists.y, &paint);
  let open_middle = settle(corner + 1u, middle, abcd, lowest(lowest(a, b), lowest(c, d)),
    highest(highest(a, b), highest(c, d)), all(exists), &paint);
  let answers = vec3u(open_right, open_below, open_middle);
  let flat_ones = select(vec3u(0u), vec3u(1u), answers == vec3u(OPEN));
  let bent_ones = select(vec3u(0u), vec3u(1u), answers == vec3u(OPEN_BENT));
  let count = flat_ones.x + flat_ones.y + flat_ones.z;
  if count > 0u {
    let slot = atomicAdd(&open[3], count);
    atomicMax(&open[0], workgroups_of(slot + count, PLACES));
    let first = FIRST_PLACE + slot;
    if flat_ones.x != 0u { leave_open(first, right); }
    if flat_ones.y != 0u { leave_open(first + flat_ones.x, below); }
    if flat_ones.z != 0u { leave_open(first + flat_ones.x + flat_ones.y, middle); }
  }
  let bent_count = bent_ones.x + bent_ones.y + bent_ones.z;
  if bent_count > 0u {
    let slot = atomicAdd(&open[BENT_HEADER + 3u], bent_count);
    // One dispatch takes places of both kinds, see check.wgsl.
    atomicMax(&open[select(BENT_HEADER, 0u, TAKES)], workgroups_of(slot + bent_count, PLACES));
    let last = arrayLength(&open) - 1u - slot;
    if bent_ones.x != 0u { leave_open(last, right); }
    if bent_ones.y != 0u { leave_open(last - bent_ones.x, below); }
    if bent_ones.z != 0u { leave_open(last - bent_ones.x - bent_ones.y, middle); }
  }
}
