// After the draw of multipass shading: its sums and light maps become points of the grid.

@group(2) @binding(0) var triangle_ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> point_queue: PointQueue;
@group(2) @binding(2) var<storage, read> light_lists: array<u32>;
@group(2) @binding(3) var<storage, read> light_maps: array<vec4f>;
@group(2) @binding(4) var<uniform> offsets: BufferOffsets;
@group(2) @binding(5) var surface_ids: texture_2d<u32>;
@group(2) @binding(6) var summed_irradiance: texture_2d<f32>;
@group(2) @binding(7) var summed_directional: texture_2d<f32>;
@group(2) @binding(8) var fine_irradiance: texture_storage_2d<rgba32float, write>;
@group(2) @binding(9) var fine_directional: texture_storage_2d<rgba32float, write>;
@group(2) @binding(10) var<storage, read> lights: array<Light>;

override HAS_CURVED: bool;
override HAS_SPECULAR: bool;

fn collect(index: u32, leaf: u32) {
  let at = vec2u(index % frame.size.x, index / frame.size.x);
  let pixel = at + vec2u(0u, frame.band.x);
  let point = (at + frame.step - 1u) / frame.step;
  let triangle = textureLoad(triangle_ids, pixel, 0).x - 1u;
  var irradiance = textureLoad(summed_irradiance, point, 0).xyz;
  var hit = hit_at(pixel, triangle);
  if offsets.light_maps != 0u && has_light_map(leaf) { irradiance += mapped_irradiance(leaf, hit.position); }
  let m = materials[triangles[triangle].material];
  var r: Reflection;
  if HAS_SPECULAR {
    if varies(m) { hit = with_coordinates(pixel, hit); }
    r = reflection(hit, m);
    if HAS_MIRRORS && shows_no_light(r) { irradiance = vec3f(0.0); }
  }
  let surface_id = spaced_surface_id(textureLoad(surface_ids, pixel, 0).x, pixel, hit.position, hit.geometric_normal, leaf);
  textureStore(fine_irradiance, point, vec4f(max(irradiance, vec3f(0.0)), surface_id));
  if HAS_CURVED || HAS_SPECULAR {
    let summed = textureLoad(summed_directional, point, 0);
    let reflects = HAS_SPECULAR && r.f90 > 0.0;
    var share = 0.0;
    if REFLECTS_ENVIRONMENT && reflects && frame.sample_solid_angle > 0.0 {
      let normal = shading_normal(hit, m);
      let reflected = reflect(-hit.wo, normal);
      var weight = 0.0;
      for (var i = 0u; i < frame.end_light; i++) { weight += weight_of(lights[i], reflected, r.alpha); }
      share = environment_share(r.alpha, summed.w, weight);
      // Else mirrored rays find out.
      if mirror_share(r, dot(normal, hit.wo)) > 0.0 { share = 0.0; }
    }
    textureStore(fine_directional, point, vec4f(summed.xyz, select(-share, 1.0, HAS_CURVED && !reflects)));
  }
}

@compute @workgroup_size(WORKGROUP)
fn multipass_collect(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x >= point_queue.chunks { return; }
  let chunk = point_queue.words[offsets.chunks_at + invocation.x];
  let slot = offsets.sorted_at + invocation.x * CHUNK;
  collect(point_queue.words[slot], chunk_leaf(chunk));
  if chunk_points(chunk) > 1u { collect(point_queue.words[slot + 1u], chunk_leaf(chunk)); }
}
