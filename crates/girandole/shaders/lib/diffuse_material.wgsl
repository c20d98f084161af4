// The last step, where a scene has no textures: from what a pixel receives to the radiance that it sends.

override WRITES_RADIANCE: bool = false; // whether points are the picture's pixels: what is stored is their radiance

// What a material makes of light.
struct DiffuseMaterial { material: u32, albedo: vec3f, emission: vec3f }

const NO_DIFFUSE_MATERIAL = DiffuseMaterial(0xffffffffu, vec3f(0.0), vec3f(0.0));

fn diffuse_material(material: u32) -> DiffuseMaterial {
  return DiffuseMaterial(material, materials[material].albedo / PI, materials[material].emission);
}

fn radiance_of(diffuse: DiffuseMaterial, irradiance: vec3f, second: vec4f) -> vec3f {
  var radiance = irradiance * diffuse.albedo + diffuse.emission;
  // The direction of light is no part of the picture.
  if HAS_SPECULAR { radiance += select(second.xyz, vec3f(0.0), second.w > 0.0); }
  return radiance;
}
