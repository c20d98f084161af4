// What waits while a ray is followed, in registers, two groups each, that are shifted: the driver reads and writes elements of an array
// lane by lane.

struct RayStack { a: vec4u, b: vec4u, c: vec4u, d: vec4u, e: vec4u, f: vec4u, g: vec4u, h: vec4u, depth: u32 }

fn push_group(stack: ptr<function, RayStack>, group: vec2u) {
  let s = *stack;
  *stack = RayStack(vec4u(group, s.a.xy), vec4u(s.a.zw, s.b.xy), vec4u(s.b.zw, s.c.xy), vec4u(s.c.zw, s.d.xy),
    vec4u(s.d.zw, s.e.xy), vec4u(s.e.zw, s.f.xy), vec4u(s.f.zw, s.g.xy), vec4u(s.g.zw, s.h.xy), s.depth + 1u);
}

fn pop_group(stack: ptr<function, RayStack>) -> vec2u {
  let s = *stack;
  *stack = RayStack(vec4u(s.a.zw, s.b.xy), vec4u(s.b.zw, s.c.xy), vec4u(s.c.zw, s.d.xy), vec4u(s.d.zw, s.e.xy),
    vec4u(s.e.zw, s.f.xy), vec4u(s.f.zw, s.g.xy), vec4u(s.g.zw, s.h.xy), vec4u(s.h.zw, 0u, 0u), s.depth - 1u);
  return s.a.xy;
}
