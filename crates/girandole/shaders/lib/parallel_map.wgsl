// Maps of parallel light: along either axis, CORE of half a map shows evenly what lies within a share of half its width, as most of what is
// seen does; what lies beyond that, as a ground that is seen through a window, is the smaller the farther away it is.

// Places across the light that a map shows in its core are `spacing` apart for a unit in the map, both in halves of the width; at u
// beyond the core, spacing / (1 − growth u)².
struct ParallelMap { spacing: f32, growth: f32 }

// `less`: by how much less than CORE is the share that the core shows; 0 = all is shown evenly, to the bit.
fn parallel_map(less: f32) -> ParallelMap {
  let spacing = (CORE - less) / CORE;
  return ParallelMap(spacing, less / ((1.0 - CORE) * CORE * (1.0 - CORE + less)));
}

// Where a map shows a place across the light.
fn shown_at(map: ParallelMap, place: vec2f) -> vec2f {
  let p = abs(place);
  let core = CORE * map.spacing;
  let beyond = max(p - core, vec2f(0.0));
  return sign(place) * (min(p, vec2f(core)) / map.spacing + beyond / (map.spacing + map.growth * beyond));
}

// The place that a map shows somewhere.
fn place_shown(map: ParallelMap, at: vec2f) -> vec2f {
  let a = abs(at);
  let beyond = max(a - CORE, vec2f(0.0));
  return sign(at) * map.spacing * (min(a, vec2f(CORE)) + beyond / (1.0 - map.growth * beyond));
}

// How far apart places are there for a unit in the map, along either axis at most.
fn spacing_at(map: ParallelMap, at: vec2f) -> f32 {
  let grown = 1.0 - map.growth * max(max(abs(at.x), abs(at.y)) - CORE, 0.0);
  return map.spacing / (grown * grown);
}
