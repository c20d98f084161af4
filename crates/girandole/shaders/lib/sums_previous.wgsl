// Points on dynamic objects have a loop of their own for all lights that are looked up, with places of lib/transforms_previous.wgsl:
// those on static objects are shaded as ever.

// Which of the old places belong to each light of the batch.
@group(2) @binding(14) var<uniform> previous_rows: array<vec4u, BATCH / 4u>;

fn previous_row(index: u32) -> u32 { return previous_rows[index / 4u][index % 4u]; }

// Adds the lights of a leaf's list that are looked up, if the leaf is on a dynamic object: those of one lane of `lanes`.
fn add_looked_up_previously(sums: ptr<function, PointSums>, leaf: u32, list: LightList, lane: u32, lanes: u32) {
  let mover = mover_of(leaf);
  let end = select(0u, list.end, mover != NONE && (*sums).is_surface);
  for (var i = list.near_shadowed + lane; i < end; i += lanes) {
    let index = listed_light(i);
    let light = lights[index];
    let a = arriving_in_full(light, (*sums).shading);
    let at = previous_shadow_texel(light, index, (*sums).shading, mover);
    let counted = select(0.0, 1.0, i >= list.subtracted);
    if FILTER > 0u && a.is_before {
      add(sums, light, a, filtered(light, at.receiver) - counted);
      continue;
    }
    let is_lit = !a.is_before || passes_shadow_test(light, at.receiver, at.texel, stored_at(light, at.texel), false);
    add(sums, light, a, select(0.0, 1.0, is_lit) - counted);
  }
}

// What is left of the list.
fn remaining(leaf: u32, list: LightList) -> LightList {
  if mover_of(leaf) == NONE { return list; }
  let end = list.near_shadowed;
  return LightList(list.unshadowed, list.near_unshadowed, end, end, end, end, end);
}
