// The address `at` of a texel, known only when the `others` (bitwise or, < 2³¹) are: so that no load is issued, and waited
// for, before all addresses have been computed. Mesa's software driver would keep each load next to its address.
fn address_after(at: vec3u, others: vec3u) -> vec3u { return at + (others >> vec3u(31u)); }
