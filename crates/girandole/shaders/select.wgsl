// Where to shade (Barczak §4.3.3, and beyond): the picture is a pyramid of grids of points, each with half the step of
// the one before. The coarsest grid is shaded. A point of a finer one is interpolated between its neighbours on the
// coarser one where they lie on the same surface and receive nearly the same light, and shaded where not. So edges,
// contacts and the shadows of strong lights are found by halving, and what is interpolated is continuous, because
// neighbouring cells share the points between them. Grids end at the picture's last column and row.

@group(2) @binding(0) var<storage, read> surfaces: array<vec4u>;
@group(2) @binding(1) var<storage, read_write> sums: array<vec4f>;
@group(2) @binding(2) var<storage, read_write> counts: array<atomic<u32>>; // points in all, 15 spare, points of each leaf
@group(2) @binding(3) var<storage, read_write> points: array<vec4u>; // pixel, leaf, place among the leaf's points

// Planes that differ less are one (sine of the angle under which one sees the other's point over itself).
const FLAT = 2e-3;
// Normals of a curved surface that are interpolated between differ by less than 26 degrees.
const BEND = 0.9;
const RISE = 0.3;
// Steepest change that is interpolated where it is even, in units of the tolerance.
const STEEPEST = 5.0;
const PI = 3.14159265358979;

fn append(index: u32, leaf: u32) {
  let slot = atomicAdd(&counts[0], 1u);
  points[slot] = vec4u(index, leaf, atomicAdd(&counts[16u + leaf], 1u), 0u);
}

// The last column and row, relative to the band.
fn last_point() -> vec2u {
  return vec2u(frame.size.x - 1u, frame.last_row - frame.band.x);
}

// Shades all points of the grid: the coarsest one, or with a step of 1 every pixel.
@compute @workgroup_size(8, 8)
fn every(@builtin(global_invocation_id) invocation: vec3u) {
  let last = last_point();
  if any(invocation.xy * frame.step >= last + frame.step) { return; }
  let at = min(invocation.xy * frame.step, last);
  let index = at.y * frame.size.x + at.x;
  let surface = surfaces[index];
  if surface.x != 0u { append(index, surface.z & LEAF); }
}

override CURVED: bool = false;
override SPECULAR: bool = false;

struct Neighbour { irradiance: vec3f, toward: vec3f, fits: bool, is_planar: bool }

// What a neighbour on the coarser grid would have this point receive, if both lie on one surface.
fn neighbour(at: vec2u, surface: vec4u, position: vec3f, normal: vec3f) -> Neighbour {
  let index = at.y * frame.size.x + at.x;
  let other = surfaces[index];
  let between = position_at(at + vec2u(0u, frame.band.x), bitcast<f32>(other.x)) - position;
  let other_normal = unpack_normal(other.y);
  let is_planar = (surface.z & PLANAR) != 0u;
  let rise = max(abs(dot(normal, between)), abs(dot(other_normal, between)));
  let allowed = select(RISE, FLAT, is_planar) * length(between);
  let alike = dot(normal, other_normal) > select(BEND, 0.9999, is_planar);
  let same = other.x != 0u && ((surface.z ^ other.z) & PLANAR) == 0u && (is_planar || surface.w == other.w);
  var result = Neighbour(sums[2u * index].xyz, vec3f(0.0), same && alike && rise <= allowed, is_planar);
  if CURVED {
    let second = sums[2u * index + 1u];
    if !is_planar {
      result.toward = second.xyz;
      // Where all light grazes, its direction says little of what a turned surface would receive.
      let cosine = dot(other_normal, second.xyz);
      result.fits = result.fits && cosine >= 0.1 * length(second.xyz);
      result.irradiance *= max(dot(normal, second.xyz), 0.0) / max(cosine, 1e-20);
    } else if SPECULAR {
      result.toward = second.xyz;
    }
  } else if SPECULAR {
    result.toward = sums[2u * index + 1u].xyz;
  }
  return result;
}

@compute @workgroup_size(8, 8)
fn refine(@builtin(global_invocation_id) invocation: vec3u) {
  let last = last_point();
  if any(invocation.xy * frame.step >= last + frame.step) { return; }
  let at = min(invocation.xy * frame.step, last);
  // Neighbours on the grid of twice the step; along an axis on which this point lies on it, the point itself.
  let below = at / (2u * frame.step) * (2u * frame.step);
  let on_grid = (at == below) | (at == last);
  if all(on_grid) { return; }
  let low = select(below, at, on_grid);
  let high = select(min(below + 2u * frame.step, last), at, on_grid);
  let index = at.y * frame.size.x + at.x;
  let surface = surfaces[index];
  if surface.x == 0u { return; }
  let f = select(vec2f(at - low) / vec2f(high - low), vec2f(0.0), on_grid);
  let position = position_at(at + vec2u(0u, frame.band.x), bitcast<f32>(surface.x));
  let normal = unpack_normal(surface.y);
  let a = neighbour(low, surface, position, normal);
  let b = neighbour(vec2u(high.x, low.y), surface, position, normal);
  let c = neighbour(vec2u(low.x, high.y), surface, position, normal);
  let d = neighbour(high, surface, position, normal);
  // Bilinear weights, of those neighbours that lie on the same surface.
  let w = vec4f((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y)
    * vec4f(f32(a.fits), f32(b.fits), f32(c.fits), f32(d.fits));
  let known = dot(w, vec4f(1.0));
  let scale = 1.0 / max(known, 1e-6);
  let value = (a.irradiance * w.x + b.irradiance * w.y + c.irradiance * w.z + d.irradiance * w.w) * scale;
  let toward = (a.toward * w.x + b.toward * w.y + c.toward * w.z + d.toward * w.w) * scale;
  let range = max(max(spread(a, b), spread(c, d)), max(max(spread(a, c), spread(b, d)), max(spread(a, d), spread(b, c))));
  let allowed = frame.tolerance * max(value.x, max(value.y, value.z));
  let all_fit = a.fits && b.fits && c.fits && d.fits;
  // Near an edge some neighbours lie elsewhere: half of them will do where they agree, in the end a quarter.
  let least = select(0.45, 0.2, frame.step == 1u);
  var stands = known > least && range <= select(0.5, 1.0, all_fit) * allowed;
  // Light that changes evenly may be interpolated over a larger range: what counts is how it bends.
  let reach = select(2u * frame.step * vec2u(1u), vec2u(0u), on_grid);
  var is_open = all_fit && !stands && range <= STEEPEST * allowed;
  while is_open {
    let bend = max(max(bend_at(a, d, low, vec2i(-1), reach, surface, position, normal),
        bend_at(d, a, high, vec2i(1), reach, surface, position, normal)),
      max(bend_at(b, c, vec2u(high.x, low.y), vec2i(1, -1), reach, surface, position, normal),
        bend_at(c, b, vec2u(low.x, high.y), vec2i(-1, 1), reach, surface, position, normal)));
    stands = bend <= allowed;
    is_open = false;
  }
  if stands && (surface.z & SHINY) == 0u {
    sums[2u * index] = vec4f(value, 0.0);
    if CURVED || SPECULAR { sums[2u * index + 1u] = vec4f(toward, select(0.0, 1.0, (surface.z & PLANAR) == 0u)); }
  } else {
    append(index, surface.z & LEAF);
  }
}

// Largest difference of what two neighbours receive; 0 where one of them lies elsewhere.
fn spread(a: Neighbour, b: Neighbour) -> f32 {
  var d = abs(a.irradiance - b.irradiance);
  if SPECULAR { d = max(d, select(vec3f(0.0), abs(a.toward - b.toward) * PI, a.is_planar)); }
  return select(0.0, max(d.x, max(d.y, d.z)), a.fits && b.fits);
}

// Largest second difference at a neighbour: between the one across and the one that lies as far beyond.
fn bend_at(near: Neighbour, across: Neighbour, at: vec2u, side: vec2i, reach: vec2u, surface: vec4u, position: vec3f, normal: vec3f) -> f32 {
  let beyond = vec2i(at) + side * vec2i(reach);
  let last = vec2i(last_point());
  let inside = all(beyond >= vec2i(0)) && all(beyond <= last);
  let next = neighbour(vec2u(clamp(beyond, vec2i(0), last)), surface, position, normal);
  let d = abs(next.irradiance - 2.0 * near.irradiance + across.irradiance);
  return select(spread(near, across), max(d.x, max(d.y, d.z)), inside && next.fits);
}
