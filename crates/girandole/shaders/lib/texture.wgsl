// All textures are words of one, so that any number of any size works on WebGPU's default limits: a directory of
// `TextureEntry`, then texels of all levels, RGBA 8.

fn texel_word(index: u32) -> u32 {
  let row = index / TEXEL_COLUMNS;
  return textureLoad(texels, vec2u(index % TEXEL_COLUMNS, row % TEXEL_ROWS), row / TEXEL_ROWS, 0).x;
}

fn wrap_texel(i: i32, n: i32, mode: u32) -> i32 {
  if mode == 2u { return clamp(i, 0, n - 1); }
  if mode == 1u {
    let m = ((i % (2 * n)) + 2 * n) % (2 * n);
    return select(2 * n - 1 - m, m, m < n);
  }
  return ((i % n) + n) % n;
}

fn srgb_decode(c: f32) -> f32 {
  return select(pow((c + 0.055) / 1.055, 2.4), c / 12.92, c <= 0.04045);
}

fn texel(offset: u32, size: vec2i, at: vec2i, flags: u32) -> vec4f {
  let x = wrap_texel(at.x, size.x, (flags >> 2u) & 3u);
  let y = wrap_texel(at.y, size.y, (flags >> 4u) & 3u);
  let c = unpack4x8unorm(texel_word(offset + u32(y * size.x + x)));
  if (flags & 1u) == 0u { return c; }
  return vec4f(srgb_decode(c.x), srgb_decode(c.y), srgb_decode(c.z), c.w);
}

// The texels that a level is interpolated between, one after another: their code is long.
fn sample_level(texture: u32, uv: vec2f, level: u32) -> vec4f {
  let entry = texture_entry_at(TEXTURE_ENTRY_WORDS * texture);
  let flags = entry.flags;
  var size = vec2i(i32(entry.extent & 0xffffu), i32(entry.extent >> 16u));
  var offset = entry.offset;
  for (var i = 0u; i < level; i++) {
    offset += u32(size.x * size.y);
    size = max(size / 2, vec2i(1));
  }
  let at = uv * vec2f(size);
  let is_nearest = (flags & 2u) != 0u;
  let corner = floor(select(at - 0.5, at, is_nearest));
  let f = at - 0.5 - corner;
  let count = select(4u, 1u, is_nearest);
  var row = vec4f(0.0);
  var above = vec4f(0.0);
  for (var i = 0u; i < count; i++) {
    let c = texel(offset, size, vec2i(corner) + vec2i(vec2u(i & 1u, i >> 1u)), flags);
    row = select(c, mix(row, c, f.x), (i & 1u) != 0u);
    if i == 1u { above = row; }
  }
  return select(mix(above, row, f.y), row, is_nearest);
}

// The linear value at vertex coordinates `uv` whose screen derivatives are `dx` and `dy` (zero: level 0).
fn sample_texture(use_: TextureUse, uv: vec2f, dx: vec2f, dy: vec2f) -> vec4f {
  let m = mat2x2f(use_.matrix.xy, use_.matrix.zw);
  let entry = texture_entry_at(TEXTURE_ENTRY_WORDS * use_.texture);
  let size = vec2f(f32(entry.extent & 0xffffu), f32(entry.extent >> 16u));
  let footprint = max(length(m * dx * size), length(m * dy * size));
  let last = f32(entry.levels - 1u);
  let lod = clamp(log2(max(footprint, 1e-8)), 0.0, last);
  let at = m * uv + use_.shift;
  let levels = select(2u, 1u, lod == 0.0 || lod >= last);
  var value = vec4f(0.0);
  for (var i = 0u; i < levels; i++) {
    let sampled = sample_level(use_.texture, at, u32(lod) + i);
    value = select(sampled, mix(value, sampled, fract(lod)), i > 0u);
  }
  return value;
}
