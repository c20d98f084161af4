// Which group of invocations a workgroup stands for. Mesa's software driver gives each of its threads one run of
// neighbouring workgroups; so that each gets its share of dear and cheap ones, neighbours stand for groups PARTS apart.
const PARTS = 16u;

fn dealt(workgroup: u32, groups: u32) -> u32 {
  let rest = groups % PARTS;
  let whole = groups / PARTS;
  // The first `rest` parts have one group more.
  let longer = rest * (whole + 1u);
  if workgroup < longer { return workgroup % (whole + 1u) * PARTS + workgroup / (whole + 1u); }
  let within = workgroup - longer;
  return within % max(whole, 1u) * PARTS + within / max(whole, 1u) + rest;
}
