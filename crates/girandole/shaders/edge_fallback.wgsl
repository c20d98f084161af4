// Further samples that `edges.wgsl` could not interpolate: the first sample of one of the neighbours on the other sides
// may lie on their surface. Only where none does, at the edges of geometry, a sample is shaded by itself.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> receivers: array<u32>;
@group(2) @binding(2) var<storage, read_write> shade_list: ShadeList;
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;
@group(2) @binding(4) var surface_ids: texture_2d<u32>;
@group(2) @binding(5) var first_irradiance: texture_2d<f32>;
@group(2) @binding(6) var first_directional: texture_2d<f32>;
@group(2) @binding(7) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(8) var fine_directional: texture_storage_2d<rgba32float, write>;
@group(2) @binding(9) var<storage, read_write> partial_sums: array<vec4f>;
@group(2) @binding(10) var<storage, read> candidates: Candidates;
@group(2) @binding(11) var picture: texture_storage_2d<rg32uint, write>;

override HAS_SPECULAR: bool = false;

// Steps to the neighbours on the other sides, the nearest first.
const OTHER_SIDES = array<vec2i, 5>(vec2i(-1, 0), vec2i(0, -1), vec2i(1, -1), vec2i(-1, 1), vec2i(-1, -1));

@compute @workgroup_size(WORKGROUP)
fn edge_fallback(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x >= candidates.flat_count { return; }
  let at = unpack_candidate(candidates.pixels[invocation.x]);
  let surface = textureLoad(surface_ids, at + vec2u(0u, frame.band.x), 0).xy;
  let side = side_of(shift_of_sample());
  var blend: Blend;
  if !is_sharp(surface) {
    for (var i = 0u; i < 5u && blend.weight <= 0.0; i++) {
      add_first_sample(&blend, first_sample_at(vec2i(at) + OTHER_SIDES[i] * side), surface.x, 1.0);
    }
  }
  var diffuse = NO_DIFFUSE_MATERIAL;
  if blend.weight > 0.0 { store_blend(at, surface, blend, &diffuse); } else { append_point(at); }
}
