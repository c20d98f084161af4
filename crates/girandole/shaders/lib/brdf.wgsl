// core: brdf::specular_brdf. GGX, height-correlated Smith (Heitz 2014, eq. 99), Schlick's Fresnel.

const PI = 3.14159265358979;

// core: brdf::widened_alpha.
fn widened_alpha(alpha: f32, solid_angle: f32) -> f32 {
  return min(sqrt(alpha * alpha + 0.25 * solid_angle), 1.0);
}

// core: brdf::widened_gain.
fn widened_gain(cosine: f32, alpha: f32, widened: f32) -> f32 {
  let nv = clamp(cosine, 0.0, 1.0);
  let along = 3.29 * nv - 0.86;
  let across = 0.95 * (1.0 - nv) * (1.0 - nv);
  return (1.0 + widened * (widened * along + across)) / (1.0 + alpha * (alpha * along + across));
}

// core: brdf::footprint_alpha.
fn footprint_alpha(alpha: f32, x: vec3f, y: vec3f) -> f32 {
  return min(sqrt(alpha * alpha + min(dot(x, x) + dot(y, y), 16.0) * (1.0 / 16.0)), max(alpha, 0.5));
}

// core: brdf::resolved_share.
fn resolved_share(alpha: f32, solid_angle: f32) -> f32 {
  return alpha * alpha / (alpha * alpha + 0.25 * solid_angle);
}

// core: brdf::sample_weight.
fn sample_weight(reflected: vec3f, wi: vec3f, alpha: f32, solid_angle: f32) -> f32 {
  let cosine = dot(reflected, wi);
  let slope2 = max((1.0 - cosine) / max(1.0 + cosine, 1e-3), 0.0);
  let width2 = alpha * alpha + 0.25 * max(solid_angle, LEAST_SOLID_ANGLE);
  let share = alpha * alpha / width2;
  let tail = width2 / ((slope2 + width2) * (slope2 + width2));
  return share * tail + (1.0 - share) * exp(-slope2 / width2) / width2;
}

fn specular_brdf(normal: vec3f, wo: vec3f, wi: vec3f, f0: vec3f, f90: f32, alpha: f32) -> vec3f {
  let sum = wo + wi;
  let h = select(vec3f(0.0), normalize(sum), dot(sum, sum) > 0.0);
  let nv = max(dot(normal, wo), 1e-4);
  let nl = max(dot(normal, wi), 0.0);
  let nh = clamp(dot(normal, h), 0.0, 1.0);
  let nxh = cross(normal, h);
  let vh = clamp(dot(wo, h), 0.0, 1.0);
  let a2 = alpha * alpha;
  let d = dot(nxh, nxh) + a2 * nh * nh;
  let distribution = a2 / (PI * d * d);
  let smith = nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2);
  let x = 1.0 - vh;
  let x5 = x * x * x * x * x;
  return (f0 + (vec3f(f90) - f0) * x5) * (distribution * 0.5 / max(smith, 1e-7));
}

// Smith's Λ for GGX (Heitz 2014, eq. 72).
fn smith_lambda(cosine: f32, alpha: f32) -> f32 {
  let nv = max(cosine, 1e-4);
  return 0.5 * sqrt(1.0 + alpha * alpha * max(1.0 / (nv * nv) - 1.0, 0.0)) - 0.5;
}

// How many of the directions that the facets seen from `wo` reflect lie about `wi`, 1/sr (Heitz 2018). Its terms are those of
// `specular_brdf`, so that compilers find them once.
fn lobe_density(normal: vec3f, wo: vec3f, wi: vec3f, alpha: f32) -> f32 {
  let sum = wo + wi;
  let h = select(vec3f(0.0), normalize(sum), dot(sum, sum) > 0.0);
  let nv = max(dot(normal, wo), 1e-4);
  let nh = clamp(dot(normal, h), 0.0, 1.0);
  let nxh = cross(normal, h);
  let a2 = alpha * alpha;
  let d = dot(nxh, nxh) + a2 * nh * nh;
  let distribution = a2 / (PI * d * d);
  return distribution * 0.25 / (nv * (1.0 + smith_lambda(nv, alpha)));
}
