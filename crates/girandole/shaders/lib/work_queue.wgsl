// Who does what. On a GPU each invocation stands for one item. Mesa's software driver deals the workgroups out to its
// threads beforehand, one run each, and then waits for the slowest; there small workgroups take one item after another
// until none is left. They are enough for half of them to take all. The last invocation to leave sets the cursors back.

override PERSISTENT_THREADS: bool = false;
override WIDTH: u32 = 64u; // invocations of a workgroup; eight where they take

// Items that one takes at most: the driver ends an invocation's loops after 65535 rounds, all of them counted together.
const MAX_ITEMS = 32u;
const FEWEST = 16u; // workgroups that take, to occupy all threads

// Workgroups for so many items, `run` of which are taken at once.
fn workgroups_of(items: u32, run: u32) -> u32 {
  if !PERSISTENT_THREADS { return (items + 63u) / 64u; }
  // Half of what eight invocations take at most.
  let share = 4u * MAX_ITEMS * run;
  return max((items + share - 1u) / share, FEWEST);
}
