// Shadows on dynamic objects are looked up where the object was when the light's map was drawn (Rust: gpu_scene/previous_transforms.rs). A pass
// that uses it binds `light_lists`, and has `previous_row`: the first of a light's places, NONE where its map is up to date.

// Which of the dynamic objects a leaf is on, or NONE.
fn mover_of(leaf: u32) -> u32 { return light_lists[leaf * LEAF_RECORD_WORDS + LEAF_RECORD_MOVER]; }

// Where a light's map shows a point of a dynamic object. `index` is the light's in its batch.
fn previous_shadow_texel(light: Light, index: u32, s: Shading, mover: u32) -> ShadowTexel {
  let row = previous_row(index);
  if row == NONE { return shadow_texel_of(light, s); }
  let place = previous_transforms[row + mover];
  let position = position_at(place, s.position);
  let normal = vec3f(
    dot(cross(place.y.xyz, place.z.xyz), s.ng),
    dot(cross(place.z.xyz, place.x.xyz), s.ng),
    dot(cross(place.x.xyz, place.y.xyz), s.ng));
  // What faced away from the light was not in its map.
  if dot(normal, light.position - position) <= 0.0 { return shadow_texel_of(light, s); }
  return shadow_texel_at(light, position, normalize(normal));
}
