// Draws occluders into the shadow atlas, confined to their face by clip planes: no fragment shader.
struct Out { @builtin(position) position: vec4f, @builtin(clip_distances) clip: array<f32, 4> }

@vertex
fn opaque(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Out {
  let p = projected(items[instance], vertex);
  return Out(p.position, array<f32, 4>(p.clip.x, p.clip.y, p.clip.z, p.clip.w));
}
