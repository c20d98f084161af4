// The points to shade in order of their leaves, in chunks of one leaf each (Rust: layout::PointQueueHeader). `words` hold
// the first chunk of each leaf, the number of its chunks, the chunks, and the pixels of their points.
struct PointQueue {
  points: u32,
  chunks: u32,
  next_chunk: u32, // with a work queue only
  finished: u32, // the same
  words: array<u32>,
}

// A chunk: its leaf, and how many points it has.
fn pack_chunk(leaf: u32, points: u32) -> u32 { return leaf | (points << 24u); }
fn chunk_leaf(chunk: u32) -> u32 { return chunk & 0xffffffu; }
fn chunk_points(chunk: u32) -> u32 { return chunk >> 24u; }
