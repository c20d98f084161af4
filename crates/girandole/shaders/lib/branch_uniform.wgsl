// A value of a uniform buffer that a branch depends on.
fn branch_value(value: u32, index: u32) -> u32 { return value; }
