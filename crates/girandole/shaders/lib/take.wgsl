// Who does what. On a GPU each invocation stands for one item. Mesa's software driver deals the workgroups out to its
// threads beforehand, one run each, and then waits for the slowest; there the first few invocations take one item after
// another until none is left. The last of them to leave sets the cursor back.

override TAKES: bool = false;

const TAKERS = 256u; // invocations that take, TAKING of each workgroup
const TAKING = 8u;

fn leaves_last(ticket: u32, count: u32) -> bool {
  return ticket == count + TAKERS - 1u;
}
