// The points to shade, in any order (Rust: layout::ShadeListHeader). `words` hold how many points each leaf has, then
// the points.
struct ShadeList {
  points: atomic<u32>,
  next_flat: atomic<u32>, // with a work queue only: candidates to test next, in runs
  next_curved: atomic<u32>,
  padding: u32,
  words: array<atomic<u32>>,
}
