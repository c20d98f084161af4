// Group 0: what changes each frame, and within it with each band of rows, sub-pixel sample and batch of lights.

struct Frame {
  eye: vec3f,
  orthographic: u32,
  right: vec3f, // unit
  half_width: f32,
  up: vec3f, // unit
  half_height: f32,
  forward: vec3f, // unit
  depth_bias: f32, // depth at a distance z is (depth_bias − z · depth_scale) / z, reversed
  size: vec2u, // of the whole picture, pixels
  band: vec2u, // first and last-but-one row of this band
  offset: vec2f, // of this sample within its pixel, in (0, 1)
  first_light: u32,
  end_light: u32,
  clamp: f32, // of the geometric factor, m⁻²; OWN_CLAMP = that of each light
  far: f32, // orthographic only: depth of the view
  sample: u32, // index of this sub-pixel sample
  samples: u32, // sub-pixel samples a pixel
  last_row: u32, // last row of the band's grids of points: one below the band where there is one
  step: u32, // pixels from a point of the grid to the next
  batch: u32, // index of the batch of lights, or of the layer
  last_batch: u32, // whether it is the last one
  tolerance: f32, // largest difference between neighbours that are interpolated, as a share
  debug: u32, // whether sums are kept for a debug view
  center: vec2f, // shift of the view, in units of half its size
  depth_scale: f32, // where rays are parallel, depth is depth_bias − z / depth_scale
  forward_depth: u32, // whether depth grows with distance in the caller's depth buffers
  environment: vec2f, // what its map is multiplied by, and how far it is turned
  sun_direction: vec3f, // unit, as the map has it, to the middle of a disc before it
  sun_chord2: f32, // squared distance of the disc's edge from there on the unit sphere; 0 = no disc
  sun_radiance: vec3f, // W/(sr·m²), before the map's factor
  sample_solid_angle: f32, // of samples of the environment, mean, sr; 0 = lobes are not widened, and samples show all of it
  writes_radiance: u32, // whether points are the picture's pixels, and their radiance is stored
  mirror_solid_angle: f32, // of light samples, mean, sr: what is sharper is found by mirrored rays; 0 = no such rays
  ray_offset: f32, // how far rays start off surfaces at least, metres
  columns: u32, // the first one that is drawn, and one past the last in the upper half
  light_set: u32, // which light set of a refinement: mirrored rays of all but 0 are spread over lobes
  sample_area: f32, // of light samples on surfaces, mean over all that they cover, m²
  polished_alpha: f32, // largest one of lobes that mirrored rays show all of; 0 = none
  padding_b: u32,
}

@group(0) @binding(0) var<uniform> frame: Frame;

struct PixelRay { origin: vec3f, direction: vec3f }

// The ray through a position in pixels from the top left corner (core: View::pixel_ray).
fn pixel_ray(at: vec2f) -> PixelRay {
  let uv = at / vec2f(frame.size);
  let shift = frame.right * ((2.0 * uv.x - 1.0 + frame.center.x) * frame.half_width)
    + frame.up * ((1.0 - 2.0 * uv.y + frame.center.y) * frame.half_height);
  let is_parallel = frame.orthographic != 0u;
  return PixelRay(frame.eye + select(vec3f(0.0), shift, is_parallel), frame.forward + select(shift, vec3f(0.0), is_parallel));
}

// Whether a column is drawn, or is the one next to those on the right, where points of grids lie.
fn is_drawn(column: u32) -> bool { return column >= (frame.columns & 0xffffu) && column <= frame.columns >> 16u; }

// Index of a pixel in the band's buffers.
fn band_index(pixel: vec2u) -> u32 {
  return (pixel.y - frame.band.x) * frame.size.x + pixel.x;
}
