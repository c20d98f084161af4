// Pixels that may have to be shaded, row << 16 | column (Rust: layout::CandidatesHeader): those on flat surfaces from
// the front of `pixels`, those on curved surfaces from the back. The numbers of workgroups are of the dispatches that
// test them.
struct Candidates {
  flat_workgroups: u32,
  flat_workgroups_y: u32,
  flat_workgroups_z: u32,
  flat_count: u32,
  curved_workgroups: u32,
  curved_workgroups_y: u32,
  curved_workgroups_z: u32,
  curved_count: u32,
  pixels: array<u32>,
}

fn unpack_candidate(packed: u32) -> vec2u { return vec2u(packed & 0xffffu, packed >> 16u); }
