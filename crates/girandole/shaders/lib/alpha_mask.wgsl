// Alpha of masked surfaces at weights of a triangle's corners.

fn mask_alpha(triangle: u32, m: Material, weights: vec3f) -> f32 {
  if m.base_color_texture.texture == NONE { return m.alpha; }
  let t = triangles[triangle].vertices;
  let uv = mask_uv(t.x, m) * weights.x + mask_uv(t.y, m) * weights.y + mask_uv(t.z, m) * weights.z;
  return m.alpha * sample_texture(m.base_color_texture, uv, vec2f(0.0), vec2f(0.0)).w;
}

fn mask_uv(vertex: u32, m: Material) -> vec2f {
  let v = vertices[vertex];
  return select(v.uv0, vec2f(v.u1, v.v1), (m.base_color_texture.uv_set & 1u) == 1u);
}
