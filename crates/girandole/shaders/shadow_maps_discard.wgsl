// Draws occluders into the shadow atlas, confined to their face by discarding: where clip distances are missing.
struct Out { @builtin(position) position: vec4f, @location(0) clip: vec4f }

@vertex
fn opaque(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Out {
  let p = projected(items[instance], vertex);
  return Out(p.position, p.clip);
}

@fragment
fn confine(in: Out) {
  if any(in.clip < vec4f(0.0)) { discard; }
}
