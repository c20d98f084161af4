// A work queue: few small workgroups, whose invocations fetch one item after another until none is left. Mesa's software
// driver assigns each of its threads a run of workgroups beforehand and waits for the slowest, so that items of unequal
// cost would leave threads idle.

const PERSISTENT_WIDTH = 8u; // invocations of a workgroup: the lanes of a processor's vector unit
// Most items that an invocation fetches: the driver ends its loops after so many steps, see `device/loop_steps.rs`.
override MAX_ITEMS: u32;
const MIN_WORKGROUPS = 16u; // enough to occupy all threads

// Workgroups that could process twice as many items.
fn workgroups_of(items: u32) -> u32 {
  let half = PERSISTENT_WIDTH * MAX_ITEMS / 2u;
  return max((items + half - 1u) / half, MIN_WORKGROUPS);
}
