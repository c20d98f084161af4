// Opaque occluders.

// A block that a triangle covers as a whole needs no tests of its texels.
const MOST_TOUCHED = 2u;

fn is_cut_out(part: MapPart, s: SetUp, triangle: u32, d: Directions) -> bool { return false; }

fn uncut(part: MapPart, s: SetUp, triangle: u32, d: Directions, covered: vec4<bool>) -> vec4<bool> { return covered; }
