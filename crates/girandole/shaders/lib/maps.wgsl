// The shadow atlas.
struct Maps {
  page: vec2f, // texels of a page
  unit: u32, // texels across a unit
  padding: u32,
  sizes: array<vec4f, MAP_SIZES>, // of maps of 1, 2, 4, ... units: texels across, and 1 / that
}

fn map_size(light: Light) -> f32 {
  return maps.sizes[(light.atlas_slot >> 20u) & 15u].x;
}

// 1 / map_size: a texel in units of the map.
fn map_texel(light: Light) -> f32 {
  return maps.sizes[(light.atlas_slot >> 20u) & 15u].y;
}

// First texel of a light's map in its page, and the page.
fn map_origin(light: Light) -> vec2u {
  return vec2u(light.atlas_slot & 0x3ffu, (light.atlas_slot >> 10u) & 0x3ffu) * maps.unit;
}

fn map_page(light: Light) -> u32 {
  return light.atlas_slot >> 24u;
}
