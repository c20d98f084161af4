// Lists all points of a grid for shading: of the coarsest grid, or with a step of 1 every pixel.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> receivers: array<u32>;
@group(2) @binding(2) var<storage, read_write> shade_list: ShadeList;
@group(2) @binding(3) var<uniform> offsets: BufferOffsets;
@group(2) @binding(4) var surface_ids: texture_2d<u32>;
@group(2) @binding(5) var fine_irradiance: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(TILE, TILE)
fn append_all_points(@builtin(global_invocation_id) invocation: vec3u) {
  let size = grid_size(frame.step);
  if any(invocation.xy >= size) { return; }
  let at = pixel_of_point(invocation.xy, frame.step);
  if !is_drawn(at.x) { return; }
  let surface_id = textureLoad(surface_ids, at + vec2u(0u, frame.band.x), 0).x;
  if surface_id != 0u { append_point(at); } else { textureStore(fine_irradiance, invocation.xy, vec4f(0.0)); }
}
