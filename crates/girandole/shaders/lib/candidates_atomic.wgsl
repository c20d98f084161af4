// lib/candidates.wgsl where candidates are appended.
struct Candidates {
  flat_workgroups: atomic<u32>,
  flat_workgroups_y: u32,
  flat_workgroups_z: u32,
  flat_count: atomic<u32>,
  curved_workgroups: atomic<u32>,
  curved_workgroups_y: u32,
  curved_workgroups_z: u32,
  curved_count: atomic<u32>,
  pixels: array<u32>,
}

fn pack_candidate(pixel: vec2u) -> u32 { return (pixel.y << 16u) | pixel.x; }
