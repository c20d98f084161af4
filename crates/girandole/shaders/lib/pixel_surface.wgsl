// What a pixel shows, as `surfaces.wgsl` leaves it for the passes that choose where to shade.

const PLANAR = 0x80000000u; // its normal is that of its plane
const SHINY = 0x40000000u; // its reflection cannot be interpolated
const LEAF = 0x00ffffffu;

// Octahedral, 16 bits a component.
fn pack_normal(n: vec3f) -> u32 {
  let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
  let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
  return pack2x16snorm(select(folded, p, n.z >= 0.0));
}

fn unpack_normal(packed: u32) -> vec3f {
  let p = unpack2x16snorm(packed);
  let z = 1.0 - abs(p.x) - abs(p.y);
  let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
  return normalize(vec3f(select(folded, p, z >= 0.0), z));
}

fn position_at(pixel: vec2u, depth: f32) -> vec3f {
  let ray = pixel_ray(vec2f(pixel) + frame.offset);
  return ray.origin + ray.direction * depth;
}
