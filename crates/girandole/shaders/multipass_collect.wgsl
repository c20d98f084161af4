// After the last draw of multipass shading: light maps and what was summed_irradiance become points of the grid.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> point_queue: array<u32>;
@group(2) @binding(2) var<storage, read> light_lists: array<u32>;
@group(2) @binding(3) var<storage, read> light_maps: array<vec4f>;
@group(2) @binding(4) var<uniform> offsets: BufferOffsets;
@group(2) @binding(5) var surface_ids: texture_2d<u32>;
@group(2) @binding(6) var summed_irradiance: texture_2d<f32>;
@group(2) @binding(7) var summed_directional: texture_2d<f32>;
@group(2) @binding(8) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(9) var fine_directional: texture_storage_2d<rgba32float, write>;

override HAS_CURVED: bool;
override HAS_SPECULAR: bool;

fn collect(index: u32, leaf: u32) {
  let at = vec2u(index % frame.size.x, index / frame.size.x);
  let pixel = at + vec2u(0u, frame.band.x);
  let point = (at + frame.step - 1u) / frame.step;
  let triangle = textureLoad(triangle_ids, pixel, 0).x - 1u;
  var irradiance = textureLoad(summed_irradiance, point, 0).xyz;
  if offsets.light_maps != 0u && light_lists[leaf * LEAF_WORDS] != NO_MAP {
    irradiance += mapped_irradiance(leaf * LEAF_WORDS, hit_at(pixel, triangle).position);
  }
  textureStore(fine_irradiance, point, vec4f(max(irradiance, vec3f(0.0)), f32(textureLoad(surface_ids, pixel, 0).x)));
  if HAS_CURVED || HAS_SPECULAR {
    var reflects = false;
    if HAS_SPECULAR {
      var hit = hit_at(pixel, triangle);
      let m = materials[triangles[triangle].material];
      if has_textures(m) { hit = with_coordinates(pixel, hit); }
      reflects = reflection(hit, m).f90 > 0.0;
    }
    textureStore(fine_directional, point, vec4f(textureLoad(summed_directional, point, 0).xyz, select(0.0, 1.0, HAS_CURVED && !reflects)));
  }
}

@compute @workgroup_size(64)
fn multipass_collect(@builtin(global_invocation_id) invocation: vec3u) {
  let chunk = invocation.x;
  if chunk >= point_queue[1] { return; }
  let record = point_queue[offsets.chunks_at + chunk];
  let leaf = record & 0xffffffu;
  let slot = offsets.sorted_at + chunk * CHUNK;
  collect(point_queue[slot], leaf);
  if (record >> 24u) > 1u { collect(point_queue[slot + 1u], leaf); }
}
