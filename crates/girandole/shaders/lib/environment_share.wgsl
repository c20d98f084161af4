// How much of what a smooth surface reflects is the environment's own maps (lib/reflected_environment.wgsl) rather than light samples,
// and whether that is seen: by those samples of the environment that lie about in that direction (core: brdf::sample_weight).

override REFLECTS_ENVIRONMENT: bool = false; // whether any surface does

// About how much of what is reflected comes from a sample of the environment, if it is seen, in any unit; 0 for other lights.
fn weight_of(light: Light, reflected: vec3f, alpha: f32) -> f32 {
  // In this unit it fits 16 bits.
  let weight = luminance(light.intensity) * frame.sample_solid_angle;
  return select(0.0, weight * sample_weight(reflected, -light.normal, alpha, light.rectangle.x), light.profile == DISTANT);
}

// The share, given the weights of the samples that are seen and of all.
fn environment_share(alpha: f32, seen: f32, all: f32) -> f32 {
  if !REFLECTS_ENVIRONMENT || all <= 0.0 { return 0.0; }
  return (1.0 - resolved_share(alpha, frame.sample_solid_angle)) * clamp(seen / all, 0.0, 1.0);
}
