// Grids of points over the picture: every `step` pixels, and at the picture's last column and row.

// The last column and row, relative to the band.
fn last_point() -> vec2u {
  return vec2u(frame.size.x - 1u, frame.last_row - frame.band.x);
}

// Points of a grid in x and y.
fn grid_size(step: u32) -> vec2u {
  return (last_point() + step - 1u) / step + 1u;
}

// Places that are still candidates are kept in one buffer: workgroups of the pass that looks at them (3 words) and how many
// there are, the same for those on curved surfaces, then places, row << 16 | column: from the front, and from the back.
const CURVED_HEADER = 4u;
const FIRST_CANDIDATE = 8u;

const CANDIDATE_RUN = 8u; // of them are taken at once, see lib/work_queue.wgsl

// Where a point lies, relative to the band.
fn pixel_of_point(point: vec2u, step: u32) -> vec2u {
  return min(point * step, last_point());
}

// What the last grid's points receive may differ more: the nearer they are, the less there is to see between them.
fn allowed_range(value: vec3f) -> f32 {
  let by_step = select(select(1.0, 1.5, frame.step == 2u), 2.5, frame.step == 1u);
  return frame.tolerance * by_step * max(value.x, max(value.y, value.z));
}
