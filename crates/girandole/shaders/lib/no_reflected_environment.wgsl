// In scenes without an environment, or without anything smooth, no share of it is reflected.
fn reflected_environment(pixel: vec2u, triangle: u32, share: f32) -> vec3f { return vec3f(0.0); }
