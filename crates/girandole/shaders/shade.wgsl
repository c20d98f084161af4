// Naive shading: every pixel of the band sums every light of the batch, each with its shadow map. Sums are kept in
// order of lights, in groups of GROUP, so the size of batches (whole groups) and bands changes nothing.
//
// Software adapters execute both sides of every branch; only loops jump. So the rare second look at a shadow map is
// put off to a loop of its own at the end of each group, and what a scene does not need is not compiled in.

override SPECULAR: bool; // whether any material has a specular lobe

@group(2) @binding(0) var ids: texture_2d<u32>;
@group(2) @binding(1) var atlas: texture_depth_2d_array;
// A batch of lights: uniform buffers are by far the quickest to read where neighbours read the same.
@group(2) @binding(2) var<uniform> lights: array<Light, 512>;
// Two elements a pixel: irradiance, specular radiance.
@group(2) @binding(3) var<storage, read_write> sums: array<vec4f>;
@group(2) @binding(4) var<uniform> maps: Maps;

const GROUP = 128u;

// What a pixel needs for every light.
struct Shading {
  position: vec3f,
  ng: vec3f, // geometric normal, on the side that is seen
  ns: vec3f, // shading normal
  wo: vec3f,
  reflection: Reflection,
}

// Light that would arrive if nothing stood in its way.
struct Arriving {
  g: f32, // geometric factor, 0 where the pair does not face each other
  to_light: vec3f, // m; of parallel light, a unit vector
  height: f32, // of the light over the receiver's plane
}

fn arriving(light: Light, s: Shading) -> Arriving {
  var to_light = light.position - s.position;
  if !PLAIN && light.profile == DIRECTIONAL { to_light = -light.normal; }
  let cos_x = dot(s.ns, to_light);
  let cos_light = -dot(light.normal, to_light);
  let height = dot(s.ng, to_light);
  let faces = min(min(cos_x, cos_light), height) > 0.0;
  let g = geometric_factor(light, cos_x, cos_light, dot(to_light, to_light));
  return Arriving(select(0.0, g, faces), to_light, height);
}

fn specular(light: Light, a: Arriving, s: Shading) -> vec3f {
  let r = s.reflection;
  return light.intensity * (a.g * specular_brdf(s.ns, s.wo, normalize(a.to_light), r.f0, r.f90, r.alpha));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let index = 2u * band_index(pixel);
  var irradiance = vec3f(0.0);
  var glossy = vec3f(0.0);
  if frame.first_light > 0u {
    irradiance = sums[index].xyz;
    glossy = sums[index + 1u].xyz;
  }
  let id = textureLoad(ids, pixel, 0).x;
  if id == 0u { return; }
  var hit = hit_at(pixel, id - 1u);
  let m = materials[triangles[hit.triangle].material];
  if has_textures(m) { hit = with_coordinates(pixel, hit); }
  var s = Shading(hit.position, hit.geometric_normal, shading_normal(hit, m), hit.wo, Reflection());
  if SPECULAR { s.reflection = reflection(hit, m); }

  for (var first = frame.first_light; first < frame.end_light; first += GROUP) {
    var doubtful = vec4u(0u);
    for (var word = 0u; word < 4u; word++) {
      let start = first + 32u * word;
      let end = min(start + 32u, frame.end_light);
      var bits = 0u;
      for (var i = start; i < end; i++) {
        let light = lights[i - frame.first_light];
        let a = arriving(light, s);
        let r = receiver(light, s.position, s.ng, a.height);
        var seen = 0.0;
        if FILTER > 0u {
          if a.g > 0.0 { seen = filtered(light, r); }
        } else {
          let texel = texel_of(light, r.uv);
          let look = first_look(light, r, texel, stored_at(light, texel));
          seen = select(0.0, 1.0, look == LIT);
          bits |= select(0u, 1u << (i - start), look == DOUBTFUL && a.g > 0.0);
        }
        irradiance += light.intensity * (a.g * seen);
        if SPECULAR { if s.reflection.f90 > 0.0 && a.g * seen > 0.0 { glossy += specular(light, a, s) * seen; } }
      }
      doubtful[word] = bits;
    }
    while any(doubtful != vec4u(0u)) {
      let word = select(select(select(3u, 2u, doubtful.z != 0u), 1u, doubtful.y != 0u), 0u, doubtful.x != 0u);
      let bits = doubtful[word];
      doubtful[word] = bits & (bits - 1u);
      let light = lights[first + 32u * word + firstTrailingBit(bits) - frame.first_light];
      let a = arriving(light, s);
      let r = receiver(light, s.position, s.ng, a.height);
      let texel = texel_of(light, r.uv);
      if second_look(light, r, texel, stored_at(light, texel)) {
        irradiance += light.intensity * a.g;
        if SPECULAR { if s.reflection.f90 > 0.0 { glossy += specular(light, a, s); } }
      }
    }
  }
  sums[index] = vec4f(irradiance, 0.0);
  sums[index + 1u] = vec4f(glossy, 0.0);
}
