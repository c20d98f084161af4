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
