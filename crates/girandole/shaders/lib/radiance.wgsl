// The last step, where a scene has no textures: from what a pixel receives to the radiance that it sends.

override FINAL: bool = false; // whether points are the picture's pixels: what is stored is their radiance

// What a material makes of light.
struct Paint { material: u32, albedo: vec3f, emission: vec3f }

const NO_PAINT = Paint(0xffffffffu, vec3f(0.0), vec3f(0.0));

fn paint_of(material: u32) -> Paint {
  return Paint(material, materials[material].albedo / PI, materials[material].emission);
}

fn radiance_of(paint: Paint, irradiance: vec3f, second: vec4f) -> vec3f {
  var radiance = irradiance * paint.albedo + paint.emission;
  // The direction of light is no part of the picture.
  if SPECULAR { radiance += select(second.xyz, vec3f(0.0), second.w > 0.0); }
  return radiance;
}
