// Set-ups that a workgroup shares, as scalars: software devices load vectors slowly.

// Three planes, the depth, the box.
const SET_UP = 14u;

var<workgroup> kept: array<u32, SET_UP * MAP_KEPT>;

fn keep_plane(at: u32, plane: vec3f) {
  kept[at] = bitcast<u32>(plane.x);
  kept[at + 1u] = bitcast<u32>(plane.y);
  kept[at + 2u] = bitcast<u32>(plane.z);
}

fn kept_plane(at: u32) -> vec3f { return bitcast<vec3f>(vec3u(kept[at], kept[at + 1u], kept[at + 2u])); }

fn keep(slot: u32, s: SetUp) {
  let at = SET_UP * slot;
  keep_plane(at, s.a);
  keep_plane(at + 3u, s.b);
  keep_plane(at + 6u, s.c);
  keep_plane(at + 9u, s.n);
  kept[at + 12u] = packed_range(s.first.x, s.end.x);
  kept[at + 13u] = packed_range(s.first.y, s.end.y);
}

fn kept_at(slot: u32) -> SetUp {
  let at = SET_UP * slot;
  let x = kept[at + 12u];
  let y = kept[at + 13u];
  return SetUp(
    kept_plane(at), kept_plane(at + 3u), kept_plane(at + 6u), kept_plane(at + 9u), box_first(x, y), box_end(x, y), true);
}

fn kept_depth(slot: u32) -> vec3f { return kept_plane(SET_UP * slot + 9u); }
