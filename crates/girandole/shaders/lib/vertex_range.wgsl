// The vertices that `vertex_irradiance` is of.
struct VertexRange { first: u32, count: u32, padding_a: u32, padding_b: u32 }
