// The rectangle that a light sample stands for (core: lights::Rectangle).

// Sums over a polygon's edges, as seen from the origin.
struct EdgeSums {
  irradiance: vec3f,
  entry: vec3f, // where the edges come to the front of the receiver's plane, and where they leave it; 0 = nowhere
  exit: vec3f,
}

// θ / sin θ for a cosine of 0 to 1: minimax, within 7e-7.
fn angle_over_sine(cosine: f32) -> f32 {
  let above = 1.5707963 + cosine * (0.9094042 + cosine * 0.026362872);
  return above / (1.0 + cosine * (1.2155301 + cosine * 0.29103087));
}

// The angle that the edge spans, along the normal of the plane that it spans with the origin.
fn add_edge(sums: ptr<function, EdgeSums>, a: vec3f, b: vec3f) {
  let across = cross(a, b);
  let inverse = inverseSqrt(dot(a, a) * dot(b, b));
  let cosine = dot(a, b) * inverse;
  let acute = angle_over_sine(abs(cosine)) * inverse;
  let obtuse = PI * inverseSqrt(max(dot(across, across), 1e-30)) - acute;
  (*sums).irradiance += across * select(acute, obtuse, cosine < 0.0);
}

// The part of an edge in front of a plane through the origin.
fn add_clipped_edge(sums: ptr<function, EdgeSums>, a: vec3f, b: vec3f, normal: vec3f) {
  let heights = vec2f(dot(normal, a), dot(normal, b));
  if max(heights.x, heights.y) <= 0.0 { return; }
  let at = a + (b - a) * (heights.x / (heights.x - heights.y));
  let starts = heights.x <= 0.0;
  let ends = heights.y <= 0.0;
  add_edge(sums, select(a, at, starts), select(b, at, ends));
  (*sums).entry = select((*sums).entry, at, starts);
  (*sums).exit = select((*sums).exit, at, ends);
}

// Share of the geometric factor at a point that is that of the light's place, and the mean over its rectangle of
// cos_light / r² times the unit direction to it, nothing where that lies behind the receiver's plane (core: Rectangle::point_share,
// mean_vector).
struct RectangleMean { vector: vec3f, point_share: f32 }

fn rectangle_mean(light: Light, position: vec3f, normal: vec3f) -> RectangleMean {
  let bitangent = cross(light.normal, light.tangent);
  let across = light.tangent * light.rectangle.x + bitangent * light.rectangle.y;
  let u = light.tangent * light.rectangle.z + bitangent * light.rectangle.w;
  let scale = abs(light.scale);
  let v = cross(light.normal, u) * scale;
  let c = light.position + across - position;
  var sums: EdgeSums;
  add_clipped_edge(&sums, c - u - v, c + u - v, normal);
  add_clipped_edge(&sums, c + u - v, c + u + v, normal);
  add_clipped_edge(&sums, c + u + v, c - u + v, normal);
  add_clipped_edge(&sums, c - u + v, c - u - v, normal);
  if any(sums.entry != vec3f(0.0)) && any(sums.exit != vec3f(0.0)) { add_edge(&sums, sums.exit, sums.entry); }
  let u2 = dot(u, u);
  let radius2 = 2.0 / 3.0 * u2 * (1.0 + scale * scale);
  let distance = sqrt(dot(c, c) / radius2);
  let mean = sums.irradiance * (-0.125 / (u2 * scale));
  return RectangleMean(mean, smoothstep(RECTANGLE_NEAR, RECTANGLE_FAR, distance));
}
