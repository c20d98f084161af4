// The address `at` of a texel that is loaded before or after the others, as the compiler sees fit.
fn address_after(at: vec3u, others: vec3u) -> vec3u { return at; }
