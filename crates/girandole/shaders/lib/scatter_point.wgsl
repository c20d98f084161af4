// Points in order of their leaves, in chunks. A pass that uses it binds `shade_list`, `point_queue` and `offsets`.

fn scatter_point(point: u32) {
  let at = offsets.points_at + POINT_WORDS * point;
  let leaf = atomicLoad(&shade_list[at + 1u]);
  let place = atomicLoad(&shade_list[at + 2u]);
  let first = point_queue[FIRSTS + leaf];
  point_queue[offsets.sorted_at + first * CHUNK + place] = atomicLoad(&shade_list[at]);
  // A chunk's last point says how many it has. The leaf's last point sets its count back: to the others 0 says as well
  // that they are not the last.
  let is_last = place + 1u == atomicLoad(&shade_list[COUNTS + leaf]);
  let in_chunk = place % CHUNK + 1u;
  if is_last || in_chunk == CHUNK { point_queue[offsets.chunks_at + first + place / CHUNK] = leaf | (in_chunk << 24u); }
  if is_last { atomicStore(&shade_list[COUNTS + leaf], 0u); }
}
