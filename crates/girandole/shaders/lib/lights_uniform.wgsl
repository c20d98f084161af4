// A batch of lights. Where all invocations read the same light, uniform buffers are by far the quickest.
@group(2) @binding(2) var<uniform> lights: array<Light, BATCH>;
