// What pixels receive that show an object which is lit by precomputed radiance transfer: interpolated between the vertices of their
// triangle. Other passes have left these pixels out, for their surface has no id.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> vertex_irradiance: array<vec4f>;
@group(2) @binding(2) var<uniform> range: VertexRange;
@group(2) @binding(3) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(4) var fine_directional: texture_storage_2d<rgba32float, write>;

override HAS_SPECULAR: bool = false;

@compute @workgroup_size(TILE, TILE)
fn interpolate_transfer(@builtin(global_invocation_id) invocation: vec3u) {
  if any(invocation.xy > last_point()) { return; }
  let pixel = invocation.xy + vec2u(0u, frame.band.x);
  let id = textureLoad(triangle_ids, pixel, 0).x;
  if id == 0u { return; }
  let corners = triangles[id - 1u].vertices - range.first;
  if any(corners >= vec3u(range.count)) { return; }
  if vertex_irradiance[corners.x].w == 0.0 { return; }
  let hit = hit_at(pixel, id - 1u);
  // What has vectors of its front alone has no back that is seen.
  let is_back = hit.side < 0.0 && vertex_irradiance[range.count + corners.x].w != 0.0;
  let first = select(0u, range.count, is_back);
  let irradiance = vertex_irradiance[first + corners.x].xyz * (1.0 - hit.u - hit.v)
    + vertex_irradiance[first + corners.y].xyz * hit.u + vertex_irradiance[first + corners.z].xyz * hit.v;
  textureStore(fine_irradiance, invocation.xy, vec4f(max(irradiance, vec3f(0.0)), 0.0));
  if HAS_SPECULAR { textureStore(fine_directional, invocation.xy, vec4f(0.0)); }
}
