// How much of what a surface reflects is found by a mirrored ray, the rest by light samples (core: brdf::mirror_share).

override HAS_MIRRORS: bool = false; // whether any surface is smooth enough

// Schlick's Fresnel where a mirror reflects.
fn mirror_fresnel(r: Reflection, cosine: f32) -> vec3f {
  let x = 1.0 - clamp(cosine, 0.0, 1.0);
  return r.f0 + (vec3f(r.f90) - r.f0) * (x * x * x * x * x);
}

fn mirror_share(r: Reflection, cosine: f32) -> f32 {
  if !HAS_MIRRORS || frame.mirror_solid_angle <= 0.0 || r.f90 <= 0.0 { return 0.0; }
  let unresolved = 1.0 - resolved_share(r.alpha, frame.mirror_solid_angle);
  let fresnel = mirror_fresnel(r, cosine);
  let strength = max(fresnel.x, max(fresnel.y, fresnel.z));
  return max(unresolved - MIRROR_LEAST, 0.0) / (1.0 - MIRROR_LEAST)
    * clamp((strength - MIRROR_LEAST_FRESNEL) / (2.0 * MIRROR_LEAST_FRESNEL), 0.0, 1.0);
}
