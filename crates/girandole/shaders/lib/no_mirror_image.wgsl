// Where no mirrored rays are sent.
fn mirrored_at(pixel: vec2u) -> vec3f { return vec3f(0.0); }
