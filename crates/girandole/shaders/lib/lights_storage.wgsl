// A batch of lights. Where neighbouring lanes read different ones, storage buffers are the quickest.
@group(2) @binding(2) var<storage, read> lights: array<Light>;
