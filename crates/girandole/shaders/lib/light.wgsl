// Light samples (core: lights::LightSample).

struct Light {
  position: vec3f,
  profile: u32, // COSINE, HEMISPHERE, SPOT, DIRECTIONAL or DISTANT
  normal: vec3f,
  scale: f32, // cosine: height / width of its rectangle, negative if that is not open; spot: 1 / (cos inner − cos outer); parallel light: 1 / half the width of its map, 1/m
  tangent: vec3f,
  offset: f32, // cosine: squared distance within which a receiver may be near, m², negative if its rectangle is spread; spot: −cos outer · scale; parallel light: 1 / radius of the scene, 1/m
  intensity: vec3f,
  atlas_slot: u32, // of its shadow map in the atlas: (page << 24) | (log2 of its units across << 20) | (row << 10) | column, in units; or NO_MAP
  rectangle: vec4f, // cosine: from the position to the rectangle's centre, and half its width, along tangent and bitangent, m; distant: x = solid angle, sr, w: > 0 where its map is large; parallel light: z, see `parallel_map`
  lobe: vec4f, // axis and matt share (core: Profile::Lobe); of what has none 0 and 1
}

const HEMISPHERE_SOLID_ANGLE = 6.28318530717959;

override ONLY_COSINE_LIGHTS: bool = false; // whether all lights have the profile COSINE
override HAS_LOBES: bool = false; // whether some of those may have lobes

// The cosine at the light times the distance, and by what a lobe sends there (core: Profile::Lobe).
fn sent_along(light: Light, to_light: vec3f, cos_light: f32, r2: f32) -> f32 {
  if !HAS_LOBES { return cos_light; }
  let along = max(-dot(light.lobe.xyz, to_light), 0.0);
  let along2 = along * along / r2;
  let cosine = max(cos_light, 0.0) * inverseSqrt(r2);
  return cos_light * (light.lobe.w + along2 * along2 / (1.0 + LOBE_SLOPE * cosine));
}

// Whether a receiver is so near that the light's rectangle counts, or may be.
fn is_near(light: Light, r2: f32) -> bool {
  return (ONLY_COSINE_LIGHTS || light.profile == COSINE) && r2 < select(0.0, abs(light.offset), frame.clamp == OWN_CLAMP);
}

// Whether its rectangle lights what its place lies behind.
fn is_open(light: Light) -> bool { return light.scale > 0.0; }

// Whether it is a point of light or a sun without extent, which no ray meets.
fn is_punctual(light: Light) -> bool {
  return !ONLY_COSINE_LIGHTS && light.profile != COSINE && light.profile != DISTANT;
}

// The solid angle of what a light stands for (core: LightSample::solid_angle), where it is not taken for a point.
fn solid_angle_of(light: Light, position: vec3f) -> f32 {
  if frame.clamp != OWN_CLAMP || is_punctual(light) { return 0.0; }
  if !ONLY_COSINE_LIGHTS && light.profile == DISTANT { return light.rectangle.x; }
  let to_light = light.position - position;
  let r2 = dot(to_light, to_light);
  let side = select(2.0, 2.0 / RECTANGLE_SPREAD, light.offset < 0.0);
  let area = side * side * dot(light.rectangle.zw, light.rectangle.zw) * abs(light.scale);
  return clamp(-dot(light.normal, to_light) * area / (r2 * sqrt(r2)), 0.0, HEMISPHERE_SOLID_ANGLE);
}

// The geometric factor G of the light's place, bounded (core: LightSample::geometric_factor), where the pair faces each
// other: `cos_x` and `cos_light` are both cosines times the distance, positive, the latter by `sent_along`; `r2` is its square.
fn geometric_factor(light: Light, cos_x: f32, cos_light: f32, r2: f32) -> f32 {
  let bound = select(frame.clamp, MAX_CLAMP, frame.clamp == OWN_CLAMP);
  if ONLY_COSINE_LIGHTS || light.profile == COSINE {
    return min(cos_x * cos_light / (r2 * r2), bound);
  }
  if light.profile >= DIRECTIONAL { return cos_x; }
  let inverse_r = inverseSqrt(r2);
  var falloff = 1.0;
  if light.profile == SPOT {
    falloff = clamp(cos_light * inverse_r * light.scale + light.offset, 0.0, 1.0);
    falloff *= falloff;
  }
  return min(cos_x * inverse_r * falloff / r2, bound);
}
