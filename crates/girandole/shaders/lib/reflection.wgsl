// Reflection (core: brdf::Surface::from_metallic_roughness, see_through).
struct Reflection {
  albedo: vec3f,
  f90: f32, // 0 = no specular lobe
  f0: vec3f,
  alpha: f32,
  transmittance: vec3f, // at normal incidence, but for what is reflected
  opacity: f32,
}

override HAS_TRANSPARENT: bool = false; // whether light passes any material

fn reflection(hit: Hit, m: Material) -> Reflection {
  let base = sample_at(m.base_color_texture, hit);
  let base_color = m.base_color * base.xyz * vertex_tint(hit, m, VERTEX_COLORED);
  let mr = sample_at(m.metallic_roughness_texture, hit);
  let metallic = m.metallic * mr.z;
  let roughness = m.roughness * mr.y;
  let specular = m.specular * sample_at(m.specular_texture, hit).w;
  let tint = m.specular_color * sample_at(m.specular_color_texture, hit).xyz;
  let dielectric = min(0.04 * tint, vec3f(1.0)) * specular;
  var r: Reflection;
  let f0 = max(dielectric.x, max(dielectric.y, dielectric.z));
  r.albedo = base_color * (1.0 - metallic) * (1.0 - (f0 + (specular - f0) / 21.0));
  r.f0 = mix(dielectric, base_color, metallic);
  r.f90 = mix(specular, 1.0, metallic);
  r.alpha = max(roughness * roughness, MIN_ALPHA);
  r.opacity = 1.0;
  if HAS_TRANSPARENT && (m.flags & TRANSPARENT) != 0u {
    r.opacity = select(1.0, m.alpha * base.w, (m.flags & BLENDED) != 0u);
    let transmission = m.transmission * sample_at(m.transmission_texture, hit).x;
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
