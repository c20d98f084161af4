// The shadow atlas.
struct Maps {
  page: vec2f, // texels of a page
  size: f32, // texels across a map
  parallel_size: f32, // texels across the map of a directional light
  texel: f32, // 1 / size
  parallel_texel: f32, // 1 / parallel_size
}

fn map_size(light: Light) -> f32 {
  if ONLY_COSINE_LIGHTS { return maps.size; }
  return select(maps.size, maps.parallel_size, light.profile == DIRECTIONAL);
}

// 1 / map_size: a texel in units of the map.
fn map_texel(light: Light) -> f32 {
  if ONLY_COSINE_LIGHTS { return maps.texel; }
  return select(maps.texel, maps.parallel_texel, light.profile == DIRECTIONAL);
}

// First texel of a light's map in its page, and the page.
fn map_origin(light: Light) -> vec2u {
  return vec2u(light.atlas_slot & 0xfffu, (light.atlas_slot >> 12u) & 0xfffu) * u32(maps.size);
}

fn map_page(light: Light) -> u32 {
  return light.atlas_slot >> 24u;
}
