// Which triangle each pixel shows, plus one; 0 = none. And the id of its surface and its material. Triangles that let light
// through are drawn afterwards, in layers.
struct Out {
  @builtin(position) position: vec4f,
  @location(0) @interpolate(flat) triangle: u32,
  @location(1) uv: vec2f,
  @location(2) @interpolate(flat) surface: vec2u,
}

struct Shown { @location(0) triangle: u32, @location(1) surface: vec2u }

@group(2) @binding(0) var<storage, read> triangle_order: array<u32>; // triangles, those without an alpha mask first
@group(2) @binding(1) var<storage, read> triangle_surfaces: array<u32>; // of each triangle

@group(2) @binding(2) var nearer_depth: texture_depth_2d; // of the layer before

// Layers lie by this share of their distance nearer than they are, so that they are seen on what they cover.
const LAYER_BIAS = 4e-6;

@vertex
fn project_layer(@builtin(vertex_index) index: u32) -> Out {
  var out = projected(index);
  out.position.z *= 1.0 + LAYER_BIAS;
  return out;
}

// What emits lies by this share of its distance nearer than it is: a lamp in one plane with a ceiling is seen before it
// (core: trace.rs).
const EMITTER_BIAS = 4e-6;

@vertex
fn project_triangle(@builtin(vertex_index) index: u32) -> Out {
  var out = projected(index);
  let m = materials[out.surface.y];
  let emits = (m.flags & UNLIT) == 0u && any(m.emission > vec3f(0.0));
  out.position.z *= select(1.0, 1.0 + EMITTER_BIAS, emits);
  return out;
}

fn projected(index: u32) -> Out {
  let id = triangle_order[index / 3u];
  let triangle = triangles[id];
  let vertex = vertices[triangle.vertices[index % 3u]];
  let d = vertex.position - frame.eye;
  let p = vec3f(dot(d, frame.right) / frame.half_width, dot(d, frame.up) / frame.half_height, dot(d, frame.forward));
  let shift = (2.0 * frame.offset - 1.0) / vec2f(frame.size) * vec2f(-1.0, 1.0);
  var out: Out;
  // Reversed depth, see Frame.
  let parallel = vec4f(p.xy - frame.center + shift, frame.depth_bias - p.z / frame.depth_scale, 1.0);
  let perspective = vec4f(p.xy - frame.center * p.z + shift * p.z, frame.depth_bias - p.z * frame.depth_scale, p.z);
  out.position = select(perspective, parallel, frame.orthographic != 0u);
  // Backs of single-sided surfaces are not there for the camera (glTF).
  if (materials[triangle.material].flags & DOUBLE_SIDED) == 0u {
    let a = vertices[triangle.vertices.x].position;
    let normal = cross(vertices[triangle.vertices.y].position - a, vertices[triangle.vertices.z].position - a);
    let towards = select(frame.eye - a, -frame.forward, frame.orthographic != 0u);
    if dot(normal, towards) <= 0.0 { out.position = vec4f(0.0, 0.0, -1.0, 1.0); }
  }
  out.triangle = id + 1u;
  out.surface = vec2u(triangle_surfaces[id], triangle.material);
  out.uv = select(vertex.uv0, vec2f(vertex.u1, vertex.v1), materials[triangle.material].base_color_texture.uv_set == 1u);
  return out;
}

@fragment
fn opaque(in: Out) -> Shown {
  return Shown(in.triangle, in.surface);
}

@fragment
fn masked(in: Out) -> Shown {
  let m = materials[triangles[in.triangle - 1u].material];
  var alpha = m.alpha;
  if m.base_color_texture.texture != NONE {
    alpha *= sample_texture(m.base_color_texture, in.uv, vec2f(0.0), vec2f(0.0)).w;
  }
  if alpha < m.alpha_cutoff { discard; }
  return Shown(in.triangle, in.surface);
}

struct Layer { @builtin(frag_depth) depth: f32, @location(0) triangle: u32, @location(1) surface: vec2u }

// The nearest surface beyond the layer before (depth peeling, Everitt 2001).
@fragment
fn layer(in: Out) -> Layer {
  let depth = in.position.z;
  if depth >= textureLoad(nearer_depth, vec2u(in.position.xy), 0) { discard; }
  return Layer(depth, in.triangle, in.surface);
}
