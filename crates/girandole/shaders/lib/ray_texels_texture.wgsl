// Hierarchies for rays as a texture.

@group(2) @binding(30) var ray_texels: texture_2d<u32>;

fn ray_texel(at: u32) -> vec4u { return textureLoad(ray_texels, vec2u(at % RAY_COLUMNS, at / RAY_COLUMNS), 0); }
