// A candidate of `refine.wgsl`, on a curved surface, near an edge, or where irradiance varies: it is interpolated after all,
// or it is shaded. A pass that uses it declares `candidates`.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> receivers: array<u32>;
@group(2) @binding(2) var<storage, read_write> shade_list: ShadeList;
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;
@group(2) @binding(4) var surface_ids: texture_2d<u32>;
// The coarser grid: irradiance and surface id; specular radiance, or the direction of light.
@group(2) @binding(5) var coarse_irradiance: texture_2d<f32>;
@group(2) @binding(6) var coarse_directional: texture_2d<f32>;
@group(2) @binding(7) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(8) var fine_directional: texture_storage_2d<rgba32float, write>;
@group(2) @binding(10) var picture: texture_storage_2d<rg32uint, write>;

override HAS_CURVED: bool = false; // whether some surface is
override HAS_SPECULAR: bool = false;
override REFLECTS_ENVIRONMENT: bool = false;

// Normals of a curved surface that are interpolated between differ by less than 26 degrees, those of a normal map, which
// turn back and forth, by less than 14,
const MIN_NORMAL_COSINE = 0.9;
const MIN_NORMAL_COSINE_MAPPED = 0.97;
// and one sees the other's point over itself by less than 17.
const MAX_RISE = 0.3;
// Largest change that is interpolated where it is even, in units of the tolerance,
const MAX_GRADIENT = 5.0;
// and largest with which irradiance is extrapolated to an edge.
const MAX_EXTRAPOLATED = 0.5;

// Surface id and material of a pixel, relative to the band.
fn surface_at(at: vec2u) -> vec2u {
  return textureLoad(surface_ids, at + vec2u(0u, frame.band.x), 0).xy;
}

// A point of a curved surface.
struct CurvedPoint { is_curved: bool, position: vec3f, geometric: vec3f, normal: vec3f, min_normal_cosine: f32 }

fn curved_point_at(at: vec2u) -> CurvedPoint {
  let pixel = at + vec2u(0u, frame.band.x);
  let triangle = max(textureLoad(triangle_ids, pixel, 0).x, 1u) - 1u;
  var hit = hit_at(pixel, triangle);
  let m = materials[triangles[triangle].material];
  if HAS_TEXTURES { hit = with_coordinates(pixel, hit); }
  let is_mapped = HAS_TEXTURES && m.normal_texture.texture != NONE;
  return CurvedPoint(true, hit.position, hit.geometric_normal, shading_normal(hit, m),
    select(MIN_NORMAL_COSINE, MIN_NORMAL_COSINE_MAPPED, is_mapped));
}

// What a point of the coarser grid predicts for a pixel, whether both lie on one surface, and whether the grid's points lie far apart there,
// across and down.
struct Neighbour { irradiance: vec3f, directional: vec3f, environment: f32, fits: bool, is_far: vec2<bool>, is_curved: bool }

fn neighbour(point: vec2i, is_curved: bool, surface_id: u32) -> Neighbour {
  let size = vec2i(grid_size(2u * frame.step));
  let inside = all(point >= vec2i(0)) && all(point < size);
  let at = vec2u(clamp(point, vec2i(0), size - 1));
  let light = textureLoad(coarse_irradiance, at, 0);
  let fits = inside && surface_id_of(light.w) == surface_id;
  var result = Neighbour(light.xyz, vec3f(0.0), 0.0, fits, is_far_of(light.w) | vec2<bool>(!fits), is_curved);
  if is_curved || HAS_SPECULAR {
    let directional = textureLoad(coarse_directional, at, 0);
    // On a plane the direction of light does not matter.
    result.directional = select(directional.xyz, vec3f(0.0), !is_curved && directional.w > 0.0);
    if REFLECTS_ENVIRONMENT { result.environment = min(directional.w, 0.0); }
  }
  return result;
}

// The same for a pixel of a curved surface: light comes from a direction, and the pixel's normal differs.
fn turned(plain: Neighbour, point: vec2i, curved: CurvedPoint) -> Neighbour {
  let at = vec2u(clamp(point, vec2i(0), vec2i(grid_size(2u * frame.step)) - 1));
  let other = curved_point_at(pixel_of_point(at, 2u * frame.step));
  let between = other.position - curved.position;
  let rise = max(abs(dot(other.geometric, between)), abs(dot(curved.geometric, between)));
  let light_direction = plain.directional;
  let cosine = dot(other.normal, light_direction);
  var result = plain;
  // Where all light grazes, its direction does not predict the irradiance of a turned surface.
  result.fits = plain.fits && dot(other.normal, curved.normal) > curved.min_normal_cosine
    && rise <= MAX_RISE * length(between) && cosine >= 0.1 * length(light_direction);
  result.irradiance *= max(dot(curved.normal, light_direction), 0.0) / max(cosine, 1e-20);
  return result;
}

// Four neighbours about a pixel.
struct Ring { a: Neighbour, b: Neighbour, c: Neighbour, d: Neighbour }

fn ring(a: vec2i, b: vec2i, c: vec2i, d: vec2i, curved: CurvedPoint, surface_id: u32) -> Ring {
  let is_curved = curved.is_curved;
  var r = Ring(neighbour(a, is_curved, surface_id), neighbour(b, is_curved, surface_id),
    neighbour(c, is_curved, surface_id), neighbour(d, is_curved, surface_id));
  if curved.is_curved {
    // Each in turn takes the first place, so that the long part is compiled once.
    var points = vec4i(a, b);
    var others = vec4i(c, d);
    for (var i = 0u; i < 4u; i++) {
      r = Ring(r.b, r.c, r.d, turned(r.a, points.xy, curved));
      let first = points.xy;
      points = vec4i(points.zw, others.xy);
      others = vec4i(others.zw, first);
    }
  }
  return r;
}

// Largest difference between two neighbours; 0 where one of them lies on another surface.
fn spread(a: Neighbour, b: Neighbour) -> f32 {
  var d = abs(a.irradiance - b.irradiance);
  if HAS_SPECULAR && !a.is_curved { d = max(d, abs(a.directional - b.directional) * PI); }
  if REFLECTS_ENVIRONMENT { d = max(d, abs(a.environment - b.environment) * a.irradiance); }
  return select(0.0, max(d.x, max(d.y, d.z)), a.fits && b.fits);
}

// The second difference of irradiance at `near`, between `across` and `beyond` at equal distances from it.
fn second_difference(near: Neighbour, across: Neighbour, beyond: Neighbour) -> f32 {
  let d = abs(beyond.irradiance - 2.0 * near.irradiance + across.irradiance);
  return select(spread(near, across), max(d.x, max(d.y, d.z)), beyond.fits);
}

// Whether irradiance changes little towards `near`, or that lies on another surface.
fn is_even(near: Neighbour, beyond: Neighbour, allowed: f32) -> bool {
  return !near.fits || (beyond.fits && spread(near, beyond) <= allowed);
}

fn test_flat_candidate(index: u32) {
  test_candidate(unpack_candidate(candidates.pixels[index]), false);
}

fn test_curved_candidate(index: u32) {
  test_candidate(unpack_candidate(candidates.pixels[arrayLength(&candidates.pixels) - 1u - index]), true);
}

// `at` is relative to the band.
fn test_candidate(at: vec2u, is_curved: bool) {
  let wide = 2u * frame.step;
  let last = last_point();
  let surface = surface_at(at);
  let surface_id = surface.x;
  var curved: CurvedPoint;
  if is_curved { curved = curved_point_at(at); }
  // Neighbours on the coarser grid; along an axis on which the pixel lies on it, the pixel itself.
  let on_grid = (at == last) | (at % wide == vec2u(0u));
  let low = select(at / wide, (at + wide - 1u) / wide, on_grid);
  let high = select(low + 1u, low, on_grid);
  let span = pixel_of_point(high, wide) - pixel_of_point(low, wide);
  let t = select(vec2f(at - pixel_of_point(low, wide)) / vec2f(max(span, vec2u(1u))), vec2f(0.0), on_grid);
  let pa = vec2i(low);
  let pb = vec2i(vec2u(high.x, low.y));
  let pc = vec2i(vec2u(low.x, high.y));
  let pd = vec2i(high);
  let near = ring(pa, pb, pc, pd, curved, surface_id);
  let a = near.a;
  let b = near.b;
  let c = near.c;
  let d = near.d;
  // Bilinear weights, of those neighbours that lie on the same surface.
  let w = vec4f((1.0 - t.x) * (1.0 - t.y), t.x * (1.0 - t.y), (1.0 - t.x) * t.y, t.x * t.y)
    * vec4f(f32(a.fits), f32(b.fits), f32(c.fits), f32(d.fits));
  let weight = dot(w, vec4f(1.0));
  let scale = 1.0 / max(weight, 1e-6);
  var value = (a.irradiance * w.x + b.irradiance * w.y + c.irradiance * w.z + d.irradiance * w.w) * scale;
  let directional = (a.directional * w.x + b.directional * w.y + c.directional * w.z + d.directional * w.w) * scale;
  let environment = (a.environment * w.x + b.environment * w.y + c.environment * w.z + d.environment * w.w) * scale;
  let range = max(max(spread(a, b), spread(c, d)),
    max(max(spread(a, c), spread(b, d)), max(spread(a, d), spread(b, c))));
  let allowed = allowed_range(value);
  let all_fit = a.fits && b.fits && c.fits && d.fits;
  // Near an edge some neighbours lie elsewhere: three of four suffice where they agree, and from pixel to pixel of a
  // plane one.
  let may_extrapolate = ((surface_id & CURVED) == 0u) & (frame.tolerance > 0.0);
  let min_weight = select(0.7, 0.2, may_extrapolate & (frame.step == 1u));
  // Of the points that the coarser grid has anew, one at least is a neighbour.
  let is_far = a.is_far & b.is_far & c.is_far & d.is_far;
  let may_interpolate = !any(is_far & !on_grid);
  var is_interpolated = may_interpolate && weight > min_weight && range <= select(0.5, 1.0, all_fit) * allowed;
  if !is_interpolated && may_interpolate {
    let reach = select(vec2i(1), vec2i(0), on_grid);
    let far = ring(pa - reach, pb + vec2i(1, -1) * reach, pc + vec2i(-1, 1) * reach, pd + reach, curved, surface_id);
    let a2 = far.a;
    let b2 = far.b;
    let c2 = far.c;
    let d2 = far.d;
    if all_fit {
      // Where irradiance changes evenly, the error of interpolation follows from its second differences.
      let curvature = max(max(second_difference(a, d, a2), second_difference(d, a, d2)),
        max(second_difference(b, c, b2), second_difference(c, b, c2)));
      is_interpolated = range <= MAX_GRADIENT * allowed && curvature <= allowed;
    } else if may_extrapolate {
      // On a plane, irradiance that is even up to an edge is extrapolated.
      let even = MAX_EXTRAPOLATED * allowed;
      is_interpolated = weight > 0.2 && range <= even && is_even(a, a2, even) && is_even(b, b2, even)
        && is_even(c, c2, even) && is_even(d, d2, even);
      value += (w.x * (a.irradiance - a2.irradiance) + w.y * (b.irradiance - b2.irradiance)
        + w.z * (c.irradiance - c2.irradiance) + w.w * (d.irradiance - d2.irradiance)) * (0.5 * scale);
    }
  }
  if is_interpolated && !is_sharp(surface) {
    let other = vec4f(directional, select(environment, 1.0, is_curved));
    if branch_value(frame.writes_radiance, at.x) != 0u {
      let pixel = at + vec2u(0u, frame.band.x);
      textureStore(picture, pixel, pack_radiance(radiance_of(diffuse_material(surface.y), value, other)));
    } else {
      let point = (at + frame.step - 1u) / frame.step;
      textureStore(fine_irradiance, point, vec4f(value, grid_surface_id(surface_id, is_far)));
      if HAS_CURVED || HAS_SPECULAR { textureStore(fine_directional, point, other); }
    }
  } else {
    append_point(at);
  }
}
