// Reflection (core: brdf::Surface::from_metallic_roughness).
struct Reflection {
  albedo: vec3f,
  f90: f32, // 0 = no specular lobe
  f0: vec3f,
  alpha: f32,
}

fn reflection(hit: Hit, m: Material) -> Reflection {
  let base_color = m.base_color * sample_at(m.base_color_texture, hit).xyz * vertex_tint(hit, m, VERTEX_COLORED);
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
  return r;
}
