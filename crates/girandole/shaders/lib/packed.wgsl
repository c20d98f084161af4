// Radiance in eight bytes: 18 bits for each channel and eight for the exponent that they share, that of the brightest (as
// Ward 1991, with more bits). It is exact to 2⁻¹⁸ of the brightest channel, over the range of 32-bit floats. Half the
// bytes of four floats. The two bits that remain say how much of the pixel shows the scene, in quarters: 1 to 4; where
// nothing does, all bits are 0. (Rust: packed.rs.)

fn pack_radiance(radiance: vec3f) -> vec4u { return pack_pixel(radiance, 1.0); }

fn pack_pixel(radiance: vec3f, coverage: f32) -> vec4u {
  let c = clamp(radiance, vec3f(0.0), vec3f(3e38));
  let exponent = max(bitcast<u32>(max(c.x, max(c.y, c.z))) >> 23u, 18u);
  let q = min(vec3u(c * bitcast<f32>((271u - exponent) << 23u) + 0.5), vec3u(0x3ffffu));
  let low = q.x | (q.y << 18u);
  let high = (q.y >> 14u) | (q.z << 4u) | (exponent << 22u) | (quarters(coverage) << 30u);
  return select(vec4u(0u, 0u, 0u, 1u), vec4u(low, high, 0u, 1u), coverage > 0.0);
}

fn unpack_radiance(words: vec2u) -> vec3f {
  let q = vec3u(words.x & 0x3ffffu, (words.x >> 18u) | ((words.y & 15u) << 14u), (words.y >> 4u) & 0x3ffffu);
  return vec3f(q) * bitcast<f32>((max((words.y >> 22u) & 0xffu, 17u) - 17u) << 23u);
}

// Quarters beyond the first.
fn quarters(coverage: f32) -> u32 { return u32(clamp(coverage * 4.0 - 0.5, 0.0, 3.0)); }

// Share of the pixel that shows the scene.
fn coverage_of(words: vec2u) -> f32 { return select(0.0, f32((words.y >> 30u) + 1u) * 0.25, words.y != 0u); }
