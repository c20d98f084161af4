// Group 1: the scene.

struct Vertex {
  position: vec3f,
  u1: f32,
  normal: vec3f,
  v1: f32,
  tangent: vec4f,
  uv0: vec2f,
  color: vec2u, // three of four times 16 bits
}

struct Triangle {
  vertices: vec3u,
  material: u32,
}

// How a material uses a texture: `texture` indexes the directory at the head of `texels`; NONE = not at all.
struct TextureUse {
  matrix: vec4f, // texture from vertex coordinates: columns
  shift: vec2f,
  texture: u32,
  uv_set: u32,
}

struct Material {
  base_color: vec3f,
  alpha: f32,
  emission: vec3f,
  alpha_cutoff: f32, // negative = opaque
  specular_color: vec3f,
  specular: f32,
  metallic: f32,
  roughness: f32,
  normal_scale: f32,
  transmission: f32,
  albedo: vec3f, // of the diffuse reflection, but for textures
  flags: u32, // VERTEX_COLORED, UNLIT and others
  base_color_texture: TextureUse,
  metallic_roughness_texture: TextureUse,
  specular_texture: TextureUse,
  specular_color_texture: TextureUse,
  normal_texture: TextureUse,
  emission_texture: TextureUse,
  transmission_texture: TextureUse,
}

@group(1) @binding(0) var<storage, read> vertices: array<Vertex>;
@group(1) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(1) @binding(2) var<storage, read> materials: array<Material>;
// A directory of textures and their texels, see lib/texture.wgsl: words in rows of a texture, which leaves a storage
// buffer to the passes.
@group(1) @binding(3) var texels: texture_2d_array<u32>;
