// The shadow atlas as a texture.

@group(2) @binding(1) var atlas: texture_2d_array<f32>;

fn atlas_at(texel: vec2u, page: u32) -> f32 { return textureLoad(atlas, texel, page, 0).x; }
