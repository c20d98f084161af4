// What a ray meets first among the occluders of shadow maps, where they are now. A pass that uses it binds `stale_maps`,
// which holds words: a `StaleMapsHeader`, a `StalePart` for each light, an `OccluderBox` for each group of BLOCKER_GROUP
// clusters and for each cluster, and the clusters' triangles (Rust: passes/stale_maps.rs).

override CLUSTER: u32; // triangles in a cluster
override BLOCKER_GROUP: u32; // clusters that share a box

// Triangles seen at a smaller angle cover no texel's centre.
const LEAST_SINE = 1e-5;

struct Blocker {
  nearness: f32, // 1 / its distance, in lengths of the ray's direction; 0 = none
  plane: vec3f, // a direction's dot product with it is the nearness of the blocker's plane there
}

// Whether a ray meets a box before something of this nearness.
fn meets_box(b: OccluderBox, ray: PixelRay, inverse: vec3f, nearness: f32) -> bool {
  let middle = (b.center - ray.origin) * inverse;
  let half = b.half_extent * abs(inverse);
  let enter = middle - half;
  let leave = middle + half;
  let first = max(enter.x, max(enter.y, enter.z));
  let last = min(leave.x, min(leave.y, leave.z));
  return last >= max(first, 0.0) && first * nearness <= 1.0;
}

// Whether a triangle's alpha mask is open at these weights of its corners 1 and 2.
fn is_cut_out(triangle: u32, weights: vec2f) -> bool {
  let t = triangles[triangle];
  let cutoff = materials[t.material].alpha_cutoff;
  if cutoff < 0.0 { return false; }
  let a = vertices[t.vertices.x];
  let b = vertices[t.vertices.y];
  let c = vertices[t.vertices.z];
  let rest = 1.0 - weights.x - weights.y;
  var hit: Hit;
  hit.uv[0] = a.uv0 * rest + b.uv0 * weights.x + c.uv0 * weights.y;
  hit.uv[1] = vec2f(a.u1, a.v1) * rest + vec2f(b.u1, b.v1) * weights.x + vec2f(c.u1, c.v1) * weights.y;
  return materials[t.material].alpha * sample_at(materials[t.material].base_color_texture, hit).w < cutoff;
}

fn meet_triangle(nearest: ptr<function, Blocker>, ray: PixelRay, triangle: u32) {
  let t = triangles[triangle];
  let p0 = vertices[t.vertices.x].position;
  let e1 = vertices[t.vertices.y].position - p0;
  let e2 = vertices[t.vertices.z].position - p0;
  let a = p0 - ray.origin;
  let normal = cross(e1, e2);
  let height = dot(normal, a);
  let slope = dot(normal, ray.direction);
  if abs(height) <= LEAST_SINE * length(normal) * length(a) || slope == 0.0 { return; }
  let nearness = slope / height;
  if nearness <= (*nearest).nearness { return; }
  let b = barycentric(ray.direction, a, e1, e2);
  if min(b.x, b.y) < 0.0 || b.x + b.y > 1.0 || is_cut_out(triangle, b) { return; }
  *nearest = Blocker(nearness, normal / height);
}

// The nearest of those in some groups.
fn nearest_blocker(ray: PixelRay, first_group: u32) -> Blocker {
  let header = stale_maps_header_at(0u);
  let d = ray.direction;
  let inverse = 1.0 / select(d, vec3f(1e-12), abs(d) < vec3f(1e-12));
  var nearest = Blocker(0.0, vec3f(0.0));
  for (var group = first_group; group < header.groups; group++) {
    let around = occluder_box_at(header.groups_at + group * OCCLUDER_BOX_WORDS);
    if !meets_box(around, ray, inverse, nearest.nearness) { continue; }
    for (var cluster = group * BLOCKER_GROUP; cluster < (group + 1u) * BLOCKER_GROUP; cluster++) {
      let about = occluder_box_at(header.clusters_at + cluster * OCCLUDER_BOX_WORDS);
      if !meets_box(about, ray, inverse, nearest.nearness) { continue; }
      let first = header.triangles_at + cluster * CLUSTER;
      for (var i = first; i < first + CLUSTER; i++) {
        if stale_maps[i] == NONE { break; }
        meet_triangle(&nearest, ray, stale_maps[i]);
      }
    }
  }
  return nearest;
}
