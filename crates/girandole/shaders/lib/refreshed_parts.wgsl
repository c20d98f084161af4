// Parts of shadow maps that kernels refresh (Rust: passes::refreshed_maps).
struct RefreshedPart {
  first: vec2u, // column and row in the map
  end: vec2u, // before the last column and row
  light: u32,
  nearest: u32, // the first texel's in `nearest`; rows follow each other
  first_piece: u32,
  end_piece: u32,
  first_texel: u32,
  end_texel: u32,
}

@group(2) @binding(0) var<storage, read> lights: array<Light>;
@group(2) @binding(1) var<storage, read> parts: array<RefreshedPart>;
@group(2) @binding(2) var<uniform> maps: Maps;
