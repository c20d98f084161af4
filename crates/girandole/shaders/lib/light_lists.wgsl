// Lists of lights by leaf and batch. A pass that uses it binds `light_lists`, which holds words: a `LeafRecord` for each
// leaf, a `LeafRange` for each leaf and batch, and the lists themselves, indices of lights within their batch, two to a word.

// Of the batch.
fn listed_light(at: u32) -> u32 { return extractBits(light_lists[at >> 1u], 16u * (at & 1u), 16u); }

fn leaf_record(leaf: u32) -> LeafRecord { return leaf_record_at(leaf * LEAF_RECORD_WORDS); }

fn has_light_map(leaf: u32) -> bool { return leaf_record(leaf).light_map != NONE; }

fn leaf_range(leaf: u32) -> LeafRange {
  return leaf_range_at(offsets.ranges_at + (leaf * offsets.batches + frame.batch) * LEAF_RANGE_WORDS);
}

// What shading sums of a leaf's list of the batch, with light maps or without.
struct LightList {
  unshadowed: u32, // first light that is added without a shadow test
  near_unshadowed: u32, // first of those among them that are near
  near_shadowed: u32, // first light that is near and added where its shadow map finds it lit
  jointed: u32, // first light that is added where a closer look at its shadow map finds it lit
  shadowed: u32, // first light that is added where its shadow map finds it lit
  subtracted: u32, // first light that is subtracted where its shadow map finds it dark
  end: u32,
}

fn light_list(leaf: u32) -> LightList {
  let range = leaf_range(leaf);
  let has_maps = offsets.light_maps != 0u;
  return LightList(select(range.mapped_unshadowed, range.unshadowed, has_maps), range.near_unshadowed,
    range.near_shadowed, range.jointed, range.shadowed, select(range.end, range.mapped_shadowed, has_maps), range.end);
}
