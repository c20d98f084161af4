// Automatic exposure (core: tonemap::luminance_histogram, auto_exposure). Counts are integers, so their order does
// not matter.

struct Exposure { stops: f32 }

@group(2) @binding(0) var picture: texture_2d<u32>;
@group(2) @binding(1) var<storage, read_write> histogram: array<atomic<u32>, HISTOGRAM_BINS>;
@group(2) @binding(2) var<storage, read_write> exposure: Exposure;

const BINS_PER_STOP = 8u;
const MIN_LOG2 = -20;
const MIDDLE_GREY = 0.18;

@compute @workgroup_size(HISTOGRAM_BINS)
fn clear(@builtin(local_invocation_index) bin: u32) {
  atomicStore(&histogram[bin], 0u);
}

@compute @workgroup_size(TILE, TILE)
fn count(@builtin(global_invocation_id) id: vec3u) {
  if any(id.xy >= textureDimensions(picture)) { return; }
  let y = luminance(unpack_radiance(textureLoad(picture, id.xy, 0).xy));
  let bits = bitcast<u32>(y);
  if !(y > 0.0) || bits >= 0x7f800000u { return; }
  let first = u32(127 + MIN_LOG2) * BINS_PER_STOP;
  let bin = select(0u, (bits >> 20u) - first, (bits >> 20u) > first);
  atomicAdd(&histogram[min(bin, HISTOGRAM_BINS - 1u)], 1u);
}

@compute @workgroup_size(1)
fn choose() {
  var total = 0u;
  for (var i = 0u; i < HISTOGRAM_BINS; i++) { total += atomicLoad(&histogram[i]); }
  let low = total / 100u * 5u + total % 100u * 5u / 100u;
  let high = total - low;
  var before = 0u;
  var sum = 0.0;
  var counted = 0u;
  for (var i = 0u; i < HISTOGRAM_BINS; i++) {
    let after = before + atomicLoad(&histogram[i]);
    let end = min(after, high);
    let start = max(before, low);
    if end > start {
      let middle = f32(MIN_LOG2) + f32(i / BINS_PER_STOP) + log2(1.0 + (f32(i % BINS_PER_STOP) + 0.5) / f32(BINS_PER_STOP));
      sum += f32(end - start) * middle;
      counted += end - start;
    }
    before = after;
  }
  exposure.stops = select(log2(MIDDLE_GREY) - sum / f32(max(counted, 1u)), 0.0, counted == 0u);
}
