// Hierarchies for rays as a storage texture.

@group(2) @binding(30) var ray_texels: texture_storage_2d<rgba32uint, read>;

fn ray_texel(at: u32) -> vec4u { return textureLoad(ray_texels, vec2u(at % RAY_COLUMNS, at / RAY_COLUMNS)); }
