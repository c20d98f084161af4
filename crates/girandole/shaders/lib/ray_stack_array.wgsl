// What waits while a ray is followed, in an array.

struct RayStack { groups: array<vec2u, RAY_STACK>, depth: u32 }

fn push_group(stack: ptr<function, RayStack>, group: vec2u) {
  (*stack).groups[(*stack).depth] = group;
  (*stack).depth++;
}

fn pop_group(stack: ptr<function, RayStack>) -> vec2u {
  (*stack).depth--;
  return (*stack).groups[(*stack).depth];
}
