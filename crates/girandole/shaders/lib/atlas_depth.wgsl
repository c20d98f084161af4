// The shadow atlas as it is drawn.

@group(2) @binding(1) var atlas: texture_depth_2d_array;

fn atlas_at(texel: vec2u, page: u32) -> f32 { return textureLoad(atlas, texel, page, 0); }
