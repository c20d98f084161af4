// Where light samples show nothing of what a surface reflects, as mirrored rays find all of it: what a plane receives is as even as on any
// other, and on metals nothing is seen of it.

override HAS_MIRRORS: bool = false; // whether any surface is smooth enough

fn is_polished(surface: vec2u) -> bool {
  let roughness = materials[surface.y].roughness;
  let is_plane = ((surface.x & CURVED) == 0u) & (materials[surface.y].normal_texture.texture == NONE);
  return (frame.polished_alpha > 0.0) & (max(roughness * roughness, MIN_ALPHA) <= frame.polished_alpha)
    & (materials[surface.y].metallic_roughness_texture.texture == NONE) & (is_plane | (materials[surface.y].metallic >= 1.0));
}

// Whether what a surface (its id and material) reflects changes from pixel to pixel.
fn is_sharp(surface: vec2u) -> bool {
  if !HAS_MIRRORS { return (surface.x & SHINY) != 0u; }
  return (surface.x & SHINY) != 0u && !is_polished(surface);
}
