// A value of a uniform buffer to branch on; `index` is anything below 2³¹ that no compiler knows. Where uniforms alone
// decide a branch, Mesa's software driver compiles the kernel anew for their values whenever it is bound.
fn non_uniform(value: u32, index: u32) -> u32 {
  return value + (index >> 31u);
}
