// What the vertices of an object receive by precomputed radiance transfer: the dot product of a vertex' transfer vector with the light
// that arrives there (Sloan 2002), which is interpolated between the points of the grid about it.

@group(2) @binding(6) var<storage, read> transfer: array<f32>; // of each side, vertex and channel the coefficients
@group(2) @binding(7) var<storage, read> incident: array<vec4f>;
@group(2) @binding(8) var<storage, read_write> vertex_irradiance: array<vec4f>; // W/m², and 1 where transfer lights the vertex; the backs follow the fronts
@group(2) @binding(9) var<uniform> range: VertexRange;

@compute @workgroup_size(WORKGROUP)
fn light_vertices(@builtin(global_invocation_id) invocation: vec3u) {
  let index = invocation.y * GROUPS_PER_ROW * WORKGROUP + invocation.x;
  if index >= branch_value(object.vertices * object.sides, index) { return; }
  let vertex = index % object.vertices;
  let side = index / object.vertices;
  let cell = grid_cell(vertices[object.first_vertex + vertex].position);
  let coefficients = branch_value(object.bands * object.bands, index);
  let at = index * object.channels * coefficients;
  var irradiance = vec3f(0.0);
  for (var i = 0u; i < coefficients; i++) {
    var light = vec3f(0.0);
    for (var p = 0u; p < 8u; p++) { light += incident[cell.index[p] * coefficients + i].xyz * cell.weight[p]; }
    var transferred = vec3f(transfer[at + i]);
    if branch_value(object.channels, index) == 3u {
      transferred = vec3f(transferred.x, transfer[at + coefficients + i], transfer[at + 2u * coefficients + i]);
    }
    irradiance += transferred * light;
  }
  vertex_irradiance[side * range.count + object.first_vertex + vertex - range.first] = vec4f(max(irradiance, vec3f(0.0)), 1.0);
}
