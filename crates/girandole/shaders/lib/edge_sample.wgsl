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
@group(2) @binding(6) var<storage, read_write> candidates: Candidates;
@group(2) @binding(7) var picture: texture_storage_2d<rg32uint, write>;

override HAS_SPECULAR: bool = false;

// Whether the picture has a row, relative to the band: the one below the band belongs to the next.
fn has_row(row: u32) -> bool {
  return row <= last_point().y && (!WRITES_RADIANCE || row + frame.band.x < frame.band.y);
}

// The first samples of a column in the two rows that a sample lies between.
struct Column { near: FirstSample, far: FirstSample }

fn column_at(at: vec2i, side: vec2i) -> Column {
  return Column(first_sample_at(at), first_sample_at(at + vec2i(0, side.y)));
}

// Writes the sample of a pixel between two columns, of which the pixel's own is one; whether it could be interpolated.
fn interpolate_edge(at: vec2u, left: Column, right: Column, diffuse: ptr<function, DiffuseMaterial>) -> bool {
  let shift = shift_of_sample();
  let t = abs(shift);
  let weight_left = select(t.x, 1.0 - t.x, side_of(shift).x > 0);
  let surface = textureLoad(surface_ids, at + vec2u(0u, frame.band.x), 0).xy;
  let surface_id = surface.x;
  var blend: Blend;
  add_first_sample(&blend, left.near, surface_id, weight_left * (1.0 - t.y));
  add_first_sample(&blend, right.near, surface_id, (1.0 - weight_left) * (1.0 - t.y));
  add_first_sample(&blend, left.far, surface_id, weight_left * t.y);
  add_first_sample(&blend, right.far, surface_id, (1.0 - weight_left) * t.y);
  let is_interpolated = surface_id == 0u || (blend.weight > 0.0 && !is_sharp(surface));
  if is_interpolated { store_blend(at, surface, blend, diffuse); }
  return is_interpolated;
}

// Lists `count` candidates for `edge_fallback.wgsl`: the index of the first one.
fn reserve_candidates(count: u32) -> u32 {
  let slot = atomicAdd(&candidates.flat_count, count);
  atomicMax(&candidates.flat_workgroups, (slot + count + WORKGROUP - 1u) / WORKGROUP);
  return slot;
}

// Writes the radiance of a pixel's first sample, where further ones follow.
fn resolve_first_sample(at: vec2u, diffuse: ptr<function, DiffuseMaterial>) {
  let first = first_sample_at(vec2i(at));
  let surface = textureLoad(surface_ids, at + vec2u(0u, frame.band.x), 0).xy;
  store_blend(at, surface, Blend(first.irradiance.xyz, first.directional, 1.0), diffuse);
}
