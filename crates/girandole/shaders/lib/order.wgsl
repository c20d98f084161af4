// Points in order of their leaves, in chunks. A pass that uses it binds `wanted`, `queue` and `plan`.

fn put_in_order(point: u32) {
  let at = plan.points_at + POINT_WORDS * point;
  let leaf = atomicLoad(&wanted[at + 1u]);
  let place = atomicLoad(&wanted[at + 2u]);
  let first = queue[FIRSTS + leaf];
  queue[plan.sorted_at + first * CHUNK + place] = atomicLoad(&wanted[at]);
  // A chunk's last point says how many it has. The leaf's last point sets its count back: to the others 0 says as well
  // that they are not the last.
  let is_last = place + 1u == atomicLoad(&wanted[COUNTS + leaf]);
  let in_chunk = place % CHUNK + 1u;
  if is_last || in_chunk == CHUNK { queue[plan.chunks_at + first + place / CHUNK] = leaf | (in_chunk << 24u); }
  if is_last { atomicStore(&wanted[COUNTS + leaf], 0u); }
}
