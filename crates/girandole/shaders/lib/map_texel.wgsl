// A texel and its depth.
struct MapTexel { place: u32, depth: f32 } // column | row << 16 in the page, or in the map

