// The mean of the pictures of light sets, and how much these differ (Welford 1962): two elements a pixel of a band.
//
//   mean, with the share of the pixel that shows the scene
//   sum of squared differences from the mean, by channel

@group(2) @binding(0) var picture: texture_2d<u32>;
@group(2) @binding(1) var mean_picture: texture_storage_2d<rg32uint, write>;
@group(2) @binding(2) var<storage, read_write> averages: array<vec4f>;
@group(2) @binding(3) var<storage, read_write> tile_errors: array<f32>;

// Keeps the relative error of dark pixels finite, (W/(sr·m²))² (reference: metrics.rs).
const RELATIVE_EPSILON = 0.01;

// `frame.sample` is the index of the light set.
@compute @workgroup_size(TILE, TILE)
fn add(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let words = textureLoad(picture, pixel, 0).xy;
  let value = vec4f(unpack_radiance(words), coverage_of(words));
  let at = 2u * band_index(pixel);
  var mean = vec4f(0.0);
  var squares = vec4f(0.0);
  if branch_value(frame.sample, pixel.x) > 0u {
    mean = averages[at];
    squares = averages[at + 1u];
  }
  let step = value - mean;
  mean += step / f32(frame.sample + 1u);
  averages[at] = mean;
  averages[at + 1u] = squares + step * (value - mean);
}

// Writes the mean in the place of the last set's picture.
@compute @workgroup_size(TILE, TILE)
fn show(@builtin(global_invocation_id) invocation: vec3u) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  if pixel.x >= frame.size.x || pixel.y >= frame.band.y { return; }
  let mean = averages[2u * band_index(pixel)];
  textureStore(mean_picture, pixel, pack_pixel(mean.xyz, mean.w));
}

var<workgroup> pixel_errors: array<f32, TILE * TILE>;

// The relative variance of the mean, summed over the pixels of each tile; `frame.samples` is how many sets there are.
@compute @workgroup_size(TILE, TILE)
fn estimate(
  @builtin(global_invocation_id) invocation: vec3u,
  @builtin(workgroup_id) tile: vec3u,
  @builtin(local_invocation_index) lane: u32,
) {
  let pixel = vec2u(invocation.x, invocation.y + frame.band.x);
  var error = 0.0;
  if pixel.x < frame.size.x && pixel.y < frame.band.y {
    let at = 2u * band_index(pixel);
    let mean = averages[at].xyz;
    let sets = f32(frame.samples);
    let variance = averages[at + 1u].xyz / (sets * (sets - 1.0));
    error = dot(variance / (mean * mean + RELATIVE_EPSILON), vec3f(1.0 / 3.0));
  }
  pixel_errors[lane] = error;
  workgroupBarrier();
  if lane == 0u {
    var sum = 0.0;
    for (var i = 0u; i < TILE * TILE; i++) { sum += pixel_errors[i]; }
    tile_errors[tile.y * ((frame.size.x + TILE - 1u) / TILE) + tile.x] = sum;
  }
}
