// lib/point_queue.wgsl with a work queue: the next chunk to shade, and the number of invocations that have finished.
struct PointQueue {
  points: u32,
  chunks: u32,
  next_chunk: atomic<u32>,
  finished: atomic<u32>,
  words: array<u32>,
}

fn chunk_leaf(chunk: u32) -> u32 { return chunk & 0xffffffu; }
fn chunk_points(chunk: u32) -> u32 { return chunk >> 24u; }
