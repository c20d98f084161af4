// An object that is lit by precomputed radiance transfer (Rust: gpu_scene/transfer.rs), and the grid of points in its box that light
// arrives at.

struct TransferObject {
  box_from_world_x: vec4f, // rows: its box is the unit cube
  box_from_world_y: vec4f,
  box_from_world_z: vec4f,
  world_from_box_x: vec4f, // rows
  world_from_box_y: vec4f,
  world_from_box_z: vec4f,
  transfer_from_world_x: vec3f, // rows, of directions
  bands: u32, // of spherical harmonics
  transfer_from_world_y: vec3f,
  channels: u32, // vectors a vertex: one, or red, green and blue
  transfer_from_world_z: vec3f,
  index: u32, // the scene's object
  points: vec3u, // of the grid
  first_vertex: u32,
  margin: vec3f, // by which the box that stands for the object is larger than it, in units of it
  vertices: u32,
  mover: u32, // which of the dynamic objects it is, or NONE
  sides: u32, // of vertices that have vectors: 2 where surfaces are double-sided
  clusters: u32, // of compressed vectors; 0 = they are not
  bases: u32, // of a cluster
}

@group(2) @binding(5) var<uniform> object: TransferObject;

fn box_from_world(position: vec3f) -> vec3f {
  let p = vec4f(position, 1.0);
  return vec3f(dot(object.box_from_world_x, p), dot(object.box_from_world_y, p), dot(object.box_from_world_z, p));
}

// Of the grid's points, `index` in order of x, y and z. They are the centres of equal cells.
fn grid_position(index: u32) -> vec3f {
  let n = object.points;
  let cell = vec3u(index % n.x, index / n.x % n.y, index / (n.x * n.y));
  let p = vec4f((vec3f(cell) + 0.5) / vec3f(n), 1.0);
  return vec3f(dot(object.world_from_box_x, p), dot(object.world_from_box_y, p), dot(object.world_from_box_z, p));
}

// The eight points about a position, and how much each counts.
struct GridCell { index: array<u32, 8>, weight: array<f32, 8> }

fn grid_cell(position: vec3f) -> GridCell {
  let n = object.points;
  let last = vec3f(n - 1u);
  let at = clamp(box_from_world(position) * vec3f(n) - 0.5, vec3f(0.0), last);
  let low = min(vec3u(at), max(n, vec3u(2u)) - 2u);
  let share = at - vec3f(low);
  var cell: GridCell;
  for (var i = 0u; i < 8u; i++) {
    let far = vec3u(i & 1u, (i >> 1u) & 1u, i >> 2u);
    let place = min(low + far, n - 1u);
    let weights = select(1.0 - share, share, far == vec3u(1u));
    cell.index[i] = (place.z * n.y + place.y) * n.x + place.x;
    cell.weight[i] = weights.x * weights.y * weights.z;
  }
  return cell;
}
