// What each pixel shows, in four words: depth, shading normal, leaf receiver and flags, object.

@group(2) @binding(0) var ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> receivers: array<u32>;
@group(2) @binding(2) var<storage, read_write> surfaces: array<vec4u>;
@group(2) @binding(3) var<uniform> plan: Plan;

fn grid_vector(at: u32) -> vec3f {
  return bitcast<vec3f>(vec3u(receivers[at], receivers[at + 1u], receivers[at + 2u]));
}

// The leaf that a point of a triangle belongs to (core: Receivers::leaf_at).
fn leaf_at(receiver: u32, position: vec3f, front: bool) -> u32 {
  if (receiver & CLUSTERED) != 0u { return receiver & ~CLUSTERED; }
  let grid = plan.grids_at + 16u * receiver;
  let d = position - grid_vector(grid);
  let size = vec2u(receivers[grid + 3u], receivers[grid + 7u]);
  let along = vec2f(dot(d, grid_vector(grid + 4u)), dot(d, grid_vector(grid + 8u)));
  let cell = min(vec2u(max(along, vec2f(0.0))), size - 1u);
  let side = select(receivers[grid + 12u], receivers[grid + 11u], front);
  return receivers[plan.cells_at + side + cell.y * size.x + cell.x];
}

const CLUSTERED = 0x80000000u;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y > frame.last_row { return; }
  let index = band_index(pixel);
  let id = textureLoad(ids, pixel, 0).x;
  if id == 0u {
    surfaces[index] = vec4u(0u);
    return;
  }
  var hit = hit_at(pixel, id - 1u);
  let m = materials[triangles[id - 1u].material];
  if TEXTURES { hit = with_coordinates(pixel, hit); }
  let normal = shading_normal(hit, m);
  let receiver = receivers[2u * (id - 1u)];
  let leaf = leaf_at(receiver, hit.position, hit.side > 0.0);
  var flags = 0u;
  if (receiver & CLUSTERED) == 0u && dot(normal, hit.geometric_normal) > 0.99999 && m.normal_texture.texture == NONE {
    flags |= PLANAR;
  }
  // Sharp reflections change from pixel to pixel, and so do those of curved surfaces.
  if m.specular > 0.0 || m.metallic > 0.0 {
    let rough = m.metallic_roughness_texture.texture == NONE && m.roughness >= 0.5 && flags == PLANAR;
    flags |= select(SHINY, 0u, rough);
  }
  let depth = dot(hit.position - frame.eye, frame.forward);
  surfaces[index] = vec4u(bitcast<u32>(depth), pack_normal(normal), leaf | flags, receivers[2u * (id - 1u) + 1u]);
}
