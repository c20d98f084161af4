// Real spherical harmonics, orthonormal (core: math::sh::basis).

// The function of degree `l` and order `m` in a unit direction: associated Legendre polynomials by recurrence in z, the multiple of
// the longitude by recurrence in x and y (Sloan 2013).
fn harmonic(direction: vec3f, l: u32, m: i32) -> f32 {
  let order = u32(abs(m));
  var turned = vec2f(1.0, 0.0); // (x + iy) to the power of the order
  var p = 0.28209479177387814;
  for (var i = 1u; i <= order; i++) {
    turned = vec2f(turned.x * direction.x - turned.y * direction.y, turned.x * direction.y + turned.y * direction.x);
    p *= sqrt(1.0 + 0.5 / f32(i));
  }
  var before = 0.0;
  var scale_before = 0.0;
  for (var i = order + 1u; i <= l; i++) {
    let scale = sqrt(f32(4u * i * i - 1u) / f32(i * i - order * order));
    let next = scale * (direction.z * p - scale_before * before);
    before = p;
    p = next;
    scale_before = 1.0 / scale;
  }
  return p * select(turned.x, turned.y, m < 0) * select(1.4142135623730951, 1.0, order == 0u);
}
