// In scenes without an environment, or without anything smooth, no share of it is reflected.
fn reflected_environment(pixel: vec2u, triangle: u32, share: f32) -> vec3f { return vec3f(0.0); }
fn environment_along(direction: vec3f, alpha: f32) -> vec3f { return vec3f(0.0); }
fn environment_of(hit: Hit, m: Material, share: f32) -> vec3f { return vec3f(0.0); }
