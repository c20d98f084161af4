// What the vertices of an object receive by precomputed radiance transfer: the dot product of a vertex' transfer vector with the light
// that arrives there (Sloan 2002), which is interpolated between the points of the grid about it.

// Of each side, vertex and channel the coefficients. Where they are compressed, of each cluster the mean and the bases, then of each side
// and vertex the cluster and the weights.
@group(2) @binding(6) var<storage, read> transfer: array<f32>;
@group(2) @binding(7) var<storage, read> incident: array<vec4f>;
@group(2) @binding(8) var<storage, read_write> vertex_irradiance: array<vec4f>; // W/m², and 1 where transfer lights the vertex; the backs follow the fronts
@group(2) @binding(9) var<uniform> range: VertexRange;
@group(2) @binding(10) var<storage, read_write> projected: array<vec4f>; // of each point and cluster what mean and bases receive

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

// What the vectors of clusters receive at the points of the grid: an invocation for each of them and each point.
@compute @workgroup_size(WORKGROUP)
fn light_clusters(@builtin(workgroup_id) group: vec3u, @builtin(global_invocation_id) invocation: vec3u) {
  let vectors = branch_value(object.clusters * (object.bases + 1u), invocation.x);
  if invocation.x >= vectors { return; }
  let coefficients = branch_value(object.bands * object.bands, invocation.x);
  let channels = branch_value(object.channels, invocation.x);
  let at = invocation.x * channels * coefficients;
  var irradiance = vec3f(0.0);
  for (var i = 0u; i < coefficients; i++) {
    var vector = vec3f(transfer[at + i]);
    if channels == 3u { vector = vec3f(vector.x, transfer[at + coefficients + i], transfer[at + 2u * coefficients + i]); }
    irradiance += vector * incident[group.y * coefficients + i].xyz;
  }
  projected[group.y * vectors + invocation.x] = vec4f(irradiance, 0.0);
}

// A vertex receives what its cluster's mean does, and its bases, as much as they weigh (Sloan 2003).
@compute @workgroup_size(WORKGROUP)
fn light_compressed_vertices(@builtin(global_invocation_id) invocation: vec3u) {
  let index = invocation.y * GROUPS_PER_ROW * WORKGROUP + invocation.x;
  if index >= branch_value(object.vertices * object.sides, index) { return; }
  let vertex = index % object.vertices;
  let side = index / object.vertices;
  let cell = grid_cell(vertices[object.first_vertex + vertex].position);
  let bases = branch_value(object.bases, index);
  let vectors = object.clusters * (bases + 1u);
  let at = vectors * object.channels * object.bands * object.bands + index * (bases + 1u);
  let first = u32(transfer[at]) * (bases + 1u);
  var irradiance = vec3f(0.0);
  for (var p = 0u; p < 8u; p++) {
    let here = cell.index[p] * vectors + first;
    var light = projected[here].xyz;
    for (var i = 1u; i <= bases; i++) { light += projected[here + i].xyz * transfer[at + i]; }
    irradiance += light * cell.weight[p];
  }
  vertex_irradiance[side * range.count + object.first_vertex + vertex - range.first] = vec4f(max(irradiance, vec3f(0.0)), 1.0);
}
