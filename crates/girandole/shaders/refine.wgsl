// Where to shade (Barczak §4.3.3, and beyond): the picture is a pyramid of grids of points, each with half the step of
// the one before. The coarsest grid is shaded. A point of a finer one is interpolated between its neighbours on the
// coarser one where they lie on the same surface and the light that they receive changes little or evenly, and shaded
// where not. So edges, contacts and the shadows of strong lights are found by halving, and what is interpolated is
// continuous, because neighbouring cells share the points between them.
//
// With WRITES_RADIANCE, points are the picture's pixels, and what is stored is their radiance.
//
// This pass interpolates the simple cases, nearly all of them: a plane, in nearly even light. The others are candidates
// for shading, which `test_candidates.wgsl` tests.

@group(2) @binding(0) var surface_ids: texture_2d<u32>;
// The coarser grid: irradiance and surface id; specular radiance, or the direction of light.
@group(2) @binding(1) var coarse_irradiance: texture_2d<f32>;
@group(2) @binding(2) var coarse_directional: texture_2d<f32>;
@group(2) @binding(3) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(4) var fine_directional: texture_storage_2d<rgba32float, write>;
@group(2) @binding(5) var<storage, read_write> candidates: Candidates;
@group(2) @binding(6) var picture: texture_storage_2d<rg32uint, write>;

override WRITES_RADIANCE: bool = false; // whether points are the picture's pixels, and their radiance is stored
override HAS_CURVED: bool = false;
override HAS_SPECULAR: bool = false;
override REFLECTS_ENVIRONMENT: bool = false;

struct GridPoint { irradiance: vec4f, directional: vec4f } // the first with the surface id

fn grid_point(point: vec2u) -> GridPoint {
  var directional = vec4f(0.0);
  if HAS_SPECULAR { directional = textureLoad(coarse_directional, point, 0); }
  return GridPoint(textureLoad(coarse_irradiance, point, 0), directional);
}

// Writes a point, given its pixel's surface id and material; pixels of a cell mostly share a material.
fn store(point: vec2u, pixel: vec2u, value: GridPoint, surface: vec2u, diffuse: ptr<function, DiffuseMaterial>) {
  if WRITES_RADIANCE {
    if surface.y != (*diffuse).material { *diffuse = diffuse_material(surface.y); }
    let radiance = radiance_of(*diffuse, value.irradiance.xyz, value.directional);
    textureStore(picture, pixel, pack_pixel(radiance, select(0.0, 1.0, surface.x != 0u)));
  } else {
    textureStore(fine_irradiance, point, select(vec4f(0.0), vec4f(value.irradiance.xyz, f32(surface.x)), surface.x != 0u));
    if HAS_SPECULAR { textureStore(fine_directional, point, value.directional); }
  }
}

const INTERPOLATED = 0u;
const CANDIDATE = 1u;
const CURVED_CANDIDATE = 2u;

// Writes a point between neighbours of which `low` and `high` are the extremes; whether it is a candidate all the same.
fn interpolate_or_defer(
  point: vec2u,
  at: vec2u,
  value: GridPoint,
  low: GridPoint,
  high: GridPoint,
  exists: bool,
  diffuse: ptr<function, DiffuseMaterial>,
) -> u32 {
  if !exists { return INTERPOLATED; }
  let pixel = at + vec2u(0u, frame.band.x);
  let surface = textureLoad(surface_ids, pixel, 0).xy;
  let surface_id = surface.x;
  var range = high.irradiance - low.irradiance;
  if HAS_SPECULAR && value.directional.w <= 0.0 { range = max(range, vec4f((high.directional - low.directional).xyz * PI, 0.0)); }
  if REFLECTS_ENVIRONMENT {
    range = max(range, vec4f(value.irradiance.xyz * (high.directional.w - low.directional.w), 0.0));
  }
  let same = low.irradiance.w == high.irradiance.w && low.irradiance.w == f32(surface_id)
    && (surface_id & CURVED) == 0u && !is_sharp(surface);
  let is_even = same && max(range.x, max(range.y, range.z)) <= allowed_range(value.irradiance.xyz);
  store(point, pixel, value, surface, diffuse);
  let kind = select(CANDIDATE, CURVED_CANDIDATE, HAS_CURVED && (surface_id & CURVED) != 0u);
  return select(INTERPOLATED, kind, surface_id != 0u && !is_even);
}

fn lowest(a: GridPoint, b: GridPoint) -> GridPoint {
  return GridPoint(min(a.irradiance, b.irradiance), min(a.directional, b.directional));
}

fn highest(a: GridPoint, b: GridPoint) -> GridPoint {
  return GridPoint(max(a.irradiance, b.irradiance), max(a.directional, b.directional));
}

fn interpolated(a: GridPoint, b: GridPoint, t: f32) -> GridPoint {
  return GridPoint(mix(a.irradiance, b.irradiance, t), mix(a.directional, b.directional, t));
}

// One invocation for a cell of the coarser grid: its first corner, and the three points between its corners.
@compute @workgroup_size(WORKGROUP)
fn refine(@builtin(global_invocation_id) invocation: vec3u) {
  let coarse = grid_size(2u * frame.step);
  let fine = grid_size(frame.step);
  if any(invocation.xy >= coarse) { return; }
  let next = min(invocation.xy + 1u, coarse - 1u);
  let is_last = invocation.xy == coarse - 1u;
  let corner = select(2u * invocation.xy, fine - 1u, is_last);
  let at = pixel_of_point(invocation.xy, 2u * frame.step);
  if !is_drawn(at.x) { return; }
  let middle = at + frame.step;
  // Where the grids end there may be no point between the last two points.
  var exists = !is_last & (middle < last_point());
  let t = f32(frame.step) / max(vec2f(pixel_of_point(next, 2u * frame.step) - at), vec2f(1.0));
  let a = grid_point(invocation.xy);
  let b = grid_point(vec2u(next.x, invocation.y));
  let c = grid_point(vec2u(invocation.x, next.y));
  let d = grid_point(next);
  var diffuse = NO_DIFFUSE_MATERIAL;
  if WRITES_RADIANCE {
    // The row below the band is the next band's.
    let rows = frame.band.y - frame.band.x;
    exists &= vec2<bool>(at.y < rows, middle.y < rows);
    if at.y < rows {
      let pixel = at + vec2u(0u, frame.band.x);
      store(corner, pixel, a, textureLoad(surface_ids, pixel, 0).xy, &diffuse);
    }
  } else {
    let surface_id = surface_id_of(a.irradiance.w);
    // Edges are told by the last grid's ids.
    textureStore(fine_irradiance, corner, vec4f(a.irradiance.xyz, select(a.irradiance.w, f32(surface_id), frame.step == 1u)));
    if HAS_SPECULAR || (HAS_CURVED && (surface_id & CURVED) != 0u) {
      textureStore(fine_directional, corner, textureLoad(coarse_directional, invocation.xy, 0));
    }
  }
  let ab = interpolated(a, b, t.x);
  let ac = interpolated(a, c, t.y);
  let abcd = interpolated(ab, interpolated(c, d, t.x), t.y);
  let right = vec2u(middle.x, at.y);
  let below = vec2u(at.x, middle.y);
  let outcomes = vec3u(
    interpolate_or_defer(corner + vec2u(1u, 0u), right, ab, lowest(a, b), highest(a, b), exists.x, &diffuse),
    interpolate_or_defer(corner + vec2u(0u, 1u), below, ac, lowest(a, c), highest(a, c), exists.y, &diffuse),
    interpolate_or_defer(corner + 1u, middle, abcd, lowest(lowest(a, b), lowest(c, d)),
      highest(highest(a, b), highest(c, d)), all(exists), &diffuse));
  let flat = select(vec3u(0u), vec3u(1u), outcomes == vec3u(CANDIDATE));
  let flat_count = flat.x + flat.y + flat.z;
  if flat_count > 0u {
    let slot = atomicAdd(&candidates.flat_count, flat_count);
    atomicMax(&candidates.flat_workgroups, workgroups_of(slot + flat_count));
    if flat.x != 0u { candidates.pixels[slot] = pack_candidate(right); }
    if flat.y != 0u { candidates.pixels[slot + flat.x] = pack_candidate(below); }
    if flat.z != 0u { candidates.pixels[slot + flat.x + flat.y] = pack_candidate(middle); }
  }
  let curved = select(vec3u(0u), vec3u(1u), outcomes == vec3u(CURVED_CANDIDATE));
  let curved_count = curved.x + curved.y + curved.z;
  if curved_count > 0u {
    let slot = atomicAdd(&candidates.curved_count, curved_count);
    atomicMax(&candidates.curved_workgroups, workgroups_of(slot + curved_count));
    let last = arrayLength(&candidates.pixels) - 1u - slot;
    if curved.x != 0u { candidates.pixels[last] = pack_candidate(right); }
    if curved.y != 0u { candidates.pixels[last - curved.x] = pack_candidate(below); }
    if curved.z != 0u { candidates.pixels[last - curved.x - curved.y] = pack_candidate(middle); }
  }
}
