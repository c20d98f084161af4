// Depth of the caller's own things, before ours is drawn and after. Both sides mean the same planes; the caller's depth
// may run the other way.

@group(2) @binding(0) var callers: texture_depth_2d;
@group(2) @binding(1) var ours: texture_depth_2d;
@group(2) @binding(2) var triangle_ids: texture_2d<u32>;

@vertex
fn fullscreen(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
  return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

fn reversed(depth: f32) -> f32 { return select(depth, 1.0 - depth, frame.forward_depth != 0u); }

@fragment
fn import_depth(@builtin(position) position: vec4f) -> @builtin(frag_depth) f32 {
  return reversed(textureLoad(callers, vec2u(position.xy), 0));
}

@fragment
fn export_depth(@builtin(position) position: vec4f) -> @builtin(frag_depth) f32 {
  if textureLoad(triangle_ids, vec2u(position.xy), 0).x == 0u { discard; }
  return reversed(textureLoad(ours, vec2u(position.xy), 0));
}
