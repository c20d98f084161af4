// Radiance in eight bytes: 18 bits for each channel and eight for the exponent that they share, that of the brightest (as
// Ward 1991, with more bits). It is exact to 2⁻¹⁸ of the brightest channel, over the range of 32-bit floats. Half the
// bytes of four floats. (Rust: packed.rs.)

fn pack_radiance(radiance: vec3f) -> vec4u {
  let c = clamp(radiance, vec3f(0.0), vec3f(3e38));
  let exponent = max(bitcast<u32>(max(c.x, max(c.y, c.z))) >> 23u, 18u);
  let q = min(vec3u(c * bitcast<f32>((271u - exponent) << 23u) + 0.5), vec3u(0x3ffffu));
  return vec4u(q.x | (q.y << 18u), (q.y >> 14u) | (q.z << 4u) | (exponent << 22u), 0u, 1u);
}

fn unpack_radiance(words: vec2u) -> vec3f {
  let q = vec3u(words.x & 0x3ffffu, (words.x >> 18u) | ((words.y & 15u) << 14u), (words.y >> 4u) & 0x3ffffu);
  return vec3f(q) * bitcast<f32>(((words.y >> 22u) - 17u) << 23u);
}
