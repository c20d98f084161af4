// Parts of shadow maps.
struct MapPart {
  first: vec2u, // column and row in the page
  end: vec2u, // before the last column and row
  page: u32,
  padding: u32,
}

@group(2) @binding(0) var<storage, read> parts: array<MapPart>;
