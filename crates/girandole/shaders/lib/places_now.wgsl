// Shadows are looked up where the receiver is.

fn mover_of(leaf: u32) -> u32 { return NONE; }

fn lookup_place(light: Light, index: u32, s: Shading) -> LookupPlace { return LookupPlace(s.position, s.ng); }
