// Grids of points over the picture: every `step` pixels, and at the picture's last column and row.

// The last column and row, relative to the band.
fn last_point() -> vec2u {
  return vec2u(frame.size.x - 1u, frame.last_row - frame.band.x);
}

// Points of a grid in x and y.
fn grid_size(step: u32) -> vec2u {
  return (last_point() + step - 1u) / step + 1u;
}

// The pixel of a point, relative to the band.
fn pixel_of_point(point: vec2u, step: u32) -> vec2u {
  return min(point * step, last_point());
}

// Largest difference of irradiance that is interpolated. It grows on finer grids: the nearer points are to each other,
// the less there is to see between them.
fn allowed_range(value: vec3f) -> f32 {
  let by_step = select(select(1.0, 1.5, frame.step == 2u), 2.5, frame.step == 1u);
  return frame.tolerance * by_step * max(value.x, max(value.y, value.z));
}

// What a grid holds beside irradiance: the id of the surface that a point shows, times FAR_ACROSS where the next points across lie too
// far away for anything to be interpolated, and negative where those below do.
fn grid_surface_id(surface_id: u32, is_far: vec2<bool>) -> f32 {
  return f32(surface_id) * select(1.0, FAR_ACROSS, is_far.x) * select(1.0, -1.0, is_far.y);
}

// More than any surface id.
const FAR_ACROSS = 16777216.0;

fn is_far_of(held: f32) -> vec2<bool> { return vec2<bool>(abs(held) >= FAR_ACROSS, held < 0.0); }

fn surface_id_of(held: f32) -> u32 { return u32(abs(held) * select(1.0, 1.0 / FAR_ACROSS, abs(held) >= FAR_ACROSS)); }
