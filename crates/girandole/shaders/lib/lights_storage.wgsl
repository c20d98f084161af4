// A batch of lights: where neighbouring lanes read different ones, storage buffers are the quickest to read.
@group(2) @binding(2) var<storage, read> lights: array<Light>;
