// Draws texels into the shadow atlas, each as a point with its depth.
@group(2) @binding(0) var<storage, read> texels: array<MapTexel>;
@group(2) @binding(1) var<uniform> maps: Maps;

@vertex
fn texel(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
  let t = texels[vertex];
  let center = vec2f(f32(t.place & 0xffffu), f32(t.place >> 16u)) + 0.5;
  return vec4f(vec2f(2.0, -2.0) * center / maps.page + vec2f(-1.0, 1.0), t.depth, 1.0);
}
