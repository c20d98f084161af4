// Where light samples show nothing of what a plane reflects, as mirrored rays find all of it: what it receives is as even as on any plane.

fn is_polished(surface: vec2u) -> bool {
  let roughness = materials[surface.y].roughness;
  return (frame.polished_alpha > 0.0) & (roughness * roughness <= frame.polished_alpha) & ((surface.x & CURVED) == 0u)
    & (materials[surface.y].metallic_roughness_texture.texture == NONE) & (materials[surface.y].normal_texture.texture == NONE);
}

// Whether what a surface (its id and material) reflects changes from pixel to pixel.
fn is_sharp(surface: vec2u) -> bool { return (surface.x & SHINY) != 0u && !is_polished(surface); }
