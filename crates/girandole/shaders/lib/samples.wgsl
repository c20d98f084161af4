// Radiance of a pixel's samples, averaged (a box filter in linear light). A pass that uses it binds `picture` and
// `partial_sums`, which holds two elements a pixel for batches of lights, then one a pixel for the samples so far.

fn add_sample(pixel: vec2u, radiance: vec3f, is_surface: bool) {
  let index = band_index(pixel);
  let at = arrayLength(&partial_sums) / 3u * 2u + index;
  var sum = vec4f(radiance, select(0.0, 1.0, is_surface));
  if branch_value(frame.sample, index) > 0u { sum += partial_sums[at]; }
  if branch_value(frame.sample + 1u, index) == frame.samples {
    textureStore(picture, pixel, pack_pixel(sum.xyz / f32(frame.samples), sum.w / f32(frame.samples)));
  } else {
    partial_sums[at] = sum;
  }
}
