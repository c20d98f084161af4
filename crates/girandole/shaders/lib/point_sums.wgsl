// Sums over lights at a point. A pass that uses it binds `lights`, `maps` and `triangle_ids`, and names one of lib/atlas_*.wgsl.
//
// Software adapters execute both sides of every branch; only loops jump. So the rare second look at a shadow map is
// put off to a loop of its own at the end of each group, and what a scene does not need is not compiled in.

override HAS_SPECULAR: bool; // whether any material has a specular lobe
override HAS_CURVED: bool = false; // whether to sum the direction of light as well, for receivers whose normals vary

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
  if !ONLY_COSINE_LIGHTS && light.profile == DIRECTIONAL { to_light = -light.normal; }
  let cos_x = dot(s.ns, to_light);
  let cos_light = -dot(light.normal, to_light);
  let height = dot(s.ng, to_light);
  let faces = min(min(cos_x, cos_light), height) > 0.0;
  let g = geometric_factor(light, cos_x, cos_light, dot(to_light, to_light));
  return Arriving(select(0.0, g, faces), to_light, height);
}

fn specular_radiance(light: Light, a: Arriving, s: Shading) -> vec3f {
  let r = s.reflection;
  return light.intensity * (a.g * specular_brdf(s.ns, s.wo, normalize(a.to_light), r.f0, r.f90, r.alpha));
}

// A point and its sums so far.
struct PointSums {
  shading: Shading,
  irradiance: vec3f,
  specular: vec3f,
  light_direction: vec3f, // luminance-weighted sum of the directions of light: irradiance follows its cosine
  ambiguous: vec4u, // lights of the group that want a second look, a bit each
  is_surface: bool,
}

fn shading_at(pixel: vec2u, triangle: u32) -> Shading {
  var hit = hit_at(pixel, triangle);
  let m = materials[triangles[triangle].material];
  if has_textures(m) { hit = with_coordinates(pixel, hit); }
  var shading = Shading(hit.position, hit.geometric_normal, shading_normal(hit, m), hit.wo, Reflection());
  if HAS_SPECULAR { shading.reflection = reflection(hit, m); }
  return shading;
}

fn add(state: ptr<function, PointSums>, light: Light, a: Arriving, seen: f32) {
  let arrived = light.intensity * (a.g * seen);
  (*state).irradiance += arrived;
  if HAS_CURVED {
    // G over the receiver's cosine, so that the sum's own cosine gives back what was summed.
    let cosine = dot((*state).shading.ns, a.to_light);
    (*state).light_direction += a.to_light * select(0.0, dot(arrived, LUMINANCE) / cosine, a.g > 0.0);
  }
  if HAS_SPECULAR {
    if (*state).shading.reflection.f90 > 0.0 && a.g * seen > 0.0 {
      (*state).specular += specular_radiance(light, a, (*state).shading) * seen;
    }
  }
}

const LUMINANCE = vec3f(0.2126, 0.7152, 0.0722);

// A place in a light's map, and in the atlas.
struct ShadowTexel { receiver: Receiver, texel: vec2u, at: vec3u }

fn shadow_texel_of(light: Light, s: Shading) -> ShadowTexel {
  let r = receiver(light, s.position, s.ng, dot(s.ng, light.position - s.position));
  let texel = texel_of(light, r.uv);
  return ShadowTexel(r, texel, in_atlas(light, texel));
}

// What is stored there; filters look for themselves.
fn shadow_lookup(shadow_texel: ShadowTexel) -> f32 {
  if FILTER > 0u { return 0.0; }
  return atlas_at(shadow_texel.at.xy, shadow_texel.at.z);
}

// Adds a light with what its map says at first look, less `counted`; the bit of one that wants a second look. With a bit
// of 0 nothing is added.
fn add_depth_tested(state: ptr<function, PointSums>, light: Light, shadow_texel: ShadowTexel, stored: f32, bit: u32, counted: f32) -> u32 {
  let a = arriving(light, (*state).shading);
  if FILTER > 0u {
    if a.g > 0.0 && bit != 0u { add(state, light, a, filtered(light, shadow_texel.receiver) - counted); }
    return 0u;
  }
  let answer = depth_test(light, shadow_texel.receiver, shadow_texel.texel, stored);
  add(state, light, a, select(0.0, select(0.0, 1.0, answer == LIT) - counted, bit != 0u));
  return select(0u, bit, answer == AMBIGUOUS && a.g > 0.0);
}

// Adds a light that the first look left in the dark if the second sees it.
fn add_slope_corrected(state: ptr<function, PointSums>, light: Light) {
  let a = arriving(light, (*state).shading);
  let r = receiver(light, (*state).shading.position, (*state).shading.ng, a.height);
  let texel = texel_of(light, r.uv);
  add(state, light, a, select(0.0, 1.0, slope_corrected_test(light, r, texel, stored_at(light, texel))));
}

// Takes the next light that wants a second look out of the group: its place there.
fn next_ambiguous(state: ptr<function, PointSums>) -> u32 {
  let d = (*state).ambiguous;
  let word = select(select(select(3u, 2u, d.z != 0u), 1u, d.y != 0u), 0u, d.x != 0u);
  let bits = d[word];
  (*state).ambiguous[word] = bits & (bits - 1u);
  return 32u * word + firstTrailingBit(bits);
}
