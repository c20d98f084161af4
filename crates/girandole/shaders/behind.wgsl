// Further samples that `edges.wgsl` left open: one of the neighbours on the other sides may have seen their surface.
// Only where none did, at the edges of geometry, a sample is shaded by itself.

@group(2) @binding(0) var ids: texture_2d<u32>;
@group(2) @binding(1) var<storage, read> receivers: array<u32>;
@group(2) @binding(2) var<storage, read_write> wanted: array<atomic<u32>>; // how many points, points of each leaf, points
@group(2) @binding(3) var<uniform> plan: Plan;
@group(2) @binding(4) var keys: texture_2d<u32>;
@group(2) @binding(5) var first_light: texture_2d<f32>;
@group(2) @binding(6) var first_second: texture_2d<f32>;
@group(2) @binding(7) var fine_light: texture_storage_2d<rgba32float, write>;
@group(2) @binding(8) var fine_second: texture_storage_2d<rgba32float, write>;
@group(2) @binding(9) var<storage, read_write> sums: array<vec4f>;
@group(2) @binding(10) var<storage, read> open: array<u32>; // see lib/grid.wgsl
@group(2) @binding(11) var picture: texture_storage_2d<rg32uint, write>;

override SPECULAR: bool = false;

// Steps to the neighbours on the other sides, the nearest first.
const BEHIND = array<vec2i, 5>(vec2i(-1, 0), vec2i(0, -1), vec2i(1, -1), vec2i(-1, 1), vec2i(-1, -1));

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
  if invocation.x >= open[3] { return; }
  let packed = open[FIRST_PLACE + invocation.x];
  let at = vec2u(packed & 0xffffu, packed >> 16u);
  let shown = textureLoad(keys, at + vec2u(0u, frame.band.x), 0).xy;
  let side = side_of(shift_of_sample());
  var blend: Blend;
  if (shown.x & SHINY) == 0u {
    for (var i = 0u; i < 5u && blend.weight <= 0.0; i++) {
      add_first(&blend, first_at(vec2i(at) + BEHIND[i] * side), shown.x, 1.0);
    }
  }
  var paint = NO_PAINT;
  if blend.weight > 0.0 { store_blend(at, shown, blend, &paint); } else { want(at); }
}
