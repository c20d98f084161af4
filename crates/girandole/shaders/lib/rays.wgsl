// Rays against a scene's triangles, but those that let light through (src/rays.rs): a hierarchy over objects, and one for each mesh in
// its own space, both with eight children a node, whose boxes are bytes (Ylitie, Karras and Laine 2017). The boxes of the upper one are
// objects, those of the others triangles.

// `t` in units of the ray's direction; `u` and `v`: weights of corners 1 and 2. No triangle: NONE.
struct RayHit { t: f32, triangle: u32, u: f32, v: f32 }

// By which share of its distance what emits is nearer (core: trace.rs).
const RAY_EMITTER_BIAS = 4e-6;
// Texels of a node, of an object, and of a triangle.
const RAY_NODE = 5u;
const RAY_OBJECT = 4u;
const RAY_TRIANGLE = 3u;

override HAS_MASKED: bool = true; // whether any material has an alpha mask
// Bits of a group above those of boxes: nodes.
const RAY_NODES = 0xff000000u;
const RAY_ROOT = vec2u(0u, 0x80000000u);

// A ray in the space of a hierarchy, whose boxes are larger by a margin: `slack` in units of the ray.
struct BoxRay { origin: vec3f, inverse: vec3f, slack: vec3f, first: u32 }

// `first`: which place of a node comes last, from the signs of the direction.
fn box_ray(origin: vec3f, direction: vec3f, margin: f32) -> BoxRay {
  let inverse = 1.0 / select(direction, vec3f(1e-18), abs(direction) < vec3f(1e-18));
  let signs = select(vec3u(0u), vec3u(4u, 2u, 1u), inverse >= vec3f(0.0));
  return BoxRay(origin, inverse, margin * abs(inverse), signs.x | signs.y | signs.z);
}

// Of four children, bits of those whose boxes a ray meets before `t`. `x`, `y` and `z` hold the smallest and the largest coordinates.
fn meets_boxes(ray: BoxRay, origin: vec3f, unit: vec3f, children: u32, x: vec2u, y: vec2u, z: vec2u, t: f32) -> u32 {
  let scale = unit * ray.inverse;
  let near = origin - ray.slack;
  let far = origin + ray.slack;
  let is_ahead = ray.inverse >= vec3f(0.0);
  let near_x = vec4f(unpack4xU8(select(x.y, x.x, is_ahead.x))) * scale.x + near.x;
  let near_y = vec4f(unpack4xU8(select(y.y, y.x, is_ahead.y))) * scale.y + near.y;
  let near_z = vec4f(unpack4xU8(select(z.y, z.x, is_ahead.z))) * scale.z + near.z;
  let far_x = vec4f(unpack4xU8(select(x.x, x.y, is_ahead.x))) * scale.x + far.x;
  let far_y = vec4f(unpack4xU8(select(y.x, y.y, is_ahead.y))) * scale.y + far.y;
  let far_z = vec4f(unpack4xU8(select(z.x, z.y, is_ahead.z))) * scale.z + far.z;
  let enters = max(max(near_x, near_y), max(near_z, vec4f(0.0)));
  let leaves = min(min(far_x, far_y), min(far_z, vec4f(t)));
  let words = unpack4xU8(children);
  // Nodes come in the order of their places along the ray, boxes as they lie.
  let places = (words ^ select(vec4u(0u), vec4u(ray.first), (words & vec4u(24u)) == vec4u(24u))) & vec4u(31u);
  let bits = select(vec4u(0u), (words >> vec4u(5u)) << places, enters <= leaves);
  return bits.x | bits.y | bits.z | bits.w;
}

// Six times the volume of ray and edge, of opposite sign for the triangles on either side of it to the bit: no ray passes between them
// (Woop, Benthin and Wald 2013 have it so).
fn edge_volume(direction: vec3f, p: vec3f, q: vec3f) -> f32 {
  return dot(direction, cross(p + q, q - p));
}

// Where a ray meets the triangle at a texel; t < 0 where it does not.
struct TriangleHit { hit: RayHit, flags: u32 }

fn triangle_hit(at: u32, origin: vec3f, direction: vec3f) -> TriangleHit {
  let first = ray_texel(at);
  let second = ray_texel(at + 1u);
  let a = bitcast<vec3f>(first.xyz) - origin;
  let b = bitcast<vec3f>(second.xyz) - origin;
  let c = bitcast<vec3f>(ray_texel(at + 2u).xyz) - origin;
  let volumes = vec3f(edge_volume(direction, b, c), edge_volume(direction, c, a), edge_volume(direction, a, b));
  let sum = volumes.x + volumes.y + volumes.z;
  let is_inside = all(volumes >= vec3f(0.0)) || all(volumes <= vec3f(0.0));
  let normal = cross(b - a, c - a);
  let t = select(-1.0, dot(normal, a) / dot(normal, direction), is_inside && sum != 0.0);
  return TriangleHit(RayHit(t, first.w, volumes.y / sum, volumes.z / sum), second.w);
}

// The first surface at 0 < t < `t_max`, from either side, leaving out triangle `ignored`; with `is_any` some surface. At equal distance
// what emits wins, else the lower index.
fn trace_ray(origin: vec3f, direction: vec3f, t_max: f32, ignored: u32, is_any: bool) -> RayHit {
  let head = ray_texel(0u);
  var best = RayHit(t_max, NONE, 0.0, 0.0);
  var best_order = t_max;
  var stack: RayStack;
  // Of the object that is walked: where its part of the stack begins.
  var is_inside = false;
  var depth_outside = 0u;
  var first_triangle = 0u;
  var nodes_at = 1u;
  var boxes_at = head.x;
  var towards = direction;
  var ray = box_ray(origin, direction, bitcast<f32>(head.y));
  // Nodes or boxes that wait: the first one, and a bit for each from there on.
  var nodes = select(RAY_ROOT, vec2u(0u), head.z != 0u);
  var boxes = vec2u(0u);
  loop {
    // Down to nodes with boxes of their own that the ray meets.
    while boxes.y == 0u && nodes.y > ~RAY_NODES {
      let bit = firstLeadingBit(nodes.y);
      nodes.y ^= 1u << bit;
      if nodes.y > ~RAY_NODES {
        push_group(&stack, nodes);
      }
      let place = (bit - 24u) ^ ray.first;
      let at = nodes_at + RAY_NODE * (nodes.x + countOneBits(extractBits(nodes.y, 0u, place)));
      let a = ray_texel(at);
      let b = ray_texel(at + 1u);
      let c = ray_texel(at + 2u);
      let d = ray_texel(at + 3u);
      let e = ray_texel(at + 4u);
      let unit = bitcast<vec3f>(unpack4xU8(a.w).xyz << vec3u(23u));
      let start = (bitcast<vec3f>(a.xyz) - ray.origin) * ray.inverse;
      let met = meets_boxes(ray, start, unit, b.z, c.xz, d.xz, e.xz, best.t)
        | meets_boxes(ray, start, unit, b.w, c.yw, d.yw, e.yw, best.t);
      nodes = vec2u(b.x, (met & RAY_NODES) | (a.w >> 24u));
      boxes = vec2u(b.y, met & ~RAY_NODES);
      if boxes.y == 0u && nodes.y <= ~RAY_NODES && stack.depth > depth_outside {
        nodes = pop_group(&stack);
        if nodes.y <= ~RAY_NODES { boxes = nodes; }
      }
    }
    while boxes.y != 0u && is_inside {
      let bit = firstLeadingBit(boxes.y);
      boxes.y ^= 1u << bit;
      let met = triangle_hit(boxes_at + RAY_TRIANGLE * (boxes.x + bit), ray.origin, towards);
      var hit = met.hit;
      hit.triangle += first_triangle;
      let order = select(hit.t, hit.t * (1.0 - RAY_EMITTER_BIAS), (met.flags & RAY_EMITS) != 0u);
      var is_better = hit.t > 0.0 && hit.t < t_max && hit.triangle != ignored
        && (order < best_order || (order == best_order && hit.triangle < best.triangle));
      if HAS_MASKED && is_better && (met.flags & RAY_MASKED) != 0u {
        let m = triangles[hit.triangle].material;
        let weights = vec3f(1.0 - hit.u - hit.v, hit.u, hit.v);
        is_better = mask_alpha(hit.triangle, materials[m], weights) >= materials[m].alpha_cutoff;
      }
      if is_better {
        best = hit;
        best_order = order;
      }
    }
    if is_any && best.triangle != NONE { break; }
    if boxes.y != 0u {
      // An object.
      let bit = firstLeadingBit(boxes.y);
      let at = boxes_at + RAY_OBJECT * (boxes.x + bit);
      boxes.y ^= 1u << bit;
      if nodes.y > ~RAY_NODES {
        push_group(&stack, nodes);
      }
      if boxes.y != 0u {
        push_group(&stack, boxes);
      }
      let x = bitcast<vec4f>(ray_texel(at));
      let y = bitcast<vec4f>(ray_texel(at + 1u));
      let z = bitcast<vec4f>(ray_texel(at + 2u));
      let record = ray_texel(at + 3u);
      let start = vec3f(dot(x.xyz, origin), dot(y.xyz, origin), dot(z.xyz, origin)) + vec3f(x.w, y.w, z.w);
      towards = vec3f(dot(x.xyz, direction), dot(y.xyz, direction), dot(z.xyz, direction));
      ray = box_ray(start, towards, bitcast<f32>(record.w));
      is_inside = true;
      depth_outside = stack.depth;
      nodes_at = record.x;
      boxes_at = record.y;
      first_triangle = record.z;
      nodes = RAY_ROOT;
      boxes.y = 0u;
    } else if nodes.y <= ~RAY_NODES {
      if is_inside && stack.depth == depth_outside {
        is_inside = false;
        depth_outside = 0u;
        nodes_at = 1u;
        boxes_at = head.x;
        towards = direction;
        ray = box_ray(origin, direction, bitcast<f32>(head.y));
      }
      if stack.depth == 0u { break; }
      nodes = pop_group(&stack);
      if nodes.y <= ~RAY_NODES { boxes = nodes; }
    }
  }
  return best;
}
