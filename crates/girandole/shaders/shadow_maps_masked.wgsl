// Draws alpha-masked occluders into the shadow atlas. They need a fragment shader for their mask in any case, so they
// are confined to their face by discarding too.
struct Out {
  @builtin(position) position: vec4f,
  @location(0) clip: vec4f,
  @location(1) uv: vec2f,
  @location(2) @interpolate(flat) material: u32,
}

@group(2) @binding(4) var<storage, read> coordinates: array<vec4f>; // u, v, material's bits, 0

@vertex
fn masked(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Out {
  let item = items[instance];
  let p = projected(item, vertex);
  let c = coordinates[corner(item, vertex)];
  return Out(p.position, p.clip, c.xy, bitcast<u32>(c.z));
}

@fragment
fn cut_out(in: Out) {
  if any(in.clip < vec4f(0.0)) { discard; }
  let m = materials[in.material];
  var alpha = m.alpha;
  if m.base_color_texture.texture != NONE {
    alpha *= sample_texture(m.base_color_texture, in.uv, vec2f(0.0), vec2f(0.0)).w;
  }
  if alpha < m.alpha_cutoff { discard; }
}
