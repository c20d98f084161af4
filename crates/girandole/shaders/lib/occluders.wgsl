// Group 2 of the shadow-map pass: lights, occluders merged in world space, and the list of what to draw.
// An item is (light, face | (cluster << 3)); a cluster is CLUSTER triangles.

struct Item { light: u32, face_cluster: u32 }

@group(2) @binding(0) var<storage, read> lights: array<Light>;
@group(2) @binding(1) var<storage, read> positions: array<f32>;
@group(2) @binding(2) var<storage, read> items: array<Item>;
@group(2) @binding(3) var<uniform> maps: Maps;

override CLUSTER: u32; // triangles in a cluster

fn corner(item: Item, vertex: u32) -> u32 {
  return (item.face_cluster >> 3u) * CLUSTER * 3u + vertex;
}

fn projected(item: Item, vertex: u32) -> Projected {
  let i = 3u * corner(item, vertex);
  return project(lights[item.light], item.face_cluster & 7u, vec3f(positions[i], positions[i + 1u], positions[i + 2u]));
}
