// Points in order of their leaves. A pass that uses it binds `wanted`, `queue` and `plan`.

fn put_in_order(point: u32) {
  let at = plan.points_at + POINT_WORDS * point;
  queue[plan.sorted_at + queue[FIRSTS + wanted[at + 1u]] * CHUNK + wanted[at + 2u]] = wanted[at];
}
