// The last step, where a scene has no textures: from the irradiance of a pixel to the radiance that it sends.

// A material without its specular lobe; albedo is divided by π.
struct DiffuseMaterial { material: u32, albedo: vec3f, emission: vec3f }

const NO_DIFFUSE_MATERIAL = DiffuseMaterial(NONE, vec3f(0.0), vec3f(0.0));

fn diffuse_material(material: u32) -> DiffuseMaterial {
  return DiffuseMaterial(material, materials[material].albedo / PI, materials[material].emission);
}

fn radiance_of(diffuse: DiffuseMaterial, irradiance: vec3f, directional: vec4f) -> vec3f {
  var radiance = irradiance * diffuse.albedo + diffuse.emission;
  // The direction of light is no part of the picture.
  if HAS_SPECULAR { radiance += select(directional.xyz, vec3f(0.0), directional.w > 0.0); }
  return radiance;
}
