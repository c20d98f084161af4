// The environment (core: scene::Environment). A pass that uses it binds `environment`, by latitude and longitude, and uses
// lib/environment_place.wgsl.

// Radiance from a unit direction: bilinear, going on at the other edge; before it the sun, where the map has it apart.
fn environment_from(direction: vec3f) -> vec3f {
  let at = place_of(direction) * vec2f(textureDimensions(environment)) - 0.5;
  let low = vec2i(floor(at));
  let f = fract(at);
  let above = mix(environment_at(low), environment_at(low + vec2i(1, 0)), f.x);
  let below = mix(environment_at(low + vec2i(0, 1)), environment_at(low + vec2i(1, 1)), f.x);
  return (mix(above, below, f.y) + sun_from(in_map(direction))) * frame.environment.x;
}

// Radiance of the sun's disc from a unit direction as the map has it (core: Disc::radiance).
fn sun_from(direction: vec3f) -> vec3f {
  let apart = direction - frame.sun_direction;
  return select(vec3f(0.0), frame.sun_radiance, dot(apart, apart) < frame.sun_chord2 && direction.y > 0.0);
}

fn environment_at(at: vec2i) -> vec3f {
  let size = vec2i(textureDimensions(environment));
  let wrapped = vec2i((at.x + size.x) % size.x, clamp(at.y, 0, size.y - 1));
  return textureLoad(environment, wrapped, 0).xyz;
}
