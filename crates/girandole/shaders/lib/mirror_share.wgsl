// How much of what a surface reflects is found by a mirrored ray, the rest by light samples (core: brdf::mirror_share).

override HAS_MIRRORS: bool = false; // whether any surface is smooth enough

// Lobes from here on are wider than a pixel: further samples of a pixel take what the first ones' rays brought.
const WIDE_ALPHA = 0.004;

// In further light sets of a refinement, rays are spread over such lobes. Both they and light samples bring all that is reflected, and are
// weighed against each other by their densities (Veach's balance heuristic): what a lobe shows is neither widened nor blurred.
fn is_spread(r: Reflection) -> bool { return (frame.light_set > 0u) & (r.alpha >= WIDE_ALPHA); }

// The weight of light samples in a direction where rays have this density, 1/sr, and samples about one in this solid angle.
fn samples_weight(density: f32, solid_angle: f32) -> f32 { return 1.0 / (1.0 + density * solid_angle); }

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
  let share = clamp((unresolved - MIRROR_LEAST) / (1.0 - MIRROR_LEAST - MIRROR_REST), 0.0, 1.0)
    * clamp((strength - MIRROR_LEAST_FRESNEL) / (2.0 * MIRROR_LEAST_FRESNEL), 0.0, 1.0);
  return select(share, 1.0, share > 0.0 && is_spread(r));
}

// Whether neither its diffuse reflection nor light samples show anything of what a surface receives.
fn shows_no_light(r: Reflection) -> bool {
  return (r.alpha <= frame.polished_alpha) & all(r.albedo == vec3f(0.0));
}
