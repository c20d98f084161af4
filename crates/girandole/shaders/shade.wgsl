// Naive shading: every pixel of the band sums every light of the batch, each with its shadow map. Sums are kept in
// order of lights, so the size of batches and bands changes nothing.

@group(2) @binding(0) var ids: texture_2d<u32>;
@group(2) @binding(1) var atlas: texture_depth_2d_array;
@group(2) @binding(2) var<storage, read> lights: array<Light>;
// Two elements a pixel: irradiance, specular radiance.
@group(2) @binding(3) var<storage, read_write> sums: array<vec4f>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let index = 2u * band_index(pixel);
  var irradiance = vec3f(0.0);
  var specular = vec3f(0.0);
  if frame.first_light > 0u {
    irradiance = sums[index].xyz;
    specular = sums[index + 1u].xyz;
  }
  let id = textureLoad(ids, pixel, 0).x;
  if id > 0u {
    var hit = hit_at(pixel, id - 1u);
    let material = triangles[hit.triangle].material;
    let m = materials[material];
    if has_textures(m) { hit = with_coordinates(pixel, hit); }
    let normal = shading_normal(hit, m);
    let r = reflection(hit, m);
    for (var i = frame.first_light; i < frame.end_light; i++) {
      // Of a light that does not face the pixel, only this much is read.
      let light_normal = lights[i].normal;
      var to_light = lights[i].position - hit.position;
      if lights[i].profile == DIRECTIONAL { to_light = -light_normal; }
      let cos_x = dot(normal, to_light);
      let cos_light = -dot(light_normal, to_light);
      if min(min(cos_x, cos_light), dot(hit.geometric_normal, to_light)) <= 0.0 { continue; }
      let light = lights[i];
      let r2 = dot(to_light, to_light);
      let g = geometric_factor(light, cos_x, cos_light, r2) * visibility(light, hit.position, hit.geometric_normal);
      irradiance += light.intensity * g;
      if r.f90 > 0.0 {
        specular += light.intensity * (g * specular_brdf(normal, hit.wo, to_light * inverseSqrt(r2), r.f0, r.f90, r.alpha));
      }
    }
  }
  sums[index] = vec4f(irradiance, 0.0);
  sums[index + 1u] = vec4f(specular, 0.0);
}
