// Where dynamic objects were when maps were drawn (Rust: maps/places.rs).

// Rows of the matrix that takes points of an object to where they were.
struct OldPlace { x: vec4f, y: vec4f, z: vec4f }

@group(2) @binding(13) var<uniform> old_places: array<OldPlace, MAX_OLD_PLACES>;

fn position_at(place: OldPlace, position: vec3f) -> vec3f {
  let p = vec4f(position, 1.0);
  return vec3f(dot(place.x, p), dot(place.y, p), dot(place.z, p));
}
