// After the last draw of multipass shading: light maps and what was summed become points of the grid.

@group(2) @binding(0) var ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> queue: array<u32>;
@group(2) @binding(2) var<storage, read> lists: array<u32>;
@group(2) @binding(3) var<storage, read> light_maps: array<vec4f>;
@group(2) @binding(4) var<uniform> plan: Plan;
@group(2) @binding(5) var keys: texture_2d<u32>;
@group(2) @binding(6) var summed: texture_2d<f32>;
@group(2) @binding(7) var summed_second: texture_2d<f32>;
@group(2) @binding(8) var fine_light: texture_storage_2d<rgba32float, write>;
@group(2) @binding(9) var fine_second: texture_storage_2d<rgba32float, write>;

override CURVED: bool;
override SPECULAR: bool;

fn collect(index: u32, leaf: u32) {
  let at = vec2u(index % frame.size.x, index / frame.size.x);
  let pixel = at + vec2u(0u, frame.band.x);
  let point = (at + frame.step - 1u) / frame.step;
  let triangle = textureLoad(ids, pixel, 0).x - 1u;
  var irradiance = textureLoad(summed, point, 0).xyz;
  if plan.light_maps != 0u && lists[leaf * LEAF_WORDS] != NO_MAP {
    irradiance += mapped_irradiance(leaf * LEAF_WORDS, hit_at(pixel, triangle).position);
  }
  textureStore(fine_light, point, vec4f(max(irradiance, vec3f(0.0)), f32(textureLoad(keys, pixel, 0).x)));
  if CURVED || SPECULAR {
    var reflects = false;
    if SPECULAR {
      var hit = hit_at(pixel, triangle);
      let m = materials[triangles[triangle].material];
      if has_textures(m) { hit = with_coordinates(pixel, hit); }
      reflects = reflection(hit, m).f90 > 0.0;
    }
    textureStore(fine_second, point, vec4f(textureLoad(summed_second, point, 0).xyz, select(0.0, 1.0, CURVED && !reflects)));
  }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let chunk = invocation.x;
  if chunk >= queue[1] { return; }
  let record = queue[plan.chunks_at + chunk];
  let leaf = record & 0xffffffu;
  let slot = plan.sorted_at + chunk * CHUNK;
  collect(queue[slot], leaf);
  if (record >> 24u) > 1u { collect(queue[slot + 1u], leaf); }
}
