// Reflection (core: brdf::Surface::from_metallic_roughness, see_through).
struct Reflection {
  albedo: vec3f,
  f90: f32, // 0 = no specular lobe
  f0: vec3f,
  alpha: f32,
  transmittance: vec3f, // at normal incidence, but for what is reflected
  opacity: f32,
}

const MEAN_SCHLICK = 0.00367; // as in brdf.rs
override HAS_TRANSPARENT: bool = false; // whether light passes any material

// What a material's textures say of its reflection, 1 where it has none.
struct ReflectionTexels { base: vec4f, metallic_roughness: vec4f, specular: f32, specular_color: vec3f, transmission: f32 }

fn reflection_texels(hit: Hit, m: Material) -> ReflectionTexels {
  var texels = ReflectionTexels(vec4f(1.0), vec4f(1.0), 1.0, vec3f(1.0), 1.0);
  if !HAS_TEXTURES { return texels; }
  // One after another: drivers inline all calls, and the look-up is long.
  for (var i = 0u; i < select(4u, 5u, HAS_TRANSPARENT); i++) {
    var use_ = m.base_color_texture;
    switch i {
      case 1u { use_ = m.metallic_roughness_texture; }
      case 2u { use_ = m.specular_texture; }
      case 3u { use_ = m.specular_color_texture; }
      case 4u { use_ = m.transmission_texture; }
      default {}
    }
    if use_.texture == NONE { continue; }
    let sampled = sample_at(use_, hit);
    switch i {
      case 1u { texels.metallic_roughness = sampled; }
      case 2u { texels.specular = sampled.w; }
      case 3u { texels.specular_color = sampled.xyz; }
      case 4u { texels.transmission = sampled.x; }
      default { texels.base = sampled; }
    }
  }
  return texels;
}

fn reflection(hit: Hit, m: Material) -> Reflection {
  let texels = reflection_texels(hit, m);
  let base = texels.base;
  let base_color = m.base_color * base.xyz * vertex_tint(hit, m, VERTEX_COLORED);
  let metallic = m.metallic * texels.metallic_roughness.z;
  let roughness = m.roughness * texels.metallic_roughness.y;
  let specular = m.specular * texels.specular;
  let tint = m.specular_color * texels.specular_color;
  let dielectric = min(0.04 * tint, vec3f(1.0)) * specular;
  var r: Reflection;
  let f0 = max(dielectric.x, max(dielectric.y, dielectric.z));
  r.albedo = base_color * (1.0 - metallic) * (1.0 - (f0 + (specular - f0) * MEAN_SCHLICK));
  r.f0 = mix(dielectric, base_color, metallic);
  r.f90 = mix(specular, 1.0, metallic);
  r.alpha = max(roughness * roughness, MIN_ALPHA);
  r.opacity = 1.0;
  if HAS_TRANSPARENT && (m.flags & TRANSPARENT) != 0u {
    r.opacity = select(1.0, m.alpha * base.w, (m.flags & BLENDED) != 0u);
    let transmission = m.transmission * texels.transmission;
    r.transmittance = transmission * base_color * (1.0 - metallic);
    r.albedo *= r.opacity * (1.0 - transmission);
    r.f0 *= r.opacity;
    r.f90 *= r.opacity;
  }
  return r;
}

// Share of the radiance from straight behind that passes, where the ray and the normal have this cosine.
fn transmittance(r: Reflection, cosine: f32) -> vec3f {
  // Without the opacity again.
  let f0 = r.f0 / max(r.opacity, 1e-6);
  let reflected = f0 + (r.f90 / max(r.opacity, 1e-6) - f0) * pow(1.0 - clamp(cosine, 0.0, 1.0), 5.0);
  return 1.0 - r.opacity + r.opacity * r.transmittance * (1.0 - min(reflected, vec3f(1.0)));
}
