// Sums over lights at a point. A pass that uses it binds `lights`, `maps` and `atlas`.
//
// The slope-corrected test is rare and long, and so is the mean over the rectangle of a light that is near. Such lights are
// deferred to the end of each group, lest the lanes that need it delay the others at every light; where they are known to be
// near beforehand, they have a loop of their own.

override HAS_SPECULAR: bool; // whether any material has a specular lobe
override HAS_CURVED: bool = false; // whether to sum the direction of light as well, for receivers whose normals vary

// A surface point, for every light.
struct Shading {
  position: vec3f,
  ng: vec3f, // geometric normal, on the side that is seen
  ns: vec3f, // shading normal
  wo: vec3f,
  reflection: Reflection,
  reflected: vec3f, // direction that a mirror would show
  sampled: f32, // share of what is reflected that light samples show, not mirrored rays
}

// Light that would arrive if nothing stood in its way.
struct Arriving {
  g: f32, // geometric factor, 0 where the pair does not face each other
  to_light: vec3f, // direction that it comes from, of any length
  is_near: bool, // whether `g` is that of the light's place, and has to be that of its rectangle
  is_before: bool, // whether the light's place lies before the receiver's planes (core: LightSample::is_before)
}

fn arriving(light: Light, s: Shading) -> Arriving {
  var to_light = light.position - s.position;
  if !ONLY_COSINE_LIGHTS && light.profile >= DIRECTIONAL { to_light = -light.normal; }
  let cos_x = dot(s.ns, to_light);
  let cos_light = -dot(light.normal, to_light);
  let height = dot(s.ng, to_light);
  let is_before = min(cos_x, height) > 0.0;
  let r2 = dot(to_light, to_light);
  let g = geometric_factor(light, cos_x, sent_along(light, to_light, cos_light, r2), r2);
  let may_be_near = cos_light > 0.0 && (is_before || is_open(light));
  return Arriving(select(0.0, g, is_before && cos_light > 0.0), to_light, may_be_near && is_near(light, r2), is_before);
}

// The same of a light that is near, whose place may be before the receiver's planes or not.
fn arriving_near(light: Light, s: Shading, is_before: bool) -> Arriving {
  let to_light = light.position - s.position;
  let r2 = dot(to_light, to_light);
  let mean = rectangle_mean(light, s.position, s.ns);
  let sent = sent_along(light, to_light, -dot(light.normal, to_light), r2);
  let of_place = to_light * select(0.0, sent / (r2 * r2), is_before);
  let vector = mix(mean.vector, of_place, mean.point_share);
  return Arriving(max(dot(vector, s.ns), 0.0), vector, true, is_before);
}

// That of the light's place or of its rectangle.
fn arriving_in_full(light: Light, s: Shading) -> Arriving {
  var a = arriving(light, s);
  if a.is_near { a = arriving_near(light, s, a.is_before); }
  return a;
}

// What a light of the mean size would subtend in its place.
fn mean_solid_angle(light: Light, position: vec3f) -> f32 {
  if !ONLY_COSINE_LIGHTS && light.profile == DISTANT { return frame.sample_solid_angle; }
  let to_light = light.position - position;
  let r2 = dot(to_light, to_light);
  return max(-dot(light.normal, to_light), 0.0) * frame.sample_area / (r2 * sqrt(r2));
}

fn specular_radiance(light: Light, a: Arriving, s: Shading) -> vec3f {
  let r = s.reflection;
  let wi = normalize(a.to_light);
  let solid_angle = solid_angle_of(light, s.position);
  let is_weighed = HAS_MIRRORS && s.sampled < 1.0 && is_spread(r);
  let alpha = widened_alpha(r.alpha, select(solid_angle, 0.0, is_weighed));
  let g = a.g * widened_gain(dot(s.ns, s.wo), r.alpha, alpha);
  let sent = light.intensity * (g * specular_brdf(s.ns, s.wo, wi, r.f0, r.f90, alpha));
  if HAS_MIRRORS && s.sampled < 1.0 && is_punctual(light) { return sent; }
  if is_weighed { return sent * samples_weight(lobe_density(s.ns, s.wo, wi, alpha), mean_solid_angle(light, s.position)); }
  if HAS_MIRRORS && s.sampled < 1.0 { return sent * s.sampled; }
  if !REFLECTS_ENVIRONMENT { return sent; }
  return sent * select(1.0, resolved_share(r.alpha, frame.sample_solid_angle), light.profile == DISTANT);
}

// A point and its sums so far.
struct PointSums {
  shading: Shading,
  irradiance: vec3f,
  specular: vec3f,
  light_direction: vec3f, // luminance-weighted sum of the directions of light: irradiance follows its cosine
  deferred: vec4u, // lights of the group to be added after the others, a bit each
  seen_weight: f32, // of those samples of the environment that are seen
  weight: f32, // of all
  is_surface: bool,
}

// Two exchanges leave all as it was: what is done to each of two points is compiled once.
fn exchange(one: ptr<function, PointSums>, other: ptr<function, PointSums>) {
  let held = *one;
  *one = *other;
  *other = held;
}

fn shading_at(pixel: vec2u, triangle: u32) -> Shading {
  var hit = hit_at(pixel, triangle);
  let m = materials[triangles[triangle].material];
  if varies(m) { hit = with_coordinates(pixel, hit); }
  var shading = Shading(hit.position, hit.geometric_normal, shading_normal(hit, m), hit.wo, Reflection(), vec3f(0.0), 1.0);
  if HAS_SPECULAR { shading.reflection = reflection(hit, m); }
  if REFLECTS_ENVIRONMENT { shading.reflected = reflect(-shading.wo, shading.ns); }
  if HAS_MIRRORS { shading.sampled = 1.0 - mirror_share(shading.reflection, dot(shading.ns, shading.wo)); }
  return shading;
}

fn add(sums: ptr<function, PointSums>, light: Light, a: Arriving, seen: f32) {
  let arrived = light.intensity * (a.g * seen);
  (*sums).irradiance += arrived;
  if HAS_CURVED {
    // G over the receiver's cosine, so that the sum's own cosine gives back what was summed.
    let cosine = dot((*sums).shading.ns, a.to_light);
    (*sums).light_direction += a.to_light * select(0.0, luminance(arrived) / cosine, a.g > 0.0);
  }
  if HAS_SPECULAR {
    if (*sums).shading.reflection.f90 > 0.0 && a.g * seen > 0.0 {
      (*sums).specular += specular_radiance(light, a, (*sums).shading) * seen;
      if REFLECTS_ENVIRONMENT { (*sums).seen_weight += weight_in(light, (*sums).shading) * seen; }
    }
  }
}

fn weight_in(light: Light, s: Shading) -> f32 { return weight_of(light, s.reflected, s.reflection.alpha); }

// Whether a point reflects the environment's own maps.
fn reflects_environment(sums: PointSums) -> bool {
  if !REFLECTS_ENVIRONMENT { return false; }
  return sums.is_surface && sums.shading.reflection.f90 * frame.sample_solid_angle > 0.0 && sums.shading.sampled >= 1.0;
}

// What a grid holds of a point beside irradiance: the direction of light and 1; or specular radiance, and less than 0 by the share of the
// environment's own maps that is to be added.
fn directional_of(sums: PointSums) -> vec4f {
  if HAS_CURVED && sums.shading.reflection.f90 <= 0.0 { return vec4f(sums.light_direction, 1.0); }
  return vec4f(sums.specular, -environment_share(sums.shading.reflection.alpha, sums.seen_weight, sums.weight));
}

// A texel of a light's map: in the map, and its column, row and page in the atlas.
struct ShadowTexel { receiver: Receiver, texel: vec2u, in_atlas: vec3u }

fn shadow_texel_of(light: Light, s: Shading) -> ShadowTexel { return shadow_texel_at(light, s.position, s.ng); }

fn shadow_texel_at(light: Light, position: vec3f, ng: vec3f) -> ShadowTexel {
  let r = receiver(light, position, ng, dot(ng, light.position - position));
  let texel = texel_of(light, r.uv);
  return ShadowTexel(r, texel, in_atlas(light, texel));
}

// The depth that it stores; filters read several.
fn shadow_lookup(texel: ShadowTexel) -> f32 {
  if FILTER > 0u { return 0.0; }
  return atlas_at(texel.in_atlas.xy, texel.in_atlas.z);
}

// Adds a light times its visibility by the depth test, less `counted`, the share that is in the sums already. Returns its
// bit if the test is ambiguous; with a bit of 0 nothing is added.
fn add_depth_tested(
  sums: ptr<function, PointSums>,
  light: Light,
  texel: ShadowTexel,
  stored: f32,
  bit: u32,
  counted: f32,
) -> u32 {
  let a = arriving(light, (*sums).shading);
  if FILTER > 0u {
    if a.g > 0.0 && bit != 0u { add(sums, light, a, filtered(light, texel.receiver) - counted); }
    return 0u;
  }
  let answer = depth_test(light, texel.receiver, texel.texel, stored);
  add(sums, light, a, select(0.0, select(0.0, 1.0, answer == LIT) - counted, bit != 0u));
  return select(0u, bit, answer == AMBIGUOUS && a.g > 0.0);
}

// Adds a light that the depth test found ambiguous, if the slope-corrected test finds it lit.
fn add_slope_corrected(sums: ptr<function, PointSums>, light: Light) {
  let a = arriving(light, (*sums).shading);
  let at = shadow_texel_of(light, (*sums).shading);
  let is_lit = is_lit_closely(light, at.receiver, at.texel, stored_at(light, at.texel), false);
  add(sums, light, a, select(0.0, 1.0, is_lit));
}

// Adds a light, near or not, with whichever shadow test it needs: a closer look where a joint may be between them.
fn add_in_full(sums: ptr<function, PointSums>, light: Light, is_shadowed: bool, is_jointed: bool) {
  let a = arriving_in_full(light, (*sums).shading);
  var is_lit = true;
  if is_shadowed && a.is_before {
    let at = shadow_texel_of(light, (*sums).shading);
    if FILTER > 0u {
      add(sums, light, a, filtered(light, at.receiver));
      return;
    }
    is_lit = passes_shadow_test(light, at.receiver, at.texel, stored_at(light, at.texel), is_jointed);
  }
  add(sums, light, a, select(0.0, 1.0, is_lit));
}

// Removes the next deferred light from the group: its index there.
fn next_deferred(sums: ptr<function, PointSums>) -> u32 {
  let d = (*sums).deferred;
  let word = select(select(select(3u, 2u, d.z != 0u), 1u, d.y != 0u), 0u, d.x != 0u);
  let bits = d[word];
  (*sums).deferred[word] = bits & (bits - 1u);
  return 32u * word + firstTrailingBit(bits);
}
