// What mirrored rays bring, four elements a pixel of a band:
//
//   radiance so far of the sample's ray and all that follow it, and the surface that sent it, 0 = none did
//   what is left of the radiance where the last one ended
//   what the samples so far reflect of all that
//   the first of these of the pixel's first sample

@group(2) @binding(3) var<storage, read_write> mirror_image: array<vec4f>;

fn mirror_image_at(pixel: vec2u) -> u32 { return 4u * band_index(pixel); }

// What the samples so far make of what their rays brought.
fn mirrored_at(pixel: vec2u) -> vec3f { return mirror_image[mirror_image_at(pixel) + 2u].xyz; }
