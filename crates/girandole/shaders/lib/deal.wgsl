// Which group of invocations a workgroup stands for. Mesa's software driver gives each of its threads one run of
// neighbouring workgroups. Groups come sorted from dear to cheap, so runs of them are dealt out in pairs that cost the
// same; within a run neighbours stay together, as they read the same.
const PARTS = 16u;
const LOW_RUNS = 0x52614370u; // the dearer run of each pair, four bits each

// How many workgroups there are for so many invocations, 64 each: whole parts.
fn workgroups_of(invocations: u32) -> u32 {
  return (invocations + 64u * PARTS - 1u) / (64u * PARTS) * PARTS;
}

fn dealt(workgroup: u32, workgroups: u32) -> u32 {
  let share = max(workgroups / PARTS, 1u);
  let part = workgroup / share;
  let low = (LOW_RUNS >> (part / 2u * 4u)) & 15u;
  return select(low, PARTS - 1u - low, (part & 1u) == 1u) * share + workgroup % share;
}
