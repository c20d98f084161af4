// Debug view: markers of light samples over the picture's pixels in their colour, with a dark rim; those behind a surface
// are rings. One invocation a light and pixel of its marker.

@group(2) @binding(0) var<storage, read> lights: array<Light>;
@group(2) @binding(1) var triangle_ids: texture_2d<u32>;
@group(2) @binding(2) var picture: texture_storage_2d<rg32uint, write>;

const RADIUS = 4;

@compute @workgroup_size(9, 9)
fn show_lights(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) lane: vec3u) {
  let index = group.y * GROUPS_PER_ROW + group.x;
  if index >= frame.end_light { return; }
  let light = lights[index];
  let d = light.position - frame.eye;
  let depth = dot(d, frame.forward);
  var across = vec2f(dot(d, frame.right) / frame.half_width, -dot(d, frame.up) / frame.half_height);
  if frame.orthographic == 0u {
    if depth <= 0.0 { return; }
    across /= depth;
  }
  across -= frame.center * vec2f(1.0, -1.0);
  let center = vec2i(floor((across * 0.5 + 0.5) * vec2f(frame.size)));
  if any(center < vec2i(0)) || any(center >= vec2i(frame.size)) { return; }
  let offset = vec2i(lane.xy) - RADIUS;
  let pixel = center + offset;
  let distance = length(vec2f(offset));
  if any(pixel < vec2i(0)) || any(pixel >= vec2i(frame.size)) || distance > 4.4 { return; }
  // Hidden: the surface at the marker's centre is nearer than the light.
  let id = textureLoad(triangle_ids, center, 0).x;
  var hidden = false;
  if id > 0u { hidden = dot(hit_at(vec2u(center), id - 1u).position - frame.eye, frame.forward) < depth * 0.999; }
  if hidden && distance < 2.5 { return; }
  let brightest = max(light.intensity.x, max(light.intensity.y, light.intensity.z));
  let color = select(light.intensity / brightest, vec3f(0.02), distance > 3.4);
  textureStore(picture, pixel, pack_radiance(color));
}
