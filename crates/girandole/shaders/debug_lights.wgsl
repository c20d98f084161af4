// Debug view: markers of light samples over the picture's pixels in their colour, with a dark rim; those behind a surface
// are rings. Where they overlap, colours lie over rims, and what is near over what is far. A workgroup a tile.

@group(2) @binding(0) var<storage, read> lights: array<Light>;
@group(2) @binding(1) var triangle_ids: texture_2d<u32>;
@group(2) @binding(2) var picture: texture_storage_2d<rg32uint, write>;

const PIXELS = TILE * TILE;
const RADIUS = 4;

struct Marker { center: vec2i, depth: f32, hidden: bool, color: vec3f }

var<workgroup> markers: array<Marker, PIXELS>;
var<workgroup> count: atomic<u32>;

// Of a light that is in view.
fn marker_of(light: Light) -> Marker {
  let d = light.position - frame.eye;
  let depth = dot(d, frame.forward);
  var across = vec2f(dot(d, frame.right) / frame.half_width, -dot(d, frame.up) / frame.half_height);
  if frame.orthographic == 0u { across /= depth; }
  across -= frame.center * vec2f(1.0, -1.0);
  let center = vec2i(floor((across * 0.5 + 0.5) * vec2f(frame.size)));
  let brightest = max(light.intensity.x, max(light.intensity.y, light.intensity.z));
  return Marker(center, depth, false, light.intensity / brightest);
}

// Whether the surface at a marker's centre is nearer than the light.
fn is_hidden(marker: Marker) -> bool {
  let id = textureLoad(triangle_ids, marker.center, 0).x;
  if id == 0u { return false; }
  return dot(hit_at(vec2u(marker.center), id - 1u).position - frame.eye, frame.forward) < marker.depth * 0.999;
}

@compute @workgroup_size(TILE, TILE)
fn show_lights(
  @builtin(global_invocation_id) invocation: vec3u,
  @builtin(workgroup_id) group: vec3u,
  @builtin(local_invocation_index) lane: u32,
) {
  let first_pixel = vec2i(group.xy * TILE + vec2u(0u, frame.band.x));
  let pixel = vec2i(invocation.xy + vec2u(0u, frame.band.x));
  var shown = Marker(vec2i(0), 0.0, false, vec3f(0.0));
  var rank = 0u; // of nothing, a rim, a colour
  for (var first = 0u; first < frame.end_light; first += PIXELS) {
    if lane == 0u { atomicStore(&count, 0u); }
    workgroupBarrier();
    if first + lane < frame.end_light {
      var marker = marker_of(lights[first + lane]);
      let is_before = frame.orthographic != 0u || marker.depth > 0.0;
      let is_inside = all(marker.center >= vec2i(0)) && all(marker.center < vec2i(frame.size));
      let is_near = all(marker.center >= first_pixel - RADIUS) && all(marker.center < first_pixel + i32(TILE) + RADIUS);
      if is_before && is_inside && is_near {
        marker.hidden = is_hidden(marker);
        markers[atomicAdd(&count, 1u)] = marker;
      }
    }
    workgroupBarrier();
    let found = workgroupUniformLoad(&count);
    for (var i = 0u; i < found; i++) {
      let marker = markers[i];
      let distance = length(vec2f(pixel - marker.center));
      if distance > 4.4 || (marker.hidden && distance < 2.5) { continue; }
      let own = select(2u, 1u, distance > 3.4);
      // Those at one place are told apart by their colours, so that all of this does not depend on the order.
      let nearer = marker.depth < shown.depth || (marker.depth == shown.depth && is_less(marker.color, shown.color));
      if own > rank || (own == rank && nearer) {
        shown = marker;
        rank = own;
      }
    }
    workgroupBarrier();
  }
  if rank == 0u || any(pixel >= vec2i(vec2u(frame.size.x, frame.band.y))) { return; }
  textureStore(picture, pixel, pack_radiance(select(vec3f(0.02), shown.color, rank == 2u)));
}

fn is_less(a: vec3f, b: vec3f) -> bool {
  return a.x < b.x || (a.x == b.x && (a.y < b.y || (a.y == b.y && a.z < b.z)));
}
