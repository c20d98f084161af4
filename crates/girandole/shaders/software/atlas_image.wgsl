// The shadow atlas as a storage texture.

@group(2) @binding(1) var atlas: texture_storage_2d_array<r32float, read>;

fn atlas_at(texel: vec2u, page: u32) -> f32 { return textureLoad(atlas, texel, page).x; }
