// core: tonemap. From exposed radiance to the display's range.

fn srgb_encode(linear: f32) -> f32 {
  let c = clamp(linear, 0.0, 1.0);
  return select(1.055 * pow(c, 1.0 / 2.4) - 0.055, c * 12.92, c <= 0.0031308);
}

fn agx_contrast(x: vec3f) -> vec3f {
  let x2 = x * x;
  let x4 = x2 * x2;
  return 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
}

fn agx(radiance: vec3f) -> vec3f {
  let inset = mat3x3f(
    0.84247906, 0.042328242, 0.042375655,
    0.0784336, 0.87846864, 0.0784336,
    0.079223745, 0.07916613, 0.879143);
  let outset = mat3x3f(
    1.196879, -0.05289685, -0.052971635,
    -0.09802088, 1.1519031, -0.09804345,
    -0.09902974, -0.09896118, 1.1510737);
  let low = -12.47393;
  let high = 4.026069;
  let logarithm = log2(max(inset * radiance, vec3f(1e-10)));
  let x = (clamp(logarithm, vec3f(low), vec3f(high)) - low) / (high - low);
  return pow(clamp(outset * agx_contrast(x), vec3f(0.0), vec3f(1.0)), vec3f(2.2));
}

fn aces(radiance: vec3f) -> vec3f {
  let input = mat3x3f(0.59719, 0.076, 0.0284, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
  let output = mat3x3f(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
  let v = input * min(radiance / 0.6, vec3f(1e6));
  let a = v * (v + 0.0245786) - 0.000090537;
  let b = v * (0.983729 * v + 0.432951) + 0.238081;
  return clamp(output * (a / b), vec3f(0.0), vec3f(1.0));
}

override CURVE: u32; // AGX, ACES or NO_CURVE
override LARGEST: f32 = 1.0; // value that the target holds: what is brighter is cut off there

fn tone_curve(radiance: vec3f) -> vec3f {
  let r = clamp(radiance, vec3f(0.0), vec3f(3e38));
  if CURVE == AGX { return agx(r); }
  if CURVE == ACES { return aces(r); }
  return min(r, vec3f(LARGEST));
}
