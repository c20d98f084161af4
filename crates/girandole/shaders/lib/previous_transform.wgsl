// Where dynamic objects were when maps were drawn (Rust: gpu_scene/previous_transforms.rs).

// Rows of the matrix that takes points of an object to where they were.
struct PreviousTransform { x: vec4f, y: vec4f, z: vec4f }

@group(2) @binding(13) var<uniform> previous_transforms: array<PreviousTransform, MAX_PREVIOUS_TRANSFORMS>;

fn position_at(place: PreviousTransform, position: vec3f) -> vec3f {
  let p = vec4f(position, 1.0);
  return vec3f(dot(place.x, p), dot(place.y, p), dot(place.z, p));
}
