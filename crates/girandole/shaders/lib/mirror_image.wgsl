// What mirrored rays bring, three elements a pixel of a band:
//
//   radiance so far of the sample's first ray and all that follow it, and whether it was sent
//   what is left of the radiance where the last one ended
//   what the samples so far reflect of all that

@group(2) @binding(3) var<storage, read_write> mirror_image: array<vec4f>;
