// A value of a uniform buffer that a branch depends on, made to depend on `index` < 2³¹ as well: where uniforms alone
// decide a branch, Mesa's software driver recompiles the kernel for their values whenever it is bound.
fn branch_value(value: u32, index: u32) -> u32 { return value + (index >> 31u); }
