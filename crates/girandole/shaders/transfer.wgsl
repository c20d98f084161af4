// What pixels receive that show an object which is lit by precomputed radiance transfer: interpolated between the vertices of their
// triangle. Other passes have left these pixels out, for their surface has no id. With WRITES_RADIANCE, what is stored is the radiance
// of a sample.

override WRITES_RADIANCE: bool = false; // whether points are the picture's pixels, and their radiance is stored

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> vertex_irradiance: array<vec4f>;
@group(2) @binding(2) var<uniform> range: VertexRange;
@group(2) @binding(3) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(4) var fine_directional: texture_storage_2d<rgba32float, write>;
@group(2) @binding(5) var<storage, read_write> partial_sums: array<vec4f>;
@group(2) @binding(6) var picture: texture_storage_2d<rg32uint, write>;

override HAS_SPECULAR: bool = false;

// What a pixel of a triangle receives, and 0 where transfer does not light it.
fn transferred(pixel: vec2u, triangle: u32) -> vec4f {
  let corners = triangles[triangle].vertices - range.first;
  if any(corners >= vec3u(range.count)) || vertex_irradiance[corners.x].w == 0.0 { return vec4f(0.0); }
  let hit = hit_at(pixel, triangle);
  // What has vectors of its front alone has no back that is seen.
  let is_back = hit.side < 0.0 && vertex_irradiance[range.count + corners.x].w != 0.0;
  let first = select(0u, range.count, is_back);
  let irradiance = vertex_irradiance[first + corners.x].xyz * (1.0 - hit.u - hit.v)
    + vertex_irradiance[first + corners.y].xyz * hit.u + vertex_irradiance[first + corners.z].xyz * hit.v;
  return vec4f(max(irradiance, vec3f(0.0)), 1.0);
}

@compute @workgroup_size(TILE, TILE)
fn interpolate_transfer(@builtin(global_invocation_id) invocation: vec3u) {
  // The row below the band is a point of its grids, and no pixel of its own.
  if any(invocation.xy > last_point()) { return; }
  let pixel = invocation.xy + vec2u(0u, frame.band.x);
  if WRITES_RADIANCE && pixel.y >= frame.band.y { return; }
  let id = textureLoad(triangle_ids, pixel, 0).x;
  if id == 0u { return; }
  let irradiance = transferred(pixel, id - 1u);
  if irradiance.w == 0.0 { return; }
  if WRITES_RADIANCE {
    let diffuse = diffuse_material(triangles[id - 1u].material);
    add_sample(pixel, radiance_of(diffuse, irradiance.xyz, vec4f(0.0)), true);
  } else {
    textureStore(fine_irradiance, invocation.xy, vec4f(irradiance.xyz, 0.0));
    if HAS_SPECULAR { textureStore(fine_directional, invocation.xy, vec4f(0.0)); }
  }
}
