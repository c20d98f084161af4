// A prefix sum over a workgroup (Hillis and Steele 1986).

const SCAN_LANES = 256u;

var<workgroup> scanned: array<u32, SCAN_LANES>;

// The sum of `value` over this lane and all before it. All lanes of the workgroup call it.
fn inclusive_scan(lane: u32, value: u32) -> u32 {
  scanned[lane] = value;
  workgroupBarrier();
  for (var reach = 1u; reach < SCAN_LANES; reach *= 2u) {
    var sum = scanned[lane];
    if lane >= reach { sum += scanned[lane - reach]; }
    workgroupBarrier();
    scanned[lane] = sum;
    workgroupBarrier();
  }
  return scanned[lane];
}
