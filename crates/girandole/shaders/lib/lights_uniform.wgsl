// A batch of lights: on software devices uniform buffers are the quickest to read.
@group(2) @binding(2) var<uniform> lights: array<Light, 512>;
