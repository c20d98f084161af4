// Radiance of a pixel's samples, averaged (a box filter in linear light). A pass that uses it binds `sums`, which holds
// two elements a pixel for batches of lights and after them one a pixel for the samples so far, and `picture`.

fn add_sample(pixel: vec2u, radiance: vec3f) {
  let index = band_index(pixel);
  let at = arrayLength(&sums) / 3u * 2u + index;
  var sum = vec4f(radiance, 1.0);
  if tied(frame.sample, index) > 0u { sum += sums[at]; }
  if tied(frame.sample + 1u, index) == frame.samples {
    textureStore(picture, pixel, pack_radiance(sum.xyz / f32(frame.samples)));
  } else {
    sums[at] = sum;
  }
}
